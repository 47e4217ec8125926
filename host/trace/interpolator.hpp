// SPDX-License-Identifier: Apache-2.0
/// Band-limited interpolation on the device (host/plan/interpolation.hpp says of what).
#pragma once

#include <cstdint>

#include "cl/program.hpp"
#include "host/plan/interpolation.hpp"

namespace raywave {

class Interpolator {
public:
  explicit Interpolator(const cl::Device& device);

  /// Frame `frame` of `coarse` (frames x Plan::gathered_size), gathered on the WRP of a layer that
  /// interpolates, into `fine` (Plan::tile_size).
  void interpolate(const Plan& plan, const Wrp& wrp, const cl::ComplexBuffer& coarse, int frame,
                   cl::ComplexBuffer& fine);

private:
  /// All columns of the gathered rows, all rows of all columns.
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
