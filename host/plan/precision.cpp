// SPDX-License-Identifier: Apache-2.0
#include "host/plan/precision.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "host/plan/lattice.hpp"
#include "host/plan/plan.hpp"

namespace raywave {
namespace {

// Relative errors of a few operations in float, pairs of floats and double
constexpr double float_ulp = 0x1p-24, pair_ulp = 0x1p-45, double_ulp = 0x1p-50;

/// Error of sine, cosine, amplitudes and sums of many waves, in every precision.
constexpr double wave_floor_turns = 1e-7;

/// Error of the plane waves of a sample: up to 16 turns from the chief ray, in floats, and 96 steps
/// of a recurrence.
constexpr double near_turns = 3e-7;

/// Error of the transforms, and of what propagate.cl computes in floats.
constexpr double propagation_floor_turns = 1e-7;

/// Errors of a bounce, over the error of an optical path: the surface's plane, the place on it, the
/// normal there and the direction onwards.
constexpr double bounce_steps = 16;

/// Rows from the middle of the pixels that share one optical path.
constexpr double tile_reach_rows = 8;

}  // namespace

PhaseErrors phase_errors_of(const Plan& plan) {
  double path_m = 0, propagated_m = 0;
  for (const auto& wrp : plan.wrps) {
    const auto& layer = plan.layer_of(wrp);
    const double depth_m = std::max(std::abs(layer.max_m.z - wrp.centre_m.z),
                                    std::abs(layer.min_m.z - wrp.centre_m.z));
    const auto slope = steepest_slope(plan);
    path_m = std::max(path_m, depth_m * std::hypot(1.0, slope.x, slope.y));
    if (wrp.centre_m.z != 0) propagated_m = std::max(propagated_m, glm::length(wrp.centre_m));
  }
  const double path_turns = path_m / plan.hologram.wavelength_m;
  const double row_turns =
      plan.hologram.largest_sine.y * plan.hologram.pitch_m.y / plan.hologram.wavelength_m;
  const bool any_near = plan.wrps[0].centre_m.z != 0;

  PhaseErrors errors;
  for (const auto precision : {Precision::floats, Precision::doubles}) {
    auto& e = errors[static_cast<std::size_t>(precision)];
    e.waves_turns =
        wave_floor_turns + path_turns * (precision == Precision::doubles ? double_ulp : pair_ulp);
    if (plan.samples.aimed && any_near) e.waves_turns += near_turns;
    if (plan.samples.aimed && precision == Precision::floats)
      e.waves_turns += float_ulp * tile_reach_rows * row_turns;
    e.bounces_turns =
        plan.specular.bounces *
        (float_ulp +
         bounce_steps * (precision == Precision::doubles ? double_ulp : pair_ulp) * path_turns);
    e.propagate_turns = propagated_m > 0 ? propagation_floor_turns + double_ulp * propagated_m /
                                                                         plan.hologram.wavelength_m
                                         : 0;
  }
  return errors;
}

Precision choose_precision(const AccuracySpec& spec, const PhaseErrors& errors, bool has_doubles) {
  if (spec.precision) return *spec.precision;
  const auto error = [&](Precision p) { return errors[static_cast<std::size_t>(p)].total_turns(); };
  auto best = Precision::floats;
  for (const auto precision : {Precision::floats, Precision::doubles}) {
    if (precision == Precision::doubles && !has_doubles) break;
    if (error(precision) < spec.phase_turns) return precision;
    if (error(precision) < error(best)) best = precision;
  }
  return best;
}

}  // namespace raywave
