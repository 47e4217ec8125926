// SPDX-License-Identifier: Apache-2.0
/// What a plane's pixels gather from a sample table, in double precision, sample by sample: what kernels/gather.cl is held against.
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "host/reference/stage.hpp"

namespace raywave::reference {

enum class Seen { no, yes, unsure };  // unsure: an edge passes closer than floats tell

/// Whether the way from `from` to `to`, beginning `bias_m` off the surface, is free, triangle by triangle.
Seen free_way(std::span<const device::Triangle> triangles, glm::dvec3 from, glm::dvec3 off_surface, double bias_m, glm::dvec3 to);

/// World place of a pixel, counted row by row, of the plane around `centre_m`.
glm::dvec3 pixel_of(const Plan& plan, glm::dvec3 centre_m, std::size_t index);

/// One sample's light at one pixel of a plane, by the definition.
struct Wave {
  std::complex<double> value = 0;  // without the random phase
  bool unsure = false;             // an edge passes closer than floats tell
};

/// pixel_m  world; at z <= 0 the plane is the hologram itself, where every sample reaches every pixel
Wave wave_of(const Rig& rig, std::size_t sample, glm::dvec3 pixel_m);

struct Agreement {
  double error = 0;       // relative, L2, over the pixels compared and all frames
  int pixels = 0;         // compared
  int unsure = 0;         // left out
  double dark_error = 0;  // largest amplitude where no light should be
};

/// `count` pixels drawn at random from fields of the frames seed, seed + 1, ... on the plane around `centre_m`, against the direct sum of
/// all samples, none of them near (Gatherer's near_spots 0).
Agreement against_direct_sum(const Rig& rig, std::span<const std::complex<float>> fields, int frames, std::uint32_t seed,
                             glm::dvec3 centre_m, int count);

}  // namespace raywave::reference
