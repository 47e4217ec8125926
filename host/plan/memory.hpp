// SPDX-License-Identifier: Apache-2.0
/// Memory that a plan takes, and what there is.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "host/common/fft_backend.hpp"
#include "host/common/memory_need.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// Memory that there is.
struct MemoryLimits {
  static constexpr auto none = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t device_bytes = none, largest_buffer_bytes = none, host_bytes = none;
  bool device_on_host = true;  // the device's memory is the host's

  /// What one of several renderers may take that work at the same time.
  MemoryLimits for_one_of(int renderers) const {
    const auto part = [&](std::uint64_t bytes) {
      return bytes == none ? none : bytes / static_cast<std::uint64_t>(renderers);
    };
    return {part(device_bytes), largest_buffer_bytes, part(host_bytes), device_on_host};
  }
  /// What another device of the same machine has, too.
  MemoryLimits least(const MemoryLimits& other) const {
    return {std::min(device_bytes, other.device_bytes),
            std::min(largest_buffer_bytes, other.largest_buffer_bytes), host_bytes, device_on_host};
  }
};

/// How a plan is carried out, as far as memory depends on it.
struct MemoryUse {
  Method method = Method::wrp;
  FftBackend fft = FftBackend::host;
  bool keep_field = true;  // at the hologram, in the host's memory
  bool by_tile = false;    // each tile is a result of its own
};

/// All but the surface samples, which only the device finds.
struct MemoryNeeds {
  std::vector<MemoryNeed> device;
  // Beside what is on the device: what is returned, and transforms on the host
  std::uint64_t host_bytes = 0;
  std::uint64_t results_bytes = 0;  // of them, what is returned

  std::uint64_t device_bytes() const;
};

/// What to do where planes are too large.
inline constexpr const char* advice_for_planes =
    "a smaller hologram.resolution or wrp.padding, or more hologram.tiles, needs less";

/// Frames that one gathering makes, at most: rays, visibility and shading are shared.
inline constexpr int most_frames_together = 16;

/// Buffers of levels: while one is copied to the host, the next field is encoded into another.
inline constexpr std::size_t level_buffers = 2;

/// Samples whose light by parts of the window is made together.
inline constexpr std::size_t most_lit_together = 1 << 16;

/// Samples that a cell of the lattice has room for at first, and the most memory for the cells
/// whose samples are found together. A GPU waits for the slowest cell of each band.
inline constexpr int slots_of_cell = 4;
constexpr std::uint64_t most_band_bytes(bool on_processor) {
  return std::uint64_t{1} << (on_processor ? 26 : 30);
}

/// The most memory for profiles of samples that are gathered together; on processors over virtual
/// planes, so little that it stays in the cache between the kernels.
inline constexpr std::uint64_t most_profile_bytes = std::uint64_t{128} << 20,
                               most_cached_profile_bytes = std::uint64_t{4} << 20;

/// Frames whose fields are held at the same time: as many as share one gathering and fit into half
/// a gigabyte, one WRP's into one buffer.
int frames_together(const Plan& plan, std::uint64_t largest_buffer_bytes);

}  // namespace raywave
