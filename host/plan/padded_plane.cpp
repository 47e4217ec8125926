// SPDX-License-Identifier: Apache-2.0
#include "host/plan/padded_plane.hpp"

#include <cmath>
#include <limits>

#include "host/common/fft_backend.hpp"

namespace raywave {
namespace {

/// Rows of padded planes are whole packets of any device's lanes, in samples.
constexpr int packet = 16;

}  // namespace

glm::ivec2 padded_size(glm::ivec2 size, double padding) {
  const auto fast = [&](double samples) {
    return static_cast<int>(next_fast_size(static_cast<std::size_t>(samples)));
  };
  return {fast(packet * std::ceil(size.x * padding / packet)), fast(std::ceil(size.y * padding))};
}

glm::ivec2 padded_size(glm::ivec2 size, double padding, glm::dvec2 pitch_m, double wavelength_m,
                       double distance_m) {
  constexpr double most = 8192;  // samples
  glm::dvec2 needed(padding);
  for (int axis = 0; axis < 2 && padding >= 2; ++axis) {
    const double spread =
        wavelength_m * std::abs(distance_m) / pitch_m[axis];  // of a pixel's light
    const double fringe = std::sqrt(wavelength_m * std::abs(distance_m)) / pitch_m[axis],
                 side = size[axis];
    const double wide =
        std::min(2 * side + 4 * fringe, side + spread / (2 * pitch_m[axis]) + 4 * fringe);
    if (wide <= std::max(most, 3 * side)) needed[axis] = std::max(padding, wide / side);
  }
  return {padded_size(size, needed.x).x, padded_size(size, needed.y).y};
}

std::pair<double, double> band_of(double wave_number, double distance_m, double shift_m,
                                  double half_m) {
  // Closed form of |shift - z u/w| <= half
  constexpr double all = std::numeric_limits<double>::infinity();
  if (distance_m == 0)
    return std::abs(shift_m) <= half_m ? std::pair(-all, all) : std::pair(all, -all);
  const auto limit = [&](double t) {
    return wave_number * t / std::copysign(std::hypot(t, distance_m), distance_m);
  };
  return std::minmax({limit(shift_m - half_m), limit(shift_m + half_m)});
}

std::pair<double, double> band_m(double wavelength_m, double distance_m, double shift_m,
                                 double half_m) {
  return band_of(1 / wavelength_m, distance_m, shift_m, half_m);
}

Band Axis::sampled(std::pair<double, double> band) const {
  const double step = 1 / (padded * pitch_m);
  // What an even transform has at -n / 2 may as well be light at +n / 2
  const bool is_sure = lowest() == -highest() || band.second >= -lowest() * step;
  const double first =
      std::max<double>(std::ceil(band.first / step), is_sure ? lowest() : -highest());
  const double last = std::min<double>(std::floor(band.second / step), highest());
  return first <= last ? Band{static_cast<int>(first), static_cast<int>(last)} : Band{};
}

}  // namespace raywave
