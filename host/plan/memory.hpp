// SPDX-License-Identifier: Apache-2.0
/// Memory that a plan takes, and plans that fit into what there is.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "cl/buffer.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// Frames whose fields are held at the same time: as many as share one gathering and fit into half
/// a gigabyte, one WRP's into one buffer.
int frames_together(const Plan& plan, std::uint64_t largest_buffer_bytes);

/// What there is.
struct MemoryLimits {
  static constexpr auto none = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t device_bytes = none, largest_buffer_bytes = none, host_bytes = none;
  bool device_on_host = true;  // the device's memory is the host's
};
MemoryLimits limits_of(const cl::DeviceInfo& device);

/// How a plan is carried out, as far as memory depends on it.
struct MemoryUse {
  Method method = Method::wrp;
  cl::FftBackend fft = cl::FftBackend::host;
  bool keep_field = true;  // at the hologram, in the host's memory
};

/// All but the surface samples, which only the device finds.
struct MemoryNeeds {
  std::vector<cl::MemoryNeed> device;
  // Beside what is on the device: what is returned, and transforms on the host
  std::uint64_t host_bytes = 0;

  std::uint64_t device_bytes() const;
};
MemoryNeeds memory_needs(const World& world, const Plan& plan, const MemoryUse& use,
                         std::uint64_t largest_buffer_bytes);

/// make_plan of the scene, where hologram.tiles is open in the fewest tiles whose needs leave an
/// eighth of what there is to the surface samples: sides are divided in turn, a tile's longer side
/// first, down to least_tile pixels. Where none fits, the last plan tried: what it needs says why.
Plan fitting_plan(const Scene& scene, const World& world, const MemoryLimits& limits,
                  const MemoryUse& use = {}, int rays_per_axis = 100, bool has_doubles = false);

/// Of a tile's longer side: smaller ones take more padding than they save.
inline constexpr int least_tile = 256;

}  // namespace raywave
