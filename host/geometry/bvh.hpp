// SPDX-License-Identifier: Apache-2.0
/// Bounding volume hierarchy: CGAL builds it, the device walks a flattened copy
/// (kernels/scene/bvh.h).
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "host/geometry/shared_types.hpp"

namespace raywave {

/// Corners of a triangle, scene frame.
struct Corners {
  float a[3], b[3], c[3];
};

inline glm::dvec3 point_of(const float* corner) { return {corner[0], corner[1], corner[2]}; }

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
/// into leaves of up to `leaf_size`. Boxes are rounded outwards to float.
///
/// positions_m  world; origin_m is subtracted in double before anything is rounded
/// throws       InputError when there is no triangle or more than 2^30
Bvh build_bvh(std::span<const glm::dvec3> positions_m, std::span<const glm::uvec3> triangles,
              glm::dvec3 origin_m, int leaf_size = 2);

/// One tree over those of several objects in one frame. Its order numbers the triangles of the
/// first, then those of the second, and so on. Normal cones are not there yet.
///
/// throws  InputError when there is none
Bvh joined(std::span<const Bvh> trees);

/// Makes the boxes of a tree anew after its vertices have moved, from the leaves upwards. Normal
/// cones are taken out. Boxes are as build_bvh would have made them of the same parts.
///
/// positions_m, triangles, origin_m  as for build_bvh, but for the positions
void refit_bvh(Bvh& bvh, std::span<const glm::dvec3> positions_m,
               std::span<const glm::uvec3> triangles, glm::dvec3 origin_m);

/// Time of a ray by the surface-area heuristic, in tests of two boxes: the surfaces of all nodes,
/// and of leaves times triangle_cost and their triangles, over the surface of the whole.
double surface_cost(const Bvh& bvh);

/// Triangles in a leaf of the trees that rays search, at most.
inline constexpr int triangles_of_leaf = 4;

/// Time to test a triangle, in units of the time to test the boxes of two children. Rays are as
/// fast with 0.6, but the tree has a third more nodes.
inline constexpr float triangle_cost = 0.35f;

/// The nearest float that is no more, or no less.
inline float rounded_down(double x) {
  const auto f = static_cast<float>(x);
  return f <= x ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
}
inline float rounded_up(double x) { return -rounded_down(-x); }

/// Margin (m) by which boxes are widened on every side, for coordinates up to reach_m. It covers
/// the replacement of zero direction components in kernels/scene/bvh.h and boxes rounded to
/// nearest, and is too small to cost time.
double box_margin_m(double reach_m);

}  // namespace raywave
