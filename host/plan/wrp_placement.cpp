// SPDX-License-Identifier: Apache-2.0
#include "host/plan/wrp_placement.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <iterator>
#include <string>
#include <vector>

#include "host/common/error.hpp"
#include "host/plan/fans.hpp"
#include "host/plan/layers.hpp"
#include "host/plan/wrp_culling.hpp"

namespace raywave {
namespace {

constexpr int largest_grid = 1024;  // WRPs

bool is_within(double x, const Interval& interval, double margin) {
  return interval.low - margin <= x && x <= interval.high + margin;
}

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
  const auto corners =
      is_whole ? std::vector<glm::dvec3>() : corners_in(world, positions_m, layer, plan.images);
  for (const auto& tile : plan.tiles) {
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
    grid.size[axis] = scene.wrp.grid ? (*scene.wrp.grid)[axis] * plan.tile_grid[axis]
                                     : static_cast<int>(std::min(wanted, largest_grid + 1.0));
  }
  return grid;
}

/// Appends the WRPs of a tile in a layer. WRPs that only gather aimed rays are left out where they
/// stand too far from where the tile's light passes, unless all do.
void add_wrps_side_by_side(const Scene& scene, const Plan& plan, std::size_t tile,
                           std::size_t number, const WrpGrid& grid,
                           const std::array<Interval, 2>& passed, std::vector<Wrp>& wrps) {
  const auto& layer = plan.layers[number];
  const auto window = plan.tile_window_m();
  std::vector<Wrp> all;
  for (int row = 0; row < grid.size.y; ++row) {
    for (int column = 0; column < grid.size.x; ++column) {
      Wrp wrp;
      wrp.layer = number;
      wrp.tile = tile;
      wrp.centre_m = {grid.middle_m.x + (column - (grid.size.x - 1) / 2.0) * window.x,
                      grid.middle_m.y - (row - (grid.size.y - 1) / 2.0) * window.y,
                      layer.distance_m};
      if (!plan.aimed) add_fan(scene, plan, wrp);
      all.push_back(std::move(wrp));
    }
  }

  const auto reach = glm::max(reach_of_light(plan, layer, layer.min_m.z),
                              reach_of_light(plan, layer, layer.max_m.z));
  const auto is_near = [&](const Wrp& wrp) {
    return is_within(wrp.centre_m.x, passed[0], reach.x) &&
           is_within(wrp.centre_m.y, passed[1], reach.y);
  };
  if (plan.aimed && std::any_of(all.begin(), all.end(), is_near))
    std::erase_if(all, [&](const Wrp& wrp) { return !is_near(wrp); });
  std::move(all.begin(), all.end(), std::back_inserter(wrps));
}

}  // namespace

SeenThrough seen_through(double distance_m, glm::dvec2 largest_tangent, const Plan& plan,
                         const Tile& tile) {
  const double wider = std::max({1.0, plan.tile_cone.x, plan.tile_cone.y});
  return {distance_m, tile.centre_m, plan.tile_window_m() / 2.0, 0.99 * largest_tangent, wider};
}

Placement place_wrps(const Scene& scene, const World& world, glm::dvec2 largest_tangent,
                     Plan& plan) {
  // Depths are shared out among the distances at which WRPs stand.
  auto distances_m = distances_of(scene, world, plan);
  const auto positions_m =
      distances_m.size() > 1 ? positions_now(world) : std::vector<glm::dvec3>();
  plan.layers = layers_around(std::move(distances_m), world, positions_m, plan.images);

  // Each layer has, for every tile, a grid of WRPs that covers the light which pixels can show.
  Placement placement;
  std::array<Interval, 2> covered;
  std::vector<std::vector<Wrp>> of_tiles(plan.tiles.size());
  double count = 0;
  for (std::size_t number = 0; number < plan.layers.size(); ++number) {
    auto& layer = plan.layers[number];
    const auto light =
        passed_light(world, positions_m, largest_tangent, plan, layer, placement.extents);
    double most = 0;
    for (std::size_t i = 0; i < plan.tiles.size(); ++i) {
      const auto grid = grid_of(scene, plan, light.shown[i], light.all_shown);
      const auto asked = scene.wrp.grid.value_or(grid.size);
      most = std::max(most, static_cast<double>(asked.x) * asked.y);
      if (count + most > largest_grid && !plan.compact) {
        const auto size = std::to_string(asked.x) + " x " + std::to_string(asked.y),
                   allowed = std::to_string(largest_grid) + " are allowed; ";
        throw InputError(
            scene.file.string() + ": " +
            (scene.wrp.grid ? "wrp.grid asks for " + size + " WRPs" +
                                  (plan.layers.size() * plan.tiles.size() > 1
                                       ? " on every layer of every tile, "
                                       : ", ") +
                                  allowed + "give a smaller one, or \"auto\""
                            : "the scene needs " + size + " or more WRPs of the hologram's size, " +
                                  allowed + "give wrp.grid, a larger hologram or a smaller scene"));
      }
      layer.grid = glm::max(layer.grid, grid.size);
      for (int axis = 0; axis < 2; ++axis) {
        for (const double side : {-0.5, 0.5})
          covered[static_cast<std::size_t>(axis)].add(
              grid.middle_m[axis] + side * grid.size[axis] * plan.tile_window_m()[axis]);
      }
      add_chief_tangents(plan, layer, plan.tiles[i], grid, placement.lit);
      if (!plan.compact)
        add_wrps_side_by_side(scene, plan, i, number, grid, light.passed[i], of_tiles[i]);
    }
    count += most;
  }

  // The grid of the plan covers the WRPs of all layers and tiles; WRPs come tile by tile.
  for (int axis = 0; axis < 2; ++axis)
    plan.grid[axis] =
        scene.wrp.grid
            ? (*scene.wrp.grid)[axis]
            : static_cast<int>(std::ceil(
                  covered[static_cast<std::size_t>(axis)].extent() / plan.window_m()[axis] - 0.01));
  for (auto& wrps : of_tiles) std::move(wrps.begin(), wrps.end(), std::back_inserter(plan.wrps));

  // Fans, mirrors and glass may bring light from anywhere; else WRPs without light are left out.
  if (!plan.aimed || plan.has_specular_samples())
    placement.lit = all_tangents;
  else if (!plan.compact)
    plan.wrps = lit_wrps(plan, world, std::move(plan.wrps));
  return placement;
}

}  // namespace raywave
