// SPDX-License-Identifier: Apache-2.0
/// WRPs gathered in fewer rows than the hologram has. Light on its way to the hologram's window converges: once the convergence is divided
/// out, it fills only a part of the band that rows a pixel pitch apart can hold, and rows a few pitches apart say all there is to know
/// (docs/pipeline.md). Columns stay as they are: the longer side leaves less to gain.
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include "cl/program.hpp"
#include "host/plan.hpp"

namespace raywave {

/// Rows of a slab's WRPs, as far apart as `oversampling` times what their light's band needs allows; those of the hologram where that
/// gains less than a quarter.
///
/// plan  with its WRPs
/// slab  of plan.slabs
WrpRows rows_for_band(const Plan& plan, const Slab& slab, double oversampling);

/// Rows of the hologram's pitch as sums of the WRP's: row i is the sum over j < taps of
/// coefficients[i * taps + j] times row first[i] + j. A windowed sinc between the converging wave taken out and put back.
struct Refinement {
  int taps = 1;
  std::vector<std::int32_t> first;
  std::vector<std::complex<float>> coefficients;
};

/// slab        with its rows
/// centre_y_m  of the WRP, from its tile's
/// accuracy    see predicted_rows_error
Refinement refinement_of(const Plan& plan, const Slab& slab, double centre_y_m);

class Refiner {
public:
  explicit Refiner(const cl::Device& device);

  /// Frame `frame` of `coarse` (frames x rows of the slab x nx), gathered on the WRP, into `fine` (ny x nx).
  void refine(const Plan& plan, const Wrp& wrp, const cl::ComplexBuffer& coarse, int frame, cl::ComplexBuffer& fine);

private:
  cl::Device device_;
  int lanes_;
  cl::Kernel refine_;
  cl::Buffer<std::int32_t> first_;
  cl::ComplexBuffer coefficients_;
};

}  // namespace raywave
