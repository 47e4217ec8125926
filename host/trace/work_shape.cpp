// SPDX-License-Identifier: Apache-2.0
#include "host/trace/work_shape.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace raywave {
namespace {

int lanes_of_kind(const cl::DeviceInfo& device) {
  for (const int lanes : {16, 8, 4}) {
    if (device.float_lanes >= lanes) return lanes;
  }
  return 1;
}

/// Memory that this process may use: that of the machine, or the limit of its container when that
/// is less.
std::uint64_t host_memory_bytes() {
  auto bytes = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
               static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
  std::uint64_t limit = 0;
  // The file holds "max" when there is no limit: reading fails then.
  if (std::ifstream("/sys/fs/cgroup/memory.max") >> limit) bytes = std::min(bytes, limit);
  return bytes;
}

}  // namespace

cl::WorkShape work_shape(const cl::DeviceInfo& device) {
  if (device.work) return *device.work;
  const int lanes = lanes_of_kind(device);
  // 16 rows: many pixels share the set-up of a sample, and all sums fit the first-level cache.
  // 8 tiles per strip: the profiles that a strip needs fit the second-level cache.
  return lanes == 1 ? cl::WorkShape{1, 1, 0} : cl::WorkShape{lanes, 16, 8};
}

std::string why_unfit(const cl::WorkShape& shape, const cl::DeviceInfo& device) {
  const bool packets = lanes_of_kind(device) > 1;
  const auto unfit = [](const char* knob, const std::string& wanted, int got) {
    return std::string(knob) + ": must be " + wanted + ", got " + std::to_string(got);
  };
  if (packets ? shape.lanes != 4 && shape.lanes != 8 && shape.lanes != 16 : shape.lanes != 1)
    return unfit("lanes", packets ? "4, 8 or 16" : "1 on a device without packets", shape.lanes);
  const int least = packets ? 2 : 1, most = packets ? 64 : 16;
  if (shape.tile_rows < least || shape.tile_rows > most)
    return unfit("tile_rows", std::to_string(least) + " to " + std::to_string(most),
                 shape.tile_rows);
  if (packets ? shape.strip_tiles < 1 || shape.strip_tiles > 1024 : shape.strip_tiles != 0)
    return unfit("strip_tiles", packets ? "1 to 1024" : "0 on a device without packets",
                 shape.strip_tiles);
  return "";
}

int rows_of_tile(const cl::WorkShape& shape, int frames) {
  return std::max(std::min(shape.tile_rows, 2), shape.tile_rows / frames);
}

MemoryLimits limits_of(const cl::DeviceInfo& device) {
  return {device.memory_bytes, device.largest_buffer_bytes, host_memory_bytes(),
          device.kind == cl::DeviceKind::cpu};
}

}  // namespace raywave
