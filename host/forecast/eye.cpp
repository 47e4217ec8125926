// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/eye.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <numbers>

#include "host/common/text.hpp"
#include "host/plan/lattice.hpp"

namespace raywave {
namespace {

/// Below this share of the scene's light a loss is not worth a line.
constexpr double least_missing = 0.005;

std::string mm_text(double metres) { return length_text(std::round(metres * 1e5) / 1e5); }

/// Share of the pupil that light of the place x_m, y_m, z_m fills: rays to points of the pupil, as
/// `lens` traces them.
double share_of_pupil(const Plan& plan, const Pupil& pupil, glm::dvec2 at_m, double z_m) {
  constexpr int points = 16;
  const auto half_m = plan.window_m() / 2.0;
  int all = 0, open = 0;
  for (int j = 0; j < points; ++j)
    for (int i = 0; i < points; ++i) {
      const glm::dvec2 from = (2.0 * glm::dvec2(i, j) + 1.0) / static_cast<double>(points) - 1.0;
      if (from.x * from.x + from.y * from.y > 1) continue;
      ++all;
      bool passes = true;
      for (int axis = 0; axis < 2; ++axis) {
        const double to_m = pupil.centre_m[axis] + from[axis] * pupil.diameter_m / 2,
                     through_m = pupil.through_m(at_m[axis], z_m, to_m),
                     slope = (to_m - pupil.a * through_m) / pupil.b_m;
        passes = passes && std::abs(through_m) <= half_m[axis] &&
                 std::abs(slope) <= plan.hologram.largest_sine[axis];
      }
      open += passes;
    }
  return static_cast<double>(open) / all;
}

}  // namespace

bool has_pupil(const Scene& scene) {
  return scene.viewer.eyepiece_m || scene.given.contains("viewer.pupil") ||
         scene.given.contains("viewer.pupil_position");
}

EyeView eye_view(const Scene& scene, const Plan& plan, const FrontView& view) {
  constexpr double arc_minute = std::numbers::pi / 180 / 60;
  const auto pupils = pupils_of(scene.viewer);
  const double lambda = plan.hologram.wavelength_m, pupil_m = scene.viewer.pupil_m;
  EyeView eye;
  eye.pupil = pupils[0];
  eye.eyebox_m = pupils[0].eyebox_m(scene.hologram);
  eye.lit_m = 2.0 * plan.hologram.largest_sine * std::abs(eye.pupil.b_m);
  eye.zero_order_m =
      -(carrier_of(plan.slm, plan.hologram.pitch_m, lambda) + own_carrier_of(plan.slm.encoding)) *
          lambda / plan.hologram.pitch_m * pupils[0].b_m +
      0.0;
  eye.acuity = std::max(arc_minute, 1.22 * lambda / pupil_m);
  eye.detail_m = eye.acuity / arc_minute *
                 detail_for_eye_m(scene.viewer, (plan.extent.near_m + plan.extent.far_m) / 2);
  eye.sharp_by_acuity = eye.acuity / pupil_m;
  eye.sharp_by_wave = 2 * lambda / (pupil_m * pupil_m);
  constexpr int most_looked_at = 64;  // along an axis
  const int step = std::max({1, view.size.x / most_looked_at, view.size.y / most_looked_at});
  for (const auto& pupil : pupils) {
    EyePlace place{pupil.centre_m, 0, 0};
    double all = 0;
    const auto look = [&](int x, int y, std::size_t cell, double z_m) {
      const double here = view.radiance[cell],
                   share = share_of_pupil(plan, pupil, view.place_m(x, y, z_m), z_m);
      all += here;
      place.light += share * here;
      if (share == 0) place.cut += here;
    };
    view.for_surfaces(look, step);
    if (all > 0) {
      place.light /= all;
      place.cut /= all;
    }
    eye.places.push_back(place);
  }
  return eye;
}

bool sees_band(const Pupil& pupil, const Plan& plan) {
  if (plan.slm.stop) return false;
  const auto half = plan.hologram.wavelength_m / 2.0 / plan.hologram.pitch_m * std::abs(pupil.b_m),
             corner = (glm::abs(pupil.centre_m) + half) / (pupil.diameter_m / 2);
  return corner.x * corner.x + corner.y * corner.y <= 1;
}

std::vector<std::string> eye_warnings(const Scene& scene, const Plan& plan, const EyeView& eye) {
  std::vector<std::string> warnings;
  const auto best = std::ranges::max_element(eye.places, {}, &EyePlace::light);
  const auto& h = plan.hologram;
  const bool is_narrowed =
      glm::all(glm::lessThan(h.largest_sine, 0.49 * h.wavelength_m / h.pitch_m)) &&
      glm::all(glm::lessThan(h.largest_sine,
                             glm::dvec2(eye.pupil.diameter_m / 2 / std::abs(eye.pupil.b_m))));
  if (const double lost = 1 - best->light; lost > least_missing)
    warnings.push_back(
        percent_text(lost) + " of the pupil gets none of the scene's light: " +
        (is_narrowed ? "about the axis half of the band alone is lit, which keeps the picture "
                       "apart from what the encoding throws aside"
                     : "it passes beside the hologram, or is steeper than its pixels can show") +
        " (eyebox " + mm_text(eye.eyebox_m.x) + " x " + mm_text(eye.eyebox_m.y) +
        "): a smaller viewer.pupil nearer to the axis, a smaller hologram.pitch or a scene closer "
        "to the axis is seen whole");
  if (!scene.viewer.eyepiece_m) return warnings;
  const auto& viewer = scene.viewer;
  // Light of the hologram's edges lands a x beside that of its middle
  const auto aside_m = std::abs(eye.pupil.a) * plan.window_m() / 2.0;
  const auto reaches_beyond = [&](glm::dvec2 half_m) {
    return std::ranges::any_of(eye.places, [&](const EyePlace& place) {
      return glm::any(
          glm::greaterThan(glm::abs(place.centre_m) + eye.pupil.diameter_m / 2 + aside_m, half_m));
    });
  };
  if (reaches_beyond(eye.eyebox_m / 2.0))
    warnings.push_back("the pupil reaches beyond the eyebox, " + mm_text(eye.eyebox_m.x) + " x " +
                       mm_text(eye.eyebox_m.y) +
                       " around the axis, where replicas of the picture are seen: a smaller "
                       "hologram.pitch, a longer viewer.eyepiece or a smaller pupil nearer to the "
                       "axis keeps them out");
  const auto pupils = pupils_of(viewer);
  if (is_near_hologram(plan) &&
      std::ranges::any_of(pupils, [&](auto& one) { return sees_band(one, plan); }))
    warnings.push_back(
        "the pupil sees all light of the SLM, which looks evenly bright through it, without a "
        "picture: a pupil of less than " +
        mm_text(0.7 * std::min(eye.eyebox_m.x, eye.eyebox_m.y)) +
        ", or optics that pass half the band, slm.stop = 0.5, show one");
  // A pupil that reaches so far, in eyeboxes, sees half of what double phase throws aside
  constexpr double sees_haze = 0.41;
  if (plan.slm.encoding == Encoding::double_phase && !plan.slm.stop && !scene.refine &&
      reaches_beyond(sees_haze * eye.eyebox_m))
    warnings.push_back(
        "the pupil sees light that double phase throws aside, as haze over the picture: optics "
        "that pass half the band where it is focused, slm.stop = 0.5, keep it out");
  constexpr double rounding = 1e-6;
  if (plan.extent.near_m + viewer.eyepiece_distance_m > 0)
    if (const double nearest = dioptres_of_depth(viewer, plan.extent.near_m);
        nearest > 1 / nearest_focus_m)
      warnings.push_back("the scene reaches to " + number_text(std::round(10 * nearest) / 10) +
                         " D, nearer than eyes focus: from z = " +
                         mm_text(depth_of_dioptres(viewer, 1 / nearest_focus_m)) +
                         " on it is seen at 10 D or less");
  if (plan.extent.far_m + viewer.eyepiece_distance_m > 0) {
    const double farthest = dioptres_of_depth(viewer, plan.extent.far_m);
    if (farthest < -rounding)
      warnings.push_back("the scene reaches to " + number_text(std::round(100 * farthest) / 100) +
                         " D, beyond infinity: no eye sees this sharp; keep it within z = " +
                         mm_text(depth_of_dioptres(viewer, 0)) + ", which is seen at 0 D");
  }
  return warnings;
}

}  // namespace raywave
