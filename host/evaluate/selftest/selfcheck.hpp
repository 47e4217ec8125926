// SPDX-License-Identifier: Apache-2.0
/// Errors of a device's arithmetic and struct layout, measured with
/// kernels/instruments/selfcheck.cl.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "cl/program.hpp"
#include "host/geometry/bvh.hpp"
#include "host/reference/rays.hpp"
#include "host/trace/instances.hpp"

namespace raywave::selftest {

/// Units, and the red laser and the SLM of the checks.
constexpr double nm = 1e-9, um = 1e-6, mm = 1e-3, red_m = 638e-9, slm_m = 3.74e-6;

/// Stated in kernels/common/phase.h.
constexpr double cos_sin_bound = 1.7e-7;

/// Largest distance of the device's cosines and sines of 2 pi turns from the C library's in double.
/// NaN when any is NaN.
double cos_sin_error(const cl::Device& device, int lanes, std::span<const float> turns);

/// cos_sin_error over every float in [-0.5, 0.5]: 2.1 thousand million. Since arguments are reduced
/// exactly first, this holds for all |turns| < 2^22.
double cos_sin_error_everywhere(const cl::Device& device, int lanes);

/// A hundred thousand arguments up to 0.75 turns, evenly spread and near zero, with those where
/// folds meet and the largest there may be.
std::vector<float> cos_sin_arguments();

/// Members of shared structs ("Sample.key") that the device places elsewhere than the host.
std::vector<std::string> misplaced_members(const cl::Device& device);

// Arrays of rays against a tree on a device (kernels/instruments/intersect.cl): what tests and the
// self-test hold against brute force.

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
