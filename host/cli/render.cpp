// SPDX-License-Identifier: Apache-2.0
#include "host/render.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cl/compile_ahead.hpp"
#include "host/carriers/planning/facts.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_set.hpp"
#include "host/cli/parts.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/rehearsal.hpp"
#include "host/common/text.hpp"
#include "host/encode/pictures.hpp"
#include "host/evaluate/goal_check.hpp"
#include "host/evaluate/report.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/forecast/first_call.hpp"
#include "host/forecast/tuning.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/message_text.hpp"
#include "host/scene/image.hpp"

namespace raywave::cli {

namespace {

struct RenderArguments : PartsArguments {
  MethodOptions method;
  bool save_wrps = false, no_field = false, rgb = false;
};

/// " over 2 virtual planes"; empty: no planes
std::string planes_text(const Plan& plan, Method method) {
  if (method != Method::wrp || is_near_hologram(plan)) return "";
  const auto count = plan.wrps.size();
  return " over " + std::to_string(count) + " " + plane_name(plan) + (count == 1 ? "" : "s");
}

/// "9.51 s (samples 5.38 s, trace 3.33 s)": all of it, and the stages that take most of it.
std::string time_text(const std::map<std::string, double>& seconds) {
  constexpr double least_share = 0.05;
  double total = 0;
  std::vector<std::pair<double, std::string>> stages;
  for (const auto& [stage, duration] : seconds) {
    total += duration;
    stages.emplace_back(duration, stage);
  }
  std::sort(stages.rbegin(), stages.rend());
  const auto number = [](double duration) { return format("%.2f s", duration); };
  std::string parts;
  for (const auto& [duration, stage] : stages) {
    if (duration < least_share * total) break;
    parts += (parts.empty() ? "" : ", ") + stage + " " + number(duration);
  }
  return number(total) + (parts.empty() ? "" : " (" + parts + ")");
}

/// One picture of all lasers.
std::string save_rgb(const std::filesystem::path& folder, std::size_t frame,
                     const Rendered& result) {
  std::array<LevelPicture, 3> pictures;
  std::array<double, 3> wavelengths_m{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& laser = result.lasers[i];
    wavelengths_m[i] = laser.plan.hologram.wavelength_m;
    pictures[i] =
        for_slm(LevelPicture{laser.plan.hologram.size, laser.levels[frame]}, laser.plan.slm);
  }
  const auto name = name_of_frame(frame, "hologram_rgb");
  save_picture(folder / name, pictures[0].size_px.x, pictures[0].size_px.y,
               packed_rgb(pictures, wavelengths_m));
  return name;
}

/// Writes the holograms of a laser, and what is kept beside them.
LaserFiles save_laser(OutputSet& out, const RenderResult& laser, const std::string& suffix,
                      bool keeps_field) {
  const auto files = files_of_laser(laser, suffix, keeps_field, keeps_field);
  for (std::size_t frame = 0; frame < laser.levels.size(); ++frame)
    out.add(save_hologram(out.folder(), frame, laser.plan.slm, laser.plan.hologram.size,
                          laser.levels[frame], "hologram" + suffix));
  const auto save_field = [&](const std::string& file, const FieldStack& field) {
    save_npy(out.folder() / file, field.nx, field.ny, field.frames, field.samples);
    out.add(file);
  };
  if (!files.field.empty()) save_field(files.field, laser.field);
  if (!files.refined.empty()) save_field(files.refined, laser.refined->phases);
  auto plane = plane_name(laser.plan);  // "wrp", "virtual_plane"
  for (auto& c : plane) c = c == ' ' ? '_' : static_cast<char>(std::tolower(c));
  for (std::size_t wrp = 0; wrp < laser.wrps.size(); ++wrp)
    save_field(plane + suffix + "_" + std::to_string(wrp + 1) + ".npy", laser.wrps[wrp]);
  return files;
}

/// Renders the scenes as they are planned.
///
/// check  what a goal in PSNR has reached
Rendered render_planned(const RenderArguments& options, std::vector<Scene>& scenes,
                        const cl::Device& device, RenderOptions how,
                        std::optional<GoalCheck>& check) {
  ProgressBar bar(options.report.quiet);
  how.progress = [&](const std::string& what, double share) { bar.show(what, share); };
  std::vector<Planned> planned;
  how.planned = notes_of_render(bar, device.info(), scenes.size(), planned);
  bar.show("meshes", 0);
  const Stopwatch of_meshes;
  auto world = build_world(scenes[0]);
  const double wall_s = of_meshes.wall_s(), processor_s = of_meshes.processor_s();
  const auto goal = options.goal.goal();
  if (goal.any()) {
    bar.show("plan", 0);
    planned =
        plan_scenes(scenes, world, figures_of(device.info()), goal, {.field = how.keep_field});
    for (std::size_t i = 0; i < scenes.size(); ++i) scenes[i] = planned[i].scene;
  }
  const auto warning = colour_warning(scenes, world);
  const auto judged = goal.psnr_db ? world : World();
  auto result = render(device, scenes, std::move(world), how);
  if (is_rehearsal) return result;
  result.lasers[0].seconds["meshes"] += wall_s;
  result.lasers[0].processor_seconds["meshes"] += processor_s;
  if (!warning.empty())
    for (auto& laser : result.lasers) laser.notes.push_back(warning);
  for (const auto& laser : result.lasers)
    if (device.info().online_compiler)
      remember_kernels(laser.plan, figures_of(device.info()), laser.seconds,
                       laser.processor_seconds);
  check = check_goal(device, goal, planned, judged, result, how);
  return result;
}

/// What the options ask for.
struct RenderTask {
  std::vector<Scene> scenes;
  cl::Device device;
  std::optional<cl::DeviceInfo> waves;  // --waves-on
  RenderOptions how;
};

RenderTask render_task_of(const RenderArguments& options) {
  auto scenes = options.scene.load_all(options.report);
  if (options.rgb && scenes.size() != 3)
    throw InputError("--rgb packs the holograms of three lasers, and the scene has " +
                     std::to_string(scenes.size()) +
                     ": leave it out, or give hologram.wavelength three");
  auto info = options.device.info();
  const auto waves = options.device.waves(info);
  RenderOptions how;
  if (waves) how.waves_device.emplace(*waves);
  how.fft = options.device.backend(waves.value_or(info));
  how.method = options.method.method();
  if (options.goal.goal().any() && how.method != Method::wrp)
    throw InputError("--preset, --budget, --psnr and --rate plan --method wrp alone");
  how.rays_per_axis = options.method.rays_per_axis;
  how.keep_wrps = options.save_wrps;
  how.keep_field = !options.no_field;
  return {std::move(scenes), cl::Device(info), waves, std::move(how)};
}

void run_render(const RenderArguments& options) {
  if (!options.parts.empty()) {
    for (const auto& [is_given, name] :
         {std::pair(options.save_wrps, "--save-wrps"), std::pair(options.rgb, "--rgb"),
          std::pair(!options.device.waves_on.empty(), "--waves-on"),
          std::pair(options.method.method() != Method::wrp, "--method")})
      if (is_given)
        throw InputError(std::string(name) +
                         ": leave it out; --tiles writes levels alone, by "
                         "--method wrp");
    return run_tiles(options);
  }
  std::optional<cl::CompileAhead> ahead([&] {
    auto [scenes, device, waves, how] = render_task_of(options);
    std::optional<GoalCheck> none;
    render_planned(options, scenes, device, how, none);
  });
  auto [scenes, device, waves, how] = render_task_of(options);
  const bool is_colour = scenes.size() > 1;
  OutputSet out(options.out);
  if (is_of_tiles(out.folder() / "report.json"))
    throw InputError(in_quotes(options.out) +
                     ": holds a hologram in tiles; add --tiles, or give another --output");
  std::optional<GoalCheck> check;
  const auto result = render_planned(options, scenes, device, how, check);
  ahead.reset();
  for (const auto& note : notes_of(result.lasers)) options.report.note(note);

  std::vector<LaserFiles> files;
  for (const auto& laser : result.lasers)
    files.push_back(save_laser(
        out, laser, laser_suffix(laser.plan.hologram.wavelength_m, scenes.size()), how.keep_field));
  for (std::size_t frame = 0; options.rgb && frame < result.lasers[0].levels.size(); ++frame)
    out.add(save_rgb(out.folder(), frame, result));
  auto report = report_json(scenes, result, files, device.info(), how.fft);
  if (check) report["goal"] = json_of(*check);
  report["set"] = options.scene.set;
  if (waves) report["waves_on"] = json_of(*waves);
  const auto text = out.finish(std::move(report), options.report);

  if (options.report.prints_text()) {
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      const auto& laser = result.lasers[i];
      const auto& plan = laser.plan;
      if (is_colour) std::printf("%s: ", length_text(plan.hologram.wavelength_m).c_str());
      std::printf("%d x %d hologram%s in %s on %s", plan.hologram.size.x, plan.hologram.size.y,
                  planes_text(plan, how.method).c_str(), time_text(laser.seconds).c_str(),
                  device.info().name.c_str());
      if (is_colour) std::printf("; power %.3f", result.powers[i]);
      std::printf("\n");
    }
    const auto drive =
        is_colour ? drive_text(scenes[0].colour.value(), result.powers, "these holograms") : "";
    if (!drive.empty()) std::printf("lasers: %s\n", drive.c_str());
    if (check && check->is_kept()) std::printf("%s\n", check->text().c_str());
    out.print();
  }
  options.report.write(text);
}

}  // namespace

void add_render(CLI::App& app) {
  auto* command = add_command(app, section::make, "render", "Compute the hologram of a scene",
                              "build/raywave render data/teapot.toml -o out --preset balanced");
  const auto options = arguments_of(*command, run_render);
  options->scene.add_to(*command)->required();
  options->goal.add_to(*command);
  options->method.add_to(*command);
  options->device.add_to(*command, /*takes_several=*/true);
  options->device.add_waves_to(*command);
  add_output(*command, options->out, "hologram.png, field.npy and report.json")->required();
  flag(*command, "--save-wrps", options->save_wrps, group::output,
       "Also write the field of every WRP or virtual plane (wrp_1.npy or "
       "virtual_plane_1.npy, ...)");
  flag(*command, "--no-field", options->no_field, group::output,
       "Write no field.npy; results take an eighth of the host's memory");
  flag(*command, "--rgb", options->rgb, group::output,
       "Of three lasers: also write hologram_rgb.png, whose channels are their holograms");
  option(
      *command, "--tiles", options->parts, "N", group::output,
      "Write a file of each tile of hologram.tiles (tile_00000.png ...) and no field, for "
      "holograms that memory does not hold: 12, or 10..20 with both ends, which several programs "
      "may make in one folder at once; or all, alone, which makes what is missing");
  options->report.add_to(*command, "report.json");
}

}  // namespace raywave::cli
