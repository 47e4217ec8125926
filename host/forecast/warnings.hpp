// SPDX-License-Identifier: Apache-2.0
/// Warnings about settings that a user may not have meant, before anything is computed.
#pragma once

#include <string>
#include <vector>

#include "host/forecast/slm_light.hpp"
#include "host/plan/front_view.hpp"

namespace raywave {

bool is_default_pitch(const Scene& scene);

/// A line where a picture that reaches to near_m lies behind the eye, or nearer than it focuses;
/// else empty.
std::string eye_distance_warning(const ViewerSpec& viewer, double near_m);

/// Those of warnings_of that tell what of the scene a viewer sees at all; shares are coarser.
std::vector<std::string> preview_warnings(const Scene& scene, const World& world, const Plan& plan);

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
