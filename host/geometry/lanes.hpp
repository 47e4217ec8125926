// SPDX-License-Identifier: Apache-2.0
/// Numbers and places side by side, in loops that the compiler makes vectors of.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "host/geometry/motion.hpp"

// For loops that frames of moving scenes wait for: the binary is not built for the CPU that it runs
// on. Results are the same on all, where nothing is contracted.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define RAYWAVE_FOR_SEVERAL_CPUS [[gnu::target_clones("avx512f", "avx2", "default")]]
#else
#define RAYWAVE_FOR_SEVERAL_CPUS
#endif

namespace raywave {

struct Lanes {
  static constexpr std::size_t count = 8;
  double v[count];
  Lanes() = default;
  explicit Lanes(double value) { std::fill_n(v, count, value); }
  double largest() const { return *std::max_element(v, v + count); }
  double sum() const {
    double all = 0;
    for (const double one : v) all += one;
    return all;
  }
};

struct Places {
  Lanes at_m[3];  // x, y, z

  void set(std::size_t lane, const glm::dvec3& p_m) {
    for (int axis = 0; axis < 3; ++axis) at_m[axis].v[lane] = p_m[axis];
  }
  glm::dvec3 get(std::size_t lane) const {
    return {at_m[0].v[lane], at_m[1].v[lane], at_m[2].v[lane]};
  }
  void move(const Motion& motion) {
    if (!motion.moved) return;
    for (std::size_t i = 0; i < Lanes::count; ++i) {
      const double x = at_m[0].v[i] - motion.from_m.x, y = at_m[1].v[i] - motion.from_m.y,
                   z = at_m[2].v[i] - motion.from_m.z;
      for (int axis = 0; axis < 3; ++axis)
        at_m[axis].v[i] = motion.to_m[axis] +
                          motion.scale * (motion.turn[0][axis] * x + motion.turn[1][axis] * y +
                                          motion.turn[2][axis] * z);
    }
  }
};

/// Puts at(0), ..., at(count - 1) side by side, the last of them also where some are missing to
/// whole lanes. `count` is at least 1.
template <class At>
std::span<Places> side_by_side(std::size_t count, const At& at, std::span<Places> places) {
  const auto groups = (count + Lanes::count - 1) / Lanes::count;
  for (std::size_t i = 0; i < groups * Lanes::count; ++i)
    places[i / Lanes::count].set(i % Lanes::count, at(std::min(i, count - 1)));
  return places.first(groups);
}

}  // namespace raywave
