// SPDX-License-Identifier: Apache-2.0
/// Vectors as mesh files hold them: of any length, and not always finite.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace raywave {

inline bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// `v` at unit length; zero when it is zero or not finite.
inline glm::dvec3 unit_or_zero(const glm::dvec3& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  // No square under- or overflows
  return largest > 0 && is_finite(v) ? glm::normalize(v / largest) : glm::dvec3(0);
}

}  // namespace raywave
