// SPDX-License-Identifier: Apache-2.0
#include "host/propagate/double_propagation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace raywave::in_double {
namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

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

}  // namespace

void transform(Field& line, int sign) {
  const Field in = line;
  const auto n = static_cast<int>(in.size());
  Field roots(in.size());
  for (int k = 0; k < n; ++k) roots[k] = std::polar(1.0, sign * 2 * pi * k / n);
  transform_strided(in.data(), n, 1, roots, line.data());
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

}  // namespace raywave::in_double
