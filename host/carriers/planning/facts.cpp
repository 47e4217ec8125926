// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/planning/facts.hpp"

#include <nlohmann/json.hpp>

#include "host/carriers/at_hologram/planning/facts.hpp"
#include "host/carriers/virtual_planes/planning/facts.hpp"
#include "host/carriers/wrps/planning/facts.hpp"

namespace raywave {
namespace {

template <class Question>
auto asked(const Plan& plan, const Question& question) {
  return std::visit(question, plan.carrier);
}

}  // namespace

WrpPropagation propagation_of(const Plan& plan) {
  return asked(plan, [](const auto& carrier) { return setting_of(carrier); });
}

std::string plane_name(const Plan& plan) {
  return asked(plan, [](const auto& carrier) { return plane_name(carrier); });
}

glm::ivec2 transformed_size(const Plan& plan) {
  return asked(plan, [&](const auto& carrier) { return transformed_size(carrier, plan); });
}

double transform_operations(const Plan& plan, FftBackend fft) {
  return asked(plan, [&](const auto& carrier) { return transform_operations(carrier, plan, fft); });
}

double propagation_error_of(const Plan& plan) {
  return asked(plan, [&](const auto& carrier) { return propagation_error_of(carrier, plan); });
}

void add_transform_memory(const Plan& plan, FftBackend fft, MemoryNeeds& needs) {
  asked(plan, [&](const auto& carrier) { add_transform_memory(carrier, plan, fft, needs); });
}

std::vector<std::pair<std::string, std::string>> report_rows(const Plan& plan) {
  return asked(plan, [&](const auto& carrier) { return report_rows(carrier, plan); });
}

void add_report(const Plan& plan, nlohmann::ordered_json& plan_report) {
  if (auto own = asked(plan, [](const auto& carrier) { return report_json(carrier); });
      !own.is_null())
    plan_report[name_of(propagation_of(plan))] = std::move(own);
}

std::vector<std::string> carrier_warnings(const Plan& plan) {
  return asked(plan, [&](const auto& carrier) { return warnings_of(carrier, plan); });
}

}  // namespace raywave
