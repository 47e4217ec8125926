// SPDX-License-Identifier: Apache-2.0
/// What part of the hologram's window a point's light reaches at angles that the pixels can show.
#pragma once

#include <utility>

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

}  // namespace raywave
