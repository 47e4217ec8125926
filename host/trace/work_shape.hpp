// SPDX-License-Identifier: Apache-2.0
/// How pixels are shared out among work-items: one source of kernels, shaped for the device. Fields
/// depend on the shape by rounding only.
#pragma once

#include <string>

#include "cl/device.hpp"

namespace raywave {

/// DeviceInfo::work where it is measured; else, on CPUs, work-items of their SIMD width (PoCL
/// vectorises no divergent loop by itself) and many rows, strip by strip; on other devices one
/// pixel each.
cl::WorkShape work_shape(const cl::DeviceInfo& device);

/// A member of a shape with its name in files and messages.
struct WorkKnob {
  const char* name;
  int cl::WorkShape::*value;
};
inline constexpr WorkKnob work_knobs[] = {{"lanes", &cl::WorkShape::lanes},
                                          {"tile_rows", &cl::WorkShape::tile_rows},
                                          {"strip_tiles", &cl::WorkShape::strip_tiles}};

/// Why a device cannot work in this shape, a line that begins with the knob's name: "lanes: must be
/// 4, 8 or 16, got 3"; empty when it can. Packets of pixels are for CPUs, whose work-groups are
/// single work-items; there is no strip without packets, since work-groups of many work-items would
/// reach beyond it.
std::string why_unfit(const cl::WorkShape& shape, const cl::DeviceInfo& device);

/// Rows of pixels that a work-item fills of each frame.
int rows_of_tile(const cl::WorkShape& shape, int frames);

}  // namespace raywave
