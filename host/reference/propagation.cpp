// SPDX-License-Identifier: Apache-2.0
#include "host/reference/propagation.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace raywave::reference {
namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

// Position of sample i of n along an axis that is centred on zero.
double position(int i, int n, double pitch) { return (i - (n - 1) / 2.0) * pitch; }

Field conjugate(Field field) {
  for (auto& f : field) f = std::conj(f);
  return field;
}

}  // namespace

Field rayleigh_sommerfeld(const Field& source, const Setup& s, const std::vector<int>& rows) {
  if (s.distance_m < 0) {
    Setup mirrored = s;
    mirrored.distance_m = -s.distance_m;
    return conjugate(rayleigh_sommerfeld(conjugate(source), mirrored, rows));
  }
  std::vector<int> wanted = rows;
  for (int y = 0; rows.empty() && y < s.size.y; ++y) wanted.push_back(y);

  const double z = s.distance_m, k = 2 * pi / s.wavelength_m;
  Field target;
  for (const int ty : wanted) {
    for (int tx = 0; tx < s.size.x; ++tx) {
      const double x = s.shift_m.x + position(tx, s.size.x, s.pitch_m.x);
      // Rows count downwards, y upwards
      const double y = s.shift_m.y - position(ty, s.size.y, s.pitch_m.y);
      Complex sum = 0;
      for (int sy = 0; sy < s.size.y; ++sy) {
        for (int sx = 0; sx < s.size.x; ++sx) {
          const double dx = x - position(sx, s.size.x, s.pitch_m.x),
                       dy = y + position(sy, s.size.y, s.pitch_m.y);
          const double r = std::sqrt(dx * dx + dy * dy + z * z);
          sum += source[sy * s.size.x + sx] * std::polar(z / (2 * pi * r * r), k * r) *
                 Complex(1 / r, -k);
        }
      }
      target.push_back(sum * s.pitch_m.x * s.pitch_m.y);
    }
  }
  return target;
}

Field direct_transform(const Field& plane, glm::ivec2 size, int sign) {
  const auto axis = [&](const Field& in, int n, int count, int stride, int distance) {
    Field factor(n), out(in.size());
    for (int i = 0; i < n; ++i) factor[i] = std::polar(1.0, sign * 2 * pi * i / n);
    for (int line = 0; line < count; ++line) {
      for (int u = 0; u < n; ++u) {
        Complex sum = 0;
        for (int x = 0; x < n; ++x)
          sum += in[line * distance + x * stride] * factor[static_cast<long long>(x) * u % n];
        out[line * distance + u * stride] = sum;
      }
    }
    return out;
  };
  return axis(axis(plane, size.x, size.y, 1, size.x), size.y, size.x, size.x, 1);
}

std::vector<std::complex<float>> noise(glm::ivec2 size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<std::complex<float>> field(static_cast<std::size_t>(size.x) * size.y);
  for (auto& f : field) f = {normal(random), normal(random)};
  return field;
}

Field beam(const Setup& s, double waist_m, glm::dvec2 sine) {
  Field field;
  for (int j = 0; j < s.size.y; ++j) {
    for (int i = 0; i < s.size.x; ++i) {
      const double x = position(i, s.size.x, s.pitch_m.x), y = -position(j, s.size.y, s.pitch_m.y);
      field.push_back(std::polar(std::exp(-(x * x + y * y) / (waist_m * waist_m)),
                                 2 * pi / s.wavelength_m * (sine.x * x + sine.y * y)));
    }
  }
  return field;
}

double relative_error(const Field& a, const Field& b) {
  double difference = 0, size = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference += std::norm(a.at(i) - b[i]);
    size += std::norm(b[i]);
  }
  return std::sqrt(difference / size);
}

Field to_double(const std::vector<std::complex<float>>& field) {
  return {field.begin(), field.end()};
}

std::vector<std::complex<float>> to_float(const Field& field) {
  std::vector<std::complex<float>> result;
  result.reserve(field.size());
  for (const auto& f : field) result.emplace_back(f);
  return result;
}

}  // namespace raywave::reference
