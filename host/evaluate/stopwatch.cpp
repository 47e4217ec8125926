// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/stopwatch.hpp"

#include <algorithm>
#include <cmath>

namespace raywave {

Spread spread_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  const auto at = [&](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    return std::lerp(values[below], values[std::min(below + 1, values.size() - 1)],
                     place - static_cast<double>(below));
  };
  return {at(0.5), at(0.25), at(0.75)};
}

}  // namespace raywave
