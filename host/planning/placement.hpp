// SPDX-License-Identifier: Apache-2.0
/// At which distances planes stand, and how many side by side the scene's light passes on its way
/// to the hologram.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

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

// Depth layers: at which distances WRPs stand, and which surfaces belong to which of them.

/// Distances from the WRPs to the hologram, in metres, front to back. WRPs that gather samples
/// stand amid the surfaces; those that gather fans stand in front of the nearest one.
///
/// throws  InputError for several layers of fans, and for WRPs of fans behind the
///         scene
std::vector<double> distances_of(const Scene& scene, const World& world, const Plan& plan);

/// Layers around these distances, without those in which there is no surface. Every sample belongs
/// to the layer on whose WRPs it has the smallest footprint.
///
/// positions_m  of all vertices; one layer needs none
std::vector<DepthLayer> layers_around(std::vector<double> distances_m, const World& world,
                                      std::span<const glm::dvec3> positions_m,
                                      const Images& images);

/// The corners of all surfaces in a layer: vertices of the meshes, and where edges enter or leave
/// the layer; and the images in it.
///
/// positions_m  of all vertices
std::vector<glm::dvec3> corners_in(const World& world, std::span<const glm::dvec3> positions_m,
                                   const DepthLayer& layer, const Images& images);

}  // namespace raywave
