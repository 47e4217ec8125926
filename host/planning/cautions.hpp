// SPDX-License-Identifier: Apache-2.0
/// Notes about parts of a scene that its hologram does not show.
#pragma once

#include <string>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// Lines where what mirrors and glass show is not as bright as it is.
std::vector<std::string> image_warnings(const Plan& plan);

/// A line where wrp.grid, as it is given, leaves parts of the scene out.
std::vector<std::string> cut_warnings(const Scene& scene, const World& world, const Plan& plan);

/// A line for objects so thin, as the hologram's centre sees them, that rays of the lattice miss
/// parts of them or all. Thinness is the area seen over the diagonal of its box.
std::vector<std::string> thin_object_warnings(const Scene& scene, const World& world,
                                              const Plan& plan);

}  // namespace raywave
