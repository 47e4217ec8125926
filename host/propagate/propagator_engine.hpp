// SPDX-License-Identifier: Apache-2.0
/// The common part of the two propagation engines: FFTs on the host's threads, line by line, and
/// FFTs of whole planes on the device.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "host/propagate/propagation.hpp"

namespace raywave {

/// How a transfer function fades within its band: 1 / the frequencies from no light to all of it,
/// from each row's first column, last column, and from each column's first and last row.
struct Fades {
  float left = 0, right = 0, first = 0, last = 0;
};

/// One propagation's transfer function, as kernels/propagate/transfer.h needs it.
struct Transfer {
  // X and Y, reduced turns, in the order of the transform
  std::vector<float> phase_x, phase_y;
  // Per column the first and then the last row kept; per row those of the columns
  std::vector<std::int32_t> band_x, band_y;
  Band rows;  // that any column keeps
  Fades fades;
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
  // once  nothing is added of it after the next `collect`
  virtual void load(const cl::ComplexBuffer& field, int frame, const Band& rows, bool once) = 0;
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
