// SPDX-License-Identifier: Apache-2.0
/// The padded plane that propagation transforms: its size, and the frequencies that carry light
/// from one plane to another. Planning counts and predicts with them, host/propagate computes with
/// them.
#pragma once

#include <algorithm>
#include <glm/vec2.hpp>
#include <utility>

namespace raywave {

/// Size of the padded plane: at least `padding` times `size`, rows of whole packets, and sizes that
/// the FFT transforms fast.
glm::ivec2 padded_size(glm::ivec2 size, double padding);

/// The same for propagation over `distance_m`. From padding 2 on the plane is wide enough for the
/// fringe that diffraction draws about light's edges, sqrt(wavelength z) wide, to fade in:
/// holograms of few Fresnel zones need it. Below 2, light that wraps around is accepted.
/// Sides that would need more than 8192 samples, and three times their own, are padded as asked.
glm::ivec2 padded_size(glm::ivec2 size, double padding, glm::dvec2 pitch_m, double wavelength_m,
                       double distance_m);

/// Frequencies (cycles per metre) that a plane `distance_m` away and shifted by `shift_m` can
/// receive from the window along one axis, the other frequency being zero: [L(shift - half),
/// L(shift + half)], L(t) = t / (wavelength sqrt(t^2 + z^2)). half_m is Axis::reach_m. No frequency
/// (first > second) when the distance is zero and the shift larger than half_m.
///
/// source  Matsushima's Table 1 without its case distinctions; the transfer function's local
///         frequency |shift - z u/w| <= half_m
std::pair<double, double> band_m(double wavelength_m, double distance_m, double shift_m,
                                 double half_m);

/// band_m where the other frequency v leaves `wave_number` = sqrt(1/lambda^2 - v^2) to this axis.
std::pair<double, double> band_of(double wave_number, double distance_m, double shift_m,
                                  double half_m);

/// First and last of the frequencies k / (n pitch) kept; none when first > last.
struct Band {
  int first = 0, last = -1;
  bool empty() const { return first > last; }
  int count() const { return empty() ? 0 : last - first + 1; }
  bool contains(int k) const { return first <= k && k <= last; }
  bool contains(const Band& other) const {
    return other.empty() || (contains(other.first) && contains(other.last));
  }
  /// The narrowest that contains both.
  Band joined(const Band& other) const {
    if (empty() || other.empty()) return empty() ? other : *this;
    return {std::min(first, other.first), std::max(last, other.last)};
  }
};

/// One axis of the padded plane. Along y everything counts downwards, like rows.
struct Axis {
  int padded = 1;
  double pitch_m = 1;
  int window = 1;  // samples of the planes in and out

  /// Light that moves sideways no farther than this, seen from the target's shift, is kept whole:
  /// from any sample to any other of an unshifted target. (At paddings below 2 as well: since the
  /// plane is periodic, light that stays inside the window comes out right.)
  double whole_reach_m() const { return (window + 0.1 * spare()) * pitch_m; }
  /// Light that moves farther than this would wrap around into the window and is left out. Between
  /// the two reaches light fades, for a hard edge of the band spreads light over all of the plane.
  double reach_m() const { return (window + 0.9 * spare()) * pitch_m; }
  /// Samples that neither light of the window nor what wraps around into it needs.
  int spare() const { return std::max(padded - 2 * window, 0); }
  int lowest() const { return -(padded / 2); }
  int highest() const { return (padded - 1) / 2; }
  int signed_index(int i) const { return i <= highest() ? i : i - padded; }
  int index(int k) const { return k < 0 ? k + padded : k; }  // in the order of the transform
  double frequency(int k) const { return k / (padded * pitch_m); }
  /// What a band keeps. Of an even number of frequencies, the steepest counts as light to both
  /// sides: a band keeps it when it holds both, so that a field's conjugate goes the mirrored way.
  Band sampled(std::pair<double, double> band) const;
};

}  // namespace raywave
