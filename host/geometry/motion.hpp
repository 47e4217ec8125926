// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <glm/common.hpp>
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

/// A box along the axes; as it is made, of nothing.
struct Box {
  glm::dvec3 min_m{INFINITY}, max_m{-INFINITY};

  void add(const glm::dvec3& p_m) { add({p_m, p_m}); }
  void add(const Box& other) {
    min_m = glm::min(min_m, other.min_m);
    max_m = glm::max(max_m, other.max_m);
  }
  glm::dvec3 size_m() const { return max_m - min_m; }
  glm::dvec3 centre_m() const { return min_m + 0.5 * size_m(); }
};

}  // namespace raywave
