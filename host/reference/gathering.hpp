// SPDX-License-Identifier: Apache-2.0
/// The field that a plane's pixels gather from a sample table, in double precision, sample by
/// sample: the oracle of kernels/gather/gather.cl.
#pragma once

#include <complex>
#include <span>

#include "host/reference/pipeline.hpp"
#include "host/reference/stage.hpp"

namespace raywave::reference {

/// The input that the device starts from.
Gathering gathering(const Rig& rig, double plane_wave_spots = 0);

struct Agreement {
  double error = 0;       // relative, L2, over the pixels compared and all frames
  int pixels = 0;         // compared
  int unsure = 0;         // left out
  double dark_error = 0;  // largest amplitude where no light should be
};

/// `count` pixels drawn at random from fields of the frames seed, seed + 1, ... on the plane around
/// `centre_m`, against the direct sum of all samples, none of them by plane waves (Gatherer's
/// plane_wave_spots 0).
///
/// unit_m  of the waves: 1 for fields as the device has them, amplitude_unit_m of the plan for
///         those of render()
Agreement against_direct_sum(const Rig& rig, std::span<const std::complex<float>> fields,
                             int frames, std::uint32_t seed, glm::dvec3 centre_m, int count,
                             double unit_m = 1);

}  // namespace raywave::reference
