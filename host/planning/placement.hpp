// SPDX-License-Identifier: Apache-2.0
/// At which distances planes stand, and how many side by side the scene's light passes on its way
/// to the hologram.
#pragma once

#include <glm/vec2.hpp>

#include "host/geometry/world.hpp"
#include "host/plan/placement.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Places the layers of depth: sets Plan::layers and grid of a plan whose tiles are set.
///
/// throws  InputError when the layers or fans cannot be as asked
Placement place_layers(const Scene& scene, const World& world, glm::dvec2 largest_tangent,
                       Plan& plan);

/// The scene's extents for one tile, through a plane distance_m before the hologram.
SeenThrough seen_through(double distance_m, glm::dvec2 largest_tangent, const Plan& plan,
                         const Tile& tile);

}  // namespace raywave
