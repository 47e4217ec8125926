// SPDX-License-Identifier: Apache-2.0
/// Which WRPs need not be computed, since no light of the scene falls into them.
#pragma once

#include <glm/vec2.hpp>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// How far from a WRP's middle, along each axis, chief rays of samples at this depth may cross its
/// plane and still leave light on it.
glm::dvec2 reach_of_light(const Plan& plan, const DepthLayer& layer, double z_m);

/// The WRPs into which light of some triangle falls on its way to the hologram; all of them when
/// there is none at all, so that whoever looks at them finds out why.
std::vector<Wrp> lit_wrps(const Plan& plan, const World& world, std::vector<Wrp> wrps);

}  // namespace raywave
