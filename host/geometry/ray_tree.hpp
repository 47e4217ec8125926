// SPDX-License-Identifier: Apache-2.0
/// Rays against a scene's objects on the host, for planning: few rays, in double precision.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "host/geometry/bvh.hpp"
#include "host/geometry/motion.hpp"
#include "host/geometry/shared_types.hpp"

namespace raywave {

/// Where a ray meets a surface first, world frame.
struct RayHit {
  double t = 0;  // along the ray
  std::size_t triangle = 0;
  std::int32_t object = 0;
  glm::dvec3 face{0};    // normal of the triangle, unit length, as its corners turn
  glm::dvec3 normal{0};  // interpolated, unit length, as the mesh has it
};

/// First and number of an object's triangles, of which each has its object's number, ascending.
std::pair<std::size_t, std::size_t> triangles_of(std::size_t object,
                                                 std::span<const std::int32_t> triangle_object);

/// A tree for each object, as it was placed. Rays are turned to where the object is now.
class RayTree {
public:
  /// positions_m, normals  of vertices; no normals: those of the faces
  /// triangle_object       of each triangle, ascending, below `objects`
  /// origin_m              of the trees' frame
  RayTree(std::span<const glm::dvec3> positions_m, std::span<const glm::vec3> normals,
          std::span<const glm::uvec3> triangles, std::span<const std::int32_t> triangle_object,
          std::size_t objects, glm::dvec3 origin_m);

  /// What build_bvh makes of an object's triangles in a frame with this origin; null: nothing that
  /// is still here.
  const Bvh* tree_of(std::size_t object, glm::dvec3 origin_m) const;

  /// The nearest hit with t_min < t < t_max of origin + t direction.
  ///
  /// motions  of the objects since they were placed; none: nothing has moved
  std::optional<RayHit> nearest(std::span<const Motion> motions, glm::dvec3 origin,
                                glm::dvec3 direction, double t_min, double t_max) const;

  /// Makes the boxes of an object anew after its vertices have moved. All as the constructor's.
  void refit(std::size_t object, std::span<const glm::dvec3> positions_m,
             std::span<const glm::vec3> normals, std::span<const glm::uvec3> triangles);

private:
  struct ObjectTree {
    Bvh bvh;
    bool is_refitted = false;
    std::size_t first_triangle = 0;
    std::vector<glm::vec3> normals;  // of the triangles' corners, three each
  };
  std::vector<ObjectTree> objects_;
  glm::dvec3 origin_m_;
};

// A tree over boxes, for rays that look for instances (kernels/scene/bvh.h).

/// Median split along the longest axis of the centres: a tree of n boxes has n - 1 nodes, the root
/// first, and is at most ceil(log2 n) nodes deep. Each leaf is one box: BvhNode's child is its
/// number. Boxes are rounded outwards.
///
/// boxes  none or one: no node
std::vector<device::BvhNode> build_box_tree(std::span<const Box> boxes);

}  // namespace raywave
