// SPDX-License-Identifier: Apache-2.0
/// Fits a tree to moved triangles, on the device (kernels/fit.cl).
#pragma once

#include <utility>
#include <vector>

#include "cl/program.hpp"
#include "host/bvh.hpp"
#include "host/shared_types.hpp"

namespace raywave {

/// The arrays of a tree in device memory.
struct DeviceTree {
  cl::Buffer<device::BvhNode> nodes;
  cl::Buffer<device::Triangle> triangles;
  cl::Buffer<float> positions;  // 3 per vertex, scene frame
};

/// Boxes and BVH_AWAY of a tree whose vertices move. Which triangles share a leaf stays; a new tree is worth its time once
/// fitting makes boxes much larger.
class Fitter {
public:
  explicit Fitter(const cl::Device& device);

  /// The tree that is fitted from now on: its nodes go to the device; triangles, in its order, and positions are the caller's.
  void take(const Bvh& bvh, DeviceTree& tree);

  /// reach_m  the largest coordinate among the positions
  /// eye_m    the hologram's centre
  /// returns  boxes that a random ray through the scene meets: the surfaces of all, over that of the whole
  double fit(DeviceTree& tree, double reach_m, glm::vec3 eye_m);

private:
  cl::Device device_;
  cl::Kernel fit_tree_;
  cl::Buffer<std::int32_t> nodes_of_runs_, first_of_run_;
  cl::Buffer<float> surfaces_;
  std::vector<std::int32_t> first_run_of_pass_;
};

}  // namespace raywave
