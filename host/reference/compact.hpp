// SPDX-License-Identifier: Apache-2.0
/// Compact propagation in double precision: what it stands for, and the same discrete computation,
/// step by step (docs/pipeline.md). The oracle of kernels/gather/compact.cl and
/// kernels/propagate/compact.cl.
#pragma once

#include <complex>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "host/reference/pipeline.hpp"

namespace raywave::reference {

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
