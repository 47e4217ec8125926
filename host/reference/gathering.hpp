// SPDX-License-Identifier: Apache-2.0
/// The field that a plane's pixels gather from a sample table, in double precision, sample by
/// sample: the oracle of kernels/gather/gather.cl.
#pragma once

#include <complex>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "host/reference/pipeline.hpp"
#include "host/reference/surfaces.hpp"

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

// Compact propagation in double precision: what it stands for, and the same discrete computation,
// step by step (docs/pipeline.md). The oracle of kernels/gather/compact.cl and
// kernels/propagate/compact.cl.

/// A sample's light at a place of the hologram, without its random phase: its spherical wave, what
/// hides it smoothed by cubic B-splines, and without light that is too steep for the pixels, which
/// fades out over 0.175 of the width of the tile.
///
/// place_m  world, z = 0
std::complex<double> smooth_wave(const Gathering& what, std::size_t sample, const Tile& tile,
                                 glm::dvec2 place_m);

/// The field that the light of one virtual plane makes at pixels of its tile, computed as devices
/// do it.
///
/// footprints  of the samples, as CompactGatherer has them
/// pixels      column and row, in the tile
std::vector<std::complex<double>> compact_field(
    const Gathering& what, const Wrp& wrp, std::uint32_t seed,
    std::span<const device::CompactFootprint> footprints, std::span<const glm::ivec2> pixels);

}  // namespace raywave::reference
