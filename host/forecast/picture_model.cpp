// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/picture_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>
#include <numbers>
#include <numeric>
#include <utility>

#include "host/forecast/eye.hpp"
#include "host/forecast/slm_light.hpp"
#include "host/plan/key_places.hpp"
#include "host/plan/lattice.hpp"
#include "host/planning/light_shown.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

/// A surface ends where the next cell lies so many cells deeper; what a step of its pattern weighs
/// over one at its end
constexpr double end_in_cells = 6, step_of_pattern = 0.5;

/// What double phase throws around the band's corners is wider than the picture and fades towards
/// it; what unlit pixels throw lies everywhere. Mean of the haze over that of the picture,
/// fitted to 19 pictures on two panels: levels within 3.1 dB, 14 of them within 2.
///
/// spread     mean of |x| + |y| from the picture's middle, by brightness, over what pixels show
/// share_lit  of the hologram
double haze_of_spread(double spread, double share_lit) {
  return std::clamp(0.018 * std::exp(30 * (spread - 0.124)) + 0.165 * (1 - share_lit), 0.009, 0.2);
}

/// The same near the hologram, where a point has light of all directions: mean squares.
double haze_near_hologram(double band_filled) {
  return std::clamp(0.06 * (band_filled - 0.33), 0.001, 0.016);
}

using Raster = std::vector<float>;

/// Side of the view's cells at a depth.
double cell_m(const FrontView& view, double z_m) {
  return view.step * std::abs(z_m - view.eye_z_m);
}

/// Calls `use` with the x and y of every cell, and its place in the view's arrays.
void for_all_cells(const FrontView& view, const auto& use) {
  for (int y = 0; y < view.size.y; ++y)
    for (int x = 0; x < view.size.x; ++x) use(x, y, view.cell(x, y));
}

/// Mean over a box of 2 half + 1 cells (a fraction of the outermost ones), along both axes; what
/// lies outside is dark.
void blur_box(Raster& raster, glm::ivec2 size, glm::dvec2 half) {
  constexpr int block = 16;  // lines side by side: columns of a raster share lines of memory
  for (int axis = 0; axis < 2; ++axis) {
    if (half[axis] <= 0) continue;
    const int n = size[axis], stride = axis == 0 ? 1 : size.x, lines = size[1 - axis],
              next = axis == 0 ? size.x : 1;
    const int whole = static_cast<int>(std::min(half[axis], 1.0 * n)), margin = whole + 1;
    const double part = half[axis] - std::floor(half[axis]), weight = 1 / (2 * half[axis] + 1);
    // Sums of the cells before each one; those in the margins are dark
    std::vector<std::array<double, block>> sums(static_cast<std::size_t>(n + 2 * margin + 1));
    for (int first = 0; first < lines; first += block) {
      const int count = std::min(block, lines - first);
      float* const cells = raster.data() + std::ptrdiff_t{first} * next;
      auto* const before = sums.data() + margin;
      for (int i = 0; i < n; ++i)
        for (int k = 0; k < count; ++k)
          before[i + 1][k] = before[i][k] + cells[std::ptrdiff_t{i} * stride + k * next];
      std::fill(before + n + 1, before + n + margin + 1, before[n]);
      for (int i = 0; i < n; ++i) {
        const auto* const at = before + i;
        for (int k = 0; k < count; ++k) {
          const double inner = at[whole + 1][k] - at[-whole][k],
                       ends =
                           at[-whole][k] - at[-whole - 1][k] + at[whole + 2][k] - at[whole + 1][k];
          cells[std::ptrdiff_t{i} * stride + k * next] =
              static_cast<float>((inner + part * ends) * weight);
        }
      }
    }
  }
}

/// Three boxes of the Gaussian's variance.
void blur_gaussian(Raster& raster, glm::ivec2 size, double sigma) {
  const double half = (std::sqrt(4 * sigma * sigma + 1) - 1) / 2;
  for (int i = 0; i < 3; ++i) blur_box(raster, size, glm::dvec2(half));
}

/// Cells of a layer, and those around them that its blur reaches: all others are dark.
struct BlurredLayer {
  glm::ivec2 first, size;
  Raster light;

  /// Calls `use` with a cell's place in the view's arrays, and its light.
  void for_cells(const FrontView& view, const auto& use) const {
    auto cell = light.begin();
    for (int y = first.y; y < first.y + size.y; ++y)
      for (int x = first.x; x < first.x + size.x; ++x) use(view.cell(x, y), double{*cell++});
  }
};

/// The picture that a lens of the hologram's size, focused on z_m, makes of the front view's cells.
/// Every depth is blurred on its own; occlusion is that of the front view.
///
/// layers  filled with what lies where, unless null
Raster lens_view(const FrontView& view, const Raster& radiance, const Plan& plan, double z_m,
                 std::vector<PictureLayer>* layers = nullptr) {
  constexpr int count = 12;
  const double wavelength_m = plan.hologram.wavelength_m;
  const double span = std::max(plan.extent.far_m - plan.extent.near_m, 1e-12);
  std::array<std::vector<glm::ivec2>, count> places;  // of each layer's cells
  view.for_surfaces([&](int x, int y, std::size_t, double z) {
    const auto at = static_cast<int>((z - plan.extent.near_m) / span * count);
    places[static_cast<std::size_t>(std::clamp(at, 0, count - 1))].emplace_back(x, y);
  });
  Raster sum(radiance.size(), 0);
  std::vector<BlurredLayer> seen;
  for (std::size_t layer = 0; layer < count; ++layer) {
    if (places[layer].empty()) continue;
    double depth = plan.extent.near_m + (static_cast<double>(layer) + 0.5) / count *
                                            (plan.extent.far_m - plan.extent.near_m);
    if (std::abs(depth) < plan.extent.closest_m)
      depth = std::copysign(plan.extent.closest_m, depth);
    const double away_m = std::abs(depth - z_m);
    const auto open = wavelength_m / limit_m(plan, z_m);  // tangents
    const auto half = open * (away_m / 2 / cell_m(view, depth));
    glm::ivec2 low = view.size, high(0);
    for (const auto place : places[layer]) {
      low = glm::min(low, place);
      high = glm::max(high, place + 1);
    }
    const auto reach = glm::ivec2(glm::min(glm::ceil(half), glm::dvec2(view.size)));
    BlurredLayer one{glm::max(low - reach, 0), {}, {}};
    one.size = glm::min(high + reach, view.size) - one.first;
    one.light.resize(area_of(one.size));
    for (const auto place : places[layer]) {
      const auto at = place - one.first;
      one.light[static_cast<std::size_t>(at.y * one.size.x + at.x)] =
          radiance[view.cell(place.x, place.y)];
    }
    blur_box(one.light, one.size, half);
    one.for_cells(view, [&](auto cell, double light) { sum[cell] += static_cast<float>(light); });
    if (!layers) continue;
    layers->push_back({open * away_m / limit_m(plan, depth)});
    seen.push_back(std::move(one));
  }
  if (!layers) return sum;
  const double all = std::inner_product(sum.begin(), sum.end(), sum.begin(), 0.0);
  for (std::size_t i = 0; i < seen.size() && all > 0; ++i)
    seen[i].for_cells(view, [&](auto cell, double light) {
      (*layers)[i].share += light * double{sum[cell]} / all;
    });
  return sum;
}

/// Light that a cone lets through, up to each place of the hologram.
class LightOfCone {
public:
  explicit LightOfCone(const Cone& cone) {
    for (std::size_t i = 0; i + 1 < sums_.size(); ++i) {
      const double passed = cone.passed((static_cast<double>(i) + 0.5) / places * 2 - 1);
      sums_[i + 1] = sums_[i] + passed * passed;
    }
  }

  /// Share between two places, in half holograms.
  double between(double low, double high) const {
    return high > low && sums_.back() > 0 ? (up_to(high) - up_to(low)) / sums_.back() : 0;
  }

private:
  static constexpr std::size_t places = 512;

  double up_to(double at) const {
    const double place = std::clamp((at + 1) / 2, 0.0, 1.0) * places;
    const auto i = std::min(static_cast<std::size_t>(place), places - 1);
    return sums_[i] + (place - static_cast<double>(i)) * (sums_[i + 1] - sums_[i]);
  }

  std::array<double, places + 1> sums_{};
};

/// The cells' radiance times what a place shows of it.
///
/// share  of a place x, y, z
Raster radiance_times(const FrontView& view, const auto& share) {
  Raster shown(view.radiance);
  view.for_surfaces([&](int x, int y, std::size_t i, double z_m) {
    shown[i] *= static_cast<float>(share(view.place_m(x, y, z_m), z_m));
  });
  return shown;
}

/// The part of the cells' radiance that hologram and WRPs show.
Raster radiance_shown(const FrontView& view, const Plan& plan) {
  const LightOfCone light(plan.cone);
  const auto half = glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m / 2.0;
  return radiance_times(view, [&](glm::dvec2 at, double z) {
    double share = 1;
    for (int axis = 0; axis < 2; ++axis) {
      const auto [low, high] = part_seen(plan, axis, at[axis], z);
      share *= light.between(low / half[axis], high / half[axis]);
    }
    return share;
  });
}

/// Light on the hologram as phases alone show it: as bright where few surfaces light it as where
/// many do.
class EvenedLight {
public:
  EvenedLight(const FrontView& view, const Plan& plan)
      : plan_(plan), half_m_(glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m / 2.0) {
    constexpr double most_looks = 1e4;
    std::array<std::array<double, places>, places> light{};
    const int step =
        std::max(1, static_cast<int>(std::sqrt(view.size.x * view.size.y / most_looks)));
    const auto add = [&](int x, int y, std::size_t i, double z_m) {
      const auto [across, down] = lit(view.place_m(x, y, z_m), z_m);
      for (auto u = across.first; u < across.second; ++u)
        for (auto v = down.first; v < down.second; ++v) light[u][v] += double{view.radiance[i]};
    };
    view.for_surfaces(add, step);
    double sum = 0, squares = 0;
    for (const auto& column : light) {
      sum += std::accumulate(column.begin(), column.end(), 0.0);
      squares += std::inner_product(column.begin(), column.end(), column.begin(), 0.0);
    }
    if (squares > 0) lit_ = sum * sum / (squares * places * places);
    for (std::size_t u = 0; u < places; ++u)
      for (std::size_t v = 0; v < places; ++v)
        sums_[u + 1][v + 1] = sums_[u][v + 1] + sums_[u + 1][v] - sums_[u][v] +
                              (light[u][v] > 0 ? 1 / light[u][v] : 0);
  }

  /// Share of the hologram that is lit, as if evenly.
  double share_lit() const { return lit_; }

  /// How bright a place is, over its radiance.
  double of(glm::dvec2 at_m, double z_m) const {
    const auto [u, v] = lit(at_m, z_m);
    return sums_[u.second][v.second] - sums_[u.first][v.second] - sums_[u.second][v.first] +
           sums_[u.first][v.first];
  }

private:
  static constexpr std::size_t places = 32;  // of the hologram, along each axis

  /// Of the places that light reaches, the first and the one after the last, by axis.
  std::array<std::pair<std::size_t, std::size_t>, 2> lit(glm::dvec2 at_m, double z_m) const {
    std::array<std::pair<std::size_t, std::size_t>, 2> ends;
    for (int axis = 0; axis < 2; ++axis) {
      const auto place = [&](double to_m) {
        const double share = std::clamp((to_m / half_m_[axis] + 1) / 2, 0.0, 1.0);
        return static_cast<std::size_t>(std::lround(share * places));
      };
      const auto [low, high] = part_seen(plan_, axis, at_m[axis], z_m);
      ends[static_cast<std::size_t>(axis)] = {place(low), place(std::max(low, high))};
    }
    return ends;
  }

  const Plan& plan_;
  glm::dvec2 half_m_;
  double lit_ = 1;
  std::array<std::array<double, places + 1>, places + 1> sums_{};  // before each place
};

/// Light of copies, over that where all of the hologram is lit. What is lit alone is shown up to
/// its own brightness: brighter pixels leave the checkerboard less.
double copies_of_lit(double share_lit) {
  constexpr double shown = 0.36, most = 0.85;  // mean square of amplitudes, over the clip's
  const auto left = [](double squares) { return 1 / squares - 1; };
  return left(std::min(shown / share_lit, most)) / left(shown);
}

/// What the pictures of all depths are made of.
struct PictureSource {
  const FrontView& view;
  const Plan& plan;
  Raster shown, fallen, evened;  // radiance as planes, slm.fill and phases alone show it
  Raster steps;                  // of radiance, squared, to the next cells right and below
  double share_lit, blur_m;
  PictureWindow window;  // within the border
};

/// A lens's picture, and the copies of it that the checkerboard throws around the band's corners.
struct CopiedPicture {
  const PictureSource& source;
  const Raster& lens;
  double z_m;
  glm::dvec2 corner_m = std::abs(z_m) * source.plan.hologram.largest_sine;

  double light(glm::dvec2 place_m) const {
    const auto& view = source.view;
    const auto at = (place_m / (z_m - view.eye_z_m) - view.low) / view.step;
    if (glm::any(glm::lessThan(at, glm::dvec2(0))) ||
        glm::any(glm::greaterThanEqual(at, glm::dvec2(view.size))))
      return 0;
    return double{lens[view.cell(static_cast<int>(at.x), static_cast<int>(at.y))]};
  }

  /// Each corner has the part of the hologram whose light goes the other way.
  double copied(glm::dvec2 place_m) const {
    double sum = 0;
    for (const glm::dvec2 side : {glm::dvec2(1, 1), {1, -1}, {-1, 1}, {-1, -1}}) {
      const auto from_m = place_m + side * corner_m;
      double part = light(from_m);
      for (int axis = 0; part > 0 && axis < 2; ++axis) {
        const auto [low, high] = part_seen(source.plan, axis, from_m[axis], z_m);
        const double middle = std::clamp(from_m[axis], low, std::max(low, high));
        part *= high > low ? (side[axis] > 0 ? middle - low : high - middle) / (high - low) : 0;
      }
      sum += part;
    }
    return sum;
  }
};

/// Sets the row's haze and copies, from looks all over the window.
void set_thrown_aside(const PictureSource& source, const Raster& lens, glm::dvec2 centre_m,
                      double peak, PictureRow& row) {
  row.haze = haze_near_hologram(source.plan.hologram.band_filled);
  if (is_near_hologram(source.plan)) return;
  const CopiedPicture picture{source, lens, row.z_m};
  constexpr int looks = 128;  // along each axis
  double light = 0, spread = 0, copies = 0, on_picture = 0;
  for (int i = 0; i < looks * looks; ++i) {
    const auto at_m = source.window.low_m + source.window.size_m() *
                                                (glm::dvec2(i % looks, i / looks) + 0.5) /
                                                double(looks);
    const double here = picture.light(at_m);
    const auto bands = glm::abs(at_m - centre_m) / (2.0 * picture.corner_m);
    light += here;
    spread += here * (bands.x + bands.y);
    if (source.plan.slm.encoding != Encoding::double_phase) continue;
    const double copy = picture.copied(at_m);  // lies beyond the scene, too
    copies += copy * copy;
    on_picture += copy * here;
  }
  if (light > 0)
    row.haze = row.mean * row.mean / row.light *
               std::pow(haze_of_spread(spread / light, source.share_lit), 2);
  row.copies = copies / (looks * looks * peak * peak);
  row.copies_on_picture = on_picture / (looks * looks * peak * peak);
}

PictureRow row_of(const PictureSource& source, double z_m) {
  const auto& view = source.view;
  const auto& plan = source.plan;
  PictureRow row;
  row.z_m = z_m;
  row.spot_m = limit_m(plan, z_m);
  // Light that an encoding throws aside has not left the picture there
  const auto aside = glm::abs(z_m) * plan.hologram.largest_sine / plan.window_m();
  if (is_near_hologram(plan)) row.unshown = std::max(0.0, 1 - aside.x) * std::max(0.0, 1 - aside.y);
  row.pitch = std::abs(z_m - view.eye_z_m) / plan.lattice.full_z_m;
  const double side_m = cell_m(view, z_m);
  const auto sharp = lens_view(view, view.radiance, plan, z_m, &row.layers);
  const auto blurred = [&](Raster picture) {
    blur_gaussian(picture, view.size, source.blur_m / side_m);
    return picture;
  };
  const auto lens = blurred(sharp);
  const auto picture_of = [&](const Raster& radiance) {
    return radiance == view.radiance ? lens : blurred(lens_view(view, radiance, plan, z_m));
  };
  const auto shown = picture_of(source.shown), fallen = picture_of(source.fallen),
             evened = picture_of(source.evened);
  const auto& window = source.window;
  double peak = 0, light = 0, squares = 0, sharp_squares = 0, edges = 0;
  glm::dvec2 moment_m(0);
  glm::dvec3 alike(0), others_squares(0);
  for_all_cells(view, [&](int x, int y, std::size_t i) {
    const auto place_m = view.place_m(x, y, z_m);
    if (glm::any(glm::lessThan(place_m, window.low_m)) ||
        glm::any(glm::greaterThan(place_m, window.high_m)))
      return;
    const double here = lens[i];
    const glm::dvec3 others(shown[i], fallen[i], evened[i]);
    peak = std::max(peak, here);
    light += here;
    moment_m += here * place_m;
    squares += here * here;
    alike += here * others;
    others_squares += others * others;
    sharp_squares += double{sharp[i]} * double{sharp[i]};
    edges += double{source.steps[i]};
  });
  if (peak == 0) return row;
  const auto size_m = window.size_m();
  const double cells = size_m.x * size_m.y / (side_m * side_m), unit = 1 / (cells * peak * peak);
  // What another picture leaves, whose brightness is free
  const auto left_by = [&](int other) {
    const double all = others_squares[other];
    return (all > 0 ? std::max(0.0, squares - alike[other] * alike[other] / all) : squares) * unit;
  };
  row.mean = light / (cells * peak);
  row.light = squares * unit;
  row.sharp = sharp_squares * unit;
  row.missing = left_by(0);
  row.fallen = left_by(1);
  row.uneven = left_by(2);
  row.edges_m = edges * side_m / (size_m.x * size_m.y * peak * peak);
  set_thrown_aside(source, lens, moment_m / light, peak, row);
  return row;
}

}  // namespace

void look_through(const std::vector<Pupil>& pupils, const Plan& plan, PictureModel& model) {
  const auto bands = plan.hologram.pitch_m / plan.hologram.wavelength_m;
  for (const auto& pupil : pupils) {
    const auto radius = pupil.diameter_m / 2 / std::abs(pupil.b_m) * bands;
    auto reach = glm::abs(pupil.centre_m) / std::abs(pupil.b_m) * bands + radius;
    if (const auto& stop = plan.slm.stop)
      reach = glm::min(reach, glm::abs(stop->centre) + stop->size / 2.0);
    model.pupil_reach = std::max({model.pupil_reach, reach.x, reach.y});
    if (is_near_hologram(plan))
      model.pupil_radius = std::max({model.pupil_radius, radius.x, radius.y});
    model.sees_band = model.sees_band || sees_band(pupil, plan);
  }
}

void set_refinement(PictureModel& model, const Plan& plan) {
  if (!plan.refine) return;
  const auto& refine = *plan.refine;
  const double blur_m = refine.blur_m.value();
  model.pace = {};
  model.refined_depths = 0;
  if (refines_samples(plan)) {
    const auto parts = refine_parts(plan, blur_m, refine.viewer);
    model.pace = {planned_iterations(plan), parts.x * parts.y,
                  depth_over_held(plan, blur_m, refine.viewer)};
    return;
  }
  const auto places = planned_places(plan);
  for (const auto& place : places) model.refined_depths += place.aperture == glm::dvec2(1);
  const double needed = refine_iterations(places);
  // Four times as many lost 2 to 4 dB of a teapot and a coin, at depths between
  model.refined_rounds = std::min(1.0, refine.iterations.value_or(needed) / needed);
}

PictureModel picture_model(const FrontView& view, const Plan& plan, double resolution_m) {
  PictureModel model;
  model.resolution_m = resolution_m;
  model.cone = plan.cone;
  model.encoding = plan.slm.encoding;
  model.sees_band = glm::any(glm::greaterThan(
      plan.hologram.largest_sine, 0.499 * plan.hologram.wavelength_m / plan.hologram.pitch_m));
  // Phases alone show no brightness, whatever an eyepiece leaves of the band
  model.is_even = plan.slm.encoding == Encoding::phase && !plan.refine;
  const auto& lighting = plan.lighting;
  const auto shines = [&](const auto number) {
    return has_highlights(lighting.materials[static_cast<std::size_t>(number)], plan.channels());
  };
  model.has_detail = lighting.textures > 0 || std::ranges::any_of(lighting.used, shines);
  if (plan.slm.stop) model.stopped = 1 - slm_light(plan, view).through_stop;
  set_refinement(model, plan);
  model.spot_m = limit_m(plan, middle_m(plan));
  Raster steps(view.radiance.size(), 0);  // squared, to the next cells right and below
  for_all_cells(view, [&](int x, int y, std::size_t i) {
    const auto squared = [&](std::size_t next) {
      const double step = double{view.radiance[i]} - double{view.radiance[next]},
                   deep_m = std::abs(double{view.depth_m[i]} - double{view.depth_m[next]});
      // A surface's own pattern goes on in the cell; its end does not
      const bool goes_on = deep_m < end_in_cells * cell_m(view, double{view.depth_m[i]});
      return static_cast<float>(step * step * (goes_on ? step_of_pattern : 1));
    };
    if (x + 1 < view.size.x) steps[i] += squared(i + 1);
    if (y + 1 < view.size.y) steps[i] += squared(i + static_cast<std::size_t>(view.size.x));
  });
  const EvenedLight light(view, plan);
  model.copies = copies_of_lit(light.share_lit());
  const double blur_m = blur_of_resolution * resolution_m;
  model.window = quality_window(plan, view, blur_m);
  const auto border_m = static_cast<double>(picture_border_px) * plan.hologram.pitch_m;
  const auto fallen = [&](glm::dvec2 at, double z) { return fall_off(plan, at, z); };
  const auto evened = [&](glm::dvec2 at, double z) { return light.of(at, z); };
  const PictureSource source{view,
                             plan,
                             radiance_shown(view, plan),
                             radiance_times(view, fallen),
                             radiance_times(view, evened),
                             std::move(steps),
                             light.share_lit(),
                             blur_m,
                             {model.window.low_m + border_m, model.window.high_m - border_m}};
  for (const double z_m : quality_depths_m(plan)) model.rows.push_back(row_of(source, z_m));
  return model;
}

}  // namespace raywave
