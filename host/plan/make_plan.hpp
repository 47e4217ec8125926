// SPDX-License-Identifier: Apache-2.0
/// From a scene to its plan: where the WRPs stand, which rays start on them, what it takes. A pure
/// function, printed by `raywave plan` and followed by `raywave render`.
#pragma once

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// The plan of a scene at its own settings. hologram.tiles "auto" is one tile here; fitting_plan
/// (host/plan/memory.hpp) knows how many fit.
///
/// rays_per_axis  of Method::rays: directions across the cone that the SLM's pixels can show
/// has_doubles    whether the device can compute in doubles, for accuracy.precision "auto"
/// moved_from     the plan of the same scene before its objects moved, if any: its tiles and its
///                predicted errors, which take long, are kept
/// throws         InputError when the scene cannot be computed as asked (WRP behind the scene or
///                through the hologram, more than 1024 WRPs, tiles that would not add up to the
///                hologram)
Plan make_plan(const Scene& scene, const World& world, Method method = Method::wrp,
               int rays_per_axis = 100, bool has_doubles = false, const Plan* moved_from = nullptr);

}  // namespace raywave
