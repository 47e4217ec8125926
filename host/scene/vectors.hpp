// SPDX-License-Identifier: Apache-2.0
/// Vectors as files hold them, of any length and not always finite; curves between them.
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

/// Hermite's cubic from `from` to `to`, s from 0 to 1. Slopes are of a parameter that grows by
/// `span`.
template <class Vector>
Vector hermite(const Vector& from, const Vector& slope_from, const Vector& to,
               const Vector& slope_to, double span, double s) {
  const double r = 1 - s;
  return r * r * (1 + 2 * s) * from + s * s * (1 + 2 * r) * to +
         span * s * r * (r * slope_from - s * slope_to);
}

}  // namespace raywave
