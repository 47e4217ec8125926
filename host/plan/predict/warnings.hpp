// SPDX-License-Identifier: Apache-2.0
/// Warnings about settings that a user may not have meant, before anything is computed.
#pragma once

#include <string>
#include <vector>

#include "host/plan/predict/front_view.hpp"
#include "host/plan/predict/slm_light.hpp"

namespace raywave {

/// A line each: what, how much, and which setting changes it.
///
/// resolution_m      wanted_resolution_m
/// is_default_pitch  nobody chose sampling.pitch
std::vector<std::string> warnings_of(const Scene& scene, const World& world, const Plan& plan,
                                     const FrontView& view, const SlmLight& slm_light,
                                     double resolution_m, bool is_default_pitch);

/// A line where wrp.grid, as it is given, leaves parts of the scene out.
std::vector<std::string> cut_warnings(const Scene& scene, const World& world, const Plan& plan);

/// A line for objects so thin, as the hologram's centre sees them, that rays of the lattice miss
/// parts of them or all. Thinness is the area seen over the diagonal of its box.
std::vector<std::string> thin_object_warnings(const Scene& scene, const World& world,
                                              const Plan& plan);

}  // namespace raywave
