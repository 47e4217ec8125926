// SPDX-License-Identifier: Apache-2.0
#include "host/plan/cone.hpp"

#include <algorithm>
#include <cmath>

namespace raywave {
double Cone::passed(double at) const {
  const double inside = half_width - std::abs(at);
  if (apodization <= 0) return inside >= 0 ? 1 : 0;
  const double e = std::clamp(inside / apodization, 0.0, 1.0);
  return e * e * (3 - 2 * e);
}

double Cone::field_error() const {
  constexpr int places = 1024;
  double first = 0, second = 0;  // means of what passes, and of its square
  for (int i = 0; i < places; ++i) {
    const double share = passed((i + 0.5) / places);
    first += share / places;
    second += share * share / places;
  }
  return std::sqrt(std::max(0.0, 1 - 2 * first * first + second * second));
}

}  // namespace raywave
