// SPDX-License-Identifier: Apache-2.0
/// Device memory that a plan takes.
#pragma once

#include <cstdint>
#include <vector>

#include "cl/buffer.hpp"
#include "host/mesh.hpp"
#include "host/plan.hpp"

namespace raywave {

/// Frames whose fields are held at the same time: as many as share one gathering and fit into half a gigabyte, one WRP's into one buffer.
int frames_together(const Scene& scene, const Plan& plan, std::uint64_t largest_buffer_bytes);

/// All but the surface samples, which only the device finds.
std::vector<cl::MemoryNeed> memory_needs(const Scene& scene, const World& world, const Plan& plan, Method method,
                                         std::uint64_t largest_buffer_bytes);

}  // namespace raywave
