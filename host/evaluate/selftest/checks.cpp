// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/selftest/checks.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace raywave::selftest {

void require_finite(std::span<const std::complex<float>> field, const char* what) {
  const auto bad = std::count_if(field.begin(), field.end(), [](auto z) {
    return !std::isfinite(z.real()) || !std::isfinite(z.imag());
  });
  if (bad > 0)
    throw std::runtime_error(std::string(what) + ": " + std::to_string(bad) +
                             " samples are NaN or infinite");
}

}  // namespace raywave::selftest
