// SPDX-License-Identifier: Apache-2.0
/// What the first picture takes besides: meshes and trees, and kernels that a driver has not
/// compiled yet.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "host/forecast/cost.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// Time that meshes and trees take, on a processor's core.
double meshes_and_trees_s(const World& world);

/// Time that drivers take for a plan's kernels; 0 where a render has had them compiled, as
/// remember_kernels has kept; empty where nothing is known.
std::optional<double> kernels_s(const Plan& plan, const DeviceFigures& device);

/// Keeps in the cache folder that the kernels of a plan are compiled, and how long that took.
///
/// wall_s, processor_s  RenderResult::seconds and processor_seconds: where other programs are at
///                      work, too, the latter tells more of compilers
void remember_kernels(const Plan& plan, const DeviceFigures& device,
                      const std::map<std::string, double>& wall_s,
                      const std::map<std::string, double>& processor_s);

}  // namespace raywave
