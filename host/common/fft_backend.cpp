// SPDX-License-Identifier: Apache-2.0
#include "host/common/fft_backend.hpp"

#include <algorithm>

namespace raywave {

std::size_t next_fast_size(std::size_t n) {
  constexpr std::size_t packet = 16;
  const auto is_fast = [](std::size_t m) {
    for (const std::size_t factor : {2u, 3u, 5u, 7u}) {
      while (m % factor == 0) m /= factor;
    }
    return m == 1;
  };
  const std::size_t step = n > 2 * packet ? packet : 1;
  std::size_t steps = std::max<std::size_t>(1, (n + step - 1) / step);
  while (!is_fast(steps)) ++steps;
  return steps * step;
}

}  // namespace raywave
