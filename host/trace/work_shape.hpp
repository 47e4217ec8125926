// SPDX-License-Identifier: Apache-2.0
/// The work shape: how pixels are distributed over work-items. All devices use the same kernel
/// sources. Fields depend on the shape by rounding only.
#pragma once

#include <string>

#include "cl/device.hpp"
#include "host/plan/memory.hpp"

namespace raywave {

/// DeviceInfo::work when it is set, a default otherwise. On CPUs a work-item handles a packet of
/// SIMD width (PoCL does not vectorise divergent loops) and many rows, strip by strip. On other
/// devices it handles one pixel.
cl::WorkShape work_shape(const cl::DeviceInfo& device);

/// A member of WorkShape and its name in files and messages.
struct WorkKnob {
  const char* name;
  int cl::WorkShape::*value;
};
inline constexpr WorkKnob work_knobs[] = {{"lanes", &cl::WorkShape::lanes},
                                          {"tile_rows", &cl::WorkShape::tile_rows},
                                          {"strip_tiles", &cl::WorkShape::strip_tiles}};

/// The reason why a device cannot use this shape, a line that begins with the knob's name: "lanes:
/// must be 4, 8 or 16, got 3"; empty when it can. Packets are for CPUs, where a work-group is one
/// work-item. Strips need packets: a work-group of many work-items would extend beyond a strip.
std::string why_unfit(const cl::WorkShape& shape, const cl::DeviceInfo& device);

/// Rows of pixels that a work-item computes in each frame.
int rows_of_tile(const cl::WorkShape& shape, int frames);

// Memory that a device and this machine have.

/// Memory of the device and of this machine, or of its container when that has less.
MemoryLimits limits_of(const cl::DeviceInfo& device);

}  // namespace raywave
