// SPDX-License-Identifier: Apache-2.0
#include "host/planning/placement.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <vector>

#include "host/planning/layers.hpp"

namespace raywave {
namespace {

/// The part of where a tile's light passes through a layer's plane that is no steeper than the
/// pixels can show.
std::array<Interval, 2> shown_part(std::array<Interval, 2> passed, const Plan& plan,
                                   const Tile& tile, double distance_m,
                                   glm::dvec2 largest_tangent) {
  for (int axis = 0; axis < 2; ++axis) {
    auto& along = passed[static_cast<std::size_t>(axis)];
    const double reach =
                     plan.tile_window_m()[axis] / 2 + std::abs(distance_m) * largest_tangent[axis],
                 centre = tile.centre_m[axis];
    along.low = std::clamp(along.low, centre - reach, centre + reach);
    along.high = std::clamp(along.high, centre - reach, centre + reach);
  }
  return passed;
}

/// Where a layer's light passes through its plane, per tile.
struct PassedLight {
  std::vector<std::array<Interval, 2>> passed;  // all of it
  std::vector<std::array<Interval, 2>> shown;   // what pixels can show
  std::array<Interval, 2> all_shown;            // of all tiles together
};

/// extents  extended by the layer's
PassedLight passed_light(const World& world, std::span<const glm::dvec3> positions_m,
                         glm::dvec2 largest_tangent, const Plan& plan, const DepthLayer& layer,
                         Extents& extents) {
  PassedLight light;
  const bool is_whole = plan.layers.size() == 1;
  const auto corners = is_whole ? std::vector<glm::dvec3>()
                                : corners_in(world, positions_m, layer, plan.specular.images);
  for (const auto& tile : plan.tiling.tiles) {
    const auto seen = seen_through(layer.distance_m, largest_tangent, plan, tile);
    const auto of_tile = is_whole ? extents_of(world, seen) : extents_of(corners, seen);
    extents.add(of_tile);
    light.passed.push_back(of_tile.passed);
    light.shown.push_back(
        shown_part(of_tile.passed, plan, tile, layer.distance_m, largest_tangent));
    for (std::size_t axis = 0; axis < 2; ++axis) {
      light.all_shown[axis].add(light.shown.back()[axis].low);
      light.all_shown[axis].add(light.shown.back()[axis].high);
    }
  }
  return light;
}

/// The WRPs side by side that a tile needs for a layer. A given grid is the hologram's: the same
/// area, divided like the hologram.
///
/// tile  where its light passes; all: that of all tiles
WrpGrid grid_of(const Scene& scene, const Plan& plan, const std::array<Interval, 2>& tile,
                const std::array<Interval, 2>& all) {
  WrpGrid grid;
  for (int axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    grid.middle_m[axis] = scene.wrp.grid ? all[i].middle() : tile[i].middle();
    const double wanted =
        std::max(1.0, std::ceil(tile[i].extent() / plan.tile_window_m()[axis] - 0.01));
    grid.size[axis] = scene.wrp.grid ? (*scene.wrp.grid)[axis] * plan.tiling.grid[axis]
                                     : static_cast<int>(std::min(wanted, most_wrps + 1.0));
  }
  return grid;
}

}  // namespace

SeenThrough seen_through(double distance_m, glm::dvec2 largest_tangent, const Plan& plan,
                         const Tile& tile) {
  const double wider = std::max({1.0, plan.tiling.cone.x, plan.tiling.cone.y});
  return {distance_m, tile.centre_m, plan.tile_window_m() / 2.0, 0.99 * largest_tangent, wider};
}

Placement place_layers(const Scene& scene, const World& world, glm::dvec2 largest_tangent,
                       Plan& plan) {
  // Depths are shared out among the distances at which planes stand.
  auto distances_m = distances_of(scene, world, plan);
  const auto positions_m =
      distances_m.size() > 1 ? positions_now(world) : std::vector<glm::dvec3>();
  plan.layers = layers_around(std::move(distances_m), world, positions_m, plan.specular.images);

  // Each layer has, for every tile, a grid of planes that covers the light which pixels can show.
  Placement placement;
  std::array<Interval, 2> covered;
  for (auto& layer : plan.layers) {
    auto light = passed_light(world, positions_m, largest_tangent, plan, layer, placement.extents);
    auto& grids = placement.grids.emplace_back();
    for (std::size_t i = 0; i < plan.tiling.tiles.size(); ++i) {
      const auto grid = grid_of(scene, plan, light.shown[i], light.all_shown);
      layer.grid = glm::max(layer.grid, grid.size);
      for (int axis = 0; axis < 2; ++axis) {
        for (const double side : {-0.5, 0.5})
          covered[static_cast<std::size_t>(axis)].add(
              grid.middle_m[axis] + side * grid.size[axis] * plan.tile_window_m()[axis]);
      }
      grids.push_back({grid, light.passed[i]});
      add_chief_tangents(plan, layer, plan.tiling.tiles[i], grid, placement.lit);
    }
  }

  // The grid of the plan covers the planes of all layers and tiles.
  for (int axis = 0; axis < 2; ++axis)
    plan.grid[axis] =
        scene.wrp.grid
            ? (*scene.wrp.grid)[axis]
            : static_cast<int>(std::ceil(
                  covered[static_cast<std::size_t>(axis)].extent() / plan.window_m()[axis] - 0.01));

  // Fans, mirrors and glass may bring light from anywhere.
  if (!plan.samples.aimed || plan.has_specular_samples()) placement.lit = all_tangents;
  return placement;
}

}  // namespace raywave
