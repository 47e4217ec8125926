// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "cl/program_folder.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/forecast/tuning.hpp"
#include "host/render.hpp"
#include "host/view/lens.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave::cli {

namespace {

struct KernelsArguments {
  std::vector<std::string> scenes, set;
  bool strict = false;
  DeviceOptions device;
  ReportOptions report;
  std::string folder;
  bool sources = false;
};

/// What every scene and `raywave reconstruct` need.
void use_shared(const cl::Device& device) {
  SlmSpec slm;
  slm.encoding = Encoding::phase;  // the self-test's
  const Encoder encode(device, std::make_shared<Panel>(slm, glm::ivec2(1), glm::dvec2(1), 1));
  const FieldStack hologram{16, 1, 1, std::vector<std::complex<float>>(16)};
  HologramSpec spec;
  spec.resolution = {16, 1};
  reconstruct(device, cl::FftBackend::host, hologram, spec, {});
}

/// What a scene needs follows from what is done with it, so that is done.
void use(const cl::Device& device, const std::vector<Scene>& lasers, ProgressBar& bar) {
  RenderOptions how;
  how.fft = cl::FftBackend::host;
  how.progress = [&](const std::string& what, double share) { bar.show(what, share); };
  const auto world = build_world(lasers[0]);
  std::vector<RenderResult> results;
  for (const bool keeps_field : {true, false}) {  // without it, levels may come of transforms
    how.keep_field = keeps_field;
    results = Renderer(device, lasers, world, how).render_lasers();
  }
  for (const auto& laser : results) {
    LensSpec lens;
    lens.z_m = laser.plan.extent.far_m;
    lens.window_m = laser.plan.hologram.pitch_m;
    lens.points = 1;
    lens_picture(device, laser.plan, DeviceScene(device, world, laser.plan), lens);
  }
}

void run_kernels(const KernelsArguments& options) {
  if (cl::program_folder())
    throw cl::DeviceError(
        "RAYWAVE_PROGRAM_DIR is set, which forbids to compile; raywave kernels needs it unset");
  auto info = options.device.found();
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
  std::vector<std::vector<Scene>> scenes;
  for (const auto& file : options.scenes)
    scenes.push_back(load_all(file, options.set, options.strict, options.report));

  const cl::ProgramRecorder recorder(options.folder, !options.sources);
  use_shared(device);
  for (const auto& lasers : scenes) {
    ProgressBar bar(options.report.quiet);
    use(device, lasers, bar);
  }
  std::vector<std::string> files;
  for (const auto& name : recorder.names())
    files.push_back(std::filesystem::path(options.folder) /
                    (name + (options.sources ? ".cl" : ".bin")));
  if (options.report.prints_text()) {
    std::printf("%zu programs %s\n", files.size(),
                options.sources ? "as sources" : ("for " + info.name).c_str());
    for (const auto& file : files) std::printf("  %s\n", file.c_str());
  }
  options.report.write(
      Json{{"device", info.name}, {"sources", options.sources}, {"programs", files}});
}

}  // namespace

void add_kernels(CLI::App& app) {
  auto* command = add_command(app, section::devices, "kernels",
                              "Build kernels ahead, for runs without a compiler",
                              "build/raywave kernels data/study.toml -o programs\n"
                              "RAYWAVE_PROGRAM_DIR=programs build/raywave render data/study.toml "
                              "-o out");
  auto options = std::make_shared<KernelsArguments>();
  command
      ->add_option("SCENES", options->scenes,
                   "Scene files (TOML): each is rendered, and what it uses is kept")
      ->type_name("SCENE");
  add_set(*command, options->set);
  add_strict(*command, options->strict);
  options->device.add_device_to(*command);
  add_output(*command, options->folder, "binaries, sources and manifest.tsv")->required();
  flag(*command, "--sources", options->sources, group::output,
       "Only sources and compiler options, as GPUs and FPGAs need them; --device is "
       "where the scenes are rendered");
  options->report.add_to(*command, "the list of programs");
  command->callback([options] { run_kernels(*options); });
}

}  // namespace raywave::cli
