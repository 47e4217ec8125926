// SPDX-License-Identifier: Apache-2.0
/// The footprint of a surface sample on a plane: where the sample's light crosses the plane on its
/// way to a window of the hologram (a tile, or all of it). The formulas are those of
/// kernels/gather/footprint.h, here in doubles and along one axis.
///
/// A footprint of few diffraction spots is gathered as a sum of plane waves
/// (kernels/gather/plane_waves.h), which includes the diffraction and so needs a tail beyond the
/// geometric footprint. A wider one is gathered as one spherical wave, cut off at the geometric
/// footprint.
#pragma once

#include <algorithm>
#include <cmath>

#include "host/plan/plan.hpp"

namespace raywave {
namespace footprint_kernel {
using std::clamp;
using std::fmin;
#define FOOTPRINT_REAL double
#include "kernels/gather/footprint.h"
#undef FOOTPRINT_REAL
}  // namespace footprint_kernel

/// A sample is gathered as plane waves where its footprint is narrower than so many spots to each
/// side.
inline constexpr double default_plane_wave_spots = PLANE_WAVE_SPOTS;

/// Tail of a footprint of plane waves, in spots to each side: the waves are cut off beyond.
inline constexpr double plane_wave_tail = PLANE_WAVE_TAIL;

/// The same on a plane at the hologram near surfaces (is_near_hologram): what is cut off there is
/// lost.
inline constexpr double near_hologram_tail = 16;

/// Spots from the middle of a footprint of plane waves to its edge, at most.
inline constexpr double widest_plane_wave_sample = PLANE_WAVE_WIDEST;

/// Tail that the sample lattice keeps around what the WRPs cover, in spots to each side. Wider than
/// plane_wave_tail, since rays of the lattice are few and cost little, while samples left out would
/// leave a dark edge.
inline constexpr double lattice_tail = 16;

/// Below this cone, in half windows, a spot is taken to grow no more: a cone of 0 has none.
inline constexpr double narrowest_cone = 1e-3;

/// Width of the cone of a sample's light on a plane, relative to its width at the hologram.
///
/// distance_m  from the plane to the hologram
/// z_m         of the sample, not 0
inline double narrowing(double distance_m, double z_m) {
  return std::abs(z_m - distance_m) / std::abs(z_m);
}

/// Width of the diffraction spot that a cone of `cone` windows makes of a sample at depth z_m.
inline double spot_of(double wavelength_m, double z_m, double cone, double window_m) {
  return footprint_kernel::footprint_spot(window_m / 2 / std::abs(z_m),
                                          std::max(cone, narrowest_cone), 1 / wavelength_m);
}

/// Half width of the geometric footprint.
inline double half_width_of(double cone, double window_m, double distance_m, double z_m) {
  return footprint_kernel::footprint_axis(cone, window_m / 2, narrowing(distance_m, z_m),
                                          window_m / 2 / std::abs(z_m), 1, 0)
      .half_width;
}

/// Along one axis.
struct Footprint {
  double half_m = 0;  // geometric half width
  double spot_m = 0;  // width of the diffraction spot
  double tail_spots = plane_wave_tail;

  /// The sample is gathered as plane waves.
  bool is_near(double plane_wave_spots = default_plane_wave_spots) const {
    return half_m < plane_wave_spots * spot_m;
  }
  /// Half width with the tail that gathering keeps.
  double reach_m(double plane_wave_spots = default_plane_wave_spots) const {
    return half_m + (is_near(plane_wave_spots) ? tail_spots * spot_m : 0);
  }
};

/// Footprint of a sample at depth z_m, on its way to a tile, on the WRPs `distance_m` before the
/// hologram.
inline Footprint footprint_of(const Plan& plan, int axis, double distance_m, double z_m) {
  const double cone = plan.tiling.cone[axis], window_m = plan.tile_window_m()[axis];
  return {half_width_of(cone, window_m, distance_m, z_m),
          spot_of(plan.hologram.wavelength_m, z_m, cone, window_m)};
}

/// Spot of a sample at the hologram, of light up to the plan's largest sine: a pixel wide, less
/// beside tilted light, and more where a part of the band is gathered.
inline double spot_at_hologram_m(const Plan& plan, int axis) {
  return plan.hologram.wavelength_m / 2 / plan.hologram.largest_sine[axis];
}

/// Footprint of a sample at depth z_m on a plane at the hologram near it.
inline Footprint footprint_at_hologram(const Plan& plan, int axis, double z_m) {
  return {std::abs(z_m) * plan.hologram.largest_sine[axis], spot_at_hologram_m(plan, axis),
          near_hologram_tail};
}

}  // namespace raywave
