// SPDX-License-Identifier: Apache-2.0
/// Warnings about settings that a user may not have meant, before anything is computed.
#pragma once

#include <string>
#include <vector>

#include "host/forecast/slm_light.hpp"
#include "host/plan/front_view.hpp"

namespace raywave {

bool is_default_pitch(const Scene& scene);

/// A line each: what, how much, and which setting changes it.
///
/// Of several lasers, each has the same advice, which serves all: that of the shortest wavelength,
/// whose light is the steepest.
///
/// is_default_pitch  nobody chose sampling.pitch
std::vector<std::string> warnings_of(const Scene& scene, const World& world, const Plan& plan,
                                     const FrontView& view, const SlmLight& slm_light,
                                     bool is_default_pitch);

/// The same of a plan that is computed as it is.
std::vector<std::string> warnings_of(const Scene& scene, const World& world, const Plan& plan);

}  // namespace raywave
