// SPDX-License-Identifier: Apache-2.0
/// Instances of the BVH: the tree and vertices of an instance stay on the device as they were
/// built, and rays are transformed into its frame (kernels/scene/bvh.h).
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "cl/program.hpp"
#include "host/geometry/bvh.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

// BVHs in device memory, and doubles as pairs of floats.

/// Trees in device memory, one for each instance.
struct DeviceTree {
  cl::Buffer<device::BvhNode> nodes;
  cl::Buffer<device::Triangle> triangles;
  cl::Buffer<float> positions;  // 3 per vertex, frame of its instance
  cl::Buffer<device::Instance> instances;
  // 3 per triangle (host/geometry/normal_cones.hpp); one element when nothing asks for them
  cl::Buffer<std::int32_t> neighbours{};

  bool has_neighbours() const { return neighbours.size() == 3 * triangles.size(); }

  /// TREE_PARAMETERS of kernels/scene/arrays.h, for cl::Kernel::run.
  auto arguments() const { return std::tie(nodes, triangles, positions, instances); }
};

/// An instance that has not moved; `root` is the node number of its tree's root.
device::Instance instance_at_rest(std::int32_t root = 0);

/// The value as the sum of two floats, the higher first.
inline std::pair<float, float> split(double value) {
  const auto high = static_cast<float>(value);
  return {high, static_cast<float>(value - high)};
}

/// Puts a vector into floats.
inline void put(const glm::dvec2& v, float& x, float& y) {
  x = static_cast<float>(v.x);
  y = static_cast<float>(v.y);
}
inline void put(const glm::dvec3& v, float& x, float& y, float& z) {
  put(glm::dvec2(v), x, y);
  z = static_cast<float>(v.z);
}

/// The tree of an instance, and what follows its leaves.
struct InstanceTree {
  Bvh bvh;                                  // with normal cones
  std::vector<device::Triangle> triangles;  // in leaf order
  std::vector<std::int32_t> neighbours;     // three for each; empty: nothing asks for them
};

/// A tree that has been refitted is built anew for a picture in which rays would take so many times
/// as long in it as when it was built, by surface_cost.
inline constexpr double most_refitted_cost = 2;

/// A scene's objects as instances: all objects that never moved share one instance of the BVH;
/// every object that has moved or deformed gets its own.
class Instances {
public:
  /// Uploads the vertices only.
  ///
  /// anchor_m  origin of the frames of all instances, world
  Instances(const cl::Device& device, const World& world, glm::dvec3 anchor_m, DeviceTree& tree,
            bool for_samples);

  /// Moves the instances as World::motions says. Trees are built on the first call and rebuilt when
  /// an object leaves the shared instance. Of an object whose vertices have changed
  /// (PlacedObject::version), the tree that was built first is refitted, or one is built for these
  /// vertices alone: a picture does not depend on those before it.
  ///
  /// returns  the objects whose vertices have changed since the last call
  std::vector<std::size_t> place(const World& world, const Plan& plan, DeviceTree& tree);

  /// The largest Bvh::depth so far: kernels compiled for it serve all trees.
  int depth() const { return depth_; }

private:
  void build_trees(const World& world, const Plan& plan, DeviceTree& tree);
  InstanceTree built(const World& world, const Plan& plan, std::size_t instance) const;
  void upload(const std::vector<const InstanceTree*>& shown, DeviceTree& tree);
  void deform(const World& world, const Plan& plan, const std::vector<std::size_t>& changed,
              DeviceTree& tree);
  std::vector<std::size_t> upload_changed(const World& world, DeviceTree& tree);

  cl::Device device_;
  glm::dvec3 anchor_m_;
  std::vector<std::int32_t> sides_;                // of the objects: device::Triangle::side
  std::vector<bool> apart_;                        // objects that have moved
  std::vector<std::uint64_t> versions_;            // of the objects' vertices on the device
  std::vector<std::vector<std::size_t>> objects_;  // of each instance
  // Where an object deforms, else empty: the trees as they were built, or refitted since; their
  // costs when they were built; those of the picture's vertices alone, in place of them
  std::vector<InstanceTree> trees_;
  std::vector<double> costs_;
  std::vector<std::optional<InstanceTree>> of_picture_;
  // Node number of each instance's root
  std::vector<std::int32_t> roots_;
  std::vector<device::BvhNode> root_nodes_;  // copies of the nodes at roots_
  bool for_samples_;                         // which ask for neighbours
  bool wants_neighbours_ = false;            // since trees were built
  int depth_ = 0;
};

}  // namespace raywave
