// SPDX-License-Identifier: Apache-2.0
/// WRPs gathered in fewer columns and rows than the hologram has. Light on its way to the
/// hologram's window converges: once the convergence is divided out, it fills only a part of the
/// band that pixels can hold, and samples a few pitches apart determine it
/// (docs/pipeline.md). Each axis for itself: the shorter side of the hologram leaves more to gain.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <vector>

#include "cl/program.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// Columns and rows of a layer's WRPs, as far apart as `oversampling` times what their light's band
/// needs allows; along an axis where that gains too little, those of the hologram.
///
/// plan  with its WRPs
/// layer  of plan.layers
WrpAxes axes_for_band(const Plan& plan, const DepthLayer& layer, double oversampling);

/// Columns or rows of the hologram's pitch as sums of the WRP's: number i is the sum over j < taps
/// of coefficients[i * taps + j] times number first[i] + j. A windowed sinc between the converging
/// wave taken out and put back.
struct Interpolation {
  int taps = 1;
  std::vector<std::int32_t> first;
  std::vector<std::complex<float>> coefficients;
};

/// layer      with its axes
/// axis      0: columns, 1: rows
/// centre_m  of the WRP from its tile's, positive towards later columns or rows: rows are counted
///           downwards
/// accuracy  see predicted_oversampling_error
Interpolation interpolation_of(const Plan& plan, const DepthLayer& layer, int axis,
                               double centre_m);

class Interpolator {
public:
  explicit Interpolator(const cl::Device& device);

  /// Frame `frame` of `coarse` (frames x Plan::gathered_size), gathered on the WRP of a layer that
  /// interpolates, into `fine` (Plan::tile_size).
  void interpolate(const Plan& plan, const Wrp& wrp, const cl::ComplexBuffer& coarse, int frame,
                   cl::ComplexBuffer& fine);

private:
  /// First all columns of the gathered rows, then all rows of all columns.
  void make_columns(const Plan& plan, const DepthLayer& layer, double centre_m,
                    const cl::ComplexBuffer& coarse, int frame, cl::ComplexBuffer& fine);
  void make_rows(const Plan& plan, const DepthLayer& layer, double centre_m,
                 const cl::ComplexBuffer& coarse, int frame, cl::ComplexBuffer& fine);

  cl::Device device_;
  int lanes_;
  cl::Program program_;
  cl::Kernel columns_, rows_;
  cl::Buffer<std::int32_t> first_column_, first_row_;
  cl::Buffer<float> column_coefficients_;
  cl::ComplexBuffer row_coefficients_;
  cl::ComplexBuffer between_;  // all columns of the gathered rows
};

}  // namespace raywave
