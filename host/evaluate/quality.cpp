// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/quality.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/report.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/forecast/candidates.hpp"
#include "host/forecast/tuning.hpp"
#include "host/planning/make_plan.hpp"
#include "host/trace/device_scene.hpp"
#include "host/view/lens.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave {
namespace {

using ImageList = std::vector<Image>;

/// Of a picture that the hologram or the field shows: what judging a pixel takes, and each frame of
/// one. An EPYC's cores.
constexpr double judging_s = 0.5e-6, frame_s = 0.1e-6;

/// The picture, averaged over squares until it fits into a cell of the contact sheet.
Image small(const Image& image, int cell_px = sheet_cell_px) {
  return averaged(image, (image.width + cell_px - 1) / cell_px);
}

Image scaled(Image image, double factor) {
  for (float& v : image.pixels) v = static_cast<float>(v * factor);
  return image;
}

/// What `change` makes of each of the images.
template <class Change>
ImageList each(const ImageList& images, const Change& change) {
  ImageList changed;
  for (const auto& image : images) changed.push_back(change(image));
  return changed;
}

/// Grey has three equal channels.
RgbPicture rgb_of(const ImageList& channels) {
  return {{channels.front(), channels[channels.size() / 2], channels.back()}};
}

Image brightness_of(const ImageList& channels) {
  return channels.size() == 1 ? channels[0] : luminance_of(rgb_of(channels));
}

/// Mean of the hologram where the lens sees nothing, in units of the lens's brightest pixel.
std::optional<double> haze_of(const Image& lens, const Image& hologram, double scale) {
  const float brightest = *std::ranges::max_element(lens.pixels);
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < lens.pixels.size(); ++i) {
    if (lens.pixels[i] > brightest / 1000) continue;
    sum += hologram.pixels[i];
    ++count;
  }
  if (count == 0 || brightest <= 0) return {};
  return sum / count * scale / brightest;
}

/// Figures of pictures that are blurred already.
ColourComparison compare(const ImageList& a, const ImageList& b, int border_px) {
  if (a.size() > 1) return compare_colours(rgb_of(a), rgb_of(b), {0, border_px, {}, Domain::srgb});
  ColourComparison figures;
  figures.luminance = compare_pictures(a[0], b[0], {0, border_px, {}});
  figures.scale = figures.luminance.scale;
  return figures;
}

/// Compares pictures of lens, levels and field, each of one channel or three. Each is blurred once,
/// for the figures and for the sheet.
QualityRow row_of(const ImageList& lens, const ImageList& hologram, const ImageList& field,
                  double blur_px, int border_px) {
  const auto blur = [&](const Image& image) { return blurred(image, blur_px); };
  const auto crop = [&](const Image& image) {
    return cropped(
        image, {border_px, border_px, image.width - 2 * border_px, image.height - 2 * border_px});
  };
  const auto cell = [&](const Image& image) { return small(image); };
  QualityRow row;
  const auto seen = each(lens, blur), shown = each(hologram, blur);
  row.figures = compare(seen, shown, border_px);
  if (!field.empty()) row.field_figures = compare(seen, each(field, blur), border_px);
  const double scale = row.figures.scale;
  const auto inner = each(seen, crop), inner_shown = each(shown, crop);
  row.haze = haze_of(brightness_of(inner), brightness_of(inner_shown), scale);
  row.lens = each(inner, cell);
  row.hologram = each(inner_shown, [&](const Image& image) { return scaled(small(image), scale); });
  row.difference = small(row.figures.luminance.difference);
  row.figures.luminance.difference = row.field_figures.luminance.difference = {};
  return row;
}

FieldStack some_frames(const FieldStack& field, int first, int count) {
  const auto start = field.samples.begin() + std::ptrdiff_t{first} * field.nx * field.ny;
  return {field.nx,
          field.ny,
          count,
          {start, start + std::ptrdiff_t{count} * field.nx * field.ny},
          field.source};
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

/// What the scene's SLM shows of a field.
FieldStack shown_by_slm(const cl::Device& device, const Scene& scene, const FieldStack& field) {
  const auto& hologram = scene.hologram;
  const auto panel = std::make_shared<const Panel>(scene.slm, hologram.resolution, hologram.pitch_m,
                                                   hologram.wavelength_m);
  Encoder encoder(device, panel);
  return shown_field(*panel, encode(device, encoder, field));
}

/// Squared correlation of two waves, mean of the first frames.
double wanted_share(const FieldStack& field, const FieldStack& shown, int frames) {
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

/// Judges the first frames of the holograms of all lasers, row by row.
class Judge {
public:
  Judge(const cl::Device& device, const std::vector<Scene>& scenes, const World& world,
        const Rendered& rendered, std::vector<int> frame_counts, const RenderOptions& how,
        const QualitySpec& what)
      : device_(device),
        scenes_(scenes),
        rendered_(rendered),
        frame_counts_(std::move(frame_counts)),
        how_(how),
        what_(what),
        plans_(plans_of(scenes, world)),
        arrays_(device, world, plans_[0]) {
    const auto& plan = plans_[0];
    depths_m_ = what.depths_m.empty() ? quality_depths_m(plan) : what.depths_m;
    const double blur_m =
        what.blur_m.value_or(blur_of_resolution * wanted_resolution_m(scenes[0], plan));
    const auto view = front_view(scenes[0], world, plan);
    QualityResult empty;
    empty.window = what.window ? *what.window : quality_window(plan, view, blur_m);
    // Whole squares around the axis, and of them those that hold the window
    pixel_m_ = double(what.square_px) * plan.hologram.pitch_m;
    const auto centred = picture_size(empty.window.centred_size_m(), plan.hologram.size, pixel_m_);
    window_m_ = glm::dvec2(centred) * pixel_m_;
    const auto place = [&](glm::dvec2 from_corner_m, int most_x, int most_y) {
      return glm::clamp(glm::ivec2(glm::round(from_corner_m / pixel_m_)), glm::ivec2(0),
                        glm::ivec2(most_x, most_y));
    };
    // Rows count from the top
    const glm::dvec2 low_m = empty.window.low_m, high_m = empty.window.high_m;
    first_px_ =
        place(window_m_ / 2.0 + glm::dvec2(low_m.x, -high_m.y), centred.x - 1, centred.y - 1);
    end_px_ =
        glm::max(place(window_m_ / 2.0 + glm::dvec2(high_m.x, -low_m.y), centred.x, centred.y),
                 first_px_ + 1);
    empty.picture_size = (end_px_ - first_px_) * what.square_px;
    empty.blur_px = blur_m / plan.hologram.pitch_m.x;
    empty.border_px = what.border_px;
    results_.assign(frame_counts_.size(), empty);
    const double pixels = double(centred.x) * centred.y,
                 all_pixels = pixels * what.square_px * what.square_px;
    const auto lens =
        lens_work(world, plan, view, window_m_, pixels * std::pow(what.lens_points, 2));
    lens_s_ = predict_times(lens, figures_of(device.info()).rates).total_s();
    look_s_ = judging_s * pixels + frame_s * all_pixels * frame_counts_.back();
    if (what.begins) what.begins(all_s());
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      // Fields of other programs come without levels.
      const auto& laser = rendered.lasers[i];
      shown_.push_back(laser.panel ? shown_field(*laser.panel, laser.levels)
                                   : shown_by_slm(device, scenes[i], laser.field));
      for (std::size_t k = 0; k < results_.size() && what.field; ++k)
        results_[k].wanted_share +=
            wanted_share(laser.field, shown_[i], frame_counts_[k]) / count();
    }
  }

  std::vector<QualityResult> judge(LensPictures& lens) {
    for (const double z_m : depths_m_) {
      if (what_.pupils.empty()) add_row(whole_view, z_m, lens);
      for (const auto& pupil : what_.pupils)
        add_row({"pupil", whole_view.centre, whole_view.aperture, pupil}, z_m, lens);
    }
    if (has_side_views()) {
      for (const auto& view : side_views) add_row(view, depths_m_.front(), lens);
    }
    return std::move(results_);
  }

private:
  // The lens uses the plans of the WRP method, whatever the method of the holograms.
  static std::vector<Plan> plans_of(const std::vector<Scene>& scenes, const World& world) {
    std::vector<Plan> plans;
    for (const auto& scene : scenes) plans.push_back(make_plan(scene, world));
    return plans;
  }

  double count() const { return static_cast<double>(scenes_.size()); }
  bool has_side_views() const { return what_.views && what_.pupils.empty(); }
  double rows() const {
    return static_cast<double>(depths_m_.size() * std::max<std::size_t>(1, what_.pupils.size()) +
                               (has_side_views() ? side_views.size() : 0));
  }
  double looks() const { return what_.field ? 2 : 1; }
  double all_s() const { return count() * rows() * (lens_s_ + looks() * look_s_); }

  /// Compares the holograms with the lens for one view and depth.
  void add_row(const QualityView& view, double z_m, LensPictures& lens) {
    const auto row = results_.front().rows.size();
    // Pictures of the lens that an earlier call made are reused.
    if (row == lens.size())
      lens.push_back(
          timed(results_.front().seconds["lens"], [&] { return seen_by_lens(view, z_m, row); }));
    const auto& seen = lens[row];
    // Each result adds frames to the mean pictures of the result before.
    ImageList shown(scenes_.size()), shown_by_field(scenes_.size());
    int frames = 0;
    for (std::size_t k = 0; k < results_.size(); ++k) {
      auto& result = results_[k];
      const int more_frames = frame_counts_[k] - frames;
      timed(result.seconds["reconstruct"], [&] {
        for (std::size_t i = 0; i < scenes_.size(); ++i) {
          const auto add = [&](const char* step, const FieldStack& all, Image& mean) {
            average_in(mean, frames,
                       look(step, view, z_m, i, some_frames(all, frames, more_frames)),
                       more_frames);
          };
          add("hologram", shown_[i], shown[i]);
          if (what_.field) add("field", rendered_.lasers[i].field, shown_by_field[i]);
        }
        return 0;
      });
      frames = frame_counts_[k];
      auto done = row_of(mixed(seen), mixed(bright(shown, frames)),
                         what_.field ? mixed(shown_by_field) : ImageList(),
                         result.blur_px / what_.square_px, what_.border_px / what_.square_px);
      done.view = view.name;
      done.pupil = view.pupil;
      done.z_m = z_m;
      const auto& size = plans_[0].hologram.size;
      for (std::size_t i = 0; i < scenes_.size(); ++i)
        done.light_share += light_in_picture(seen[i], shown[i]) * what_.square_px *
                            what_.square_px / (static_cast<double>(size.x) * size.y) / count();
      result.rows.push_back(std::move(done));
    }
  }

  /// The progress of a laser's picture, which takes `picture_s` of all.
  std::function<void(double)> progress_of(const char* step, const QualityView& view, double z_m,
                                          double picture_s) {
    const double from_s = std::exchange(done_s_, done_s_ + picture_s);
    return [this, from_s, picture_s,
            name = std::string(step) + ", " + view.name + " at " + length_text(z_m)](double share) {
      if (how_.progress) how_.progress(name, std::min(1.0, (from_s + picture_s * share) / all_s()));
    };
  }

  ImageList seen_by_lens(const QualityView& view, double z_m, std::size_t row) {
    const double all = count() * rows();
    ImageList seen;
    for (std::size_t i = 0; i < plans_.size(); ++i) {
      if (plans_.size() > 1) arrays_.show(plans_[i]);
      const auto image = lens_picture(
          device_, plans_[i], arrays_,
          {z_m, window_m_, view.centre, view.aperture, what_.lens_points, pixel_m_,
           what_.square_px > 1, view.pupil},
          [&, show = progress_of("lens", view, z_m, lens_s_)](double share) {
            show(share);
            if (what_.lens_progress)
              what_.lens_progress(
                  count() * static_cast<double>(row) + static_cast<double>(i) + share, all);
          });
      seen.push_back(in_window(image));
    }
    return seen;
  }

  Image look(const char* step, const QualityView& view, double z_m, std::size_t laser,
             const FieldStack& field) {
    ReconstructSpec spec{z_m, window_m_, view.centre, view.aperture};
    spec.pupil = view.pupil;
    return in_window(averaged(reconstruct(device_, how_.fft, field, scenes_[laser].hologram, spec,
                                          progress_of(step, view, z_m, look_s_)),
                              what_.square_px));
  }

  /// The part of a picture around the axis that is judged.
  Image in_window(const Image& image) const {
    const auto size = end_px_ - first_px_;
    return cropped(image, {first_px_.x, first_px_.y, size.x, size.y});
  }

  /// What the levels of the first frames show, each laser with its power.
  ImageList bright(ImageList light, int frames) const {
    if (light.size() == 1) return light;
    const auto& lasers = scenes_[0].colour.value().lasers;
    auto powers = rendered_.powers;
    if (frames != rendered_.lasers[0].field.frames) {
      std::vector<double> needs;
      for (const auto& laser : rendered_.lasers) needs.push_back(laser_need(laser, frames));
      powers = laser_powers(lasers, needs);
    }
    for (std::size_t i = 0; i < light.size(); ++i)
      light[i] = scaled(std::move(light[i]), powers[i] / lasers.white_powers[i]);
    return light;
  }

  /// The picture of what each laser shows: its light, or of several their colours.
  ImageList mixed(const ImageList& light) const {
    if (light.size() == 1) return light;
    const auto rgb = picture_of_lasers(scenes_[0].colour.value().lasers, light);
    return {rgb.channels.begin(), rgb.channels.end()};
  }

  const cl::Device& device_;
  const std::vector<Scene>& scenes_;
  const Rendered& rendered_;
  std::vector<int> frame_counts_;
  const RenderOptions& how_;
  const QualitySpec& what_;
  std::vector<Plan> plans_;
  DeviceScene arrays_;
  glm::dvec2 window_m_{0, 0}, pixel_m_{0, 0};  // of the pictures that are computed
  glm::ivec2 first_px_{0, 0}, end_px_{0, 0};   // of them, in pixels: what is judged
  std::vector<double> depths_m_;
  // Predicted: of a laser's picture by the lens, and by its levels or its field; of those begun
  double lens_s_ = 0, look_s_ = 0, done_s_ = 0;
  std::vector<FieldStack> shown_;  // behind the SLM
  std::vector<QualityResult> results_;
};

/// The first frames of all lasers, one after another.
FieldStack first_frames(const Rendered& rendered) {
  FieldStack all{0, 0, 0, {}};
  for (const auto& laser : rendered.lasers) {
    const auto& first = laser.field;
    all.nx = first.nx;
    all.ny = first.ny;
    ++all.frames;
    all.samples.insert(all.samples.end(), first.samples.begin(),
                       first.samples.begin() + std::ptrdiff_t{1} * first.nx * first.ny);
  }
  return all;
}

Sheet empty_sheet(int columns, int rows, glm::ivec2 cell) {
  Sheet sheet{columns * (cell.x + sheet_gap_px) - sheet_gap_px,
              rows * (cell.y + sheet_gap_px) - sheet_gap_px,
              {}};
  sheet.rgb.assign(std::size_t{3} * sheet.width * sheet.height, 128);
  return sheet;
}

void put_cell(Sheet& sheet, int column, int row, glm::ivec2 cell,
              const std::vector<std::uint8_t>& rgb) {
  for (int y = 0; y < cell.y; ++y) {
    const std::size_t left = std::size_t{1} * (row * (cell.y + sheet_gap_px) + y) * sheet.width +
                             column * (cell.x + sheet_gap_px);
    std::copy_n(&rgb[std::size_t{3} * y * cell.x], 3 * cell.x, &sheet.rgb[3 * left]);
  }
}

}  // namespace

QualityResult assess(const cl::Device& device, const std::vector<Scene>& scenes, const World& world,
                     const RenderOptions& how, const QualitySpec& what) {
  double seconds = 0;
  auto rendered = timed(seconds, [&] { return render(device, scenes, world, how); });
  LensPictures lens;
  auto result = assess(device, scenes, world, std::move(rendered), how, what, lens);
  result.seconds["render"] = seconds;
  return result;
}

QualityResult assess(const cl::Device& device, const std::vector<Scene>& scenes, const World& world,
                     Rendered rendered, const RenderOptions& how, const QualitySpec& what,
                     LensPictures& lens) {
  auto result = std::move(assess_frames(device, scenes, world, rendered,
                                        {rendered.lasers.at(0).field.frames}, how, what, lens)
                              .front());
  result.render = std::move(rendered);
  if (what.against_points)
    result.against_points = timed(result.seconds["points"], [&] {
      return compare_with_points(device, scenes, world, result.render, how);
    });
  return result;
}

std::vector<QualityResult> assess_frames(const cl::Device& device, const std::vector<Scene>& scenes,
                                         const World& world, const Rendered& rendered,
                                         const std::vector<int>& frame_counts,
                                         const RenderOptions& how, const QualitySpec& what,
                                         LensPictures& lens) {
  return Judge(device, scenes, world, rendered, frame_counts, how, what).judge(lens);
}

FieldComparison compare_with_points(const cl::Device& device, const std::vector<Scene>& scenes,
                                    const World& world, const Rendered& rendered,
                                    const RenderOptions& how) {
  auto one_frame = scenes;
  for (auto& scene : one_frame) scene.sampling.frames = 1;
  auto by_points = how;
  by_points.method = Method::points;
  by_points.keep_wrps = false;
  by_points.keep_field = true;
  by_points.planned = nullptr;  // it was said of the holograms
  return compare_fields(first_frames(render(device, one_frame, world, by_points)),
                        first_frames(rendered));
}

std::map<std::string, double> sum_of_stages(const std::vector<RenderResult>& lasers,
                                            std::map<std::string, double> RenderResult::*seconds) {
  std::map<std::string, double> sums;
  for (const auto& laser : lasers)
    for (const auto& [stage, of_laser] : laser.*seconds) sums[stage] += of_laser;
  return sums;
}

Sheet picture_sheet(const std::vector<std::vector<ImageList>>& rows, Frame frame, int cell_px,
                    int free_columns, double* white) {
  // All pictures form one tall image, so that they share an exposure.
  RgbPicture all;
  std::size_t columns = 0;
  for (const auto& row : rows) {
    columns = std::max(columns, row.size());
    for (const auto& picture : row) {
      const auto rgb = rgb_of(picture);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto cell = in_frame(small(rgb.channels[c], cell_px), frame);
        auto& channel = all.channels[c];
        channel.width = cell.width;
        channel.height += cell.height;
        channel.pixels.insert(channel.pixels.end(), cell.pixels.begin(), cell.pixels.end());
      }
    }
  }
  const double shown_white = white_of(all.channels, 99.5);
  if (white) *white = shown_white;
  const auto exposed = expose_to(all.channels, shown_white);

  // The cells are arranged in rows and columns.
  const auto cells = rows.size() * columns;
  const glm::ivec2 size(all.width(), all.height() / static_cast<int>(cells));
  auto sheet =
      empty_sheet(static_cast<int>(columns) + free_columns, static_cast<int>(rows.size()), size);
  const auto bytes = std::ptrdiff_t{3} * size.x * size.y;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const auto first = exposed.begin() + static_cast<std::ptrdiff_t>(cell) * bytes;
    put_cell(sheet, static_cast<int>(cell % columns), static_cast<int>(cell / columns), size,
             {first, first + bytes});
  }
  return sheet;
}

Sheet contact_sheet(const QualityResult& result, Frame frame) {
  std::vector<std::vector<ImageList>> pictures;
  for (const auto& row : result.rows) pictures.push_back({row.lens, row.hologram});
  double white = 0;
  auto sheet = picture_sheet(pictures, frame, sheet_cell_px, 1, &white);
  // Differences in colour are of values as a screen shows them, 0 to 1.
  if (pictures[0][0].size() > 1) white = 1;
  for (std::size_t row = 0; row < result.rows.size(); ++row) {
    const auto difference = in_frame(result.rows[row].difference, frame);
    put_cell(sheet, 2, static_cast<int>(row), {difference.width, difference.height},
             diverging_colours(difference, sheet_full_difference * white));
  }
  return sheet;
}

Json json_of(const FieldComparison& figures) {
  return {{"correlation", figures.correlation},
          {"relative_error", figures.error},
          {"relative_error_scaled", figures.error_scaled},
          {"energy_ratio", figures.energy_ratio}};
}

Json json_of(const PictureWindow& window) {
  return {{"low", {window.low_m.x, window.low_m.y}}, {"high", {window.high_m.x, window.high_m.y}}};
}

Json json_of(const Pupil& pupil) {
  return {{"diameter_m", pupil.diameter_m}, {"position_m", {pupil.centre_m.x, pupil.centre_m.y}}};
}

std::string pupil_text(const Pupil& pupil, Frame frame) {
  const auto seen_m = in_frame(pupil.centre_m, frame) + 0.0;  // not -0
  return length_text(pupil.diameter_m) +
         (seen_m == glm::dvec2(0) ? " on the axis"
                                  : " at " + length_text(seen_m.x) + ", " + length_text(seen_m.y));
}

Json delta_e_json(const ColourComparison& figures) {
  return {{"mean", figures.mean},
          {"median", figures.median},
          {"percentile_95", figures.most_of_95},
          {"largest", figures.most}};
}

Json quality_json(const std::vector<Scene>& scenes, const QualityResult& result,
                  const cl::DeviceInfo& device, const RenderOptions& how, const QualitySpec& what) {
  const auto& first = result.render.lasers.at(0);
  const bool is_colour = scenes.size() > 1;
  Json json{{"method", name_of(how.method)},
            {"picture_size", {result.picture_size.x, result.picture_size.y}},
            {"window_m", json_of(result.window)},
            {"frames", first.field.frames},
            {"encoding", name_of(first.plan.slm.encoding)},
            {"domain", name_of(is_colour ? Domain::srgb : Domain::intensity)},
            {"blur_px", result.blur_px},
            {"border_px", result.border_px},
            {"lens_points_per_axis", what.lens_points}};
  if (what.field) json["wanted_share"] = result.wanted_share;
  const auto figures_json = [&](const ColourComparison& figures) {
    Json told{{"psnr_db", figures.luminance.psnr_db},
              {"ssim", figures.luminance.ssim},
              {"flip", figures.luminance.flip}};
    if (is_colour) told["delta_e_2000"] = delta_e_json(figures);
    return told;
  };
  for (const auto& row : result.rows) {
    Json told{{"z_m", row.z_m}, {"view", row.view}};
    if (row.pupil) told["pupil"] = json_of(*row.pupil);
    told.update(figures_json(row.figures));
    told.update({{"scale", row.figures.scale},
                 {"light_share", row.light_share},
                 {"haze", row.haze ? Json(*row.haze) : Json()},
                 {"speckle_contrast",
                  {{"lens", row.figures.luminance.contrast_a},
                   {"hologram", row.figures.luminance.contrast_b}}}});
    if (what.field) told["field"] = figures_json(row.field_figures);
    json["rows"].push_back(std::move(told));
  }
  if (result.against_points) json["against_points"] = json_of(*result.against_points);
  json["seconds"] = result.seconds;
  json["render"] =
      report_json(scenes, result.render, std::vector<LaserFiles>(scenes.size()), device, how.fft);
  return json;
}

}  // namespace raywave
