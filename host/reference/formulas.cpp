// SPDX-License-Identifier: Apache-2.0
#include "host/reference/formulas.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace raywave::reference {

double texture_at(const Image& image, glm::dvec2 uv, int channel) {
  const auto texels = image.channel(channel);
  const double x = uv.x * image.width - 0.5, y = (1 - uv.y) * image.height - 0.5;
  const auto texel = [&](double column, double row) {
    const auto wrapped = [](double i, int n) {
      return static_cast<std::size_t>(i - n * std::floor(i / n));
    };
    return static_cast<double>(
        texels[wrapped(row, image.height) * image.width + wrapped(column, image.width)]);
  };
  const double left = std::floor(x), top = std::floor(y);
  double sum = 0;
  for (const double column : {left, left + 1})
    for (const double row : {top, top + 1})
      sum += (1 - std::abs(x - column)) * (1 - std::abs(y - row)) * texel(column, row);
  return sum;
}

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
