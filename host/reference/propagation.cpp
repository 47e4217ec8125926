// SPDX-License-Identifier: Apache-2.0
#include "host/reference/propagation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace raywave::reference {
namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

// Position of sample i of n along an axis that is centred on zero.
double position(int i, int n, double pitch) { return (i - (n - 1) / 2.0) * pitch; }

// Frequency of element k of a transform of n samples.
double frequency(int k, int n, double pitch) { return (k < (n + 1) / 2 ? k : k - n) / (n * pitch); }

// Transform of n samples, `stride` apart, by splitting off the smallest prime factor; roots: the
// n stride roots of unity.
void transform_strided(const Complex* in, int n, int stride, const Field& roots, Complex* out) {
  if (n == 1) {
    out[0] = in[0];
    return;
  }
  int p = 2;
  while (n % p != 0) ++p;
  const int m = n / p;
  Field parts(n);
  for (int r = 0; r < p; ++r)
    transform_strided(in + r * stride, m, stride * p, roots, parts.data() + r * m);
  for (int k = 0; k < n; ++k) {
    out[k] = 0;
    for (int r = 0; r < p; ++r)
      out[k] += parts[r * m + k % m] * roots[static_cast<long long>(r) * k % n * stride];
  }
}

void transform_plane(Field& plane, glm::ivec2 size, int sign) {
  Field line(size.x);
  for (int y = 0; y < size.y; ++y) {
    std::copy_n(plane.begin() + y * size.x, size.x, line.begin());
    transform(line, sign);
    std::copy_n(line.begin(), size.x, plane.begin() + y * size.x);
  }
  line.resize(size.y);
  for (int x = 0; x < size.x; ++x) {
    for (int y = 0; y < size.y; ++y) line[y] = plane[y * size.x + x];
    transform(line, sign);
    for (int y = 0; y < size.y; ++y) plane[y * size.x + x] = line[y];
  }
}

Field conjugate(Field field) {
  for (auto& f : field) f = std::conj(f);
  return field;
}

}  // namespace

void transform(Field& line, int sign) {
  const Field in = line;
  const auto n = static_cast<int>(in.size());
  Field roots(in.size());
  for (int k = 0; k < n; ++k) roots[k] = std::polar(1.0, sign * 2 * pi * k / n);
  transform_strided(in.data(), n, 1, roots, line.data());
}

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

Field shifted_angular_spectrum(const Field& source, const Setup& s, glm::ivec2 padded) {
  Field plane(static_cast<std::size_t>(padded.x) * padded.y);
  for (int y = 0; y < s.size.y; ++y)
    for (int x = 0; x < s.size.x; ++x) plane[y * padded.x + x] = source[y * s.size.x + x];
  transform_plane(plane, padded, -1);

  const double half_x = std::max(padded.x / 2.0, 1.0 * s.size.x) * s.pitch_m.x, z = s.distance_m;
  const double half_y = std::max(padded.y / 2.0, 1.0 * s.size.y) * s.pitch_m.y;
  for (int j = 0; j < padded.y; ++j) {
    const double v = -frequency(j, padded.y, s.pitch_m.y);  // rows count downwards, y upwards
    for (int i = 0; i < padded.x; ++i) {
      const double u = frequency(i, padded.x, s.pitch_m.x);
      const double w_squared = 1 / (s.wavelength_m * s.wavelength_m) - u * u - v * v;
      const double w = std::sqrt(std::max(w_squared, 0.0));
      const auto within = [&](double shift, double f, double half) {
        return z == 0 ? std::abs(shift) <= half
                      : w_squared > 0 && std::abs(shift - z * f / w) <= half;
      };
      // The steepest of an even number of frequencies is light to both sides
      const auto within_both = [&](double shift, double f, double half, int k, int n) {
        return within(shift, f, half) && (2 * k != n || within(shift, -f, half));
      };
      const bool kept = within_both(s.shift_m.x, u, half_x, i, padded.x) &&
                        within_both(s.shift_m.y, v, half_y, j, padded.y);
      const double turns = s.shift_m.x * u + s.shift_m.y * v + z * w;
      const double scale = kept ? 1 / (static_cast<double>(padded.x) * padded.y) : 0;
      plane[j * padded.x + i] *= std::polar(scale, 2 * pi * (turns - std::round(turns)));
    }
  }
  transform_plane(plane, padded, +1);

  Field target(source.size());
  for (int y = 0; y < s.size.y; ++y)
    for (int x = 0; x < s.size.x; ++x) target[y * s.size.x + x] = plane[y * padded.x + x];
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
