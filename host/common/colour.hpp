// SPDX-License-Identifier: Apache-2.0
/// Colours of lasers: what light of one wavelength looks like, and how strongly each of three
/// lasers shines for a colour (docs/colour.md). Colours are linear sRGB, in which (1, 1, 1) is D65.
#pragma once

#include <array>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace raywave {

/// Wavelengths of which the eye's answer is known.
inline constexpr double least_visible_m = 380e-9, largest_visible_m = 780e-9;

/// The CIE 1931 colour matching functions (2 degrees): X, Y, Z of light of this wavelength, for a
/// radiant power of one.
///
/// wavelength_m  380 to 780 nm
/// accuracy      within 4e-4 of the table in steps of 1 nm
glm::dvec3 xyz_of_wavelength(double wavelength_m);

/// Chromaticity (x, y); (0, 0) where X + Y + Z is not > 0.
glm::dvec2 chromaticity_of(glm::dvec3 xyz);

/// CIE 1976 L*, a*, b*.
///
/// white  X, Y, Z of what has L* = 100
glm::dvec3 lab_of(glm::dvec3 xyz, glm::dvec3 white);

/// CIEDE2000 colour difference of two L*, a*, b*: about 1 where eyes just tell them apart.
///
/// source  Sharma, Wu, Dalal, Color Res. Appl. 30, 21 (2005)
double delta_e_2000(glm::dvec3 lab_a, glm::dvec3 lab_b);

/// Between linear sRGB and XYZ, from the primaries and the white of IEC 61966-2-1; Y of white is 1.
glm::dmat3 xyz_from_srgb();

/// The sRGB value, 0 to 1, of linear light from 0 to 1; what lies beyond becomes 0 or 1.
double srgb_of(double linear);

/// Three lasers, and the light of each that makes a colour. The unit of each laser's light is what
/// it has in white: (1, 1, 1) is white in lasers and in sRGB.
struct LaserSet {
  std::array<double, 3> wavelengths_m{};
  std::array<double, 3> white_powers{};  // radiant powers that are D65 together; their sum is 1
  // Light of the lasers = lasers_from_rgb * colour. Negative where a laser would have to take light
  // away: the colour is beyond the lasers' gamut, or a primary of sRGB is
  glm::dmat3 lasers_from_rgb{1};
  glm::dmat3 rgb_from_lasers{1};
  glm::dmat3 xyz_from_lasers{1};

  /// Weights of red, green and blue in the light of a laser; their sum is 1.
  glm::dvec3 row(std::size_t laser) const {
    const auto i = static_cast<int>(laser);
    return {lasers_from_rgb[0][i], lasers_from_rgb[1][i], lasers_from_rgb[2][i]};
  }
};

/// throws  std::invalid_argument when the lasers cannot show white: a power of it would not be > 0
LaserSet laser_set(const std::array<double, 3>& wavelengths_m);

}  // namespace raywave
