// SPDX-License-Identifier: Apache-2.0
/// Compile-time options that all kernels that gather samples share (kernels/gather/).
#pragma once

#include <string>

#include "cl/device.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/scene/scene.hpp"
#include "host/trace/samples.hpp"

namespace raywave {

// The kernel option for the precision of a plan.

/// The value of RAYWAVE_PRECISION (kernels/common/double_single.h).
///
/// throws  DeviceError when the device has no doubles
std::string precision_option(const cl::DeviceInfo& device, Precision precision);

/// Of the scene's options only those that gathering reads: scenes that differ only in others share
/// its kernels, which take the longest to compile.
inline cl::Options gather_options(const cl::Device& device, const Plan& plan,
                                  const DeviceScene& scene, const SampleTable& table, int frames,
                                  int tile_rows) {
  cl::Options options{{option::frames, std::to_string(frames)},
                      {option::precision, precision_option(device.info(), plan.precision)},
                      {option::tile_rows, std::to_string(tile_rows)},
                      {option::visibility_parts, std::to_string(table.visibility_parts)},
                      {option::paths, has_fitted_paths(plan) ? "1" : "0"},
                      {option::sine_limit, plan.beyond_diffraction ? "1" : "0"}};
  for (const auto& name : {option::lanes, option::lights, option::highlights})
    options[name] = scene.options.at(name);
  if (options[option::highlights] != "0") {
    for (const auto& name : {option::light_places, option::spots, option::sharp})
      options[name] = scene.options.at(name);
  }
  return options;
}

}  // namespace raywave
