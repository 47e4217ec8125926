// SPDX-License-Identifier: Apache-2.0
/// Normal cones of the subtrees of a BVH. Normal-cone culling: sample rays skip a subtree when
/// every triangle in it faces away from the hologram's centre (kernels/scene/normal_cones.h).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "host/geometry/bvh.hpp"

namespace raywave {

/// A cone that holds the outer normals below a node: unit vectors, each no farther than `spread`
/// (length of the difference) from the axis, a unit vector. The default holds all directions.
struct NormalCone {
  glm::dvec3 axis{0, 0, 1};
  double spread = 2;
};

/// Writes the normal cone of each child into the counts of a tree's nodes.
///
/// sides  device::Triangle::side of each of bvh.triangles; a subtree with an open mesh gets no cone
///        and is never skipped
void store_normal_cones(Bvh& bvh, const std::vector<std::int32_t>& sides);

/// The cone as the bits of kernels/scene/normal_cones.h; 0 when its spread is too large for them.
std::int32_t normal_cone_bits(const NormalCone& cone);

/// Sets view and view_margin of an instance that lies in a sphere.
///
/// middle_m, radius_m  the sphere, in the instance's frame
/// eye_m               the hologram's centre, in the instance's frame
/// side                1: rays come from there; -1: they go there; 0: either, and nothing is known
void set_view(device::Instance& instance, glm::dvec3 middle_m, double radius_m, glm::dvec3 eye_m,
              int side);

// Which triangles of a mesh share an edge.

/// The triangles beyond the edges ab, bc and ca of each triangle, three numbers for each; -1 where
/// there is none, more than one, or one of the other winding. Corners at equal positions are the
/// same corner.
std::vector<std::int32_t> neighbours_of(const std::vector<glm::dvec3>& positions_m,
                                        const std::vector<glm::uvec3>& triangles);

}  // namespace raywave
