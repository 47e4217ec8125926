// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <tuple>

#include "cl/program.hpp"
#include "host/geometry/shared_types.hpp"

namespace raywave {

/// Trees in device memory, one for each instance.
struct DeviceTree {
  cl::Buffer<device::BvhNode> nodes;
  cl::Buffer<device::Triangle> triangles;
  cl::Buffer<float> positions;  // 3 per vertex, frame of its instance
  cl::Buffer<device::Instance> instances;

  /// TREE_PARAMETERS of kernels/scene/arrays.h, for cl::Kernel::run.
  auto arguments() const { return std::tie(nodes, triangles, positions, instances); }
};

/// A instance that has not moved, the root of its tree at node `root`.
device::Instance instance_at_rest(std::int32_t root = 0);

}  // namespace raywave
