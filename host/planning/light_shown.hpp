// SPDX-License-Identifier: Apache-2.0
/// What part of the hologram's window a point's light reaches at angles that the pixels can show.
#pragma once

#include <algorithm>
#include <utility>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// The part, along one axis and from -half to half a window, that light of the point at `x_m` in
/// the plane z_m reaches no more steeply than the pixels can show, and having crossed the planned
/// WRPs. The first is beyond the second where there is none.
std::pair<double, double> part_seen(const Plan& plan, int axis, double x_m, double z_m);

/// Share, along one axis, of the hologram's window from which the point at `x_m` in the plane z_m
/// is seen no more steeply than the pixels can show.
double share_within_pixels(const Plan& plan, int axis, double x_m, double z_m);

/// The part of that share whose light also crosses the planned WRPs.
double share_seen(const Plan& plan, int axis, double x_m, double z_m);

// The stop behind the SLM, and the frequencies that light has there.

inline constexpr double band_edge = 0.5;  // cycles per pixel

/// Cycles per pixel of light with this sine to the axis.
double cycles_per_sine(const Plan& plan, int axis);

/// Frequency, in cycles per pixel, at place `to_m` of the SLM, of light from the place `from_m` in
/// the plane z_m.
double frequency_at(const Plan& plan, int axis, double from_m, double z_m, double to_m);

/// Calls `use` with each part of the SLM's band that the stop passes along an axis. Frequencies
/// that lie a whole number apart are the same to pixels.
template <class Use>
void for_passed(const StopSpec& stop, int axis, const Use& use) {
  for (const int replica : {-1, 0, 1}) {
    const double low = std::max(stop.centre[axis] - stop.size[axis] / 2 + replica, -band_edge),
                 high = std::min(stop.centre[axis] + stop.size[axis] / 2 + replica, band_edge);
    if (low < high) use(low, high);
  }
}

/// Refuses a stop that passes none of the light that the scene can send, judged by its box.
///
/// throws  InputError naming the key that mends it
void require_light_through_stop(const Plan& plan, const World& world);

}  // namespace raywave
