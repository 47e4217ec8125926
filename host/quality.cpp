// SPDX-License-Identifier: Apache-2.0
#include "host/quality.hpp"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "host/device_scene.hpp"
#include "host/lens.hpp"
#include "host/reconstruct.hpp"
#include "host/report.hpp"
#include "host/text.hpp"

namespace raywave {
namespace {

using Json = nlohmann::ordered_json;

/// A part of the hologram, as in ReconstructSpec.
struct View {
  const char* name;
  glm::dvec2 centre, aperture;
};

const View whole{"whole", {0, 0}, {1, 1}};
const View parts[] = {
    {"left", {-0.5, 0}, {0.5, 0.5}}, {"right", {0.5, 0}, {0.5, 0.5}}, {"top", {0, 0.5}, {0.5, 0.5}}, {"bottom", {0, -0.5}, {0.5, 0.5}}};

/// Calls f and adds the seconds it takes.
template <class F>
auto timed(double& seconds, F&& f) {
  const auto start = std::chrono::steady_clock::now();
  auto result = f();
  seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

Image without_border(const Image& image, int border) {
  Image inner{image.width - 2 * border, image.height - 2 * border, {}};
  for (int y = border; y < image.height - border; ++y) {
    const auto row = image.pixels.begin() + std::ptrdiff_t{y} * image.width;
    inner.pixels.insert(inner.pixels.end(), row + border, row + image.width - border);
  }
  return inner;
}

/// Means over squares of whole pixels, so that the picture fits into a cell.
Image small(const Image& image) {
  const int side = (image.width + sheet_cell_px - 1) / sheet_cell_px;
  Image result{(image.width + side - 1) / side, (image.height + side - 1) / side, {}};
  for (int y = 0; y < image.height; y += side) {
    for (int x = 0; x < image.width; x += side) {
      const int right = std::min(x + side, image.width), below = std::min(y + side, image.height);
      double sum = 0;
      for (int j = y; j < below; ++j) {
        for (int i = x; i < right; ++i) sum += image.pixels[std::size_t{1} * j * image.width + i];
      }
      result.pixels.push_back(static_cast<float>(sum / ((right - x) * (below - y))));
    }
  }
  return result;
}

Image scaled(Image image, double factor) {
  for (float& v : image.pixels) v = static_cast<float>(v * factor);
  return image;
}

/// Both pictures are blurred once, for the figures and for the sheet.
QualityRow row_of(const View& view, double z_m, const Image& lens, const Image& hologram, double blur_px, int border_px) {
  QualityRow row{view.name, z_m, {}, {}, {}, {}};
  const auto seen = blurred(lens, blur_px), shown = blurred(hologram, blur_px);
  row.figures = compare_pictures(seen, shown, {0, border_px, {}});
  row.lens = small(without_border(seen, border_px));
  row.hologram = scaled(small(without_border(shown, border_px)), row.figures.scale);
  row.difference = small(row.figures.difference);
  row.figures.difference = {};
  return row;
}

FieldStack first_frame(const FieldStack& field) {
  const auto count = std::ptrdiff_t{field.nx} * field.ny;
  return {field.nx, field.ny, 1, {field.samples.begin(), field.samples.begin() + count}};
}

}  // namespace

std::vector<double> quality_depths_m(const Plan& plan) {
  std::vector<double> depths{plan.near_m};
  if (plan.far_m - plan.near_m > 1e-6 * plan.near_m) depths.push_back(plan.far_m);
  depths.push_back(plan.near_m - std::min(std::max(0.1 * (plan.far_m - plan.near_m), 0.01 * plan.near_m), 0.5 * plan.near_m));
  return depths;
}

QualityResult assess(const cl::Device& device, const Scene& scene, const RenderOptions& how, const QualitySpec& what) {
  double seconds = 0;
  auto rendered = timed(seconds, [&] { return render(device, scene, how); });
  auto result = assess(device, scene, std::move(rendered), how, what);
  result.seconds["render"] = seconds;
  return result;
}

QualityResult assess(const cl::Device& device, const Scene& scene, RenderResult rendered, const RenderOptions& how,
                     const QualitySpec& what) {
  std::vector<Image> lens;
  return assess(device, scene, build_world(scene), std::move(rendered), how, what, lens);
}

QualityResult assess(const cl::Device& device, const Scene& scene, const World& world, RenderResult rendered, const RenderOptions& how,
                     const QualitySpec& what, std::vector<Image>& lens) {
  // The lens sees the scene as WRPs do, whatever the method.
  const auto plan = make_plan(scene, world);
  const DeviceScene arrays(device, scene, world, plan);
  const auto window_m = what.window_m.value_or(glm::dvec2(plan.size * plan.grid) * plan.pitch_m);
  const auto depths_m = what.depths_m.empty() ? quality_depths_m(plan) : what.depths_m;

  QualityResult result;
  result.render = std::move(rendered);
  result.picture_size = picture_size(window_m, plan.size, plan.pitch_m);
  result.blur_px = what.blur_m.value_or(0.6 * scene.sampling.pitch_m) / plan.pitch_m.x;
  result.border_px = what.border_px;

  const auto add_row = [&](const View& view, double z_m) {
    const auto progress_of = [&](const char* step) {
      return [&how, name = std::string(step) + ", " + view.name + " at " + length_text(z_m)](double share) {
        if (how.progress) how.progress(name, share);
      };
    };
    if (const auto row = result.rows.size(); row == lens.size()) {
      lens.push_back(timed(result.seconds["lens"], [&] {
        return lens_picture(device, plan, arrays, {z_m, window_m, view.centre, view.aperture, what.lens_points}, progress_of("lens"));
      }));
    }
    const auto hologram = timed(result.seconds["reconstruct"], [&] {
      ReconstructSpec spec;
      spec.z_m = z_m;
      spec.window_m = window_m;
      spec.view = view.centre;
      spec.aperture = view.aperture;
      return reconstruct(device, how.fft, result.render.field, scene.hologram, spec, progress_of("hologram"));
    });
    result.rows.push_back(row_of(view, z_m, lens[result.rows.size()], hologram, result.blur_px, result.border_px));
  };
  for (const double z_m : depths_m) add_row(whole, z_m);
  if (what.views) {
    for (const auto& view : parts) add_row(view, depths_m.front());
  }

  if (what.against_points) {
    auto one_frame = scene;
    one_frame.sampling.frames = 1;
    auto by_points = how;
    by_points.method = Method::points;
    by_points.keep_wrps = false;
    const auto points = timed(result.seconds["points"], [&] { return render(device, one_frame, by_points); });
    result.against_points = compare_fields(points.field, first_frame(result.render.field));
  }
  return result;
}

ColourPicture contact_sheet(const QualityResult& result) {
  // Lens and hologram of all rows below each other, exposed as one picture.
  const int cell_width = result.rows.at(0).lens.width, cell_height = result.rows.at(0).lens.height;
  const int count = static_cast<int>(result.rows.size());
  Image pictures{cell_width, 2 * count * cell_height, {}};
  for (const auto& row : result.rows) {
    for (const auto* image : {&row.lens, &row.hologram})
      pictures.pixels.insert(pictures.pixels.end(), image->pixels.begin(), image->pixels.end());
  }
  double white = 0;
  const auto grey = expose(pictures, 99.5, &white);

  ColourPicture sheet{3 * cell_width + 2 * sheet_gap_px, count * (cell_height + sheet_gap_px) - sheet_gap_px, {}};
  sheet.rgb.assign(std::size_t{3} * sheet.width * sheet.height, 128);
  for (int i = 0; i < count; ++i) {
    const auto difference = diverging_colours(result.rows[i].difference, sheet_full_difference * white);
    for (int y = 0; y < cell_height; ++y) {
      const std::size_t left = std::size_t{1} * (i * (cell_height + sheet_gap_px) + y) * sheet.width;
      const auto pixel = [&](int column, int x) { return &sheet.rgb[3 * (left + column * (cell_width + sheet_gap_px) + x)]; };
      for (int x = 0; x < cell_width; ++x) {
        const std::size_t at = std::size_t{1} * y * cell_width + x, cell = std::size_t{2} * i * cell_width * cell_height;
        std::fill_n(pixel(0, x), 3, grey[cell + at]);
        std::fill_n(pixel(1, x), 3, grey[cell + std::size_t{1} * cell_width * cell_height + at]);
        std::copy_n(&difference[3 * at], 3, pixel(2, x));
      }
    }
  }
  return sheet;
}

std::string quality_json(const Scene& scene, const QualityResult& result, const cl::DeviceInfo& device, const RenderOptions& how,
                         const QualitySpec& what) {
  constexpr const char* methods[] = {"wrp", "points", "rays"};
  Json json{{"method", methods[static_cast<int>(how.method)]},
            {"picture_size", {result.picture_size.x, result.picture_size.y}},
            {"frames", result.render.field.frames},
            {"blur_px", result.blur_px},
            {"border_px", result.border_px},
            {"lens_points_per_axis", what.lens_points}};
  for (const auto& row : result.rows) {
    json["rows"].push_back({{"z_m", row.z_m},
                            {"view", row.view},
                            {"psnr_db", row.figures.psnr_db},
                            {"ssim", row.figures.ssim},
                            {"scale", row.figures.scale},
                            {"speckle_contrast", {{"lens", row.figures.contrast_a}, {"hologram", row.figures.contrast_b}}}});
  }
  if (result.against_points) {
    json["against_points"] = {{"correlation", result.against_points->correlation},
                              {"relative_error", result.against_points->error},
                              {"relative_error_scaled", result.against_points->error_scaled},
                              {"energy_ratio", result.against_points->energy_ratio}};
  }
  json["seconds"] = result.seconds;
  json["render"] = Json::parse(render_report_json(scene, result.render, device, how.fft));
  return json.dump(2) + "\n";
}

}  // namespace raywave
