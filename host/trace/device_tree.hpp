// SPDX-License-Identifier: Apache-2.0
/// BVHs in device memory, and doubles as pairs of floats.
#pragma once

#include <cstdint>
#include <tuple>
#include <utility>

#include "cl/program.hpp"
#include "host/geometry/shared_types.hpp"

namespace raywave {

/// Trees in device memory, one for each instance.
struct DeviceTree {
  cl::Buffer<device::BvhNode> nodes;
  cl::Buffer<device::Triangle> triangles;
  cl::Buffer<float> positions;  // 3 per vertex, frame of its instance
  cl::Buffer<device::Instance> instances;
  // 3 per triangle (host/geometry/neighbours.hpp); one element when nothing asks for them
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

}  // namespace raywave
