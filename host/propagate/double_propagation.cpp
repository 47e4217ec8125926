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
  // Of part r, frequency k takes root r k: no division, which would take most of the time
  const Complex* const root = roots.data();
  const auto all = static_cast<int>(roots.size());
  for (int k = 0, step = 0, of_part = 0; k < n; ++k, step += stride, ++of_part) {
    if (of_part == m) of_part = 0;
    Complex sum = 0;
    for (int at = 0, i = of_part; i < n; i += m) {
      sum += parts[i] * root[at];
      at += step;
      if (at >= all) at -= all;
    }
    out[k] = sum;
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

/// What of each frequency passes along one axis, by number k of the axis and number l of the other.
class AxisBand {
public:
  AxisBand(const Setup& s, glm::ivec2 padded, int axis)
      : n_(padded[axis]),
        other_n_(padded[1 - axis]),
        other_sign_(axis == 0 ? -1 : 1),
        other_pitch_m_(s.pitch_m[1 - axis]),
        limits_(static_cast<std::size_t>(other_n_)) {
    const int spare = std::max(n_ - 2 * s.size[axis], 0);
    const auto kept = [&](int k, int l, double share_of_spare) {
      const double reach_m = (s.size[axis] + share_of_spare * spare) * s.pitch_m[axis];
      const double f = frequency(k, n_, s.pitch_m[axis]), g = other_frequency(l);
      const double w_squared = 1 / (s.wavelength_m * s.wavelength_m) - f * f - g * g;
      // Rows count downwards, y upwards
      const double shift_m = axis == 0 ? s.shift_m.x : -s.shift_m.y;
      const auto within = [&](double at) {
        return s.distance_m == 0
                   ? std::abs(shift_m) <= reach_m
                   : w_squared > 0 &&
                         std::abs(shift_m - s.distance_m * at / std::sqrt(w_squared)) <= reach_m;
      };
      // The steepest of an even number of frequencies is light to both sides
      return within(f) && (2 * k != n_ || within(-f));
    };
    const auto limits = [&](int l, double share_of_spare) {
      Limits found;
      for (int k = -(n_ / 2); k < (n_ + 1) / 2; ++k) {
        if (!kept(k < 0 ? k + n_ : k, l, share_of_spare)) continue;
        if (found.first > found.last) found.first = k;
        found.last = k;
      }
      return found;
    };
    for (int l = 0; l < other_n_; ++l) limits_[static_cast<std::size_t>(l)] = limits(l, 0.9);
    const auto widest = limits_[0], whole = limits(0, 0.1);
    if (whole.first > whole.last) return;
    rise_ = whole.first - widest.first;
    fall_ = widest.last - whole.last;
  }

  double other_frequency(int l) const {
    return other_sign_ * frequency(l, other_n_, other_pitch_m_);
  }

  /// Fades from nothing to all within rise_ or fall_ frequencies.
  double passed(int k, int l) const {
    if (k >= (n_ + 1) / 2) k -= n_;
    const auto& [first, last] = limits_[static_cast<std::size_t>(l)];
    if (k < first || k > last) return 0;
    const double low = rise_ > 0 ? (k - first + 0.5) / rise_ : 1,
                 high = fall_ > 0 ? (last - k + 0.5) / fall_ : 1;
    const double t = std::min({low, high, 1.0});
    return t * t * (3 - 2 * t);
  }

private:
  struct Limits {
    int first = 0, last = -1;
  };
  int n_, other_n_;
  double other_sign_, other_pitch_m_;
  std::vector<Limits> limits_;  // by the other axis' frequency
  int rise_ = 0, fall_ = 0;
};

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

  const AxisBand columns(s, padded, 0), rows(s, padded, 1);
  for (int j = 0; j < padded.y; ++j) {
    const double v = columns.other_frequency(j);
    for (int i = 0; i < padded.x; ++i) {
      const double u = rows.other_frequency(i);
      const double w =
          std::sqrt(std::max(1 / (s.wavelength_m * s.wavelength_m) - u * u - v * v, 0.0));
      const double turns = s.shift_m.x * u + s.shift_m.y * v + s.distance_m * w;
      const double scale =
          columns.passed(i, j) * rows.passed(j, i) / (static_cast<double>(padded.x) * padded.y);
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
