// SPDX-License-Identifier: Apache-2.0
#include "host/trace/device_limits.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace raywave {
namespace {

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

MemoryLimits limits_of(const cl::DeviceInfo& device) {
  return {device.memory_bytes, device.largest_buffer_bytes, host_memory_bytes(),
          device.kind == cl::DeviceKind::cpu};
}

}  // namespace raywave
