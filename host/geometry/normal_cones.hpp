// SPDX-License-Identifier: Apache-2.0
/// Which way the parts of a tree face, so that rays in search of samples pass by the inner sides of
/// closed meshes (kernels/scene/normal_cones.h).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "host/geometry/bvh.hpp"

namespace raywave {

/// Directions of the outer normals below a node: of unit length, all within `spread` of an axis, a
/// unit vector.
struct NormalCone {
  glm::dvec3 axis{0, 0, 1};
  double spread = 2;
};

/// Writes the facing of each child into the counts of a tree's nodes.
///
/// sides  of bvh.triangles: device::Triangle::side; with an open mesh below it a child faces
///        everywhere
void store_normal_cones(Bvh& bvh, const std::vector<std::int32_t>& sides);

/// The bits of kernels/scene/normal_cones.h; 0 where the spread is too large for them.
std::int32_t normal_cone_bits(const NormalCone& cone);

/// Sets view and view_margin of a instance that lies in a sphere.
///
/// middle_m, radius_m, eye_m  the sphere, and the hologram's centre, in the instance's frame
void set_view(device::Instance& instance, glm::dvec3 middle_m, double radius_m, glm::dvec3 eye_m);

}  // namespace raywave
