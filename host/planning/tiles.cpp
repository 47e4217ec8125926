// SPDX-License-Identifier: Apache-2.0
#include "host/planning/tiles.hpp"

#include <glm/common.hpp>

#include "host/plan/padded_plane.hpp"

namespace raywave {

std::string why_in_one_piece(const Plan& plan, Method method) {
  if (method != Method::wrp) return "";
  if (!plan.samples.aimed) return "the rays of fans hang on the whole hologram's window";
  if (plan.cone.half_width - plan.cone.apodization < 1 - 1e-9)
    return "sampling.cone less sampling.apodization is below 1, which would darken the tiles' "
           "borders";
  return "";
}

glm::ivec2 tile_size_of(glm::ivec2 size, glm::ivec2 tile_grid) {
  return (size + tile_grid - 1) / tile_grid;
}

glm::ivec2 with_more_tiles(glm::ivec2 size, glm::ivec2 tile_grid) {
  const auto tile_size = tile_size_of(size, tile_grid);
  const int longer = tile_size.x >= tile_size.y ? 0 : 1;
  if (tile_size[longer] >= 2 * least_tile) ++tile_grid[longer];
  return tile_grid;
}

void set_padding(Plan& plan, double padding) {
  if (auto* wrps = std::get_if<SpectrumWrps>(&plan.carrier))
    *wrps = {{}, padding, padded_size(plan.tiling.tile_size, padding)};
}

void divide(Plan& plan, glm::ivec2 tile_grid, double padding) {
  plan.tiling.grid = tile_grid;
  plan.tiling.tile_size = tile_size_of(plan.hologram.size, tile_grid);
  plan.tiling.tiles.clear();
  for (int row = 0; row < tile_grid.y; ++row) {
    for (int column = 0; column < tile_grid.x; ++column) {
      Tile tile;
      tile.first = glm::ivec2(column, row) * (plan.hologram.size - plan.tiling.tile_size) /
                   glm::max(tile_grid - 1, 1);
      const auto off_middle =
          glm::dvec2(tile.first) + glm::dvec2(plan.tiling.tile_size - plan.hologram.size) / 2.0;
      tile.centre_m =
          off_middle * plan.hologram.pitch_m * glm::dvec2(1, -1);  // rows count downwards
      plan.tiling.tiles.push_back(tile);
    }
  }
  set_padding(plan, padding);
  const auto padded = padded_size(plan.tiling.tile_size, padding);

  // A tile's cone reaches as far beyond its borders as the hologram's does, where the padded plane
  // holds it: light beyond would wrap around into the tile.
  const auto held = glm::max(2.0 * glm::dvec2(padded) / glm::dvec2(plan.tiling.tile_size) - 1.0,
                             plan.cone.half_width);
  const auto smaller = glm::dvec2(plan.hologram.size) / glm::dvec2(plan.tiling.tile_size);
  const auto wanted = plan.cone.half_width + (plan.cone.half_width - 1) * (smaller - 1.0);
  plan.tiling.cone = glm::min(wanted, held);
  plan.tiling.apodization = plan.cone.apodization * smaller - (wanted - plan.tiling.cone);
}

}  // namespace raywave
