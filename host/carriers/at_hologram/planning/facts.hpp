// SPDX-License-Identifier: Apache-2.0
/// Answers to host/carriers/planning/facts.hpp of gathering at the hologram, without a transform.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "host/geometry/shared_types.hpp"
#include "host/plan/memory.hpp"

namespace raywave {

inline glm::ivec2 transformed_size(const AtHologram&, const Plan& plan) {
  return plan.tiling.tile_size;
}
inline double transform_operations(const AtHologram&, const Plan&, FftBackend) { return 0; }
inline double propagation_error_of(const AtHologram&, const Plan&) { return 0; }
inline void add_transform_memory(const AtHologram&, const Plan&, FftBackend, MemoryNeeds&) {}
inline double gathering_bytes(const AtHologram&, const Plan&, double samples) {
  return (sizeof(device::ProjectedSample) + 16) * samples;
}
inline std::vector<std::pair<std::string, std::string>> report_rows(const AtHologram&,
                                                                    const Plan&) {
  return {};
}
inline nlohmann::ordered_json report_json(const AtHologram&) { return {}; }
inline std::vector<std::string> warnings_of(const AtHologram&, const Plan&) { return {}; }

}  // namespace raywave
