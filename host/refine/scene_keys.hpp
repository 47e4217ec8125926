// SPDX-License-Identifier: Apache-2.0
/// The pictures that a scene's hologram is refined towards: what a lens sees from planned places.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "host/plan/key_places.hpp"
#include "host/refine/refine.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {

/// Iterations per frame that so many pictures need.
int refine_iterations(const std::vector<RefineKey>& keys);

struct KeyPictures {
  std::optional<glm::dvec2> window_m;  // empty: what the WRPs cover
  int lens_points = 8;                 // per axis of the whole hologram; views take half of them
};

/// The pictures that a lens sees from the places.
///
/// progress  called with the picture at work and the completed share, 0 to 1, when given
RefineKey lens_key(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                   const KeyPlace& place, double blur_m, const KeyPictures& how,
                   const std::function<void(double)>& progress = {});

}  // namespace raywave
