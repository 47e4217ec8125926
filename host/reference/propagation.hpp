// SPDX-License-Identifier: Apache-2.0
/// Propagation in double precision, written for plainness: the oracles of
/// host/propagate/propagator.hpp. Same conventions: row 0 is the top, distances count along the
/// direction of travel, shifts are of the target's centre relative to the source's (x right, y up).
#pragma once

#include <complex>
#include <glm/vec2.hpp>
#include <vector>

namespace raywave::reference {

using Field = std::vector<std::complex<double>>;  // size.y rows of size.x samples

/// A source plane and its target plane, as for Propagator.
struct Setup {
  glm::ivec2 size{1, 1};
  glm::dvec2 pitch_m{1, 1};
  double wavelength_m = 1;
  glm::dvec2 shift_m{0, 0};
  double distance_m = 1;
};

/// First Rayleigh-Sommerfeld integral as a sum over all pairs of samples with the exact kernel z
/// (1/r - ik) exp(ikr) / (2 pi r^2). A negative distance gives the field that was there before (the
/// conjugate field's forward propagation, conjugated).
///
/// rows  only these rows of the target are computed, all when empty
Field rayleigh_sommerfeld(const Field& source, const Setup& setup,
                          const std::vector<int>& rows = {});

/// The field that Propagator computes, from the definition: zero padding to `padded`, transform,
/// the exact transfer function where its local frequency |x0 - z u/w| (likewise y) does not exceed
/// half the padded plane, or the whole window when that is more, transform back, cut out.
Field shifted_angular_spectrum(const Field& source, const Setup& setup, glm::ivec2 padded);

/// Discrete Fourier transform of any length, in place, not normalised; sign -1 forward, +1 inverse.
void transform(Field& line, int sign);

/// Transform of a plane as the sums that define it, axis by axis; shares nothing with `transform`.
Field direct_transform(const Field& plane, glm::ivec2 size, int sign);

/// Fields to propagate: complex normal noise in floats; and exp(-(x^2 + y^2) / waist^2) that
/// travels along (sine.x, sine.y), x right and y up.
std::vector<std::complex<float>> noise(glm::ivec2 size, unsigned seed);
Field beam(const Setup& setup, double waist_m, glm::dvec2 sine);

/// Root of sum |a - b|^2 / sum |b|^2.
double relative_error(const Field& a, const Field& b);

Field to_double(const std::vector<std::complex<float>>& field);
std::vector<std::complex<float>> to_float(const Field& field);

}  // namespace raywave::reference
