// SPDX-License-Identifier: Apache-2.0
/// Memory that a plan takes, and plans that fit into what there is.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "host/common/fft_backend.hpp"
#include "host/common/memory_need.hpp"
#include "host/geometry/world.hpp"
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
};

/// Frames that one gathering makes, at most: rays, visibility and shading are shared.
inline constexpr int most_frames_together = 16;

/// Buffers of levels: while one is copied to the host, the next field is encoded into another.
inline constexpr std::size_t level_buffers = 2;

/// Frames whose fields are held at the same time: as many as share one gathering and fit into half
/// a gigabyte, one WRP's into one buffer.
int frames_together(const Plan& plan, std::uint64_t largest_buffer_bytes);

/// How a plan is carried out, as far as memory depends on it.
struct MemoryUse {
  Method method = Method::wrp;
  FftBackend fft = FftBackend::host;
  bool keep_field = true;  // at the hologram, in the host's memory
};

/// All but the surface samples, which only the device finds.
struct MemoryNeeds {
  std::vector<MemoryNeed> device;
  // Beside what is on the device: what is returned, and transforms on the host
  std::uint64_t host_bytes = 0;
  std::uint64_t results_bytes = 0;  // of them, what is returned

  std::uint64_t device_bytes() const;
};
MemoryNeeds memory_needs(const World& world, const Plan& plan, const MemoryUse& use,
                         std::uint64_t largest_buffer_bytes);

/// A line that tells that results alone are too much for the host's memory, however the hologram is
/// divided, and what to do; empty where they fit.
std::string results_shortage(const Plan& plan, const MemoryNeeds& needs, const MemoryUse& use,
                             const MemoryLimits& limits);

/// The same for all that lies in the host's memory.
std::string host_shortage(const Plan& plan, const MemoryNeeds& needs, const MemoryLimits& limits);

/// make_plan of the scene. Where hologram.tiles is open, the plan has the fewest tiles whose needs
/// leave an eighth of the memory to the surface samples: sides are divided in turn, a tile's longer
/// side first, down to least_tile pixels. Where no division fits, it is the last plan tried, whose
/// needs tell why; that in one piece where results or triangles alone are too much.
Plan fitting_plan(const Scene& scene, const World& world, const MemoryLimits& limits,
                  const MemoryUse& use = {}, int rays_per_axis = 100, bool has_doubles = false);

/// A plan from which make_plan, as from `moved_from`, goes on to every pose of a scene that moves:
/// its tiles fit into the memory that each pose needs, and its propagation and depth layers serve
/// all of them. So the plan of a pose does not depend on the poses before it.
///
/// poses    >= 1
/// move_to  moves scene and world to a pose; they are left at the last one
/// throws   as make_plan, what `move_to` throws, and InputError when no plan serves all poses
Plan fitting_plan_of_poses(Scene& scene, World& world, int poses,
                           const std::function<void(int pose)>& move_to, const MemoryLimits& limits,
                           const MemoryUse& use = {}, int rays_per_axis = 100,
                           bool has_doubles = false);

}  // namespace raywave
