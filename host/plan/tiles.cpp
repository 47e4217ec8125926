// SPDX-License-Identifier: Apache-2.0
#include "host/plan/tiles.hpp"

#include <glm/common.hpp>

#include "host/plan/padded_plane.hpp"

namespace raywave {

std::string why_in_one_piece(const Plan& plan, Method method) {
  if (method != Method::wrp) return "";
  if (!plan.aimed) return "the rays of fans hang on the whole hologram's window";
  if (plan.cone_half_width - plan.apodization < 1 - 1e-9)
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

void divide(Plan& plan, glm::ivec2 tile_grid, double padding) {
  plan.tile_grid = tile_grid;
  plan.tile_size = tile_size_of(plan.size, tile_grid);
  plan.tiles.clear();
  for (int row = 0; row < tile_grid.y; ++row) {
    for (int column = 0; column < tile_grid.x; ++column) {
      Tile tile;
      tile.first =
          glm::ivec2(column, row) * (plan.size - plan.tile_size) / glm::max(tile_grid - 1, 1);
      const auto off_middle = glm::dvec2(tile.first) + glm::dvec2(plan.tile_size - plan.size) / 2.0;
      tile.centre_m = off_middle * plan.pitch_m * glm::dvec2(1, -1);  // rows count downwards
      plan.tiles.push_back(tile);
    }
  }
  plan.padded = padded_size(plan.tile_size, padding);

  // A tile's cone reaches as far beyond its borders as the hologram's does, where the padded plane
  // holds it: light beyond would come round into the tile.
  const auto held = glm::max(2.0 * glm::dvec2(plan.padded) / glm::dvec2(plan.tile_size) - 1.0,
                             plan.cone_half_width);
  const auto smaller = glm::dvec2(plan.size) / glm::dvec2(plan.tile_size);
  const auto wanted = plan.cone_half_width + (plan.cone_half_width - 1) * (smaller - 1.0);
  plan.tile_cone = glm::min(wanted, held);
  plan.tile_apodization = plan.apodization * smaller - (wanted - plan.tile_cone);
}

}  // namespace raywave
