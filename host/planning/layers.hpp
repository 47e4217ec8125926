// SPDX-License-Identifier: Apache-2.0
/// Depth layers: at which distances WRPs stand, and which surfaces belong to which of them.
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

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
