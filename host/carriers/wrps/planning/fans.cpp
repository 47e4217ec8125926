// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/wrps/planning/fans.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/message_text.hpp"

namespace raywave {
namespace {

/// Mirrors show things up to this many times as deep as the scene: rays are spaced for it.
constexpr double deepest_virtual_picture = 2;

constexpr std::size_t largest_fan = 1 << 24;  // rays

/// Rays across a fan, as fan_tangents makes them.
double fan_count(double window_m, double distance_m, double depth_m, double pitch_m) {
  return std::max(1.0, std::ceil(std::abs(window_m / distance_m) * depth_m / pitch_m - 1e-9));
}

/// Directions of a fan that the SLM's pixels can show; steeper ones are left out.
std::vector<glm::dvec2> fan_of(const std::vector<double>& across, const std::vector<double>& up,
                               glm::dvec2 largest_sine) {
  std::vector<glm::dvec2> fan;
  for (const double ty : up) {
    for (const double tx : across) {
      const double length = std::sqrt(1 + tx * tx + ty * ty);
      // Rounded to floats, which devices are given, so that every reader of the plan has the same
      // rays
      if (std::abs(tx) <= largest_sine.x * length && std::abs(ty) <= largest_sine.y * length)
        fan.emplace_back(static_cast<float>(tx), static_cast<float>(ty));
    }
  }
  return fan;
}

}  // namespace

std::vector<double> fan_tangents(double window_m, double distance_m, double shift_m, double depth_m,
                                 double pitch_m) {
  const double width = window_m / distance_m;
  const auto count = static_cast<std::size_t>(
      std::min(fan_count(window_m, distance_m, depth_m, pitch_m), double{largest_fan}));
  std::vector<double> tangents(count);
  for (std::size_t i = 0; i < count; ++i)
    tangents[i] =
        shift_m / distance_m + (static_cast<double>(i) - static_cast<double>(count - 1) / 2) *
                                   width / static_cast<double>(count);
  return tangents;
}

void add_fan(const Scene& scene, const Plan& plan, Wrp& wrp) {
  const auto& layer = plan.layer_of(wrp);
  const auto window = plan.tile_window_m();
  const double depth = (plan.extent.far_m - layer.distance_m) *
                       (plan.specular.bounces > 0 ? deepest_virtual_picture : 1);
  const double p = scene.sampling.pitch_m;

  const auto rays = [&](int axis) { return fan_count(window[axis], layer.distance_m, depth, p); };
  if (!(rays(0) * rays(1) <= largest_fan)) {
    throw InputError(one_line(scene.file.string()) + ": sampling.pitch " + millimetres(p) +
                     " needs " + count_text(rays(0)) + " x " + count_text(rays(1)) +
                     " rays per pixel, at most 16777216 are allowed; give a larger pitch");
  }

  std::array<std::vector<double>, 2> tangents;
  for (int axis = 0; axis < 2; ++axis)
    tangents[axis] = fan_tangents(window[axis], layer.distance_m, wrp.centre_m[axis], depth, p);
  wrp.fan = fan_of(tangents[0], tangents[1], plan.hologram.largest_sine);
}

Wrp plane_at_hologram(const Plan& plan, std::size_t tile, glm::dvec2 largest_tangent,
                      int rays_per_axis) {
  Wrp plane{.centre_m = {plan.tiling.tiles[tile].centre_m, 0}, .tile = tile};
  std::array<std::vector<double>, 2> tangents;
  for (int axis = 0; axis < 2; ++axis) {
    const double step = 2 * largest_tangent[axis] / rays_per_axis;
    for (int i = 0; i < rays_per_axis; ++i)
      tangents[axis].push_back((i - (rays_per_axis - 1) / 2.0) * step);
  }
  plane.fan = fan_of(tangents[0], tangents[1], plan.hologram.largest_sine);
  return plane;
}

}  // namespace raywave
