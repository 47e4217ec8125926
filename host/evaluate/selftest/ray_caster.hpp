// SPDX-License-Identifier: Apache-2.0
/// Arrays of rays against a tree on a device (kernels/instruments/intersect.cl): what tests and the
/// self-test hold against brute force.
#pragma once

#include <span>
#include <vector>

#include "cl/program.hpp"
#include "host/geometry/bvh.hpp"
#include "host/reference/rays.hpp"
#include "host/trace/device_tree.hpp"

namespace raywave::selftest {

/// A tree and its triangles, none of which shares a vertex.
DeviceTree upload(const cl::Device& device, const Bvh& bvh);

class RayCaster {
public:
  /// lanes  1, 4, 8 or 16
  /// depth  of the device's stack, at least the tree's
  RayCaster(const cl::Device& device, int lanes, const Bvh& bvh, int depth = 32);
  RayCaster(const cl::Device& device, int lanes, DeviceTree tree, int depth = 32);

  /// Hits as the device found them (t_uncertainty stays 0); a miss has t = t_max. Rays are rounded
  /// to float.
  std::vector<reference::Hit> nearest(std::span<const reference::Ray> rays);

  /// 1 where anything lies in (t_min, t_max), else 0.
  std::vector<int> occluded(std::span<const reference::Ray> rays);

private:
  cl::Device device_;
  std::size_t lanes_;
  cl::Program program_;
  DeviceTree tree_;
};

}  // namespace raywave::selftest
