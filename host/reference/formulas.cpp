// SPDX-License-Identifier: Apache-2.0
#include "host/reference/formulas.hpp"

#include <algorithm>
#include <cmath>

namespace raywave::reference {

double power_of_cosine(double cosine, double exponent) {
  if (cosine <= 0) return exponent == 0 ? 1 : 0;
  return std::pow(std::min(cosine, 1.0), exponent);
}

double phase_turns(std::int32_t i, std::int32_t j, std::int32_t k, std::uint32_t seed) {
  const auto x = static_cast<std::uint32_t>(i), y = static_cast<std::uint32_t>(j),
             z = static_cast<std::uint32_t>(k);
  std::uint32_t h = x * 0x9e3779b1u ^ (y * 0x85ebca77u + 0x165667b1u);
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h ^= z * 0xc2b2ae3du;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  return phase_turns_of_key(h ^ (h >> 15), seed);
}

double phase_turns_of_key(std::uint32_t key, std::uint32_t seed) {
  std::uint32_t h = (key ^ (seed * 0x9e3779b9u)) * 0x846ca68bu;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h ^= h >> 15;
  return (h >> 8) * 0x1p-24;
}

}  // namespace raywave::reference
