// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/quality.hpp"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/forecast.hpp"
#include "host/common/format.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/report.hpp"
#include "host/forecast/tuning.hpp"
#include "host/scene/image.hpp"

namespace raywave::cli {

namespace {

struct QualityArguments {
  SceneOptions scene;
  MethodOptions method;
  GoalOptions goal;
  DepthOptions depths;
  DeviceOptions device;
  ReportOptions report;
  QualitySpec quality;
  FrameOption frame;
  std::string out = ".", blur;
};

QualitySpec spec_of(const QualityArguments& options, const Scene& scene) {
  auto spec = options.quality;
  spec.depths_m = options.depths.depths_m([&] { return scene.viewer; });
  if (const auto size_m = options.depths.window_m())
    spec.window = PictureWindow::around_axis(*size_m);
  if (!options.blur.empty()) {
    const auto blur = parse_blur(options.blur);
    spec.blur_m = blur.in_pixels ? blur.value * scene.hologram.pitch_m.x : blur.value;
  }
  return spec;
}

/// Lets long steps say how long they take.
void say_times(ProgressBar& bar, const cl::DeviceInfo& device, std::size_t lasers,
               RenderOptions& how, QualitySpec& spec, const std::vector<Planned>& planned) {
  how.planned = notes_of_render(bar, device, lasers, planned, "the render");
  spec.lens_progress = [&, forecast = Forecast()](double seen, double all) mutable {
    if (const auto seconds = forecast.add(seen, all))
      say_time(bar, *seconds, "the lens",
               "fewer --lens-points, a smaller --window or --no-views take less");
  };
}

/// "PSNR 29.6 dB in 13.8 x 8.58 mm, mean of whole pictures; 29.5 dB predicted at 0.1 mm"
std::string mean_text(const QualityResult& result, const std::vector<Planned>& planned) {
  double sum_db = 0, count = 0;
  for (const auto& row : result.rows) {
    if (row.view != whole_view.name) continue;
    sum_db += row.figures.luminance.psnr_db;
    ++count;
  }
  auto text = format("PSNR %.1f dB in %s, mean of whole pictures", sum_db / count,
                     result.window.text().c_str());
  if (!planned.empty() && planned[0].prediction.pictures) {
    const auto& prediction = planned[0].prediction;
    text += format("; %.1f dB predicted in %s at %s", prediction.pictures->mean_psnr_db,
                   prediction.pictures->window.text().c_str(),
                   length_text(std::round(prediction.resolution_m * 1e7) / 1e7).c_str());
  }
  return text;
}

void print_table(const QualityResult& result, const QualitySpec& spec,
                 const QualityArguments& options, const std::vector<Planned>& planned) {
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
    std::printf("%-10s  %-6s  %8.2f  %6.4f  %6.4f  %5.2f  %6s  %.4f (%.4f)  %8.2f",
                length_text(row.z_m).c_str(), row.view.c_str(), figures.psnr_db, figures.ssim,
                figures.flip, row.light_share, haze.c_str(), figures.contrast_b, figures.contrast_a,
                of_field.psnr_db);
    if (is_colour)
      std::printf("  %19.2f  %6.2f  %11.2f", row.figures.mean, row.figures.most_of_95,
                  row.field_figures.mean);
    std::printf("\n");
  }
  std::printf("%s\n", mean_text(result, planned).c_str());
  if (is_colour) std::printf("PSNR and SSIM of luminances as sRGB, Delta E 2000 of the colours\n");
  std::printf("levels by %s; %.2f of the SLM's light is the wanted wave\n",
              name_of(lasers[0].plan.slm.encoding).c_str(), result.wanted_share);
  if (result.against_points) {
    std::printf(
        "against the sum of all points, first frame: complex correlation %.4f, relative L2 error "
        "%.4f\n",
        result.against_points->correlation, result.against_points->error);
  }
  auto stages = sum_of_stages(lasers, &RenderResult::seconds);
  std::printf(
      "%s rendered in %.2f s (trace %.2f s, propagate %.2f s), reconstructed in %.2f s, seen by "
      "the lens in %.2f s\n",
      options.method.name.c_str(), result.seconds.at("render"), stages["trace"],
      stages["propagate"], result.seconds.at("reconstruct"), result.seconds.at("lens"));
}

void run_quality(const QualityArguments& options) {
  const auto frame = options.frame.frame();
  auto scenes = options.scene.load_all(options.report);
  auto spec = spec_of(options, scenes[0]);
  const cl::Device device(options.device.info());
  RenderOptions how;
  how.fft = options.device.backend(device.info());
  how.method = options.method.method();
  how.rays_per_axis = options.method.rays_per_axis;
  if (options.goal.goal().any() && how.method != Method::wrp)
    throw InputError("--preset, --budget and --psnr plan --method wrp alone");
  std::vector<Planned> planned;
  QualityResult result;
  {
    ProgressBar bar(options.report.quiet);
    how.progress = [&](const std::string& what, double share) { bar.show(what, share); };
    say_times(bar, device.info(), scenes.size(), how, spec, planned);
    const auto world = build_world(scenes[0]);
    if (const auto goal = options.goal.goal(); goal.any()) {
      planned = plan_scenes(scenes, world, figures_of(device.info()), goal);
      for (std::size_t i = 0; i < scenes.size(); ++i) scenes[i] = planned[i].scene;
      // Judged as it was planned
      const auto& prediction = planned[0].prediction;
      if (!spec.blur_m) spec.blur_m = blur_of_resolution * prediction.resolution_m;
      if (!spec.window && prediction.pictures) spec.window = prediction.pictures->window;
    }
    if (const auto warning = colour_warning(scenes, world); !warning.empty())
      options.report.note(warning);
    result = assess(device, scenes, world, how, spec);
  }
  for (const auto& note : notes_of(result.render.lasers)) options.report.note(note);

  const auto sheet = contact_sheet(result, frame);
  auto json = quality_json(scenes, result, device.info(), how, spec);
  json["frame"] = name_of(frame);
  const auto out = std::filesystem::path(options.out);
  save_picture(out / "quality.png", sheet.width, sheet.height, sheet.rgb);
  write_text(out / "quality.json", json.dump(2) + "\n");

  if (options.report.prints_text()) {
    print_table(result, spec, options, planned);
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
  auto options = std::make_shared<QualityArguments>();
  auto& quality = options->quality;
  options->scene.add_to(*command)->required();
  options->goal.add_to(*command);
  options->method.add_to(*command);
  options->depths.add_to(*command, "nearest and farthest surface and a little in front",
                         "what the lens sees, with a margin");
  add_views(*command, quality.views,
            "At the first depth also through the left, right, top and bottom of the hologram");
  add_blur(*command, options->blur, "0.6 sampling.pitch");
  options->frame.add_to(*command, "From where quality.png shows the pictures");
  add_border(*command, quality.border_px);
  add_lens_points(*command, quality.lens_points);
  command
      ->add_flag("--against-points", quality.against_points,
                 "Also compare the field with the sum of all points (slow)")
      ->group(group::pictures);
  options->device.add_to(*command);
  add_output(*command, options->out, "quality.png and quality.json");
  options->report.add_to(*command, "quality.json");
  command->callback([options] { run_quality(*options); });
}

}  // namespace raywave::cli
