// SPDX-License-Identifier: Apache-2.0
#include "host/view/preview.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>

namespace raywave {

namespace {

/// All of the scene that the pixels can show, in the plane z_m around the axis: a tenth more than
/// it covers, and two pixels, seen from the middle of the hologram.
///
/// pupil  whose middle it is seen from instead
glm::dvec2 whole_window_m(std::span<const glm::dvec3> vertices, const Plan& plan, double z_m,
                          const std::optional<Pupil>& pupil) {
  const auto away = [&](double at_m) { return pupil ? pupil->a * at_m + pupil->b_m : at_m; };
  glm::dvec2 half_m(0);
  for (const auto& place : vertices)
    if (std::abs(away(place.z)) > 0)
      half_m = glm::max(half_m, glm::abs(glm::dvec2(place) / away(place.z)) * std::abs(away(z_m)));
  const auto sine = glm::min(plan.hologram.largest_sine, 0.999);
  const auto reach_m = std::abs(z_m) * sine / glm::sqrt(1.0 - sine * sine) + plan.window_m() / 2.0;
  return 2.0 * glm::max(glm::min(1.1 * half_m + 2.0 * plan.hologram.pitch_m, reach_m),
                        plan.hologram.pitch_m);
}

}  // namespace

LensSpec preview_spec(std::span<const glm::dvec3> vertices, const Plan& plan,
                      std::optional<double> z_m, std::optional<glm::dvec2> window_m,
                      glm::dvec2 view, const ViewerSpec& viewer) {
  constexpr double longest_px = 320;
  LensSpec what;
  what.view = view;
  // One ray to a pixel, from nearly one place: nothing is blurred
  what.aperture = glm::dvec2(1e-3);
  what.points = 1;
  if (viewer.eyepiece_m) {
    what.pupil = pupils_of(viewer).front();
    what.view = {0, 0};
    what.aperture = {1, 1};
  }
  what.z_m = z_m ? *z_m : (plan.extent.near_m + plan.extent.far_m) / 2;
  what.window_m = window_m ? *window_m : whole_window_m(vertices, plan, what.z_m, what.pupil);
  const auto pixels = *what.window_m / plan.hologram.pitch_m;
  what.pixel_m =
      plan.hologram.pitch_m * std::max(1.0, std::ceil(std::max(pixels.x, pixels.y) / longest_px));
  return what;
}

}  // namespace raywave
