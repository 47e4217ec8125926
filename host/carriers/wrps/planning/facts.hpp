// SPDX-License-Identifier: Apache-2.0
/// Answers to host/carriers/planning/facts.hpp of WRPs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "host/plan/memory.hpp"
#include "host/plan/padded_plane.hpp"

namespace raywave {

glm::ivec2 transformed_size(const SpectrumWrps& carrier, const Plan& plan);
double transform_operations(const SpectrumWrps& carrier, const Plan& plan, FftBackend fft);
double propagation_error_of(const SpectrumWrps& carrier, const Plan& plan);
void add_transform_memory(const SpectrumWrps& carrier, const Plan& plan, FftBackend fft,
                          MemoryNeeds& needs);
double gathering_bytes(const SpectrumWrps& carrier, const Plan& plan, double samples);
std::vector<std::pair<std::string, std::string>> report_rows(const SpectrumWrps& carrier,
                                                             const Plan& plan);
nlohmann::ordered_json report_json(const SpectrumWrps& carrier);
std::vector<std::string> warnings_of(const SpectrumWrps& carrier, const Plan& plan);

/// Rows of the padded plane that the band keeps of a WRP.
Band rows_kept(const SpectrumWrps& wrps, const Plan& plan, const Wrp& wrp);

}  // namespace raywave
