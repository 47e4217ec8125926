// SPDX-License-Identifier: Apache-2.0
#include "host/planning/light_shown.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace raywave
