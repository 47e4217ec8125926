// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "host/forecast/presets.hpp"
#include "host/live/live_scene.hpp"

namespace raywave {

/// What a LiveScene is told of these scenes, which begin with the plan that a goal asks for.
LivePlanning planning_of(std::vector<Scene> scenes, Goal started, const cl::DeviceInfo& device);

}  // namespace raywave
