// SPDX-License-Identifier: Apache-2.0
/// The places that light passes on its way to the hologram, before planes are put there.
#pragma once

#include <array>
#include <vector>

#include "host/geometry/extents.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

inline constexpr int most_wrps = 1024;

/// The planes side by side that a tile needs for a layer, and where all of its light passes.
struct TileGrid {
  WrpGrid grid;
  std::array<Interval, 2> passed;
};

struct Placement {
  Extents extents;                             // of the whole scene
  ChiefTangents lit;                           // chief rays of the light that falls onto the planes
  std::vector<std::vector<TileGrid>> grids{};  // layer by layer, tile by tile
};

}  // namespace raywave
