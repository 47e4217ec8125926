// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/quality.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/report.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/plan/make_plan.hpp"
#include "host/trace/device_scene.hpp"
#include "host/view/lens.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave {
namespace {

using Json = nlohmann::ordered_json;

Image without_border(const Image& image, int border) {
  Image inner{image.width - 2 * border, image.height - 2 * border, {}};
  for (int y = border; y < image.height - border; ++y) {
    const auto row = image.pixels.begin() + std::ptrdiff_t{y} * image.width;
    inner.pixels.insert(inner.pixels.end(), row + border, row + image.width - border);
  }
  return inner;
}

/// The picture, averaged over squares until it fits into a cell of the contact sheet.
Image small(const Image& image, int cell_px = sheet_cell_px) {
  return averaged(image, (image.width + cell_px - 1) / cell_px);
}

Image scaled(Image image, double factor) {
  for (float& v : image.pixels) v = static_cast<float>(v * factor);
  return image;
}

/// Light of the picture in the rectangle around what the lens sees.
double light_in_picture(const Image& lens, const Image& hologram) {
  const float least = *std::max_element(lens.pixels.begin(), lens.pixels.end()) / 100;
  int left = lens.width, right = -1, top = lens.height, bottom = -1;
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      if (lens.pixels[std::size_t{1} * y * lens.width + x] <= least) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = y;
    }
  }
  double sum = 0;
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x)
      sum += hologram.pixels[std::size_t{1} * y * hologram.width + x];
  }
  return sum;
}

/// Mean of the hologram where the lens sees nothing, in units of the lens's brightest pixel.
std::optional<double> haze_of(const Image& lens, const Image& hologram, double scale) {
  const float brightest = *std::max_element(lens.pixels.begin(), lens.pixels.end());
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < lens.pixels.size(); ++i) {
    if (lens.pixels[i] > brightest / 1000) continue;
    sum += hologram.pixels[i];
    ++count;
  }
  if (count == 0 || brightest <= 0) return {};
  return sum / count * scale / brightest;
}

/// Compares pictures of lens, levels and field. Each is blurred once, for the figures and for the
/// sheet.
QualityRow row_of(const QualityView& view, double z_m, const Image& lens, const Image& hologram,
                  const Image& field, double blur_px, int border_px) {
  QualityRow row;
  row.view = view.name;
  row.z_m = z_m;
  const auto seen = blurred(lens, blur_px), shown = blurred(hologram, blur_px);
  row.figures = compare_pictures(seen, shown, {0, border_px, {}});
  row.field_figures = compare_pictures(seen, blurred(field, blur_px), {0, border_px, {}});
  row.field_figures.difference = {};
  row.light_share = light_in_picture(lens, hologram);
  const auto inner = without_border(seen, border_px),
             inner_shown = without_border(shown, border_px);
  row.haze = haze_of(inner, inner_shown, row.figures.scale);
  row.lens = small(inner);
  row.hologram = scaled(small(inner_shown), row.figures.scale);
  row.difference = small(row.figures.difference);
  row.figures.difference = {};
  return row;
}

FieldStack some_frames(const FieldStack& field, int first, int count) {
  const auto start = field.samples.begin() + std::ptrdiff_t{first} * field.nx * field.ny;
  return {field.nx, field.ny, count, {start, start + std::ptrdiff_t{count} * field.nx * field.ny}};
}

/// Updates the mean of `count` frames with the mean of `more_count` other frames.
void average_in(Image& mean, int count, const Image& more, int more_count) {
  if (count == 0) {
    mean = more;
    return;
  }
  const double share = static_cast<double>(more_count) / (count + more_count);
  for (std::size_t i = 0; i < mean.pixels.size(); ++i)
    mean.pixels[i] = static_cast<float>(mean.pixels[i] + share * (more.pixels[i] - mean.pixels[i]));
}

/// Squared correlation of two waves, mean of the first frames.
double wanted_share(const JudgedHologram& hologram, int frames) {
  const auto& [field, shown] = hologram;
  const auto pixels = std::size_t{1} * field.nx * field.ny;
  double sum = 0;
  for (int frame = 0; frame < frames; ++frame) {
    std::complex<double> product;
    double wanted = 0;
    for (std::size_t i = frame * pixels; i < (frame + 1) * pixels; ++i) {
      const std::complex<double> u(field.samples[i]), v(shown.samples[i]);
      product += u * std::conj(v);
      wanted += std::norm(u);
    }
    // The light on the SLM is 1 per pixel.
    if (wanted > 0) sum += std::norm(product) / (wanted * static_cast<double>(pixels));
  }
  return sum / frames;
}

}  // namespace

ColourPicture empty_sheet(int columns, int rows, glm::ivec2 cell) {
  ColourPicture sheet{columns * (cell.x + sheet_gap_px) - sheet_gap_px,
                      rows * (cell.y + sheet_gap_px) - sheet_gap_px,
                      {}};
  sheet.rgb.assign(std::size_t{3} * sheet.width * sheet.height, 128);
  return sheet;
}

void put_cell(ColourPicture& sheet, int column, int row, glm::ivec2 cell,
              const std::vector<std::uint8_t>& rgb) {
  for (int y = 0; y < cell.y; ++y) {
    const std::size_t left = std::size_t{1} * (row * (cell.y + sheet_gap_px) + y) * sheet.width +
                             column * (cell.x + sheet_gap_px);
    std::copy_n(&rgb[std::size_t{3} * y * cell.x], 3 * cell.x, &sheet.rgb[3 * left]);
  }
}

QualityResult assess(const cl::Device& device, const Scene& scene, const RenderOptions& how,
                     const QualitySpec& what) {
  double seconds = 0;
  auto rendered = timed(seconds, [&] { return render(device, scene, how); });
  auto result = assess(device, scene, std::move(rendered), how, what);
  result.seconds["render"] = seconds;
  return result;
}

QualityResult assess(const cl::Device& device, const Scene& scene, RenderResult rendered,
                     const RenderOptions& how, const QualitySpec& what) {
  std::vector<Image> lens;
  return assess(device, scene, build_world(scene), std::move(rendered), how, what, lens);
}

FieldStack shown_by_slm(const cl::Device& device, const Scene& scene, const FieldStack& field) {
  const auto& hologram = scene.hologram;
  const auto panel = std::make_shared<const Panel>(scene.slm, hologram.resolution, hologram.pitch_m,
                                                   hologram.wavelength_m);
  Encoder encoder(device, panel);
  return shown_field(*panel, encode(device, encoder, field));
}

QualityResult assess(const cl::Device& device, const Scene& scene, const World& world,
                     RenderResult rendered, const RenderOptions& how, const QualitySpec& what,
                     std::vector<Image>& lens) {
  // Fields of other programs come without levels.
  const auto shown = rendered.panel ? shown_field(*rendered.panel, rendered.levels)
                                    : shown_by_slm(device, scene, rendered.field);
  auto result = std::move(assess_frames(device, scene, world, {rendered.field, shown},
                                        {rendered.field.frames}, how, what, lens)
                              .front());
  result.render = std::move(rendered);
  if (what.against_points)
    result.against_points = timed(result.seconds["points"], [&] {
      return compare_with_points(device, scene, world, result.render.field, how);
    });
  return result;
}

std::vector<QualityResult> assess_frames(const cl::Device& device, const Scene& scene,
                                         const World& world, const JudgedHologram& hologram,
                                         const std::vector<int>& frame_counts,
                                         const RenderOptions& how, const QualitySpec& what,
                                         std::vector<Image>& lens) {
  // The lens uses the plan of the WRP method, whatever the method of the hologram.
  const auto plan = make_plan(scene, world);
  const DeviceScene arrays(device, world, plan);
  const auto window_m = what.window_m.value_or(glm::dvec2(plan.size * plan.grid) * plan.pitch_m);
  const auto depths_m = what.depths_m.empty() ? quality_depths_m(plan) : what.depths_m;

  // Fields that all results share
  QualityResult empty;
  empty.picture_size = picture_size(window_m, plan.size, plan.pitch_m);
  empty.blur_px =
      what.blur_m.value_or(blur_of_resolution * scene.sampling.pitch_m) / plan.pitch_m.x;
  empty.border_px = what.border_px;
  std::vector<QualityResult> results(frame_counts.size(), empty);
  for (std::size_t i = 0; i < results.size(); ++i)
    results[i].wanted_share = wanted_share(hologram, frame_counts[i]);
  const auto frame_pixels = static_cast<double>(plan.size.x) * plan.size.y;

  // A row compares the hologram with the lens for one view and depth.
  std::size_t row = 0;
  const auto add_row = [&](const QualityView& view, double z_m) {
    const auto progress_of = [&](const char* step) {
      return [&how, name = std::string(step) + ", " + view.name + " at " +
                           length_text(z_m)](double share) {
        if (how.progress) how.progress(name, share);
      };
    };
    // Pictures of the lens that an earlier call made are reused.
    if (row == lens.size()) {
      const auto seen = timed(results.front().seconds["lens"], [&] {
        return lens_picture(device, plan, arrays,
                            {z_m, window_m, view.centre, view.aperture, what.lens_points},
                            [&, show = progress_of("lens")](double share) {
                              show(share);
                              if (what.lens_progress)
                                what.lens_progress(static_cast<double>(row) + share,
                                                   static_cast<double>(rows_of(depths_m, what)));
                            });
      });
      lens.push_back(averaged(seen, what.square_px));
    }
    // Each result adds frames to the mean pictures of the result before.
    Image shown, shown_by_field;
    int frames = 0;
    for (std::size_t i = 0; i < results.size(); ++i) {
      const int more_frames = frame_counts[i] - frames;
      const auto look = [&](const FieldStack& all) {
        ReconstructSpec spec;
        spec.z_m = z_m;
        spec.window_m = window_m;
        spec.view = view.centre;
        spec.aperture = view.aperture;
        const auto picture = [&](const FieldStack& at) {
          return reconstruct(device, how.fft, at, scene.hologram, spec, progress_of("hologram"));
        };
        return averaged(more_frames == all.frames ? picture(all)
                                                  : picture(some_frames(all, frames, more_frames)),
                        what.square_px);
      };
      timed(results[i].seconds["reconstruct"], [&] {
        average_in(shown, frames, look(hologram.shown), more_frames);
        average_in(shown_by_field, frames, look(hologram.field), more_frames);
        return 0;
      });
      frames = frame_counts[i];
      auto& done = results[i].rows.emplace_back(row_of(view, z_m, lens[row], shown, shown_by_field,
                                                       empty.blur_px / what.square_px,
                                                       what.border_px / what.square_px));
      done.light_share *= what.square_px * what.square_px / frame_pixels;
    }
    ++row;
  };
  for (const double z_m : depths_m) add_row(whole_view, z_m);
  if (what.views) {
    for (const auto& view : side_views) add_row(view, depths_m.front());
  }
  return results;
}

FieldComparison compare_with_points(const cl::Device& device, const Scene& scene,
                                    const World& world, const FieldStack& field,
                                    const RenderOptions& how) {
  auto one_frame = scene;
  one_frame.sampling.frames = 1;
  auto by_points = how;
  by_points.method = Method::points;
  by_points.keep_wrps = false;
  by_points.keep_field = true;
  by_points.planned = nullptr;  // it was said of the holograms
  return compare_fields(render(device, one_frame, world, by_points).field,
                        some_frames(field, 0, 1));
}

ColourPicture grey_sheet(const std::vector<std::vector<Image>>& rows, int cell_px, double* white) {
  // All pictures form one tall image, so that they share an exposure.
  Image all;
  std::size_t columns = 0;
  for (const auto& row : rows) {
    columns = std::max(columns, row.size());
    for (const auto& picture : row) {
      const auto cell = small(picture, cell_px);
      all.width = cell.width;
      all.height += cell.height;
      all.pixels.insert(all.pixels.end(), cell.pixels.begin(), cell.pixels.end());
    }
  }
  const auto grey = expose(all, 99.5, white);

  // The cells are arranged in rows and columns.
  const int height = all.height / static_cast<int>(rows.size() * columns);
  ColourPicture sheet =
      empty_sheet(static_cast<int>(columns), static_cast<int>(rows.size()), {all.width, height});
  for (std::size_t cell = 0; cell < rows.size() * columns; ++cell) {
    const auto first = grey.begin() + static_cast<std::ptrdiff_t>(cell) * all.width * height;
    std::vector<std::uint8_t> rgb;
    for (auto pixel = first; pixel != first + std::ptrdiff_t{all.width} * height; ++pixel)
      rgb.insert(rgb.end(), 3, *pixel);
    put_cell(sheet, static_cast<int>(cell % columns), static_cast<int>(cell / columns),
             {all.width, height}, rgb);
  }
  return sheet;
}

ColourPicture contact_sheet(const QualityResult& result) {
  std::vector<std::vector<Image>> pictures;
  for (const auto& row : result.rows) pictures.push_back({row.lens, row.hologram});
  double white = 0;
  const auto grey = grey_sheet(pictures, sheet_cell_px, &white);

  const glm::ivec2 cell(result.rows.at(0).lens.width, result.rows.at(0).lens.height);
  const int count = static_cast<int>(result.rows.size());
  auto sheet = empty_sheet(3, count, cell);
  for (int y = 0; y < sheet.height; ++y)
    std::copy_n(&grey.rgb[std::size_t{3} * y * grey.width], 3 * grey.width,
                &sheet.rgb[std::size_t{3} * y * sheet.width]);
  for (int row = 0; row < count; ++row)
    put_cell(sheet, 2, row, cell,
             diverging_colours(result.rows[row].difference, sheet_full_difference * white));
  return sheet;
}

Json quality_json(const Scene& scene, const QualityResult& result, const cl::DeviceInfo& device,
                  const RenderOptions& how, const QualitySpec& what) {
  constexpr const char* methods[] = {"wrp", "points", "rays"};
  Json json{{"method", methods[static_cast<int>(how.method)]},
            {"picture_size", {result.picture_size.x, result.picture_size.y}},
            {"frames", result.render.field.frames},
            {"encoding", name_of(result.render.plan.slm.encoding)},
            {"wanted_share", result.wanted_share},
            {"blur_px", result.blur_px},
            {"border_px", result.border_px},
            {"lens_points_per_axis", what.lens_points}};
  for (const auto& row : result.rows) {
    json["rows"].push_back(
        {{"z_m", row.z_m},
         {"view", row.view},
         {"psnr_db", row.figures.psnr_db},
         {"ssim", row.figures.ssim},
         {"scale", row.figures.scale},
         {"light_share", row.light_share},
         {"haze", row.haze ? Json(*row.haze) : Json()},
         {"field", {{"psnr_db", row.field_figures.psnr_db}, {"ssim", row.field_figures.ssim}}},
         {"speckle_contrast",
          {{"lens", row.figures.contrast_a}, {"hologram", row.figures.contrast_b}}}});
  }
  if (result.against_points) {
    json["against_points"] = {{"correlation", result.against_points->correlation},
                              {"relative_error", result.against_points->error},
                              {"relative_error_scaled", result.against_points->error_scaled},
                              {"energy_ratio", result.against_points->energy_ratio}};
  }
  json["seconds"] = result.seconds;
  json["render"] = render_report_json(scene, result.render, device, how.fft);
  return json;
}

}  // namespace raywave
