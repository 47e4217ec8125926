// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>

#include "cl/program_folder.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
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
  GoalOptions goal;
  DeviceOptions device;
  ReportOptions report;
  std::string folder, target;
};

/// Whose compiler makes a bitstream of frame.cl.
enum class Toolchain { aoc, vitis };
constexpr auto names_of(Toolchain) { return std::array{"aoc", "v++"}; }

/// What every scene and `raywave reconstruct` need.
void use_shared(const cl::Device& device) {
  SlmSpec slm;
  slm.encoding = Encoding::phase;  // the self-test's
  HologramSpec spec;
  spec.resolution = {16, 1};
  const FieldStack hologram{16, 1, 1, std::vector<std::complex<float>>(16)};
  Encoder encoder(device, std::make_shared<Panel>(slm, spec.resolution, glm::dvec2(1), 1));
  encode(device, encoder, hologram);
  reconstruct(device, cl::FftBackend::host, hologram, spec, {});
}

/// What a scene needs follows from what is done with it, so that is done.
///
/// waves  whose programs are wanted, for levels alone; none: those of the device
void use(const cl::Device& device, const std::optional<cl::Device>& waves,
         const std::vector<Scene>& lasers, const Goal& goal, ProgressBar& bar) {
  RenderOptions how;
  how.waves_device = waves;
  how.fft = cl::FftBackend::host;
  how.progress = [&](const std::string& what, double share) { bar.show(what, share); };
  const auto world = build_world(lasers[0]);
  std::vector<RenderResult> results;
  for (const bool keeps_field : {true, false}) {  // without it, levels may come of transforms
    how.keep_field = keeps_field;
    if (waves && keeps_field) continue;
    auto scenes = lasers;
    if (goal.any()) {
      const auto planned =
          plan_scenes(lasers, world, figures_of(device.info()), goal, {.field = keeps_field});
      for (std::size_t i = 0; i < scenes.size(); ++i) scenes[i] = planned[i].scene;
    }
    results = Renderer(device, scenes, world, how).render_lasers().lasers;
    // One laser after another, fields may be needed where all together leave transforms
    if (scenes.size() > 1) render(device, scenes, world, how);
  }
  if (waves) return;
  for (const auto& laser : results) {
    LensSpec lens;
    lens.z_m = laser.plan.extent.far_m;
    lens.window_m = laser.plan.hologram.pitch_m;
    lens.points = 1;
    lens_picture(device, laser.plan, DeviceScene(device, world, laser.plan), lens);
  }
}

/// Makes one binary of frame.cl by an FPGA's toolchain, and NAME.bin of every program.
std::string makefile_of(Toolchain toolchain, const std::vector<cl::ProgramSource>& programs,
                        const std::string& frame) {
  std::string names, kernels;
  for (const auto& program : programs) names += " " + program.name();
  const std::regex kernel("KERNEL void (\\w+)\\(");
  for (auto it = std::sregex_iterator(frame.begin(), frame.end(), kernel);
       it != std::sregex_iterator(); ++it)
    kernels += " " + it->str(1);
  const bool is_aoc = toolchain == Toolchain::aoc;
  const std::string compile =
      is_aoc
          ? "\t$(AOC) $(AOCFLAGS) $(MODE) $< -o $@\n"
          : "\tfor kernel in $(KERNELS); do $(VPP) $(VPPFLAGS) -c -t $(MODE) --platform $(board) "
            "-k $$kernel $< -o $(@D)/$$kernel.xo || exit 1; done\n"
            "\t$(VPP) $(VPPFLAGS) -l -t $(MODE) --platform $(board) "
            "$(KERNELS:%=$(@D)/%.xo) -o $@\n";
  const std::string file = is_aoc ? "frame.aocx" : "frame.xclbin";
  const auto rule = [&](const std::string& name, const std::string& mode) {
    return name + ": " + name + "/" + file + "\n" + name + "/" + file + ": MODE = " + mode + "\n";
  };
  return "# Made by raywave kernels. BOARD: the board's name in its package, or its platform\n"
         "#   make emulate BOARD=...   into emulate/, for the toolchain's emulator\n"
         "#   make report BOARD=...    into report/: area, loops; minutes to an hour\n"
         "#   make build BOARD=...     into build/, for the board; hours\n"
         "#   RAYWAVE_PROGRAM_DIR=build raywave render SCENE -o out --no-field --waves-on DEVICE\n"
         "# DEVICE: as raywave devices lists it\n" +
         std::string(is_aoc ? "AOC ?= aoc\n" : "VPP ?= v++\n") + "PROGRAMS =" + names + "\n" +
         (is_aoc ? "" : "KERNELS =" + kernels + "\n") +
         "board = $(or $(BOARD),$(error BOARD is missing: make build BOARD=...))\n"
         ".PHONY: help emulate report build\n"
         ".DELETE_ON_ERROR:\n"
         "help:\n\t@sed -n 's/^# *//p' Makefile\n" +
         rule("emulate", is_aoc ? "-march=emulator" : "sw_emu") +
         rule("report", is_aoc ? "-rtl -report -board=$(board)" : "hw_emu") +
         rule("build", is_aoc ? "-board=$(board)" : "hw") + "%/" + file +
         ": frame.cl\n\tmkdir -p $(@D)\n" + compile +
         "\tfor name in $(PROGRAMS); do cp $@ $(@D)/$$name.bin || exit 1; done\n";
}

void run_kernels(const KernelsArguments& options) {
  if (cl::program_folder())
    throw cl::DeviceError(
        "RAYWAVE_PROGRAM_DIR is set, which forbids to compile; raywave kernels needs it unset");
  std::optional<Toolchain> toolchain;
  if (!options.target.empty()) toolchain = choice_of<Toolchain>(options.target, "--target");
  const auto goal = options.goal.goal();
  auto info = options.device.info();
  auto waves_info = options.device.waves(info);
  if (toolchain) {  // the device stands in for the FPGA
    waves_info = info;
    waves_info->kind = cl::DeviceKind::accelerator;
    waves_info->float_lanes = cl::fpga_lanes;
    waves_info->work = {};
    info.compiles_always = true;
  }
  for (const auto& one : {info, waves_info.value_or(info)})
    if (!one.online_compiler)
      throw cl::DeviceError(one.name +
                            " has no online compiler; --target writes what an offline one needs");
  if (options.scenes.empty() && (waves_info || options.goal.goal().any()))
    throw InputError("give a scene: what --waves-on, --target and presets make depends on it");
  const std::filesystem::path folder(options.folder);
  if (toolchain && std::filesystem::exists(folder / "frame.cl"))
    throw InputError(in_quotes((folder / "frame.cl").string()) +
                     ": is there, with what was built of it; give another -o");
  const cl::Device device(info);
  std::optional<cl::Device> waves;
  if (waves_info) waves.emplace(*waves_info);
  std::vector<std::vector<Scene>> scenes;
  for (const auto& file : options.scenes)
    scenes.push_back(load_all(file, options.set, options.strict, options.report));

  const cl::ProgramRecorder recorder(toolchain ? std::nullopt : std::optional(folder));
  if (!waves) use_shared(device);
  for (const auto& lasers : scenes) {
    ProgressBar bar(options.report.quiet);
    use(device, waves, lasers, goal, bar);
  }
  const auto& programs = recorder.programs();
  std::vector<std::string> files;
  if (toolchain) {
    const auto frame = cl::one_source(programs);
    write_text(folder / "frame.cl", frame);
    write_text(folder / "Makefile", makefile_of(*toolchain, programs, frame));
    files = {folder / "frame.cl", folder / "Makefile"};
  } else {
    for (const auto& program : programs) files.push_back(folder / (program.name() + ".bin"));
  }
  const auto& name = waves_info.value_or(info).name;
  if (options.report.prints_text()) {
    std::printf("%zu programs for %s\n", programs.size(),
                toolchain ? options.target.c_str() : name.c_str());
    for (const auto& file : files) std::printf("  %s\n", file.c_str());
  }
  options.report.write(Json{{"device", name}, {"target", options.target}, {"programs", files}});
}

}  // namespace

void add_kernels(CLI::App& app) {
  auto* command = add_command(app, section::devices, "kernels",
                              "Build kernels ahead, for runs without a compiler",
                              "build/raywave kernels data/study.toml -o programs\n"
                              "RAYWAVE_PROGRAM_DIR=programs build/raywave render data/study.toml "
                              "-o out");
  const auto options = arguments_of(*command, run_kernels);
  argument(*command, "SCENES", options->scenes, "SCENE",
           "Scene files (TOML): each is rendered, and what it uses is kept");
  add_set(*command, options->set);
  add_strict(*command, options->strict);
  options->goal.add_to(*command);
  options->device.add_device_to(*command);
  add_output(*command, options->folder, "binaries, sources and manifest.tsv")->required();
  options->device.add_waves_to(*command);
  option(*command, "--target", options->target, "aoc|v++", group::output,
         "For an FPGA that is not here: frame.cl with the kernels of --waves-on, and a Makefile "
         "for this toolchain; --device renders the scenes meanwhile")
      ->excludes("--waves-on");
  options->report.add_to(*command, "the list of programs");
}

}  // namespace raywave::cli
