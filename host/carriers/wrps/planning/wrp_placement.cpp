// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/wrps/planning/wrp_placement.hpp"

#include <algorithm>
#include <glm/common.hpp>
#include <iterator>
#include <string>

#include "host/carriers/wrps/planning/fans.hpp"
#include "host/carriers/wrps/planning/wrp_culling.hpp"
#include "host/common/error.hpp"

namespace raywave {
namespace {

bool is_within(double x, const Interval& interval, double margin) {
  return interval.low - margin <= x && x <= interval.high + margin;
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
      Wrp wrp{.centre_m = {grid.middle_m.x + (column - (grid.size.x - 1) / 2.0) * window.x,
                           grid.middle_m.y - (row - (grid.size.y - 1) / 2.0) * window.y,
                           layer.distance_m},
              .layer = number,
              .tile = tile};
      if (!plan.samples.aimed) add_fan(scene, plan, wrp);
      all.push_back(std::move(wrp));
    }
  }

  const auto reach = glm::max(reach_of_light(plan, layer, layer.min_m.z),
                              reach_of_light(plan, layer, layer.max_m.z));
  const auto is_near = [&](const Wrp& wrp) {
    return is_within(wrp.centre_m.x, passed[0], reach.x) &&
           is_within(wrp.centre_m.y, passed[1], reach.y);
  };
  if (plan.samples.aimed && std::ranges::any_of(all, is_near))
    std::erase_if(all, [&](const Wrp& wrp) { return !is_near(wrp); });
  std::move(all.begin(), all.end(), std::back_inserter(wrps));
}

}  // namespace

void place_wrps(const Scene& scene, const World& world, const Placement& placement, Plan& plan) {
  std::vector<std::vector<Wrp>> of_tiles(plan.tiling.tiles.size());
  double count = 0;
  for (std::size_t layer = 0; layer < plan.layers.size(); ++layer) {
    double most = 0;
    for (std::size_t i = 0; i < of_tiles.size(); ++i) {
      const auto& [grid, passed] = placement.grids[layer][i];
      const auto asked = scene.wrp.grid.value_or(grid.size);
      most = std::max(most, static_cast<double>(asked.x) * asked.y);
      if (count + most > most_wrps) {
        const auto size = std::to_string(asked.x) + " x " + std::to_string(asked.y),
                   allowed = std::to_string(most_wrps) + " are allowed; ";
        throw InputError(
            scene.file.string() + ": " +
            (scene.wrp.grid ? "wrp.grid asks for " + size + " WRPs" +
                                  (plan.layers.size() * plan.tiling.tiles.size() > 1
                                       ? " on every layer of every tile, "
                                       : ", ") +
                                  allowed + "give a smaller one, or \"auto\""
                            : "the scene needs " + size + " or more WRPs of the hologram's size, " +
                                  allowed + "give wrp.grid, a larger hologram or a smaller scene"));
      }
      add_wrps_side_by_side(scene, plan, i, layer, grid, passed, of_tiles[i]);
    }
    count += most;
  }
  for (auto& wrps : of_tiles) std::move(wrps.begin(), wrps.end(), std::back_inserter(plan.wrps));

  // Fans, mirrors and glass may bring light from anywhere
  if (plan.samples.aimed && !plan.has_specular_samples())
    plan.wrps = lit_wrps(plan, world, std::move(plan.wrps));
}

}  // namespace raywave
