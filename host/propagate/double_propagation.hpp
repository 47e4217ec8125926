// SPDX-License-Identifier: Apache-2.0
/// Propagation in double precision on one thread, written for plainness: what the library computes
/// for fields of doubles, and what tests hold Propagator against. Tests hold it against direct
/// sums. Conventions of Propagator: row 0 is the top, distances count along the direction of
/// travel, shifts are of the target's centre relative to the source's (x right, y up).
#pragma once

#include <complex>
#include <glm/vec2.hpp>
#include <vector>

namespace raywave::in_double {

using Field = std::vector<std::complex<double>>;  // size.y rows of size.x samples

/// A source plane and its target plane, as for Propagator.
struct Setup {
  glm::ivec2 size{1, 1};
  glm::dvec2 pitch_m{1, 1};
  double wavelength_m = 1;
  glm::dvec2 shift_m{0, 0};
  double distance_m = 1;
};

/// The field that Propagator computes, from the definition: zero padding to `padded`, transform,
/// the exact transfer function where its local frequency |x0 - z u/w| (likewise y) does not exceed
/// Axis::reach_m, faded from Axis::whole_reach_m on, transform back, cut out.
Field shifted_angular_spectrum(const Field& source, const Setup& setup, glm::ivec2 padded);

/// Discrete Fourier transform of any length, in place, not normalised; sign -1 forward, +1 inverse.
void transform(Field& line, int sign);

}  // namespace raywave::in_double
