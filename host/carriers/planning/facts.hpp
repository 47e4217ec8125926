// SPDX-License-Identifier: Apache-2.0
/// What memory, forecasts and reports ask of the way in which a plan's light travels. Each way
/// answers in its own folder. What else depends on it asks Plan::carrier.
#pragma once

#include <glm/vec2.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/plan/memory.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// The value of wrp.propagation that asks for it; "spectrum" at the hologram.
WrpPropagation propagation_of(const Plan& plan);

/// Name of a plane that light is gathered on: "WRP", "virtual plane".
std::string plane_name(const Plan& plan);

/// Columns and rows of the planes that are transformed; of a tile where none is.
glm::ivec2 transformed_size(const Plan& plan);

/// Floating-point operations of the transforms of one frame.
double transform_operations(const Plan& plan, FftBackend fft);

/// Relative L2 error that propagation brings to the field at the hologram, predicted: what padding
/// or virtual planes leave wrong.
double propagation_error_of(const Plan& plan);

/// Adds what the transforms take, beside the planes that are gathered on.
void add_transform_memory(const Plan& plan, FftBackend fft, MemoryNeeds& needs);

/// Bytes on the device, about, that gathering the light of so many samples takes beside them.
double gathering_bytes(const Plan& plan, double samples);

/// Rows for `raywave plan`: a name, and what the planes and their errors are.
std::vector<std::pair<std::string, std::string>> report_rows(const Plan& plan);

/// Adds the same to the JSON of a plan, where there is more than all plans have.
void add_report(const Plan& plan, nlohmann::ordered_json& plan_report);

/// Lines for the user where much of the field is going to be wrong.
std::vector<std::string> carrier_warnings(const Plan& plan);

}  // namespace raywave
