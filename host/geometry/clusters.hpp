// SPDX-License-Identifier: Apache-2.0
/// Neighbouring vertices in clusters, so that what lies outermost is found without a look at every
/// vertex.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "host/geometry/lanes.hpp"
#include "host/geometry/motion.hpp"

namespace raywave {

/// Boxes side by side.
struct BoxLanes {
  Places centre;
  Places half[3];  // from the centre to three sides
};

/// Of an object's vertices. The last cluster may have fewer than the others.
struct Clusters {
  static constexpr std::size_t size = 64;
  std::vector<std::uint32_t> vertices;  // cluster by cluster
  // First boxes around the clusters, then around as many of these as there are lanes, and so on, up
  // to one group of boxes around all; the last box of a level also where some are missing to whole
  // lanes.
  std::vector<std::vector<BoxLanes>> levels;
};

/// normals  one per vertex: boxes lie flat on the surface, which makes them thin
Clusters clusters_of(std::span<const glm::dvec3> positions_m, std::span<const glm::vec3> normals);

/// Raises numbers, lane by lane, to what functions of place are in some places.
using RaiseInPlaces = std::function<void(std::span<const Places>, std::span<Lanes>)>;

/// Raises `largest` to the largest that functions are at the vertices of clusters. Over a convex
/// instance, each must be largest at a corner.
///
/// positions_m  of the vertices that `clusters` was made of
/// motion       takes them to where the functions are taken
/// least        what is larger by less may be missed
void raise_to_largest(const Clusters& clusters, std::span<const glm::dvec3> positions_m,
                      const Motion& motion, const RaiseInPlaces& raise, double least,
                      std::span<double> largest);

}  // namespace raywave
