// SPDX-License-Identifier: Apache-2.0
/// What the hologram's centre sees in mirrors and through glass, for planning: a few rays, followed
/// on the host. kernels/samples/paths.cl computes the samples.
#pragma once

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// Where the radiance of what mirrors and glass show is farther off, trace.bounces "auto" fits
/// paths, and plans have a warning.
constexpr double most_points_error = 0.03;

/// The virtual points of the scene that a plan is made for. Needs its window, lattice-independent:
/// size, pitch, bounces and lighting.
Images images_of(const World& world, const Plan& plan);

}  // namespace raywave
