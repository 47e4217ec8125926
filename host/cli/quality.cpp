// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/quality.hpp"

#include <cstdio>
#include <filesystem>
#include <memory>

#include "host/cli/commands.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/scene/image.hpp"

namespace raywave::cli {

namespace {

struct Options {
  std::string scene, out = ".", window, blur;
  std::vector<std::string> z, set;
  std::string method = "wrp";
  RenderOptions render;
  QualitySpec quality;
  DeviceOptions device;
  bool json = false, quiet = false;
};

QualitySpec spec_of(const Options& options) {
  auto spec = options.quality;
  for (const auto& text : options.z) spec.depths_m.push_back(positive_length_m(text, "-z"));
  if (!options.window.empty()) {
    const auto [x, y] = two_parts(options.window, 'x', "--window");
    spec.window_m = glm::dvec2(positive_length_m(x, "--window"), positive_length_m(y, "--window"));
  }
  if (!options.blur.empty()) spec.blur_m = parse_length_m(options.blur, "--blur");
  return spec;
}

void print_table(const QualityResult& result, const QualitySpec& spec, const Options& options) {
  std::printf(
      "%d x %d pixels, mean of %d frames, blur %.4g px, border %d px, lens of %d x %d points\n",
      result.picture_size.x, result.picture_size.y, result.render.field.frames, result.blur_px,
      result.border_px, spec.lens_points, spec.lens_points);
  std::printf("%-10s  %-6s  %8s  %6s  %s\n", "depth", "view", "PSNR, dB", "SSIM",
              "speckle contrast: hologram (lens)");
  for (const auto& row : result.rows) {
    std::printf("%-10s  %-6s  %8.2f  %6.4f  %.4f (%.4f)\n", length_text(row.z_m).c_str(),
                row.view.c_str(), row.figures.psnr_db, row.figures.ssim, row.figures.contrast_b,
                row.figures.contrast_a);
  }
  if (result.against_points) {
    std::printf(
        "against the sum of all points, first frame: complex correlation %.4f, relative L2 error "
        "%.4f\n",
        result.against_points->correlation, result.against_points->error);
  }
  std::printf(
      "%s rendered in %.2f s (trace %.2f s, propagate %.2f s), reconstructed in %.2f s, seen by "
      "the lens in %.2f s\n",
      options.method.c_str(), result.seconds.at("render"), result.render.seconds.at("trace"),
      result.render.seconds.contains("propagate") ? result.render.seconds.at("propagate") : 0.0,
      result.seconds.at("reconstruct"), result.seconds.at("lens"));
}

void run(const Options& options) {
  const auto scene = load_scene(options.scene, options.set);
  const auto spec = spec_of(options);
  const cl::Device device(options.device.info());
  auto how = options.render;
  how.fft = options.device.backend(device.info());
  how.method = method_of(options.method);
  QualityResult result;
  {
    ProgressBar bar(options.quiet);
    how.progress = [&](const std::string& what, double share) { bar.show(what, share); };
    result = assess(device, scene, how, spec);
  }

  const std::filesystem::path out(options.out);
  const auto sheet = contact_sheet(result);
  save_png_rgb(out / "quality.png", sheet.width, sheet.height, sheet.rgb);
  const auto json = quality_json(scene, result, device.info(), how, spec);
  write_text(out / "quality.json", json);

  if (options.json) {
    std::fputs(json.c_str(), stdout);
  } else if (!options.quiet) {
    print_table(result, spec, options);
    std::printf(
        "%s  %d x %d, rows as in the table; columns: lens, hologram, difference; .json beside it\n",
        (out / "quality.png").c_str(), sheet.width, sheet.height);
  }
}

}  // namespace

void add_quality(CLI::App& app) {
  auto* command = app.add_subcommand(
      "quality",
      "Say how true a scene's hologram is to what a lens sees, at several depths and views");
  auto options = std::make_shared<Options>();
  auto& quality = options->quality;
  command->add_option("scene", options->scene, "Scene file (TOML)")->required();
  command->add_option("-o,--out", options->out, "Folder for quality.png and quality.json (.)");
  command
      ->add_option("-z", options->z,
                   "Depth, e.g. 95mm; may be given many times; nearest and farthest surface and a "
                   "little in front when not given")
      ->allow_extra_args(false);
  command->add_flag(
      "--views,!--no-views", quality.views,
      "At the first depth also through the left, right, top and bottom of the hologram");
  command->add_option(
      "--window", options->window,
      "Size of the pictures, e.g. 14.36mmx8.08mm; what the WRPs cover when not given");
  command->add_option("--blur", options->blur,
                      "Blur both pictures first: standard deviation as a length; 0.6 "
                      "sampling.pitch when not given");
  command->add_option("--border", quality.border_px,
                      "Pixels left out on every side after the blur (20)");
  command->add_option("--points", quality.lens_points,
                      "Points on the lens that rays start from, per axis (24)");
  command->add_flag("--against-points", quality.against_points,
                    "Also compare the field with the sum of all points (slow)");
  command->add_option("--method", options->method, "As in raywave render: wrp, points or rays");
  command
      ->add_option("--rays", options->render.rays_per_axis,
                   "Rays per axis and pixel of --method rays")
      ->check(CLI::Range(1, 1000));
  command->add_option("--set", options->set, "Change a value of the scene: section.key=value")
      ->allow_extra_args(false);
  command->add_flag("--json", options->json, "Print the JSON instead of a table");
  command->add_flag("--quiet", options->quiet, "Print nothing but errors");
  options->device.add_to(*command);
  command->callback([options] { run(*options); });
}

}  // namespace raywave::cli
