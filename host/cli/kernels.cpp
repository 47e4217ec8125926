// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include "cl/program_folder.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/plan/rates.hpp"
#include "host/render.hpp"
#include "host/view/lens.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave::cli {

namespace {

struct Options {
  std::string folder, device;
  std::vector<std::string> scenes, set;
  bool sources = false, quiet = false;
};

/// What every scene and `raywave reconstruct` need.
void use_shared(const cl::Device& device) {
  const PhaseEncoder encode(device);
  const FieldStack hologram{16, 1, 1, std::vector<std::complex<float>>(16)};
  HologramSpec spec;
  spec.resolution = {16, 1};
  reconstruct(device, cl::FftBackend::host, hologram, spec, {});
}

/// What a scene needs follows from what is done with it, so that is done.
void use(const cl::Device& device, const Scene& scene, ProgressBar& bar) {
  RenderOptions how;
  how.fft = cl::FftBackend::host;
  how.progress = [&](const std::string& what, double share) { bar.show(what, share); };
  const auto result = render(device, scene, how);
  const auto world = build_world(scene);
  LensSpec lens;
  lens.z_m = result.plan.far_m;
  lens.window_m = scene.hologram.pitch_m;
  lens.points = 1;
  lens_picture(device, result.plan, DeviceScene(device, world, result.plan), lens);
}

void run(const Options& options) {
  if (cl::program_folder())
    throw cl::DeviceError(
        "RAYWAVE_PROGRAM_DIR is set, which forbids to compile; raywave kernels needs it unset");
  auto info = cl::find_device(options.device);
  if (options.sources) {
    info.kind = cl::DeviceKind::accelerator;
    info.float_lanes = 1;
  } else if (!info.online_compiler) {
    throw cl::DeviceError(
        info.name + " has no online compiler; --sources writes what its offline compiler needs");
  } else {
    info = tuned(info);  // as it will be asked for
  }
  const cl::Device device(info);
  std::vector<Scene> scenes;
  for (const auto& file : options.scenes) scenes.push_back(load_scene(file, options.set));

  const cl::ProgramRecorder recorder(options.folder, !options.sources);
  use_shared(device);
  for (const auto& scene : scenes) {
    ProgressBar bar(options.quiet);
    use(device, scene, bar);
  }
  if (options.quiet) return;
  std::printf("%zu programs %s\n", recorder.names().size(),
              options.sources ? "as sources" : ("for " + info.name).c_str());
  for (const auto& name : recorder.names())
    std::printf("  %s\n", (std::filesystem::path(options.folder) /
                           (name + (options.sources ? ".cl" : ".bin")))
                              .c_str());
}

}  // namespace

void add_kernels(CLI::App& app) {
  auto* command = app.add_subcommand(
      "kernels", "Build kernels ahead, for runs without a compiler (RAYWAVE_PROGRAM_DIR)");
  auto options = std::make_shared<Options>();
  command->add_option("scenes", options->scenes,
                      "Scene files (TOML): what they need is found by rendering them");
  command->add_option("--build", options->folder, "Folder for binaries, sources and manifest.tsv")
      ->required();
  command->add_flag(
      "--sources", options->sources,
      "Only sources and options, as a GPU or FPGA needs them; --device is where that is found out");
  command->add_option("--device", options->device,
                      "Device: index (0:1) or part of its name; also RAYWAVE_DEVICE");
  command->add_option("--set", options->set, "Change a value of the scenes: section.key=value")
      ->allow_extra_args(false);
  command->add_flag("--quiet", options->quiet, "Print nothing but errors");
  command->callback([options] { run(*options); });
}

}  // namespace raywave::cli
