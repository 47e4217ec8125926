// SPDX-License-Identifier: Apache-2.0
/// The common part of the two propagation engines: FFTs on the host's threads, line by line, and
/// FFTs of whole planes on the device.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "host/propagate/propagator.hpp"

namespace raywave {

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

  /// Light is kept that moves sideways no farther than this, seen from the target's shift: from any
  /// sample to any other of an unshifted target, and to the edge of the padded plane. (The latter
  /// alone would cut light at paddings below 2 that stays inside the window and comes out right,
  /// since the plane is periodic.)
  double reach_m() const { return std::max(padded / 2.0, static_cast<double>(window)) * pitch_m; }
  int lowest() const { return -(padded / 2); }
  int highest() const { return (padded - 1) / 2; }
  int signed_index(int i) const { return i <= highest() ? i : i - padded; }
  int index(int k) const { return k < 0 ? k + padded : k; }  // in the order of the transform
  double frequency(int k) const { return k / (padded * pitch_m); }
  Band sampled(std::pair<double, double> band) const;
};

/// One propagation's transfer function, as kernels/propagate/transfer.h needs it.
struct Transfer {
  // X and Y, reduced turns, in the order of the transform
  std::vector<float> phase_x, phase_y;
  // Per column the first and then the last row kept; per row those of the columns
  std::vector<std::int32_t> band_x, band_y;
  Band rows;                         // that any column keeps
  float depth_hi = 0, depth_lo = 0;  // distance / (2 wavelength), in turns
  double remainder_turns = 0;        // R at most, inside the band
  bool two_floats = false;           // R needs them

  Band columns_of(int row) const { return {band_y[row], band_y[band_y.size() / 2 + row]}; }
};

/// The settings and tables of both engines.
struct PropagationPlan {
  PropagatorSpec spec;
  Axis x, y;
  std::vector<float> power_x, power_y;  // (lambda f)^2 as high parts, then low parts
  double scale = 1;                     // 1 / samples of the padded plane
};

/// Propagator's steps, arguments checked.
class PropagationEngine {
public:
  virtual ~PropagationEngine() = default;
  virtual void load(const cl::ComplexBuffer& field, int frame, const Band& rows) = 0;
  // Transfer->rows lie within those loaded
  virtual void add(const std::shared_ptr<const Transfer>& transfer) = 0;
  virtual void collect(cl::ComplexBuffer& field) = 0;
};

// propagator_host.cpp
std::unique_ptr<PropagationEngine> make_host_engine(const PropagationPlan& plan);
// propagator_device.cpp
std::unique_ptr<PropagationEngine> make_device_engine(const cl::Device& device,
                                                      const PropagationPlan& plan);

}  // namespace raywave
