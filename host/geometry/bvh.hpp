// SPDX-License-Identifier: Apache-2.0
/// Bounding volume hierarchy: CGAL builds it, the device walks a flattened copy
/// (kernels/scene/bvh.h).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "host/geometry/shared_types.hpp"

namespace raywave {

/// Corners of a triangle, scene frame.
struct Corners {
  float a[3], b[3], c[3];
};

/// A flattened tree over triangles in the scene frame. Node 0 is the root.
struct Bvh {
  std::vector<device::BvhNode> nodes;
  std::vector<Corners> triangles;    // in leaf order, rounded
  std::vector<std::uint32_t> order;  // order[i]: index, in the input, of the triangle at place i
  // Nodes on the longest path from the root to a leaf; the device's stack holds this many
  int depth = 0;
};

/// Builds CGAL's AABB tree (median split along the longest axis) and flattens it through CGAL's
/// public interface. Parts of up to 512 triangles are divided anew, by a surface-area heuristic,
/// into leaves of up to `leaf_size`: rays take a quarter to two fifths less time
/// (docs/parts.md). Boxes are rounded outwards to float.
///
/// positions_m  world; origin_m is subtracted in double before anything is rounded
/// throws       InputError when there is no triangle or more than 2^30
Bvh build_bvh(const std::vector<glm::dvec3>& positions_m, const std::vector<glm::uvec3>& triangles,
              glm::dvec3 origin_m, int leaf_size = 2);

/// Margin (m) by which boxes are widened on every side, for coordinates up to reach_m. It covers
/// the replacement of zero direction components in kernels/scene/bvh.h and boxes rounded to
/// nearest, and is too small to cost time.
double box_margin_m(double reach_m);

}  // namespace raywave
