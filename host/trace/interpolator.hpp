// SPDX-License-Identifier: Apache-2.0
/// Band-limited interpolation on the device: computes all rows of a WRP from the gathered rows
/// (host/plan/interpolation.hpp).
#pragma once

#include <cstdint>

#include "cl/program.hpp"
#include "host/plan/interpolation.hpp"

namespace raywave {

class Interpolator {
public:
  explicit Interpolator(const cl::Device& device);

  /// Computes all rows of a WRP whose layer interpolates.
  ///
  /// coarse  the gathered rows, frames x Plan::gathered_size; only frame `frame` is read
  /// fine    receives Plan::tile_size samples
  void interpolate(const Plan& plan, const Wrp& wrp, const cl::ComplexBuffer& coarse, int frame,
                   cl::ComplexBuffer& fine);

private:
  cl::Device device_;
  int lanes_;
  cl::Program program_;
  cl::Kernel rows_;
  cl::Buffer<std::int32_t> first_row_;
  cl::ComplexBuffer coefficients_;
};

}  // namespace raywave
