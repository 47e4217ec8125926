// SPDX-License-Identifier: Apache-2.0
#include "host/plan/predict/light_shown.hpp"

#include <algorithm>
#include <cmath>

namespace raywave {
namespace {

/// The part of the hologram's window, from -half to half, from which the point at x_m in the plane
/// z_m is not too steep for the pixels.
std::pair<double, double> within_pixels(const Plan& plan, int axis, double x_m, double z_m) {
  const double half = plan.size[axis] * plan.pitch_m[axis] / 2;
  const double sine = std::min(plan.largest_sine[axis], 0.999),
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
  return std::max(0.0, high - low) / (plan.size[axis] * plan.pitch_m[axis]);
}

double share_seen(const Plan& plan, int axis, double x_m, double z_m) {
  const auto [low, high] = part_seen(plan, axis, x_m, z_m);
  return std::max(0.0, high - low) / (plan.size[axis] * plan.pitch_m[axis]);
}

}  // namespace raywave
