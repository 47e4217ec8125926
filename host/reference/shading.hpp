// SPDX-License-Identifier: Apache-2.0
/// The field that a pixel's fan of rays gathers, in double precision, ray by ray and triangle by
/// triangle, followed by recursion: the oracle of kernels/gather/fan.cl.
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/reference/rays.hpp"
#include "host/scene/scene.hpp"

namespace raywave::reference {

struct TracedField {
  std::vector<std::complex<double>> field;  // as FanTracer::trace fills it
  /// Pixels one of whose rays, moved by less than single precision resolves, would meet another
  /// triangle, phase cell or shadow: there two right answers differ.
  std::vector<bool> undecided;
  /// Counts of events on the rays, to show that a test covers them.
  std::int64_t hits = 0, shadowed = 0, mirrored = 0, refracted = 0, totally_reflected = 0;
};

/// sum over the fan of sqrt(radiance) / r exp(2 pi i (r / wavelength + phase of the cell)), r the
/// optical length from pixel to source in the phase, and in the amplitude the length in air that
/// spreads light as much, a quarter of a pixel at least. Triangles have corners in single precision
/// in the scene frame, as the device has them; all else is double.
TracedField trace_fan(const Scene& scene, const World& world, const Plan& plan, const Wrp& wrp,
                      std::uint32_t seed);

}  // namespace raywave::reference
