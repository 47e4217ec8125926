// SPDX-License-Identifier: Apache-2.0
/// Colours of lasers: what light of one wavelength looks like, and how strongly each of several
/// lasers shines for a colour (docs/colour.md). Colours are linear sRGB, in which (1, 1, 1) is D65.
#pragma once

#include <cstddef>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numeric>
#include <vector>

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

/// Lasers, and the light of each that makes a colour. The unit of each laser's light is what it has
/// in white: a light of 1 of all lasers is their white, as (1, 1, 1) is of sRGB.
struct LaserSet {
  static constexpr std::size_t most = 8;

  std::vector<double> wavelengths_m;
  std::vector<double> white_powers;  // radiant powers that are white together; their sum is 1
  // Weights of red, green and blue in the light of each laser; their sum is 1. Negative where a
  // laser would have to take light away: the colour is beyond the lasers' gamut
  std::vector<glm::dvec3> from_rgb;
  std::vector<glm::dvec3> rgb;  // linear sRGB of the light that each has in white

  std::size_t count() const { return wavelengths_m.size(); }
  /// Linear sRGB of the white that the lasers mix: (1, 1, 1), D65, but for two of them.
  glm::dvec3 white() const { return std::accumulate(rgb.begin(), rgb.end(), glm::dvec3(0)); }
};

/// CIEDE2000 of a linear sRGB from D65.
double white_error(glm::dvec3 rgb);

/// Lasers as they are on the bench: a number for each, or nothing.
struct LaserBench {
  std::vector<double> powers;        // radiant, at most, in any unit
  std::vector<double> efficiencies;  // share of the light on the SLM that goes into the picture
  std::vector<double> duties;        // share of the time; empty: equal ones
};

/// How the lasers of a bench show white.
struct LaserDrive {
  std::vector<double> powers;  // on the SLM, while each is on, relative; their sum is 1
  std::vector<double> shares;  // of its given power; the largest is 1. Empty: none are given
  glm::dvec3 full{0};          // linear sRGB of white with all at their given powers; Y is 1
};

/// light  of each laser in white, times what its picture needs of it (laser_powers)
LaserDrive drive_of(const LaserSet& lasers, const LaserBench& bench,
                    const std::vector<double>& light);

/// The mix of lasers for each of sRGB's primaries (docs/colour.md). Three lasers have but one. Two
/// show the nearest colour, by least squares in linear sRGB. Of more, every three mix the primary:
/// the mean of those that need no negative light of any laser, or else the three that need the
/// least of it.
///
/// wavelengths_m  2 to `most`, different
/// throws         std::invalid_argument when white, the sum of the primaries, has no light of a
///                laser
LaserSet laser_set(const std::vector<double>& wavelengths_m);

}  // namespace raywave
