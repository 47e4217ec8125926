// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/quality.hpp"

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/stage_clock.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/goal_check.hpp"
#include "host/evaluate/report.hpp"
#include "host/forecast/tuning.hpp"
#include "host/planning/make_plan.hpp"
#include "host/scene/image.hpp"

namespace raywave::cli {

namespace {

struct QualityArguments : SceneArguments {
  MethodOptions method;
  DepthOptions depths;
  QualitySpec quality;
  FrameOption frame;
  PupilOption pupil;
  std::string out = ".", blur;
};

QualitySpec spec_of(const QualityArguments& options, const Scene& scene) {
  auto spec = options.quality;
  spec.depths_m = options.depths.depths_m([&] { return scene.viewer; });
  if (const auto size_m = options.depths.window_m())
    spec.window = PictureWindow::around_axis(*size_m);
  for (const auto& pupil : options.pupil.pupils(scene.viewer, options.frame.frame()))
    if (pupil) spec.pupils.push_back(*pupil);
  if (!options.blur.empty()) {
    const auto blur = parse_blur(options.blur);
    spec.blur_m = blur.in_pixels ? blur.value * scene.hologram.pitch_m.x : blur.value;
  }
  return spec;
}

/// Says before the first picture how long the comparison takes, and of the lens again where it
/// turns out to take much longer.
void say_times(ProgressBar& bar, QualitySpec& spec) {
  const auto told_s = std::make_shared<double>(0);
  const auto say = [&bar](double seconds, const char* what) {
    constexpr double long_s = 10;
    say_time(bar, seconds, what, "fewer --lens-points, a smaller --window or --no-views take less",
             long_s);
  };
  spec.begins = [say, told_s](double seconds) { say(*told_s = seconds, "the comparison"); };
  spec.lens_progress = [say, told_s, forecast = Forecast()](double seen, double all) mutable {
    constexpr double much = 1.5;
    if (const auto seconds = forecast.add(seen, all); seconds && *seconds > much * *told_s)
      say(*seconds, "the lens");
  };
}

void print_table(const QualityResult& result, const QualitySpec& spec,
                 const QualityArguments& options, const ViewerSpec& viewer,
                 const GoalCheck& check) {
  const auto& lasers = result.render.lasers;
  const bool is_colour = lasers.size() > 1;
  std::printf(
      "window %s, %d x %d pixels, mean of %d frames, blur %.4g px, border %d px, lens of %d x %d "
      "points\n",
      result.window.text().c_str(), result.picture_size.x, result.picture_size.y,
      lasers.at(0).field.frames, result.blur_px, result.border_px, spec.lens_points,
      spec.lens_points);
  std::printf("%-10s  %-6s  %8s  %6s  %6s  %5s  %6s  %-15s  %s%s\n", "depth", "view", "PSNR, dB",
              "SSIM", "FLIP", "light", "haze", "speckle (lens)", "field: PSNR, dB",
              is_colour ? "  Delta E mean  95 % <  field: mean" : "");
  for (const auto& row : result.rows) {
    const auto &figures = row.figures.luminance, &of_field = row.field_figures.luminance;
    const auto haze = row.haze ? format("%.4f", *row.haze) : "-";
    const auto field_text = [&](double value) { return spec.field ? format("%.2f", value) : "-"; };
    std::printf("%-10s  %-6s  %8.2f  %6.4f  %6.4f  %5.2f  %6s  %.4f (%.4f)  %8s",
                length_text(row.z_m).c_str(), row.view.c_str(), figures.psnr_db, figures.ssim,
                figures.flip, row.light_share, haze.c_str(), figures.contrast_b, figures.contrast_a,
                field_text(of_field.psnr_db).c_str());
    if (is_colour)
      std::printf("  %19.2f  %6.2f  %11s", row.figures.mean, row.figures.most_of_95,
                  field_text(row.field_figures.mean).c_str());
    if (viewer.eyepiece_m)
      std::printf("  %s D",
                  number_text(std::round(1e3 * dioptres_of_depth(viewer, row.z_m)) / 1e3).c_str());
    if (row.pupil) std::printf("  %s", pupil_text(*row.pupil, options.frame.frame()).c_str());
    std::printf("\n");
  }
  GoalCheck of_all;
  of_all.measure(result, lasers[0].plan.hologram.pitch_m.x);
  const bool is_of_one = is_colour && check.wanted_db();
  std::printf("mean of whole pictures: %s\n", (is_of_one ? of_all : check).text().c_str());
  if (is_of_one)
    std::printf("the laser of the longest wavelength alone, which goals are for: %s\n",
                check.text().c_str());
  if (check.goal.any() && !check.goal.preset)
    std::printf("the goal is %sreached%s\n", check.is_kept() ? "" : "not ",
                check.wanted_db() ? ", to within 0.5 dB" : "");
  if (is_colour) std::printf("PSNR and SSIM of luminances as sRGB, Delta E 2000 of the colours\n");
  std::printf("levels by %s", name_of(lasers[0].plan.slm.encoding));
  // Refined phases make pictures, not the field
  if (spec.field && !lasers[0].plan.refine)
    std::printf("; %.2f of the SLM's light is the wanted wave", result.wanted_share);
  std::printf("\n");
  if (result.against_points) {
    std::printf(
        "against the sum of all points, first frame: complex correlation %.4f, relative L2 error "
        "%.4f\n",
        result.against_points->correlation, result.against_points->error);
  }
  auto stages = sum_of_stages(lasers, &RenderResult::seconds);
  if (const auto rendered = result.seconds.find("render"); rendered != result.seconds.end())
    std::printf("%s rendered in %.2f s (trace %.2f s, propagate %.2f s), ",
                options.method.name.c_str(), rendered->second, stages["trace"],
                stages["propagate"]);
  std::printf("reconstructed in %.2f s, seen by the lens in %.2f s\n",
              result.seconds.at("reconstruct"), result.seconds.at("lens"));
}

/// Measures what the goal has reached: with several lasers, of the one that it was planned for.
void measure(const QualityArguments& options, const cl::Device& device,
             const std::vector<Scene>& scenes, const World& world, const RenderOptions& how,
             const QualityResult& result, GoalCheck& check) {
  if (scenes.size() > 1 && check.wanted_db() && check.resolution_m > 0)
    return measure_judged(device, scenes, world, result.render, how, check);
  check.measure(result, scenes[0].hologram.pitch_m.x);
  if (options.depths.z.empty()) return;
  // Prediction and goal of a report are for the plan's own depths
  check.predicted_db.reset();
  check.goal.psnr_db = options.goal.psnr_db;
}

/// The goal of a report, or the one that is given in its place.
GoalCheck goal_of(const FinishedRender& finished, const Goal& given, const std::string& file) {
  GoalCheck check;
  if (finished.report.contains("goal")) check = goal_of_json(finished.report.at("goal"));
  if (given.preset && given.preset != check.goal.preset)
    throw InputError(one_line(file) + ": was not rendered with --preset " + name_of(*given.preset) +
                     "; a finished hologram is held to --psnr, --budget or --rate, "
                     "or to the goal that it was rendered for");
  if (given.any()) check.goal = given;
  check.picture_s = picture_s(finished.rendered);
  return check;
}

/// Renders the scenes, planned for the goal, and judges them.
QualityResult judge_scenes(const QualityArguments& options, const cl::Device& device,
                           std::vector<Scene>& scenes, RenderOptions& how, QualitySpec& spec,
                           ProgressBar& bar, GoalCheck& check) {
  std::vector<Planned> planned;
  how.planned = notes_of_render(bar, device.info(), scenes.size(), planned, "the render");
  const auto world = build_world(scenes[0]);
  const auto goal = options.goal.goal();
  if (goal.any()) {
    planned = plan_scenes(scenes, world, figures_of(device.info()), goal);
    for (std::size_t i = 0; i < scenes.size(); ++i) scenes[i] = planned[i].scene;
    if (const auto promise = promised(goal, planned, {})) judge_as_planned(check = *promise, spec);
  }
  if (const auto warning = colour_warning(scenes, world); !warning.empty())
    options.report.note(warning);
  auto result = assess(device, scenes, world, how, spec);
  check.picture_s = picture_s(result.render);
  measure(options, device, scenes, world, how, result, check);
  return result;
}

/// Judges holograms that were rendered before.
QualityResult judge_files(const QualityArguments& options, const cl::Device& device,
                          FinishedRender& finished, const RenderOptions& how, QualitySpec& spec,
                          GoalCheck& check) {
  check = goal_of(finished, options.goal.goal(), options.scene.file);
  judge_as_planned(check, spec);
  const auto world = build_world(finished.scenes[0]);
  for (std::size_t i = 0; i < finished.scenes.size(); ++i) {
    auto& laser = finished.rendered.lasers[i];
    laser.plan = make_plan(finished.scenes[i], world);
    spec.field &= !laser.field.samples.empty();
  }
  if (spec.against_points && !spec.field)
    throw InputError("--against-points: " + one_line(options.scene.file) + " has no fields");
  LensPictures lens;
  auto result =
      assess(device, finished.scenes, world, std::move(finished.rendered), how, spec, lens);
  measure(options, device, finished.scenes, world, how, result, check);
  return result;
}

void run_quality(const QualityArguments& options) {
  const auto frame = options.frame.frame();
  std::optional<FinishedRender> finished;
  if (extension_of(options.scene.file) == ".json") {
    if (!options.scene.set.empty())
      throw InputError("--set changes a scene; " + one_line(options.scene.file) +
                       " is of a finished hologram");
    finished.emplace(options.scene.file);
  }
  auto scenes = finished ? finished->scenes : options.scene.load_all(options.report);
  auto spec = spec_of(options, scenes[0]);
  const cl::Device device(options.device.info());
  RenderOptions how;
  how.fft = options.device.backend(device.info());
  how.method = options.method.method();
  how.rays_per_axis = options.method.rays_per_axis;
  if (options.goal.goal().any() && how.method != Method::wrp)
    throw InputError("--preset, --budget, --psnr and --rate plan --method wrp alone");
  GoalCheck check;
  QualityResult result;
  {
    ProgressBar bar(options.report.quiet);
    how.progress = [&](const std::string& what, double share) { bar.show(what, share); };
    say_times(bar, spec);
    result = finished ? judge_files(options, device, *finished, how, spec, check)
                      : judge_scenes(options, device, scenes, how, spec, bar, check);
  }
  for (const auto& note : notes_of(result.render.lasers)) options.report.note(note);

  const auto sheet = contact_sheet(result, frame);
  auto json = quality_json(scenes, result, device.info(), how, spec);
  if (finished) json["render"] = finished->report;
  if (check.goal.any()) json["goal"] = json_of(check);
  json["frame"] = name_of(frame);
  const auto out = std::filesystem::path(options.out);
  save_picture(out / "quality.png", sheet.width, sheet.height, sheet.rgb);
  write_text(out / "quality.json", json.dump(2) + "\n");

  if (options.report.prints_text()) {
    print_table(result, spec, options, scenes[0].viewer, check);
    std::printf(
        "%s  %d x %d, seen %s, rows as in the table; columns: lens, hologram, difference%s; .json "
        "beside it\n",
        (out / "quality.png").c_str(), sheet.width, sheet.height, seen_by(frame),
        scenes.size() > 1 ? " of luminances" : "");
  }
  options.report.write(json);
}

}  // namespace

void add_quality(CLI::App& app) {
  auto* command = add_command(app, section::look, "quality",
                              "Compare a scene's hologram with an ideal lens, from several views",
                              "build/raywave quality data/study.toml -o out --lens-points 8");
  const auto options = arguments_of(*command, run_quality);
  auto& quality = options->quality;
  options->scene.add_to(*command, "Scene file (TOML); or report.json of render or refine")
      ->required();
  options->goal.add_to(*command);
  options->method.add_to(*command);
  options->depths.add_to(*command, "nearest and farthest surface and a little in front",
                         "what the lens sees, with a margin");
  add_views(*command, quality.views,
            "At the first depth also through the left, right, top and bottom of the hologram");
  add_blur(*command, options->blur, "0.6 of what the viewer makes out, as plan predicts");
  options->frame.add_to(*command, "From where quality.png shows the pictures");
  options->pupil.add_to(*command);
  add_border(*command, quality.border_px);
  add_lens_points(*command, quality.lens_points);
  flag(*command, "--against-points", quality.against_points, group::pictures,
       "Also compare the field with the sum of all points (slow)");
  options->device.add_to(*command);
  add_output(*command, options->out, "quality.png and quality.json");
  options->report.add_to(*command, "quality.json");
}

}  // namespace raywave::cli
