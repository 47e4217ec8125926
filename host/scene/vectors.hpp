// SPDX-License-Identifier: Apache-2.0
/// Vectors as files hold them, of any length and not always finite; curves between them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

namespace raywave {

template <int N, class T>
bool is_finite(const glm::vec<N, T>& v) {
  for (int i = 0; i < N; ++i)
    if (!std::isfinite(v[i])) return false;
  return true;
}

/// False for what is NaN, infinite or beyond floats: squares of areas fit into doubles.
inline bool is_position(const glm::dvec3& p) {
  constexpr double largest = std::numeric_limits<float>::max();
  return std::abs(p.x) <= largest && std::abs(p.y) <= largest && std::abs(p.z) <= largest;
}

/// `v` at unit length; zero when it is zero or not finite.
inline glm::dvec3 unit_or_zero(const glm::dvec3& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  // No square under- or overflows
  return largest > 0 && is_finite(v) ? glm::normalize(v / largest) : glm::dvec3(0);
}

/// The unit normal of a triangle, zero where it has no area. Scaled by the longest edge first, so
/// that no finite mesh under- or overflows.
inline glm::dvec3 face_normal(const std::array<glm::dvec3, 3>& p) {
  const glm::dvec3 a = p[1] - p[0], b = p[2] - p[0];
  const double longest = std::max(
      {std::abs(a.x), std::abs(a.y), std::abs(a.z), std::abs(b.x), std::abs(b.y), std::abs(b.z)});
  return longest > 0 ? unit_or_zero(glm::cross(a / longest, b / longest)) : glm::dvec3(0);
}

/// The corners of a triangle.
inline std::array<glm::dvec3, 3> corners_of(std::span<const glm::dvec3> positions,
                                            const glm::uvec3& t) {
  return {positions[t.x], positions[t.y], positions[t.z]};
}

/// Turns normals as `linear` turns surfaces, also where it has no inverse: the cofactor matrix.
inline glm::dmat3 cofactor_of(const glm::dmat3& linear) {
  return {glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
          glm::cross(linear[0], linear[1])};
}

/// Where a time lies among keys: at key k, or the share s of the way on to the next, `span` later.
struct PlaceInTime {
  std::size_t k = 0;
  double s = 0, span = 0;
};

/// Before the first key and after the last one, time stands still.
inline PlaceInTime place_among(const std::vector<double>& keys, double time) {
  if (time <= keys.front()) return {};
  if (time >= keys.back()) return {keys.size() - 1};
  const auto next = std::upper_bound(keys.begin(), keys.end(), time);
  const double span = *next - next[-1];
  return {static_cast<std::size_t>(next - keys.begin()) - 1, (time - next[-1]) / span, span};
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
