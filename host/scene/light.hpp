// SPDX-License-Identifier: Apache-2.0
/// The lights of a scene.
#pragma once

#include <glm/vec3.hpp>

namespace raywave {

enum class LightType { ambient, directional, point };

struct Light {
  LightType type = LightType::directional;
  // Direction in which light travels, of any length > 0; directional only
  glm::dvec3 direction{0, 0, 1};
  // Point only; a point light does not weaken with distance (as in Phong's model)
  glm::dvec3 position_m{0};
  double intensity = 1.0;  // >= 0
};

/// Lights of a scene besides ambient ones, at most.
inline constexpr int most_lights = 1024;

}  // namespace raywave
