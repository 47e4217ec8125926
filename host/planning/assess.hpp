// SPDX-License-Identifier: Apache-2.0
/// The plan of one choice: where planes stand, which rays start on them, what it leaves wrong.
#pragma once

#include <optional>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// True for scenes on both sides of the hologram, or in it, that are sampled from before them and
/// gathered there. On one side alone, the lattice from the hologram's centre serves, but for what
/// is seen near the hologram through an eyepiece.
bool meets_hologram(const Scene& scene, const World& world);

/// The plan with the scene's own propagation, which is not "auto" of Method::wrp, layers and tiles.
///
/// moved_from  as make_plan
/// samples     the lattice, where another plan's is shared
/// images      none: they are found, and kept there
/// throws      as make_plan
Plan assess(const Scene& scene, const World& world, Method method, int rays_per_axis,
            bool has_doubles, const Plan* moved_from, const std::optional<LatticePlan>& samples,
            std::optional<Images>& images);

}  // namespace raywave
