// SPDX-License-Identifier: Apache-2.0
#include "host/planning/light_shown.hpp"

#include <cmath>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/geometry/extents.hpp"
#include "host/plan/lattice.hpp"

namespace raywave {
namespace {

/// The part of the hologram's window, from -half to half, from which the point at x_m in the plane
/// z_m is not too steep for the pixels.
std::pair<double, double> within_pixels(const Plan& plan, int axis, double x_m, double z_m) {
  const double half = plan.hologram.size[axis] * plan.hologram.pitch_m[axis] / 2;
  // A surface near the hologram lights the part before it, and is seen from straight ahead
  if (is_near_hologram(plan)) {
    const double reach = std::abs(z_m) * plan.hologram.largest_sine[axis];
    return std::abs(x_m) <= half + reach ? std::pair(-half, half) : std::pair(half, -half);
  }
  if (const auto& light = plan.slm.illumination; !light.is_plane()) {
    // Beyond the light on the SLM, sines are nearly linear in the place
    const auto beyond = [&](double to_m) {
      return (to_m - x_m) / std::copysign(std::hypot(to_m - x_m, z_m), z_m) -
             light.sine_at(glm::dvec2(to_m))[axis];
    };
    const double first = beyond(-half), last = beyond(half), rise = (last - first) / (2 * half),
                 limit = plan.hologram.largest_sine[axis];
    if (std::abs(rise) * half < 1e-12)
      return std::abs(first) <= limit ? std::pair(-half, half) : std::pair(half, -half);
    const double a = -half + (-limit - first) / rise, b = -half + (limit - first) / rise;
    return {std::max(-half, std::min(a, b)), std::min(half, std::max(a, b))};
  }
  const double sine = std::min(plan.hologram.largest_sine[axis], 0.999),
               reach = std::abs(z_m) * sine / std::sqrt(1 - sine * sine);
  return {std::max(-half, x_m - reach), std::min(half, x_m + reach)};
}

}  // namespace

std::pair<double, double> part_seen(const Plan& plan, int axis, double x_m, double z_m) {
  auto [low, high] = within_pixels(plan, axis, x_m, z_m);
  const auto& layer = plan.layer_at(z_m);
  const auto [first, last] = wrps_extent(plan, layer);
  // The line from h on the hologram through x crosses the WRPs at h + (x - h) distance / z.
  const double share = layer.distance_m / z_m, left = first[axis] - x_m * share,
               right = last[axis] - x_m * share;
  if (std::abs(1 - share) < 1e-9) {
    if (left > 0 || right < 0) return {0, -1};
  } else {
    const double a = left / (1 - share), b = right / (1 - share);
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return {low, high};
}

double share_within_pixels(const Plan& plan, int axis, double x_m, double z_m) {
  const auto [low, high] = within_pixels(plan, axis, x_m, z_m);
  return std::max(0.0, high - low) / (plan.hologram.size[axis] * plan.hologram.pitch_m[axis]);
}

double share_seen(const Plan& plan, int axis, double x_m, double z_m) {
  const auto [low, high] = part_seen(plan, axis, x_m, z_m);
  return std::max(0.0, high - low) / (plan.hologram.size[axis] * plan.hologram.pitch_m[axis]);
}

double cycles_per_sine(const Plan& plan, int axis) {
  return plan.hologram.pitch_m[axis] / plan.hologram.wavelength_m;
}

double frequency_at(const Plan& plan, int axis, double from_m, double z_m, double to_m) {
  const double sine = (to_m - from_m) / std::copysign(std::hypot(to_m - from_m, z_m), z_m);
  return cycles_per_sine(plan, axis) *
         (sine - plan.slm.illumination.sine_at(glm::dvec2(to_m))[axis]);
}

void require_light_through_stop(const Plan& plan, const World& world) {
  if (!plan.slm.stop || plan.specular.bounces > 0) return;  // mirrors show what is not in the box
  const auto half_m = plan.window_m() / 2.0;
  for (int axis = 0; axis < 2; ++axis) {
    Interval cycles;
    for (const double from_m : {world.min_m[axis], world.max_m[axis]})
      for (const double z_m : {plan.extent.near_m, plan.extent.far_m})
        for (const double to_m : {-half_m[axis], half_m[axis]})
          cycles.add(frequency_at(plan, axis, from_m, z_m, to_m));
    cycles = {std::max(cycles.low, -band_edge), std::min(cycles.high, band_edge)};
    if (cycles.low > cycles.high) continue;  // too steep for the pixels: the hologram is dark
    bool has_light = false;
    for_passed(*plan.slm.stop, axis, [&](double low, double high) {
      has_light = has_light || (low <= cycles.high && high >= cycles.low);
    });
    if (has_light) continue;
    const auto text = [](double value) { return number_text(std::round(value * 1000) / 1000); };
    auto centre = plan.slm.stop->centre;
    centre[axis] = std::round(cycles.middle() * 1000) / 1000;
    throw InputError(
        one_line(plan.scene_name) + ": slm.stop passes none of the scene's light: of " +
        (axis == 0 ? "x" : "y") + " it passes " +
        text(plan.slm.stop->centre[axis] - plan.slm.stop->size[axis] / 2) + " to " +
        text(plan.slm.stop->centre[axis] + plan.slm.stop->size[axis] / 2) +
        " cycles per pixel, and the light has " + text(cycles.low) + " to " + text(cycles.high) +
        "; give slm.stop_centre = [" + text(centre.x) + ", " + text(centre.y) + "]");
  }
}

}  // namespace raywave
