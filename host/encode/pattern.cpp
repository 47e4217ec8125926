// SPDX-License-Identifier: Apache-2.0
#include "host/encode/pattern.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

bool along_x(Side side) { return side == Side::right || side == Side::left; }

/// Sine of the angle that a blaze turns the light by.
double blaze_sine(const PatternSpec& spec, const HologramSpec& hologram) {
  return hologram.wavelength_m /
         (spec.period_px * (along_x(spec.side) ? hologram.pitch_m.x : hologram.pitch_m.y));
}

void require_shown(const PatternSpec& spec, const HologramSpec& hologram) {
  const bool has_period = spec.pattern == Pattern::blaze || spec.pattern == Pattern::checker;
  if (has_period && !(spec.period_px >= 2))
    throw InputError("period " + number_text(spec.period_px) +
                     ": pixels show periods of 2 and more");
  if (spec.pattern == Pattern::blaze && blaze_sine(spec, hologram) >= 1)
    throw InputError("period " + number_text(spec.period_px) +
                     ": so fine a grating turns no light of this wavelength; give more than " +
                     number_text(spec.period_px * blaze_sine(spec, hologram)));
  if (spec.pattern != Pattern::lens) return;
  // At the edge, phase may go on by half a turn per pixel.
  double least_m = 0;
  for (int axis = 0; axis < 2; ++axis) {
    const double rim_m = 0.5 * hologram.resolution[axis] * hologram.pitch_m[axis];
    const double sine = hologram.wavelength_m / (2 * hologram.pitch_m[axis]);
    if (sine < 1) least_m = std::max(least_m, rim_m / sine * std::sqrt(1 - sine * sine));
  }
  if (!(std::abs(spec.focal_m) >= least_m) || spec.focal_m == 0)
    throw InputError("focal " + length_text(spec.focal_m) +
                     ": too strong a lens for these pixels; give " +
                     length_text(std::ceil(least_m * 1e3 + 1e-9) / 1e3) + " or more");
}

}  // namespace

SlmSpec slm_of_pattern(SlmSpec slm) {
  if (!shows_amplitude(slm.encoding)) slm.encoding = Encoding::phase;
  slm.band = {1, 1};
  return slm;
}

double blaze_slope(const PatternSpec& spec, const HologramSpec& hologram) {
  return std::tan(std::asin(blaze_sine(spec, hologram)));
}

FieldStack pattern_field(const PatternSpec& spec, const HologramSpec& hologram) {
  require_shown(spec, hologram);
  const auto size = hologram.resolution;
  const auto turns_at = [&](int column, int row) -> double {
    const double right = column - (size.x - 1) / 2.0, up = (size.y - 1) / 2.0 - row;
    switch (spec.pattern) {
      case Pattern::lens: {
        const double path_m =
            std::hypot(right * hologram.pitch_m.x, up * hologram.pitch_m.y, spec.focal_m) -
            std::abs(spec.focal_m);
        return -std::copysign(path_m, spec.focal_m) / hologram.wavelength_m;
      }
      case Pattern::blaze: {
        const double sign = spec.side == Side::right || spec.side == Side::up ? 1 : -1;
        return sign * (along_x(spec.side) ? right : up) / spec.period_px;
      }
      case Pattern::checker: {
        const auto square = [&](int pixel) {
          return static_cast<long>(std::floor(pixel / (spec.period_px / 2)));
        };
        return (square(column) + square(row)) % 2 == 0 ? 0 : 0.5;
      }
      case Pattern::ramp:
        return row < size.y / 4 ? 0 : static_cast<double>(column) / size.x;
    }
    return 0;
  };
  FieldStack field{size.x, size.y, 1, {}};
  field.samples.reserve(std::size_t{1} * size.x * size.y);
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) {
      const double turns = turns_at(column, row);
      field.samples.emplace_back(
          std::polar(1.0, 2 * std::numbers::pi * (turns - std::floor(turns))));
    }
  }
  return field;
}

}  // namespace raywave
