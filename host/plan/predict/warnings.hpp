// SPDX-License-Identifier: Apache-2.0
/// Warnings about settings that a user may not have meant, before anything is computed.
#pragma once

#include <string>
#include <vector>

#include "host/plan/predict/front_view.hpp"
#include "host/plan/predict/slm_light.hpp"

namespace raywave {

/// A line each: what, how much, and which setting changes it.
std::vector<std::string> warnings_of(const Scene& scene, const World& world, const Plan& plan,
                                     const FrontView& view, const SlmLight& slm_light,
                                     double resolution_m);

}  // namespace raywave
