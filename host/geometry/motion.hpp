// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace raywave {

/// A similarity transform: from where place_objects put an object to where it is now.
struct Motion {
  glm::dmat3 turn{1};
  double scale = 1;
  glm::dvec3 from_m{0}, to_m{0};  // `from_m` comes to `to_m`
  bool moved = false;             // otherwise every position stays as it is, bit for bit

  glm::dvec3 operator()(const glm::dvec3& p_m) const {
    return moved ? to_m + scale * (turn * (p_m - from_m)) : p_m;
  }
};

}  // namespace raywave
