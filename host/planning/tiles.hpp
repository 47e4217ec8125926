// SPDX-License-Identifier: Apache-2.0
/// Tiles: windows of the hologram that are computed one after another where memory is short.
#pragma once

#include <glm/vec2.hpp>
#include <string>

#include "host/plan/plan.hpp"

namespace raywave {

/// Why the hologram can only be computed in one piece; empty: it can be divided.
std::string why_in_one_piece(const Plan& plan, Method method);

/// Divides a plan's hologram into tiles: Plan::tiling, and the padded plane of WRPs.
void divide(Plan& plan, glm::ivec2 tile_grid, double padding);

/// Pads the planes of WRPs; other planes have no padding.
void set_padding(Plan& plan, double padding);

/// Pixels of a tile's longer side at least: smaller tiles take more padding than they save.
inline constexpr int least_tile = 256;

/// Pixels of the tiles of a hologram of `size` pixels. All are of one size; where that does not
/// divide the hologram's, neighbours overlap.
glm::ivec2 tile_size_of(glm::ivec2 size, glm::ivec2 tile_grid);

/// The next finer division: one tile more along a tile's longer side, or the same where tiles would
/// become smaller than least_tile.
glm::ivec2 with_more_tiles(glm::ivec2 size, glm::ivec2 tile_grid);

}  // namespace raywave
