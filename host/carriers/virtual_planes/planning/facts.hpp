// SPDX-License-Identifier: Apache-2.0
/// Answers to host/carriers/planning/facts.hpp of virtual planes.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "host/plan/memory.hpp"

namespace raywave {

glm::ivec2 transformed_size(const VirtualPlanes& carrier, const Plan& plan);
double transform_operations(const VirtualPlanes& carrier, const Plan& plan, FftBackend fft);
double propagation_error_of(const VirtualPlanes& carrier, const Plan& plan);
void add_transform_memory(const VirtualPlanes& carrier, const Plan& plan, FftBackend fft,
                          MemoryNeeds& needs);
double gathering_bytes(const VirtualPlanes& carrier, const Plan& plan, double samples);
std::vector<std::pair<std::string, std::string>> report_rows(const VirtualPlanes& carrier,
                                                             const Plan& plan);
nlohmann::ordered_json report_json(const VirtualPlanes& carrier);
std::vector<std::string> warnings_of(const VirtualPlanes& carrier, const Plan& plan);

}  // namespace raywave
