// SPDX-License-Identifier: Apache-2.0
/// Band-limited interpolation: WRPs gathered in fewer rows than the hologram has. Light on its way
/// to the hologram's window converges. Once the converging wave is divided out, the light fills
/// only a part of the band that pixels can hold, and rows a few pitches apart determine it
/// (docs/accuracy.md, "Fewer rows").
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include "host/plan/plan.hpp"

namespace raywave {

/// Rows of a layer's WRPs, as far apart as `oversampling` times what their light's band needs
/// allows; those of the hologram where that gains too little.
///
/// plan   with its WRPs
/// layer  of plan.layers
GatheredRows rows_for_band(const Plan& plan, const DepthLayer& layer, double oversampling);

/// The hologram's rows as sums of the gathered ones: row i is the sum over j < taps of
/// coefficients[i * taps + j] times gathered row first[i] + j. A windowed sinc between the
/// converging wave taken out and put back.
struct Interpolation {
  int taps = 1;
  std::vector<std::int32_t> first;
  std::vector<std::complex<float>> coefficients;
};

/// layer     with its rows
/// centre_m  of the WRP from its tile's, positive towards later rows, which are counted downwards
/// accuracy  see predicted_oversampling_error
Interpolation interpolation_of(const Plan& plan, const DepthLayer& layer, double centre_m);

}  // namespace raywave
