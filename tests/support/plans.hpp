// SPDX-License-Identifier: Apache-2.0
/// The plan of a scene of one wavelength.
#pragma once

#include "host/forecast/presets.hpp"

namespace raywave::test {

inline Planned plan_scene(const Scene& scene, const World& world, const DeviceFigures& device = {},
                          const Goal& goal = {}, bool keep_field = true) {
  return plan_scenes({scene}, world, device, goal, keep_field)[0];
}

}  // namespace raywave::test
