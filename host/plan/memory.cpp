// SPDX-License-Identifier: Apache-2.0
#include "host/plan/memory.hpp"

#include <algorithm>
#include <numeric>

namespace raywave {

int frames_together(const Plan& plan, std::uint64_t largest_buffer_bytes) {
  if (!plan.samples.aimed) return 1;
  const double plane = 8.0 * static_cast<double>(plan.gathered_pixels()),
               half_a_gigabyte = 512.0 * 1024 * 1024;
  const double fitting = std::min(
      half_a_gigabyte /
          (plane * static_cast<double>(std::max<std::size_t>(plan.most_wrps_of_a_tile(), 1))),
      static_cast<double>(largest_buffer_bytes) / plane);
  return static_cast<int>(std::clamp(
      fitting, 1.0, static_cast<double>(std::min(plan.hologram.frames, most_frames_together))));
}

std::uint64_t MemoryNeeds::device_bytes() const {
  return std::accumulate(device.begin(), device.end(), std::uint64_t{0},
                         [](auto sum, const auto& need) { return sum + need.bytes; });
}

}  // namespace raywave
