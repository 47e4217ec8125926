// SPDX-License-Identifier: Apache-2.0
/// Where WRPs stand: side by side at the distances of the layers, as many as the scene's light
/// passes on its way to the hologram.
#pragma once

#include "host/geometry/world.hpp"
#include "host/plan/placement.hpp"

namespace raywave {

/// Places the WRPs of all tiles and layers, tile by tile: sets Plan::wrps.
///
/// throws  InputError for more than most_wrps, and as add_fan
void place_wrps(const Scene& scene, const World& world, const Placement& placement, Plan& plan);

}  // namespace raywave
