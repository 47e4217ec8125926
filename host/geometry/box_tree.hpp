// SPDX-License-Identifier: Apache-2.0
/// A tree over boxes, for rays that look for instances (kernels/scene/bvh.h).
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "host/geometry/shared_types.hpp"

namespace raywave {

struct Box {
  glm::dvec3 min_m{0}, max_m{0};
};

/// Median split along the longest axis of the centres: a tree of n boxes has n - 1 nodes, the root
/// first, and is at most ceil(log2 n) nodes deep. Each leaf is one box: BvhNode's child is its
/// number. Boxes are rounded outwards.
///
/// boxes  none or one: no node
std::vector<device::BvhNode> build_box_tree(std::span<const Box> boxes);

}  // namespace raywave
