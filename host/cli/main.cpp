// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <iostream>
#include <new>
#include <string>
#include <system_error>
#include <utility>

#include "cl/device.hpp"
#include "host/cli/arguments.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
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

/// Opens what is closed of standard input, output and error: a file of ours would take its place.
void open_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) < 0) open("/dev/null", O_RDWR);  // takes the lowest number
  }
}

/// What ends a program that has done its work: 0 where all that it printed has arrived.
int end_of_output() {
  std::cout.flush();
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && !std::ferror(stdout) && std::cout) return 0;
  if (flushed) {  // errno of an earlier write is gone: one more byte meets the same reason
    errno = EIO;
    [[maybe_unused]] const auto written = write(STDOUT_FILENO, "\n", 1);
  }
  return fail(
      exit_input,
      ("standard output cannot be written: " + std::generic_category().message(errno)).c_str());
}

/// Refuses options with an empty value: they would pass for not given.
void refuse_empty_values(CLI::App& app) {
  for (auto* command : app.get_subcommands({})) {
    for (auto* option : command->get_options()) {
      if (option->get_items_expected_max() > 0)
        option->check([](const std::string& value) {
          return std::string(value.empty() ? "a value is needed" : "");
        });
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  using namespace raywave::cli;
  open_standard_streams();
  raywave::remove_temporaries_at_signals();
  raywave::cl::explain_aborts(exit_device);
  keep_freed_memory();
  CLI::App app{std::string("raywave ") + raywave::version +
                   ": photorealistic holograms of meshes for spatial light modulators",
               "raywave"};
  app.formatter(help_formatter());
  app.set_help_flag("-h,--help", "Show this help");
  app.set_version_flag("--version", raywave::version, "Show the version");
  app.require_subcommand(1);
  add_new(app);
  add_plan(app);
  add_render(app);
  add_encode(app);
  add_pattern(app);
  add_refine(app);
  add_animate(app);
  add_units(app);
  add_reconstruct(app);
  add_lens(app);
  add_preview(app);
  add_compare(app);
  add_quality(app);
  add_show(app);
  add_view(app);
  add_bench(app);
  add_trade(app);
  add_tune(app);
  add_devices(app);
  add_selftest(app);
  add_kernels(app);
  add_completion(app);
  refuse_empty_values(app);
  app.footer(
      "raywave COMMAND --help shows the options of a command and an example.\n"
      "Exit codes: 0 done, 1 a self-test failed or --strict met a note, 2 something given is\n"
      "wrong, 3 the device or its driver cannot do it.");
  try {
    auto words = read_arguments(argc, argv);
    if (words.empty()) words.push_back("--help");
    std::reverse(words.begin(), words.end());  // as the parser takes them
    app.parse(std::move(words));
    return end_of_output();
  } catch (const CLI::RuntimeError& outcome) {
    return outcome.get_exit_code();  // a command that has said what there is to say
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // --help, --version
      app.exit(error);
      return end_of_output();
    }
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
