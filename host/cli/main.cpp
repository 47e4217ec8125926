// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <new>
#include <string>
#include <utility>

#include "cl/device.hpp"
#include "host/cli/arguments.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/common/error.hpp"
#include "raywave_version.hpp"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace {

constexpr int exit_input = 2, exit_device = 3, exit_bug = 70;

int fail(int code, const char* message) {
  std::fprintf(stderr, "raywave: %s\n", message);
  return code;
}

/// Memory that one picture frees serves the next. Else glibc gives megabytes back to the system,
/// and each new page costs a fault: 1 ms of a picture of 21.
void keep_freed_memory() {
#if defined(__GLIBC__)
  constexpr int bytes = 128 << 20;
  mallopt(M_MMAP_THRESHOLD, bytes);
  mallopt(M_TRIM_THRESHOLD, bytes);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  using namespace raywave::cli;
  keep_freed_memory();
  CLI::App app{std::string("raywave ") + raywave::version +
                   ": photorealistic holograms of meshes for spatial light modulators",
               "raywave"};
  app.formatter(help_formatter());
  app.set_help_flag("-h,--help", "Show this help");
  app.set_version_flag("--version", raywave::version, "Show the version");
  app.require_subcommand(1);
  add_plan(app);
  add_render(app);
  add_encode(app);
  add_pattern(app);
  add_refine(app);
  add_reconstruct(app);
  add_lens(app);
  add_compare(app);
  add_quality(app);
  add_bench(app);
  add_trade(app);
  add_tune(app);
  add_devices(app);
  add_selftest(app);
  add_kernels(app);
  add_completion(app);
  app.footer(
      "raywave COMMAND --help shows the options of a command and an example.\n"
      "Exit codes: 0 done, 1 a self-test failed, 2 something given is wrong, 3 the device or its\n"
      "driver cannot do it.");
  try {
    auto arguments = read_arguments(argc, argv);
    for (const auto& note : arguments.notes) std::fprintf(stderr, "raywave: %s\n", note.c_str());
    std::reverse(arguments.words.begin(), arguments.words.end());  // as the parser takes them
    app.parse(std::move(arguments.words));
    return 0;
  } catch (const CLI::RuntimeError& outcome) {
    return outcome.get_exit_code();  // a command that has said what there is to say
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return fail(exit_input, refusal(app, error).c_str());
  } catch (const raywave::InputError& error) {
    return fail(exit_input, error.what());
  } catch (const raywave::cl::MemoryError& error) {
    return fail(exit_device,
                (std::string(error.what()) + "; a smaller hologram.resolution or wrp.padding, more "
                                             "hologram.tiles or a larger sampling.pitch need less")
                    .c_str());
  } catch (const raywave::cl::DeviceError& error) {
    return fail(exit_device, error.what());
  } catch (const std::bad_alloc&) {
    return fail(
        exit_device,
        "out of host memory; a smaller hologram.resolution, sampling.frames or mesh needs less");
  } catch (const std::exception& error) {
    return fail(exit_bug,
                (std::string("unexpected: ") + error.what() + " (please report this)").c_str());
  }
}
