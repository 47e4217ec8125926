// SPDX-License-Identifier: Apache-2.0
/// Properties of materials that depend on the wavelength.
#pragma once

#include <glm/vec3.hpp>
#include <utility>
#include <vector>

namespace raywave {

/// 0 red (>= 580 nm), 1 green, 2 blue (< 490 nm): the channel of colours and textures that light of
/// this wavelength sees.
int channel_of(double wavelength_m);

/// The channels of colours and textures that a hologram sees: that of its wavelength, or, in
/// colour, all three.
struct Channels {
  int first = 0;  // what a scene of one wavelength sees; in colour, the nearest to the laser's
  bool all = false;

  int count() const { return all ? 3 : 1; }
  /// Number i of `count`.
  int operator[](int i) const { return all ? i : first; }
  template <class Test>
  bool any(const Test& test) const {
    return all ? test(0) || test(1) || test(2) : test(first);
  }
  bool operator==(const Channels&) const = default;
};

/// A number for each wavelength: one for all, one for each channel of a colour, or a table.
struct Spectrum {
  glm::dvec3 channels{0};                        // red, green, blue; unless there is a table
  std::vector<std::pair<double, double>> table;  // wavelengths (m, ascending) and values

  Spectrum() = default;
  Spectrum(double value) : channels(value) {}  // NOLINT: a number is a spectrum

  /// Between the wavelengths of a table, values lie on a straight line over 1 / wavelength^2, as
  /// Cauchy's formula has it for indices of refraction. Beyond them, the nearest one's is taken.
  double at(double wavelength_m) const;
  /// False beyond the wavelengths of a table.
  bool holds(double wavelength_m) const;
  /// True where the value is above zero for some wavelength.
  bool is_positive() const;

  bool operator==(const Spectrum&) const = default;
};

}  // namespace raywave
