// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/api/state.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/encode/pattern.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/goal_check.hpp"
#include "host/evaluate/quality.hpp"
#include "host/evaluate/trade/trade.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/padded_plane.hpp"
#include "host/planning/make_plan.hpp"
#include "host/propagate/double_propagation.hpp"
#include "host/propagate/propagator.hpp"
#include "host/propagate/resample.hpp"
#include "host/view/colour_picture.hpp"
#include "host/view/compare.hpp"
#include "host/view/lens.hpp"
#include "host/view/preview.hpp"
#include "host/view/pupil.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave::v0 {
namespace {

/// The points at which a propagated field is told.
PointGrid points_of(const raywave::HologramSpec& field, double distance_m,
                    const PropagateOptions& options) {
  if (!std::isfinite(distance_m)) throw InputError("distance: must be finite");
  for (const double x : options.shift_m)
    if (!std::isfinite(x)) throw InputError("shift: must be finite");
  if (!(options.padding >= 1 && options.padding <= 64))
    throw InputError("padding: must be 1 to 64, got " + number_text(options.padding));
  PointGrid points{field.resolution, field.pitch_m, vector_of(options.shift_m)};
  if (options.out_pitch_m) points.pitch_m = vector_of(*options.out_pitch_m);
  for (const double pitch_m : {points.pitch_m.x, points.pitch_m.y})
    if (!(pitch_m > 0 && std::isfinite(pitch_m)))
      throw InputError("out_pitch: must be > 0, got " + number_text(pitch_m));
  if (options.out_size) points.size = {(*options.out_size)[0], (*options.out_size)[1]};
  constexpr int most_side = 1 << 20;
  if (std::min(points.size.x, points.size.y) < 1 ||
      std::max(points.size.x, points.size.y) > most_side ||
      std::int64_t{points.size.x} * points.size.y > std::int64_t{1} << 30)
    throw InputError("points: there are " + std::to_string(points.size.x) + " x " +
                     std::to_string(points.size.y) +
                     ", and must be 1 to 2^20 on each side, 2^30 in all");
  return points;
}

/// A field, frame by frame, at the resampler's points.
///
/// load     takes a frame with its margin
/// arrived  as of Resampler::at_points, of the frame that was loaded
template <class Sample>
BasicField<Sample> at_points(const BasicFieldView<Sample>& field, const Resampler& resampler,
                             const auto& load, const auto& arrived) {
  BasicField<Sample> result{resampler.points().x, resampler.points().y, field.frames, {}};
  const auto plane = static_cast<std::ptrdiff_t>(field.nx) * field.ny;
  for (int frame = 0; frame < field.frames; ++frame) {
    load(resampler.padded(field.values + frame * plane));
    const auto values = resampler.at_points<std::complex<Sample>>(arrived);
    result.values.insert(result.values.end(), values.begin(), values.end());
  }
  return result;
}

std::optional<glm::dvec2> window_of(const std::optional<Vec2>& window_m) {
  if (!window_m) return std::nullopt;
  return vector_of(*window_m);
}

/// Progress of one of several lasers, which come one after another.
Progress part_of(const Progress& progress, std::size_t laser, std::size_t lasers) {
  if (!progress) return {};
  return [progress, laser, lasers](const std::string& what, double share) {
    return progress(what, (static_cast<double>(laser) + share) / static_cast<double>(lasers));
  };
}

std::function<void(double)> share_of(const Progress& progress, const std::string& what) {
  if (!progress) return {};
  return [report = progress_of(progress), what](double share) { report(what, share); };
}

Picture as_picture(Image image) { return {image.width, image.height, 1, std::move(image.pixels)}; }

Picture as_picture(const RgbPicture& picture) {
  return {picture.width(), picture.height(), 3, interleaved(picture.channels)};
}

/// Of one channel or three.
Picture as_picture(const std::vector<Image>& channels) {
  if (channels.size() == 1) return as_picture(channels[0]);
  return as_picture(RgbPicture{{channels[0], channels[1], channels[2]}});
}

PictureComparison as_comparison(const ColourComparison& c, bool is_colour) {
  const auto& of = c.luminance;
  PictureComparison figures{of.psnr_db,    of.ssim,       of.flip, of.scale,
                            of.contrast_a, of.contrast_b, {}};
  if (is_colour) figures.colours = {c.mean, c.median, c.most, c.most_of_95};
  return figures;
}

Panel panel_of(const Slm& slm, glm::ivec2 size, const Pixels& pixels) {
  const auto hologram = hologram_spec(pixels, size);
  return {slm.state().at(hologram.wavelength_m), size, hologram.pitch_m, hologram.wavelength_m};
}

template <class Level>
std::vector<Level> joined(const std::vector<std::vector<Level>>& frames) {
  std::vector<Level> all;
  all.reserve(frames.size() * frames[0].size());
  for (const auto& frame : frames) all.insert(all.end(), frame.begin(), frame.end());
  return all;
}

template <class Level>
std::vector<std::vector<Level>> apart(const std::vector<Level>& all, const Levels& levels) {
  const auto size = static_cast<std::size_t>(levels.nx) * static_cast<std::size_t>(levels.ny);
  if (levels.nx < 1 || levels.ny < 1 || levels.frames < 1 ||
      all.size() != size * static_cast<std::size_t>(levels.frames))
    throw InputError("levels: as many are needed as frames, rows and columns say");
  std::vector<std::vector<Level>> frames;
  for (auto at = all.begin(); at != all.end(); at += static_cast<std::ptrdiff_t>(size))
    frames.emplace_back(at, at + static_cast<std::ptrdiff_t>(size));
  return frames;
}

Levels levels_of(const FieldStack& field, Panel wanted, const DeviceOptions& on) {
  const auto panel = std::make_shared<const Panel>(std::move(wanted));
  const auto opened = open(on);
  Encoder encoder(opened.device, panel);
  Levels levels{field.nx, field.ny, field.frames, panel->slm().bits, {}, {}};
  if (levels.bits > 8)
    levels.values16 = joined(raywave::encode<std::uint16_t>(opened.device, encoder, field));
  else
    levels.values = joined(raywave::encode(opened.device, encoder, field));
  return levels;
}

}  // namespace

Field propagate(const FieldView& field, const Pixels& pixels, double distance_m,
                const PropagateOptions& options) {
  require_samples(field, "u");
  const auto hologram = hologram_spec(pixels, {field.nx, field.ny});
  const Resampler resampler(hologram.resolution, hologram.pitch_m,
                            points_of(hologram, distance_m, options));
  const auto opened = open(options.on);
  const auto size = resampler.grid_size();
  Propagator propagator(opened.device, {size, hologram.pitch_m, hologram.wavelength_m,
                                        options.padding, opened.fft, distance_m});
  std::vector<raywave::Target> targets;
  for (const auto centre_m : resampler.centres_m()) targets.push_back({centre_m, distance_m});
  const auto first = targets.front();
  std::erase_if(targets, [&](const auto& target) { return !propagator.reaches(target); });
  if (targets.empty()) propagator.require_reach(first);
  const auto samples = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
  cl::ComplexBuffer source(opened.device, samples, "field"),
      target(opened.device, samples, "field");
  return at_points(
      field, resampler,
      [&](const std::vector<std::complex<float>>& frame) {
        source.write(frame);
        propagator.load(source, 0, targets);
      },
      [&](glm::dvec2 centre_m) {
        std::vector<std::complex<float>> arrived;
        if (!propagator.reaches({centre_m, distance_m})) return arrived;
        propagator.add({centre_m, distance_m});
        propagator.collect(target);
        arrived = target.read();
        return arrived;
      });
}

FieldDouble propagate(const FieldDoubleView& field, const Pixels& pixels, double distance_m,
                      const PropagateOptions& options) {
  require_samples(field, "u");
  const auto hologram = hologram_spec(pixels, {field.nx, field.ny});
  const Resampler resampler(hologram.resolution, hologram.pitch_m,
                            points_of(hologram, distance_m, options));
  const auto size = resampler.grid_size();
  const auto padded =
      padded_size(size, options.padding, hologram.pitch_m, hologram.wavelength_m, distance_m);
  std::vector<std::complex<double>> source;
  return at_points(
      field, resampler, [&](std::vector<std::complex<double>> frame) { source = std::move(frame); },
      [&](glm::dvec2 centre_m) {
        return in_double::shifted_angular_spectrum(
            source, {size, hologram.pitch_m, hologram.wavelength_m, centre_m, distance_m}, padded);
      });
}

namespace {

/// What is looked through: the first of the pupils that are asked for.
std::optional<Pupil> pupil_of(const ViewOptions& options, const ViewerSpec& viewer) {
  const bool is_part = options.view != Vec2{0, 0} || options.aperture != Vec2{1, 1};
  std::vector<std::string> given;
  if (options.pupil) given.push_back(*options.pupil);
  return pupils_asked(given, viewer, Frame::hologram, is_part, "pupil").front();
}

Picture reconstruct(FieldStack field, const Pixels& pixels, const ViewOptions& options,
                    const ViewerSpec& viewer = {}) {
  const auto hologram = hologram_spec(pixels, {field.nx, field.ny});
  const auto opened = open(options.on);
  ReconstructSpec what{options.z_m, window_of(options.window_m), vector_of(options.view),
                       vector_of(options.aperture)};
  what.centre_m = vector_of(options.centre_m);
  what.pupil = pupil_of(options, viewer);
  return as_picture(raywave::reconstruct(opened.device, opened.fft, field, hologram, what,
                                         share_of(options.progress, "reconstruction")));
}

/// Of one laser, with the spread of its light.
Picture reconstruct_shown(const Hologram& hologram, const ViewOptions& options) {
  auto field = field_of(hologram.shown(), "hologram");
  field.source = hologram.state().lasers[hologram.first_laser()].result.panel->source();
  const auto scene = hologram.scene();
  return reconstruct(std::move(field), hologram.pixels(), options, scene.state().scenes[0].viewer);
}

}  // namespace

Picture reconstruct(const FieldView& field, const Pixels& pixels, const ViewOptions& options) {
  return reconstruct(field_of(field, "field"), pixels, options);
}

Picture reconstruct(const Hologram& hologram, const ViewOptions& options) {
  if (hologram.lasers() == 1) return reconstruct_shown(hologram, options);
  const auto lasers = laser_set(hologram.wavelengths_m());
  std::vector<Image> light;
  for (std::size_t i = 0; i < lasers.count(); ++i) {
    const auto of_laser = hologram.laser(static_cast<int>(i));
    auto how = options;
    how.progress = part_of(options.progress, i, lasers.count());
    auto seen = reconstruct_shown(of_laser, how);
    const double gain = hologram.powers()[i] / lasers.white_powers[i];
    for (float& pixel : seen.values) pixel = static_cast<float>(double{pixel} * gain);
    light.push_back({seen.nx, seen.ny, std::move(seen.values)});
  }
  return as_picture(picture_of_lasers(lasers, light));
}

namespace {

/// What a lens sees of a scene, all its lasers in one picture.
///
/// what_of  tells how, of the world and the plan of the first laser
template <class WhatOf>
Picture seen_by_lens(const Scene& scene, const DeviceOptions& on, const Progress& progress,
                     const WhatOf& what_of) {
  const auto opened = open(on);
  const auto world = scene.state().world();
  const auto& scenes = scene.state().scenes;
  std::vector<raywave::Plan> plans;
  for (const auto& one : scenes) plans.push_back(lens_plan(one, world));
  DeviceScene arrays(opened.device, world, plans[0]);
  const LensSpec what = what_of(world, plans[0]);
  std::vector<Image> seen;
  for (std::size_t i = 0; i < plans.size(); ++i) {
    if (plans.size() > 1) arrays.show(plans[i]);
    seen.push_back(lens_picture(opened.device, plans[i], arrays, what,
                                share_of(part_of(progress, i, plans.size()), "lens")));
  }
  if (seen.size() == 1) return as_picture(std::move(seen[0]));
  return as_picture(picture_of_lasers(scenes[0].colour.value().lasers, seen));
}

}  // namespace

Picture lens(const Scene& scene, const ViewOptions& options, int points) {
  LensSpec what{options.z_m, window_of(options.window_m), vector_of(options.view),
                vector_of(options.aperture), points};
  what.pupil = pupil_of(options, scene.state().scenes[0].viewer);
  return seen_by_lens(scene, options.on, options.progress,
                      [&](const auto&, const auto&) { return what; });
}

Picture preview(const Scene& scene, const PreviewOptions& options) {
  return seen_by_lens(scene, options.on, {}, [&](const World& world, const raywave::Plan& plan) {
    return preview_spec(positions_now(world), plan, options.z_m, window_of(options.window_m),
                        vector_of(options.view), scene.state().scenes[0].viewer);
  });
}

Levels encode(const FieldView& field, const Slm& slm, const Pixels& pixels,
              const DeviceOptions& on) {
  const auto stack = field_of(field, "field");
  return levels_of(stack, panel_of(slm, {stack.nx, stack.ny}, pixels), on);
}

Levels pattern(Pattern pattern, std::array<int, 2> resolution, const Pixels& pixels, const Slm& slm,
               const PatternOptions& options) {
  const PatternSpec spec{pattern, options.focal_m, options.period_px, options.to};
  for (const int side : resolution)
    if (side < 1 || side > 65536)
      throw InputError("resolution: must be 1 to 65536 pixels, got " + std::to_string(side));
  const auto hologram = hologram_spec(pixels, {resolution[0], resolution[1]});
  const Panel panel(slm_of_pattern(slm.state().at(hologram.wavelength_m)), hologram.resolution,
                    hologram.pitch_m, hologram.wavelength_m);
  auto levels = levels_of(pattern_field(spec, hologram), panel, options.on);
  const auto turned = [&]<class Level>(std::vector<Level>& of_frame) {
    auto picture =
        for_slm(LevelPictureOf<Level>{panel.size_px(), std::move(of_frame)}, panel.slm());
    levels.nx = picture.size_px.x;
    levels.ny = picture.size_px.y;
    of_frame = std::move(picture.levels);
  };
  levels.bits > 8 ? turned(levels.values16) : turned(levels.values);
  return levels;
}

Field shown(const Levels& levels, const Slm& slm, const Pixels& pixels) {
  const auto panel = panel_of(slm, {levels.nx, levels.ny}, pixels);
  require_level_bytes(panel.slm(), levels.bits > 8 ? 2 : 1);
  if (levels.bits > 8) {
    const auto most = static_cast<std::uint16_t>(grey_levels_of(panel.slm()) - 1);
    if (std::any_of(levels.values16.begin(), levels.values16.end(),
                    [&](std::uint16_t level) { return level > most; }))
      throw InputError("levels: the SLM has levels up to " + std::to_string(most));
    return as_field(shown_field(panel, apart(levels.values16, levels)));
  }
  return as_field(shown_field(panel, apart(levels.values, levels)));
}

FieldComparison compare(const FieldView& a, const FieldView& b) {
  const auto c = compare_fields(field_of(a, "a"), field_of(b, "b"));
  return {c.correlation, c.error, c.error_scaled, c.energy_ratio};
}

PictureComparison compare(const PictureView& a, const PictureView& b,
                          const CompareOptions& options) {
  raywave::PictureOptions how{options.blur_px, options.border_px, {}, options.domain};
  if (const auto& region = options.region)
    how.region = Region{(*region)[0], (*region)[1], (*region)[2], (*region)[3]};
  if (a.channels != b.channels)
    throw InputError("b: has " + std::to_string(b.channels) + " channels, a " +
                     std::to_string(a.channels) + "; both are grey, or both are in colour");
  if (a.channels == 3)
    return as_comparison(compare_colours(rgb_of(a, "a"), rgb_of(b, "b"), how), true);
  ColourComparison c;
  c.luminance = compare_pictures(image_of(a, "a"), image_of(b, "b"), how);
  return as_comparison(c, false);
}

namespace {

void require_depths(const std::vector<double>& depths_m) {
  for (const double z_m : depths_m)
    if (!std::isfinite(z_m) || z_m == 0)
      throw InputError("depths: must be finite and not 0, got " + number_text(z_m));
}

}  // namespace

std::vector<QualityRow> quality(const Hologram& hologram, const QualityOptions& options) {
  if (!hologram.field().values)
    throw InputError("hologram: has no field, with which it was rendered (keep_field), to judge");
  require_depths(options.depths_m);
  if (options.border_px < 0)
    throw InputError("border: must be 0 or more, got " + std::to_string(options.border_px));
  if (options.blur_m && !(*options.blur_m >= 0 && std::isfinite(*options.blur_m)))
    throw InputError("blur: must be finite and >= 0, got " + number_text(*options.blur_m));
  QualitySpec what;
  what.depths_m = options.depths_m;
  if (options.window_m) what.window = PictureWindow::around_axis(vector_of(*options.window_m));
  what.blur_m = options.blur_m;
  what.views = options.views;
  what.lens_points = options.lens_points;
  what.border_px = options.border_px;
  const auto report = Json::parse(hologram.report());
  if (report.contains("goal")) judge_as_planned(goal_of_json(report.at("goal")), what);
  const auto opened = open(options.on);
  raywave::RenderOptions how;
  how.fft = opened.fft;
  how.progress = progress_of(options.progress);
  const auto scene = hologram.scene();
  const auto& scenes = scene.state().scenes;
  for (const auto& pupil :
       pupils_asked(options.pupils, scenes[0].viewer, Frame::hologram, false, "pupils"))
    if (pupil) what.pupils.push_back(*pupil);
  LensPictures lens;
  const auto result =
      assess(opened.device, scenes, scene.state().world(), rendered_of(hologram), how, what, lens);
  std::vector<QualityRow> rows;
  for (const auto& row : result.rows) {
    const bool is_colour = row.lens.size() > 1;
    rows.push_back({row.z_m, choice_of<View>(row.view, "view"),
                    as_comparison(row.figures, is_colour),
                    as_comparison(row.field_figures, is_colour), row.light_share, row.haze,
                    as_picture(row.lens), as_picture(row.hologram)});
    if (row.pupil) {
      rows.back().pupil_m = row.pupil->diameter_m;
      rows.back().pupil_place_m = {row.pupil->centre_m.x, row.pupil->centre_m.y};
    }
  }
  return rows;
}

Trade trade(const Scene& scene, const TradeOptions& options) {
  require_depths(options.depths_m);
  if (options.presets && options.exhaustive)
    throw InputError("presets and exhaustive: at most 1 of them can be given");
  const auto within = [](const char* name, int value, int least, int most) {
    if (value < least || value > most)
      throw InputError(std::string(name) + ": must be " + std::to_string(least) + " to " +
                       std::to_string(most) + ", got " + std::to_string(value));
  };
  within("renders", options.renders, 0, 1000);
  within("lens_points", options.lens_points, 1, 4096);
  within("border", options.border_px, 0, 1 << 20);
  const auto opened = open(options.on);
  TradeSpec spec;
  spec.quick = options.quick;
  spec.presets = options.presets;
  spec.exhaustive = options.exhaustive;
  spec.renders = options.renders;
  auto& pictures = spec.pictures;
  pictures.depths_m = options.depths_m;
  if (options.window_m) pictures.window = PictureWindow::around_axis(vector_of(*options.window_m));
  pictures.views = options.views;
  pictures.lens_points = options.lens_points;
  pictures.border_px = options.border_px;
  const auto& scenes = scene.state().scenes;
  pictures.against_points = options.against_points.value_or(has_few_pixels(scenes[0]));
  if (options.on.fft) spec.fft = opened.fft;
  TradeBench bench(opened.device, scenes, scene.state().world(), spec);
  const auto progress = progress_of(options.progress);
  Sheet sheet;
  if (options.folder.empty()) {
    bench.measure([] {}, progress);
    sheet = bench.sheet(progress);
  } else {
    sheet = measure_in(
        bench, options.folder, [](const std::string&) {}, progress);
  }
  const auto& made = bench.trade();
  return {trade_text(made),
          trade_json(made),
          trade_csv(made),
          {sheet.width, sheet.height, 3, std::move(sheet.rgb)}};
}

}  // namespace raywave::v0
