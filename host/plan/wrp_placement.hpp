// SPDX-License-Identifier: Apache-2.0
/// Where the WRPs stand: side by side at the distances of the layers, as many as the scene's light
/// passes on its way to the hologram.
#pragma once

#include <glm/vec2.hpp>

#include "host/geometry/extents.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

struct Placement {
  Extents extents;    // of the whole scene
  ChiefTangents lit;  // chief rays of the light that falls onto the WRPs
};

/// Places the WRPs of all tiles and layers: sets Plan::layers, grid and wrps of a plan whose tiles
/// are set.
///
/// throws  InputError when the layers or fans cannot be as asked, or for more than 1024 WRPs
Placement place_wrps(const Scene& scene, const World& world, glm::dvec2 largest_tangent,
                     Plan& plan);

/// The scene's extents for one tile, through a plane distance_m before the hologram.
SeenThrough seen_through(double distance_m, glm::dvec2 largest_tangent, const Plan& plan,
                         const Tile& tile);

}  // namespace raywave
