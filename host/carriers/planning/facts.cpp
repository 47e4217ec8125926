// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/planning/facts.hpp"

#include <nlohmann/json.hpp>

#include "host/carriers/at_hologram/planning/facts.hpp"
#include "host/carriers/virtual_planes/planning/facts.hpp"
#include "host/carriers/wrps/planning/facts.hpp"

namespace raywave {

WrpPropagation propagation_of(const Plan& plan) {
  return std::visit([](const auto& carrier) { return carrier.setting; }, plan.carrier);
}

std::string plane_name(const Plan& plan) {
  return std::visit([](const auto& carrier) { return carrier.plane_name; }, plan.carrier);
}

glm::ivec2 transformed_size(const Plan& plan) {
  return std::visit([&](const auto& carrier) { return transformed_size(carrier, plan); },
                    plan.carrier);
}

double transform_operations(const Plan& plan, FftBackend fft) {
  return std::visit([&](const auto& carrier) { return transform_operations(carrier, plan, fft); },
                    plan.carrier);
}

double propagation_error_of(const Plan& plan) {
  return std::visit([&](const auto& carrier) { return propagation_error_of(carrier, plan); },
                    plan.carrier);
}

void add_transform_memory(const Plan& plan, FftBackend fft, MemoryNeeds& needs) {
  std::visit([&](const auto& carrier) { add_transform_memory(carrier, plan, fft, needs); },
             plan.carrier);
}

double gathering_bytes(const Plan& plan, double samples) {
  return std::visit([&](const auto& carrier) { return gathering_bytes(carrier, plan, samples); },
                    plan.carrier);
}

std::vector<std::pair<std::string, std::string>> report_rows(const Plan& plan) {
  return std::visit([&](const auto& carrier) { return report_rows(carrier, plan); }, plan.carrier);
}

void add_report(const Plan& plan, nlohmann::ordered_json& plan_report) {
  if (auto own = std::visit([](const auto& carrier) { return report_json(carrier); }, plan.carrier);
      !own.is_null())
    plan_report[name_of(propagation_of(plan))] = std::move(own);
}

std::vector<std::string> carrier_warnings(const Plan& plan) {
  return std::visit([&](const auto& carrier) { return warnings_of(carrier, plan); }, plan.carrier);
}

}  // namespace raywave
