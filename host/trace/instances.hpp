// SPDX-License-Identifier: Apache-2.0
/// Instances of the BVH: the tree and vertices of an instance stay on the device as they were
/// built, and rays are transformed into its frame (kernels/scene/bvh.h).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/device_tree.hpp"

namespace raywave {

/// A scene's objects as instances: all objects that never moved share one instance of the BVH;
/// every object that has moved gets its own.
class Instances {
public:
  /// Uploads the vertices only.
  ///
  /// anchor_m  origin of the frames of all instances, world
  Instances(const cl::Device& device, const World& world, glm::dvec3 anchor_m, DeviceTree& tree);

  /// Moves the instances as World::motions says. Trees are built on the first call and rebuilt when
  /// an object leaves the shared instance.
  void place(const World& world, const Plan& plan, DeviceTree& tree);

  /// The largest Bvh::depth so far: kernels compiled for it serve all trees.
  int depth() const { return depth_; }

private:
  void build_trees(const World& world, const Plan& plan, DeviceTree& tree);

  cl::Device device_;
  glm::dvec3 anchor_m_;
  std::vector<std::int32_t> sides_;                // of the objects: device::Triangle::side
  std::vector<bool> apart_;                        // objects that have moved
  std::vector<std::vector<std::size_t>> objects_;  // of each instance
  // Node number of each instance's root
  std::vector<std::int32_t> roots_;
  std::vector<device::BvhNode> root_nodes_;  // copies of the nodes at roots_
  int depth_ = 0;
};

}  // namespace raywave
