// SPDX-License-Identifier: Apache-2.0
#include <clocale>
#include <cstdio>
#include <new>

#include "cl/device.hpp"
#include "host/cli/commands.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "raywave_version.hpp"

namespace {

constexpr int exit_input = 2, exit_device = 3, exit_bug = 70;

int fail(int code, const char* message) {
  std::fprintf(stderr, "raywave: %s\n", message);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"raywave: photorealistic holograms of meshes for spatial light modulators"};
  app.set_version_flag("--version", raywave::version);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 a self-test failed, 2 something given is wrong, 3 the device or its "
      "driver cannot do it.");
  raywave::cli::add_render(app);
  raywave::cli::add_reconstruct(app);
  raywave::cli::add_lens(app);
  raywave::cli::add_compare(app);
  raywave::cli::add_quality(app);
  raywave::cli::add_plan(app);
  raywave::cli::add_tune(app);
  raywave::cli::add_devices(app);
  raywave::cli::add_selftest(app);
  raywave::cli::add_kernels(app);
  raywave::cli::add_bench(app);
  raywave::cli::add_trade(app);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::RuntimeError& outcome) {
    return outcome.get_exit_code();  // a command that has said what there is to say
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return fail(
        exit_input,
        (raywave::one_line(error.what()) + " (raywave --help lists what there is)").c_str());
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
