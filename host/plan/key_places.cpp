// SPDX-License-Identifier: Apache-2.0
#include "host/plan/key_places.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <random>

#include "host/plan/lattice.hpp"
#include "host/plan/padded_plane.hpp"

namespace raywave {
namespace {

/// Depth that a picture holds, before and behind its own, in blurs times distance over hologram.
constexpr double held_blurs = 2.4;
// Between pictures through the scene, and from its ends to those beyond it, in held depths;
// measured on data/study.toml (docs/refine.md)
constexpr double between = 2.2, first_beyond = 2.15, second_beyond = 4.85, behind = 3.65;
constexpr int most_depths_within = 12;

constexpr int least_iterations = 28;
constexpr double rounds_of_depths = 2.15, rounds_with_views = 3;

/// Blurs of the picture for each of the spots that a part of the hologram resolves, at least.
constexpr double pixels_of_part = 0.85;
constexpr int most_parts = 16;
// Depths of rounds of parts: between them, and from the scene's ends to those beyond it, in the
// depth that a part's picture holds
constexpr double between_parts = 0.6, beyond_parts = 0.25;
constexpr int most_depths = 11;

/// The number i of 0, ..., count - 1 in the order first, last, second, last but one ...
int from_ends(int i, int count) { return i % 2 == 0 ? i / 2 : count - 1 - i / 2; }

/// 0, ..., count - 1 in random order, the same on every C++ library.
std::vector<int> shuffled(int count, std::mt19937& random) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1],
              order[static_cast<std::size_t>(random() * static_cast<std::uint64_t>(i) >> 32)]);
  return order;
}

double share(std::mt19937& random) { return static_cast<double>(random()) * 0x1p-32; }

/// Pixels per blur of a picture: it needs no more, and rays are what it costs.
constexpr double pixels_per_blur = 1.5;

/// Share of pairs of points, one on each of two centred lines, that are farther than `limit` apart.
double share_beyond(double side_a, double side_b, double limit) {
  const double low = std::abs(side_a - side_b) / 2, high = (side_a + side_b) / 2;
  if (limit >= high) return 0;
  // The distance of the two has a trapezium as its density: flat to `low`, then falling to `high`.
  const double area = low + high;
  return limit <= low ? 1 - 2 * limit / area
                      : (high - limit) * (high - limit) / ((high - low) * area);
}

/// Depths of surfaces on one side of the hologram, by their distance.
struct OneSide {
  double sign, near_m, far_m;
};

std::vector<OneSide> sides_of(const Plan& plan) {
  const auto& extent = plan.extent;
  if (extent.near_m > 0) return {{1, extent.near_m, extent.far_m}};
  if (extent.far_m < 0) return {{-1, -extent.far_m, -extent.near_m}};
  std::vector<OneSide> sides;
  for (const double sign : {-1, 1}) {
    OneSide side{sign, sign < 0 ? -extent.near_m : extent.far_m, 0};
    for (const auto& layer : plan.layers) {
      if (layer.distance_m * sign < 0) continue;
      side.near_m = std::min(side.near_m, std::max(layer.closest_m(), extent.closest_m));
      side.far_m = std::max(side.far_m, layer.farthest_m());
    }
    sides.push_back(side);
  }
  return sides;
}

/// Of a scene before the hologram, as of its mirror image beyond it.
std::vector<double> depths_of_side_m(const Plan& plan, const OneSide& side, double blur_m) {
  const auto window_m = plan.window_m();
  const double hologram_m = std::max(window_m.x, window_m.y);
  const auto held_m = [&](double z_m) { return held_blurs * blur_m * z_m / hologram_m; };
  const double near_m = side.near_m, far_m = side.far_m, depth_m = far_m - near_m;
  const double middle_m = held_m((near_m + far_m) / 2), front_m = held_m(near_m);
  const auto in_front = [&](double helds) {
    return std::max(near_m - helds * front_m, near_m / 2);
  };

  std::vector<double> depths{in_front(second_beyond), in_front(first_beyond)};
  const int steps = std::clamp(static_cast<int>(std::ceil(depth_m / (between * middle_m) - 0.02)),
                               depth_m > 1e-6 * near_m ? 1 : 0, most_depths_within - 1);
  for (int i = 0; i <= steps; ++i)
    depths.push_back(steps == 0 ? near_m : near_m + depth_m * i / steps);
  if (steps == 0) depths.push_back(far_m + first_beyond * held_m(far_m));
  depths.push_back(far_m + (steps == 0 ? second_beyond : behind) * held_m(far_m));
  for (double& z_m : depths) z_m *= side.sign;
  return depths;
}

/// From the first depth to the last of each side, `share` of the whole way.
double depth_at(std::vector<double> depths, double share) {
  std::ranges::sort(depths);
  const auto beyond = std::ranges::find_if(depths, [](double z_m) { return z_m > 0; });
  const double before_m = beyond == depths.begin() ? 0 : *(beyond - 1) - depths.front(),
               beyond_m = beyond == depths.end() ? 0 : depths.back() - *beyond,
               along_m = share * (before_m + beyond_m);
  return along_m < before_m || beyond == depths.end() ? depths.front() + along_m
                                                      : *beyond + (along_m - before_m);
}

/// RefineSettings::views, or their number where the scene leaves it open: 24 of a teapot's are seen
/// 2 to 3 dB better, and whole pictures 2.5 dB worse (study) to 0.2 better, in 1.8 times the time.
int planned_views(const RefineSettings& refine) {
  constexpr int enough = 24;
  const bool is_limited = refine.iterations || refine.budget_s || !refine.depths_m.empty();
  return refine.views.value_or(is_limited ? 0 : enough);
}

}  // namespace

std::vector<double> refine_depths_m(const Plan& plan, double blur_m) {
  std::vector<double> depths;
  for (const auto& side : sides_of(plan)) {
    const auto of_side = depths_of_side_m(plan, side, blur_m);
    depths.insert(depths.end(), of_side.begin(), of_side.end());
  }
  return depths;
}

std::vector<KeyPlace> key_places(const Plan& plan, double blur_m, const KeySpec& what) {
  const bool own = what.depths_m.empty();
  const auto depths = own ? refine_depths_m(plan, blur_m) : what.depths_m;
  std::vector<KeyPlace> places;
  for (const double z_m : depths) places.push_back({z_m, {0, 0}, {1, 1}, what.views > 0 ? 2 : 1});
  if (own) {
    // The outermost depths have no neighbours to agree with, and need fewer draws.
    for (auto& place : places) place.times = 3;
    places.front().times = places.back().times = 2;
  }
  if (what.views < 1) return places;

  // One view in each cell of a grid, and in each of as many ranges of depth
  std::mt19937 random(what.seed);
  const int columns = static_cast<int>(std::ceil(std::sqrt(what.views * 1.5 - 0.001))),
            rows = (what.views + columns - 1) / columns;
  const auto cells = shuffled(columns * rows, random), ranges = shuffled(what.views, random);
  for (int i = 0; i < what.views; ++i) {
    const int cell = what.views == columns * rows ? i : cells[static_cast<std::size_t>(i)];
    const double x = (cell % columns + share(random)) / columns,
                 y = (cell / columns + share(random)) / rows,
                 z = (ranges[static_cast<std::size_t>(i)] + share(random)) / what.views;
    places.push_back({depth_at(depths, z), {x - 0.5, y - 0.5}, {0.5, 0.5}, 1});
  }
  return places;
}

PartPlane part_plane(const Plan& plan, const ViewerSpec& viewer) {
  const auto& h = plan.hologram;
  const double middle_m = (plan.extent.near_m + plan.extent.far_m) / 2;
  if (!viewer.eyepiece_m) return {{}, plan.window_m(), {0, 0}, {1, 1}, std::abs(middle_m)};
  const auto pupils = pupils_of(viewer);
  const auto& first = pupils.front();
  PartPlane plane{first,
                  first.eyebox_m({h.size, h.pitch_m, h.wavelength_m}),
                  {1, 1},
                  {0, 0},
                  std::abs(first.b_m + first.a * middle_m)};
  for (const auto& pupil : pupils) {
    const auto half_m = glm::dvec2(pupil.diameter_m / 2);
    plane.low = glm::min(plane.low, 0.5 + (pupil.centre_m - half_m) / plane.size_m);
    plane.high = glm::max(plane.high, 0.5 + (pupil.centre_m + half_m) / plane.size_m);
  }
  plane.low = glm::clamp(plane.low, 0.0, 1.0);
  plane.high = glm::clamp(plane.high, 0.0, 1.0);
  return plane;
}

glm::ivec2 refine_parts(const Plan& plan, double blur_m, const ViewerSpec& viewer) {
  const auto plane = part_plane(plan, viewer);
  auto wanted = glm::max(glm::round(plane.open_m() / viewer.pupil_m), 1.0);
  if (plane.pupil) return glm::min(wanted, 1.0 * most_parts);
  if (wanted == glm::dvec2(1)) wanted = glm::dvec2(2);
  const auto most =
      blur_m * plane.size_m / (pixels_of_part * plan.hologram.wavelength_m * plane.distance_m);
  return glm::max(glm::min(wanted, glm::min(most, 1.0 * most_parts)), 1.0);
}

namespace {

/// Depth that the picture of a part holds, before and behind its own.
double held_by_part_m(const PartPlane& plane, double blur_m, glm::ivec2 parts) {
  const auto part_m = plane.open_m() / glm::dvec2(parts);
  return held_blurs * blur_m * plane.distance_m / std::max(part_m.x, part_m.y);
}

}  // namespace

double depth_over_held(const Plan& plan, double blur_m, const ViewerSpec& viewer) {
  return (plan.extent.far_m - plan.extent.near_m) /
         held_by_part_m(part_plane(plan, viewer), blur_m, refine_parts(plan, blur_m, viewer));
}

int least_paced_iterations(const Plan& plan, double blur_m, const ViewerSpec& viewer) {
  return static_cast<int>(std::ceil(std::min(depth_over_held(plan, blur_m, viewer) / 1.4, 1e6)));
}

bool serves_samples(const Plan& plan, const ViewerSpec& viewer) {
  return plan.samples.aimed && !plan.has_specular_samples() &&
         (viewer.eyepiece_m || lies_on_one_side(plan));
}

bool lies_on_one_side(const Plan& plan) {
  return (plan.extent.near_m > 0 || plan.extent.far_m < 0) && !is_near_hologram(plan);
}

bool refines_samples(const Plan& plan) {
  const auto& refine = plan.refine.value();
  if (refine.targets != RefineTargets::automatic) return refine.targets == RefineTargets::samples;
  return serves_samples(plan, refine.viewer) && refine.views.value_or(0) == 0 &&
         (refine.viewer.eyepiece_m ||
          refine.iterations.value_or(most_paced_iterations + 1) <= most_paced_iterations);
}

std::vector<KeyPlace> planned_places(const Plan& plan) {
  const auto& refine = plan.refine.value();
  const double blur_m = refine.blur_m.value();
  if (refines_samples(plan) || refine.viewer.eyepiece_m)
    return part_places(plan, blur_m, refine.viewer, planned_iterations(plan), refine.depths_m);
  return key_places(plan, blur_m, {refine.depths_m, planned_views(refine)});
}

std::vector<KeyPlace> part_places(const Plan& plan, double blur_m, const ViewerSpec& viewer,
                                  int iterations, std::vector<double> depths_m) {
  const double near_m = plan.extent.near_m, far_m = plan.extent.far_m;
  const auto plane = part_plane(plan, viewer);
  const auto parts = refine_parts(plan, blur_m, viewer);
  const double held_m = held_by_part_m(plane, blur_m, parts);
  const int enough =
      std::clamp(static_cast<int>(std::ceil((far_m - near_m) / (between_parts * held_m))) + 1, 3,
                 most_depths) |
      1;
  // An odd number has a depth in the middle, where the last iteration ends.
  const bool each_has_one = iterations < enough;
  if (depths_m.empty()) {
    const int count = each_has_one ? iterations : enough;
    for (int i = 0; i < count; ++i) {
      const double margin_m = each_has_one ? 0 : beyond_parts * held_m;
      const double share = each_has_one ? (i + 0.3) / (count - 0.4) : i / (count - 1.0);
      depths_m.push_back(near_m - margin_m + (far_m - near_m + 2 * margin_m) * share);
    }
  }
  std::ranges::sort(depths_m);

  std::vector<KeyPlace> places;
  const auto add_round = [&](int round, double z_m, glm::dvec2 shift) {
    // Edges of the parts along each axis, in holograms or eyeboxes
    const auto edges = [&](int axis) {
      std::vector<double> at{0};
      const int n = parts[axis];
      for (int i = 0; i < n; ++i)
        if (n > 1 && i + shift[axis] > 0.01) at.push_back((i + shift[axis]) / n);
      at.push_back(1);
      for (double& edge : at) edge = plane.low[axis] + edge * (plane.high - plane.low)[axis];
      return at;
    };
    const auto x = edges(0), y = edges(1);
    for (std::size_t j = 0; j + 1 < y.size(); ++j)
      for (std::size_t i = 0; i + 1 < x.size(); ++i)
        places.push_back({z_m,
                          {x[i] + x[i + 1] - 1, y[j] + y[j + 1] - 1},
                          {x[i + 1] - x[i], y[j + 1] - y[j]},
                          1,
                          round,
                          plane.pupil});
  };
  // The last iterations go through all depths once, and end with parts that begin at the edge.
  const int depths = static_cast<int>(depths_m.size()), rounds = std::min(iterations, 2 * depths);
  for (int round = 0; round < rounds; ++round) {
    const int turn = round + 2 * depths - rounds;
    add_round(round, depths_m[static_cast<std::size_t>(from_ends(turn % depths, depths))],
              glm::fract(glm::dvec2(0.618034, 0.754878) * (rounds - 1.0 - round)));
  }
  return places;
}

int refine_iterations(const std::vector<KeyPlace>& places) {
  int draws = 0;
  bool views = false;
  for (const auto& place : places) {
    draws += place.times;
    views = views || !place.is_whole();
  }
  return std::max(
      least_iterations,
      static_cast<int>(std::lround(draws * (views ? rounds_with_views : rounds_of_depths))));
}

int planned_iterations(const Plan& plan) {
  const auto& refine = plan.refine.value();
  if (refines_samples(plan)) return refine.iterations.value_or(most_paced_iterations);
  if (refine.viewer.eyepiece_m) return refine.iterations.value_or(least_iterations);
  return refine.iterations.value_or(refine_iterations(
      key_places(plan, refine.blur_m.value(), {refine.depths_m, planned_views(refine)})));
}

glm::dvec2 refine_window_m(const Plan& plan) {
  if (plan.refine && plan.refine->window_m) return *plan.refine->window_m;
  return plan.window_m() * glm::dvec2(plan.grid);
}

glm::dvec2 key_pixels(const Plan& plan, glm::dvec2 window_m, double blur_m) {
  const auto pixel_m = glm::max(glm::dvec2(blur_m / pixels_per_blur), plan.hologram.pitch_m);
  return glm::max(glm::round(window_m / pixel_m), 1.0);
}

glm::ivec2 samples_through_pupil(const KeyPlace& place, glm::ivec2 plane, glm::dvec2 pitch_m,
                                 double blur_m) {
  const auto pixels = glm::min(blur_m / (pitch_m * place.larger()), 1e6);
  return glm::ceil(glm::dvec2(plane) * glm::max(place.aperture, 1.0 / glm::max(pixels, 1.0)));
}

int key_lens_points(const KeyPlace& place, int points) {
  return std::max(
      2, static_cast<int>(std::ceil(points * std::max(place.aperture.x, place.aperture.y))));
}

namespace {

/// Whether the Fresnel propagation is near enough to the exact one.
bool fresnel_serves(glm::ivec2 size, glm::dvec2 pitch_m, double wavelength_m, double blur_m,
                    double z_m, glm::dvec2 window_m) {
  // Rays from the hologram's corners to the window's miss their places by so many standard
  // deviations of the blur, at most
  constexpr double most_miss = 2.5;
  // Share of the pairs of hologram pixels and window points between which the pixels cannot show
  // the angle: their light is computed at a wrong place
  constexpr double most_folded = 0.01;
  z_m = std::abs(z_m);
  const glm::dvec2 hologram_m = glm::dvec2(size) * pitch_m;
  // A ray between opposite corners: its frequency says z sin where the exact place is z tan.
  const double across_m = glm::length((hologram_m + window_m) / 2.0);
  const double sine = across_m / std::hypot(across_m, z_m);
  const double miss = (across_m - z_m * sine) / std::max(blur_m, glm::min(pitch_m.x, pitch_m.y));
  const glm::dvec2 reach_m = wavelength_m * z_m / (2.0 * pitch_m);
  const double folded = 1 - (1 - share_beyond(hologram_m.x, window_m.x, reach_m.x)) *
                                (1 - share_beyond(hologram_m.y, window_m.y, reach_m.y));
  return miss <= most_miss && folded <= most_folded;
}

constexpr int fringe = 16;  // of edges, in pixels

/// How far the steepest light goes aside on its way, by its sine, and by how much more in truth.
struct Reach {
  Reach(glm::dvec2 pitch_m, double wavelength_m, double z_m) {
    const auto sine = wavelength_m / (2.0 * pitch_m);
    by_sine_m = std::abs(z_m) * sine;
    stretch = 1 / std::sqrt(std::max(1 - glm::dot(sine, sine), 0.01));
  }
  glm::dvec2 by_sine_m;
  double stretch;
};

}  // namespace

SpectrumPlanes corrected_planes(glm::ivec2 size, glm::ivec2 first, glm::ivec2 open,
                                glm::dvec2 pitch_m, double wavelength_m, double z_m,
                                glm::dvec2 window_m, double padding) {
  z_m = std::abs(z_m);
  const Reach reach(pitch_m, wavelength_m, z_m);
  const auto reach_m = reach.by_sine_m, reach_px = reach_m / pitch_m;
  SpectrumPlanes planes;
  planes.margin =
      fringe + static_cast<int>(std::ceil(std::max(reach_px.x, reach_px.y) * (reach.stretch - 1)));
  planes.open = open + 2 * planes.margin;
  planes.pixels = 2 * padded_size((planes.open + 1) / 2, 1);  // even
  // What the open part sends to a period of the transform beyond the window would fold into it
  const auto edges = glm::max(glm::abs(glm::dvec2(first) - glm::dvec2(size) / 2.0),
                              glm::abs(glm::dvec2(first + open) - glm::dvec2(size) / 2.0)),
             far_m = window_m / 2.0 + (edges + 1.0 * planes.margin) * pitch_m;
  planes.finer = planes.pixels;
  for (int axis = 0; axis < 2; ++axis) {
    const double periods =
        std::clamp((far_m[axis] + reach_m[axis]) / (2 * reach_m[axis]), 1.0, 1e3);
    if (far_m[axis] > reach_m[axis])
      planes.finer[axis] = static_cast<int>(std::ceil(periods * planes.pixels[axis] - 1e-6));
  }
  planes.finer = padded_size(planes.finer, 1);
  planes.finer_open =
      glm::min(glm::ivec2(glm::ceil(glm::dvec2(planes.open) * planes.fine())), planes.finer);
  planes.picture = padded_size(
      glm::max(planes.finer, glm::ivec2(glm::ceil(glm::dvec2(planes.finer_open) * padding))), 1);
  planes.pixel_m = wavelength_m * z_m * planes.fine() / (glm::dvec2(planes.picture) * pitch_m);
  planes.transformed = {planes.pixels, planes.finer, planes.picture};
  return planes;
}

SpectrumPlanes exact_planes(glm::ivec2 size, glm::dvec2 pitch_m, double wavelength_m, double z_m,
                            glm::dvec2 window_m) {
  const Reach reach(pitch_m, wavelength_m, z_m);
  const auto window = window_m / pitch_m;
  const auto sides =
      glm::max((window + glm::dvec2(size)) / 2.0 + reach.stretch * reach.by_sine_m / pitch_m,
               glm::max(window, glm::dvec2(size))) +
      1.0 * fringe;
  SpectrumPlanes planes;
  planes.pixels = 2 * padded_size((glm::ivec2(glm::ceil(sides)) + 1) / 2, 1);  // even
  planes.open = planes.finer = planes.finer_open = planes.picture = planes.pixels;
  planes.pixel_m = pitch_m;
  planes.transformed = {planes.pixels, planes.picture};
  return planes;
}

SpectrumPlanes spectrum_planes(KeyPropagation propagation, const KeyPlace& place, glm::ivec2 size,
                               glm::dvec2 pitch_m, double wavelength_m, glm::dvec2 window_m) {
  if (propagation == KeyPropagation::exact)
    return exact_planes(size, pitch_m, wavelength_m, place.z_m, window_m);
  const auto edge = [&](double side) {
    return glm::ivec2(glm::clamp(
        (1.0 + glm::dvec2(1, -1) * place.view + side * place.aperture) / 2.0 * glm::dvec2(size),
        glm::dvec2(0), glm::dvec2(size)));
  };
  const auto first = edge(-1);
  return corrected_planes(size, first, edge(1) - first, pitch_m, wavelength_m, place.z_m, window_m);
}

double butterflies_of_look(const SpectrumPlanes& planes, glm::dvec2 window_m, double blur_m) {
  constexpr double of_sample = 18, of_pixel = 8, of_blurs = 6;
  double sum = 0;
  for (const auto& plane : planes.transformed) {
    const double samples = 1.0 * plane.x * plane.y;
    sum += samples * (std::log2(samples) + of_sample);
  }
  const auto window = glm::min(window_m / planes.pixel_m, glm::dvec2(planes.picture)),
             blurs = blur_m / planes.pixel_m;
  return sum + window.x * window.y * (of_pixel + of_blurs * (blurs.x + blurs.y));
}

KeyPropagation key_propagation(glm::ivec2 size, glm::dvec2 pitch_m, double wavelength_m,
                               double blur_m, double z_m, glm::dvec2 window_m) {
  if (fresnel_serves(size, pitch_m, wavelength_m, blur_m, z_m, window_m))
    return KeyPropagation::fresnel;
  const auto cost = [&](const SpectrumPlanes& planes) {
    return butterflies_of_look(planes, window_m, blur_m);
  };
  return cost(corrected_planes(size, {0, 0}, size, pitch_m, wavelength_m, z_m, window_m)) <
                 cost(exact_planes(size, pitch_m, wavelength_m, z_m, window_m))
             ? KeyPropagation::corrected
             : KeyPropagation::exact;
}

}  // namespace raywave
