// SPDX-License-Identifier: Apache-2.0
/// Memory that a plan takes, and plans that fit into what there is.
#pragma once

#include <cstdint>
#include <string>

#include "host/geometry/world.hpp"
#include "host/plan/memory.hpp"

namespace raywave {

/// All that is to be allocated but for the surface samples.
MemoryNeeds memory_needs(const World& world, const Plan& plan, const MemoryUse& use,
                         std::uint64_t largest_buffer_bytes);

/// What so many surface samples take on the device.
double bytes_of_samples(const Plan& plan, double samples);

/// The most that the process of a render holds at a time, resident: program and drivers, the scene,
/// results, and what is computed with or written.
///
/// results_bytes  of all lasers
/// device_bytes   of this one, surface samples included, where they lie in the host's memory
/// compiles       whether a processor's driver compiles the kernels
std::uint64_t host_peak_bytes(const World& world, const Plan& plan, const MemoryNeeds& needs,
                              std::uint64_t results_bytes, std::uint64_t device_bytes,
                              bool compiles);

/// A line that tells that results alone are too much for the host's memory, however the hologram is
/// divided, and what to do; empty where they fit.
std::string results_shortage(const Plan& plan, const MemoryNeeds& needs, const MemoryUse& use,
                             const MemoryLimits& limits);

/// The same for all that lies in the host's memory.
std::string host_shortage(const Plan& plan, const MemoryNeeds& needs, const MemoryLimits& limits);

/// A line that tells what is short where more tiles help: an eighth of the memory is left to the
/// surface samples. Empty where the plan fits, and where tiles cannot help.
std::string shortage_of_division(const World& world, const Plan& plan, const MemoryUse& use,
                                 const MemoryLimits& limits);

}  // namespace raywave
