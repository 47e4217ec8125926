// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/colour_quality.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/colour_report.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/plan/make_plan.hpp"
#include "host/trace/device_scene.hpp"
#include "host/view/lens.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave {
namespace {

using Json = nlohmann::ordered_json;

/// The picture times a factor, blurred, without its border, averaged over squares until it fits
/// into a cell of the contact sheet.
RgbPicture cell_of(const RgbPicture& picture, double factor, double blur_px, int border) {
  RgbPicture cell;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto image = blurred(picture.channels[c], blur_px);
    Image inner{image.width - 2 * border, image.height - 2 * border, {}};
    for (int y = border; y < image.height - border; ++y)
      for (int x = border; x < image.width - border; ++x)
        inner.pixels.push_back(static_cast<float>(
            image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                         static_cast<std::size_t>(x)] *
            factor));
    cell.channels[c] = averaged(inner, (inner.width + sheet_cell_px - 1) / sheet_cell_px);
  }
  return cell;
}

Json json_of(const ColourComparison& figures) {
  return {{"psnr_db", figures.luminance.psnr_db},
          {"ssim", figures.luminance.ssim},
          {"delta_e_2000",
           {{"mean", figures.mean},
            {"median", figures.median},
            {"percentile_95", figures.most_of_95},
            {"largest", figures.most}}}};
}

}  // namespace

ColourQualityResult assess_colours(const cl::Device& device, const std::vector<Scene>& scenes,
                                   const World& world, const RenderOptions& how,
                                   const QualitySpec& what) {
  if (what.against_points)
    throw InputError(
        "--against-points compares the fields of one wavelength: give colour.only, or one "
        "wavelength");
  ColourQualityResult result;
  auto keeping = how;
  keeping.keep_field = true;
  result.render =
      timed(result.seconds["render"], [&] { return render(device, scenes, world, keeping); });
  const auto lasers = scenes.at(0).colour.value().lasers;

  // The lens uses the plans of the WRP method, whatever the method of the holograms
  std::vector<Plan> plans;
  glm::dvec2 all_m(0);
  for (const auto& scene : scenes) {
    plans.push_back(make_plan(scene, world));
    all_m =
        glm::max(all_m, glm::dvec2(plans.back().size * plans.back().grid) * plans.back().pitch_m);
  }
  const auto& first = plans[0];
  DeviceScene arrays(device, world, first);
  const auto window_m = what.window_m.value_or(all_m);
  const auto depths_m = what.depths_m.empty() ? quality_depths_m(first) : what.depths_m;
  result.picture_size = picture_size(window_m, first.size, first.pitch_m);
  result.blur_px =
      what.blur_m.value_or(blur_of_resolution * scenes[0].sampling.pitch_m) / first.pitch_m.x;
  result.border_px = what.border_px;
  std::vector<FieldStack> shown;
  for (const auto& laser : result.render.lasers)
    shown.push_back(shown_field(*laser.panel, laser.levels));

  const PictureOptions compared{result.blur_px, what.border_px, {}, Domain::srgb};
  const auto add_row = [&](const QualityView& view, double z_m) {
    const auto place = std::string(", ") + view.name + " at " + length_text(z_m);
    // A picture of all lasers, of the light that `light_of` gives of each
    const auto picture_of = [&](const char* step, const auto& light_of) {
      std::array<Image, 3> light;
      for (std::size_t i = 0; i < light.size(); ++i) {
        light[i] = light_of(i, [&, i](double share) {
          if (how.progress) how.progress(step + place, (static_cast<double>(i) + share) / 3);
        });
      }
      return picture_of_lasers(lasers, light);
    };
    const auto look = [&](const FieldStack& field, std::size_t laser,
                          const std::function<void(double)>& progress) {
      const ReconstructSpec spec{z_m, window_m, view.centre, view.aperture};
      return reconstruct(device, how.fft, field, scenes[laser].hologram, spec, progress);
    };
    const auto lens = timed(result.seconds["lens"], [&] {
      return picture_of("lens", [&](std::size_t i, const std::function<void(double)>& progress) {
        arrays.show(plans[i]);
        return lens_picture(
            device, plans[i], arrays, {z_m, window_m, view.centre, view.aperture, what.lens_points},
            [&](double share) {
              progress(share);
              const auto done = static_cast<double>(3 * result.rows.size() + i);
              if (what.lens_progress)
                what.lens_progress(done + share, static_cast<double>(3 * rows_of(depths_m, what)));
            });
      });
    });
    const auto of_levels = timed(result.seconds["reconstruct"], [&] {
      return picture_of("hologram",
                        [&](std::size_t i, const std::function<void(double)>& progress) {
                          auto image = look(shown[i], i, progress);
                          const double gain = result.render.powers[i] / lasers.white_powers[i];
                          for (float& pixel : image.pixels)
                            pixel = static_cast<float>(double{pixel} * gain);
                          return image;
                        });
    });
    const auto of_fields = timed(result.seconds["reconstruct"], [&] {
      return picture_of("field", [&](std::size_t i, const std::function<void(double)>& progress) {
        return look(result.render.lasers[i].field, i, progress);
      });
    });
    auto& row = result.rows.emplace_back();
    row.view = view.name;
    row.z_m = z_m;
    row.figures = compare_colours(lens, of_levels, compared);
    row.field_figures = compare_colours(lens, of_fields, compared);
    row.field_figures.luminance.difference = {};
    row.lens = cell_of(lens, 1, result.blur_px, what.border_px);
    row.hologram = cell_of(of_levels, row.figures.scale, result.blur_px, what.border_px);
    auto& difference = row.figures.luminance.difference;
    difference = averaged(difference, (difference.width + sheet_cell_px - 1) / sheet_cell_px);
  };
  for (const double z_m : depths_m) add_row(whole_view, z_m);
  if (what.views)
    for (const auto& view : side_views) add_row(view, depths_m.front());
  return result;
}

ColourPicture contact_sheet(const ColourQualityResult& result) {
  double white = 0;
  for (const auto& row : result.rows)
    for (const auto* picture : {&row.lens, &row.hologram})
      white = std::max(white, white_of(*picture, 99.5));
  const glm::ivec2 cell(result.rows.at(0).lens.width(), result.rows.at(0).lens.height());
  auto sheet = empty_sheet(3, static_cast<int>(result.rows.size()), cell);
  for (std::size_t i = 0; i < result.rows.size(); ++i) {
    const auto& row = result.rows[i];
    const int at = static_cast<int>(i);
    put_cell(sheet, 0, at, cell, expose_to(row.lens, white));
    put_cell(sheet, 1, at, cell, expose_to(row.hologram, white));
    // Of values as a screen shows them, 0 to 1
    put_cell(sheet, 2, at, cell,
             diverging_colours(row.figures.luminance.difference, sheet_full_difference));
  }
  return sheet;
}

Json colour_quality_json(const std::vector<Scene>& scenes, const ColourQualityResult& result,
                         const cl::DeviceInfo& device, const RenderOptions& how,
                         const QualitySpec& what) {
  constexpr const char* methods[] = {"wrp", "points", "rays"};
  const auto& first = result.render.lasers.at(0);
  Json json{{"method", methods[static_cast<int>(how.method)]},
            {"picture_size", {result.picture_size.x, result.picture_size.y}},
            {"frames", first.field.frames},
            {"encoding", name_of(first.plan.slm.encoding)},
            {"domain", name_of(Domain::srgb)},
            {"blur_px", result.blur_px},
            {"border_px", result.border_px},
            {"lens_points_per_axis", what.lens_points}};
  for (const auto& row : result.rows) {
    Json told{{"z_m", row.z_m}, {"view", row.view}};
    told.update(json_of(row.figures));
    told["scale"] = row.figures.scale;
    told["field"] = json_of(row.field_figures);
    told["speckle_contrast"] = {{"lens", row.figures.luminance.contrast_a},
                                {"hologram", row.figures.luminance.contrast_b}};
    json["rows"].push_back(std::move(told));
  }
  json["seconds"] = result.seconds;
  std::vector<LaserFiles> none(scenes.size());
  json["render"] = report_json(scenes, result.render, none, device, how.fft);
  return json;
}

}  // namespace raywave
