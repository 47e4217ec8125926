// SPDX-License-Identifier: Apache-2.0
#include "host/plan/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/footprint.hpp"
#include "host/plan/message_text.hpp"

namespace raywave {
namespace {

constexpr double largest_lattice = 1 << 28;  // cells

/// Cells from the axis: floats count no farther and still tell places within a cell.
constexpr double farthest_lattice_ray = 1 << 22;

/// Covers these tangents with cells.
///
/// tangents  low and high, per axis
/// throws    InputError when these are too many cells, or too far off the axis
void cover(const Scene& scene, const std::array<Interval, 2>& tangents, LatticePlan& lattice) {
  double cells = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const auto& along = tangents[static_cast<std::size_t>(axis)];
    const double first = std::floor(along.low / lattice.step - 0.5);
    const double last = std::ceil(along.high / lattice.step - 0.5);
    cells *= last - first + 1;
    const std::string asked =
        one_line(scene.file.string()) + ": sampling.pitch " + millimetres(scene.sampling.pitch_m);
    if (!(cells <= largest_lattice))
      throw InputError(
          asked + " needs " + count_text(cells) +
          " lattice cells or more, at most 268435456 are allowed; give a larger pitch");
    if (const double farthest = std::max(std::abs(first), std::abs(last));
        farthest > farthest_lattice_ray)
      throw InputError(asked + " puts the scene " + count_text(farthest) +
                       " pitches off the axis, at most 4194304 are allowed; give a larger pitch");
    lattice.first[axis] = static_cast<int>(first);
    lattice.size[axis] = static_cast<int>(last - first + 1);
  }
}

}  // namespace

void add_chief_tangents(const Plan& plan, const DepthLayer& layer, const Tile& tile,
                        const WrpGrid& wrps, ChiefTangents& lit) {
  for (int axis = 0; axis < 2; ++axis) {
    // Light of a sample reaches a WRP when the sample's chief ray passes no farther beyond its edge
    // than the widest footprint and a tail of the widest spot.
    const double middle = wrps.middle_m[axis] - tile.centre_m[axis];
    const auto nearest = footprint_of(plan, axis, layer.distance_m, layer.min_m.z),
               farthest = footprint_of(plan, axis, layer.distance_m, layer.max_m.z);
    const double footprint =
        std::max(nearest.half_m, farthest.half_m) + lattice_tail * farthest.spot_m;
    const double half = wrps.size[axis] * plan.tile_window_m()[axis] / 2 + footprint;
    // A ray to the tile's centre that crosses the plane at x comes from the tangent (x - centre) /
    // distance + centre / z.
    for (const double z : {layer.min_m.z, layer.max_m.z}) {
      for (const double side : {-half, half})
        lit[static_cast<std::size_t>(axis)].add((middle + side) / layer.distance_m +
                                                tile.centre_m[axis] / z);
    }
  }
}

LatticePlan lattice_over(const Scene& scene, const Extents& extents, const Plan& plan,
                         glm::dvec2 largest_tangent, const ChiefTangents& lit) {
  LatticePlan lattice;
  lattice.full_z_m = (plan.extent.closest_m + plan.extent.farthest_m()) / 2;
  lattice.step = scene.sampling.pitch_m / lattice.full_z_m;
  const auto window = plan.window_m();
  std::array<Interval, 2> covered;
  for (int axis = 0; axis < 2; ++axis) {
    // Chief rays no steeper than light that pixels can show into some part of the window, and none
    // whose light misses all WRPs
    const auto i = static_cast<std::size_t>(axis);
    const auto& tangents = extents.tangents[i];
    const double reach = largest_tangent[axis] + std::max(1.0, plan.cone.half_width) *
                                                     window[axis] / (2 * plan.extent.closest_m);
    const double low = std::max(-reach, lit[i].low),
                 high = std::max(low, std::min(reach, lit[i].high));

    // Whole cells around what the scene's extents leave of them
    covered[i] = {std::clamp(tangents.low, low, high), std::clamp(tangents.high, low, high)};
  }
  cover(scene, covered, lattice);
  return lattice;
}

LatticePlan lattice_from_eye(const Scene& scene, const World& world, const Plan& plan,
                             glm::dvec2 largest_tangent) {
  // So far away that perspective hardly matters over the scene and the window
  const auto window = plan.window_m();
  const double away_m =
      std::max({scene.viewer.distance_m, 2 * (plan.extent.far_m - plan.extent.near_m),
                4 * std::max(window.x, window.y)});
  LatticePlan lattice;
  lattice.eye_m = {0, 0, plan.extent.near_m - away_m};
  lattice.full_z_m = (plan.extent.near_m + plan.extent.far_m) / 2 - lattice.eye_m.z;
  lattice.step = scene.sampling.pitch_m / lattice.full_z_m;
  std::array<Interval, 2> covered;
  for (const auto& p_m : positions_now(world)) {
    for (std::size_t i = 0; i < 2; ++i) {
      // What no place of the window shows is left out
      const auto axis = static_cast<int>(i);
      const double reach_m = window[axis] / 2 + largest_tangent[axis] * plan.extent.farthest_m();
      covered[i].add(std::clamp(p_m[axis], -reach_m, reach_m) / (p_m.z - lattice.eye_m.z));
    }
  }
  cover(scene, covered, lattice);
  return lattice;
}

glm::dvec2 tangents_of_sines(glm::dvec2 sines) {
  sines = glm::min(sines, 0.999);
  return sines / glm::sqrt(1.0 - sines * sines);
}

glm::dvec2 steepest_slope(const Plan& plan) {
  const auto sine = plan.hologram.largest_sine;
  return sine / glm::sqrt(glm::max(glm::dvec2(1e-3), 1.0 - sine * sine));
}

glm::dvec2 steepest_of_masks(const Plan& plan) {
  // Of light along one axis, farther off the axis along the other
  const auto sine =
      glm::min(plan.hologram.largest_sine + glm::abs(plan.slm.illumination.sine), 0.7);
  return sine / std::sqrt(1 - std::min(glm::dot(sine, sine), 0.98));
}

glm::dvec2 limit_m(const Plan& plan, double z_m) {
  const auto limit = plan.hologram.wavelength_m * std::abs(z_m) / plan.window_m();
  if (!is_near_hologram(plan)) return limit;
  // The pixel, or what the part of the band that is gathered resolves
  const auto resolved = plan.hologram.wavelength_m / (2.0 * plan.hologram.largest_sine);
  return glm::max(limit, glm::max(resolved, plan.hologram.pitch_m));
}

std::uint64_t primary_rays(const Plan& plan) {
  if (!plan.samples.aimed) {
    std::uint64_t rays = 0;
    for (const auto& wrp : plan.wrps) rays += wrp.fan.size() * area_of(plan.tiling.tile_size);
    return rays;
  }
  double rays = 0;
  for (const auto& layer : plan.layers) {
    double of_layer = static_cast<double>(plan.lattice.size.x) * plan.lattice.size.y /
                      static_cast<double>(plan.layers.size());
    for (int axis = 0; axis < 2; ++axis) {
      // Of the hologram: the cone, or what pixels can show of a sample's light
      const double share =
          layer.distance_m != 0
              ? plan.cone.half_width *
                    narrowing(layer.distance_m, (layer.min_m.z + layer.max_m.z) / 2)
              : (std::abs(layer.min_m.z) + std::abs(layer.max_m.z)) *
                    plan.hologram.largest_sine[axis] / plan.window_m()[axis];
      of_layer *= std::max(1.0, std::min(share, 1.0) * plan.hologram.size[axis]);
    }
    rays += of_layer;
  }
  return static_cast<std::uint64_t>(rays);
}

double ray_bias_m(const World& world, const Plan& plan) {
  const double reach_m = std::max(glm::length(world.min_m - plan.extent.origin_m),
                                  glm::length(world.max_m - plan.extent.origin_m));
  return std::max(glm::length(world.max_m - world.min_m) * 0x1p-16, reach_m * 0x1p-20);
}

bool breaks_pay(const LatticePlan& lattice, std::size_t triangles) {
  constexpr std::size_t most_of_a_cell = 16;
  return triangles <= most_of_a_cell * area_of(lattice.size);
}

bool shades_parts(const Plan& plan, std::size_t triangles) {
  constexpr std::size_t few_of_a_cell = 3;
  const auto& lighting = plan.lighting;
  return lighting.shadows || lighting.textures > 0 || lighting.diffuse_rays > 0 ||
         lighting.gloss_rays > 0 || std::ranges::any_of(lighting.lights, has_size) ||
         triangles > few_of_a_cell * area_of(plan.lattice.size);
}

}  // namespace raywave
