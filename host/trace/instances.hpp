// SPDX-License-Identifier: Apache-2.0
/// What moves as one: its tree and vertices stay on the device as they were made, rays are turned
/// to it (kernels/scene/bvh.h).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/device_tree.hpp"

namespace raywave {

/// A scene's objects as instances: those that have not moved since the world was made are one, each of
/// the others is one of its own.
class Instances {
public:
  /// The vertices go to the device, nothing else yet.
  ///
  /// anchor_m  origin of the frames of all instances, world
  Instances(const cl::Device& device, const World& world, glm::dvec3 anchor_m, DeviceTree& tree);

  /// The instances where World::motions have them now. Trees are built the first time, and where
  /// objects part that were one instance.
  void place(const World& world, const Plan& plan, DeviceTree& tree);

  /// Bvh::depth of the deepest tree there has been: kernels made for it serve all.
  int depth() const { return depth_; }

private:
  void build_trees(const World& world, const Plan& plan, DeviceTree& tree);

  cl::Device device_;
  glm::dvec3 anchor_m_;
  std::vector<std::int32_t> sides_;                // of the objects: device::Triangle::side
  std::vector<bool> apart_;                        // objects that have moved
  std::vector<std::vector<std::size_t>> objects_;  // of each instance
  // Of each instance: the place of its tree's root among the nodes
  std::vector<std::int32_t> roots_;
  std::vector<device::BvhNode> root_nodes_;  // these nodes
  int depth_ = 0;
};

}  // namespace raywave
