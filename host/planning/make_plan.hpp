// SPDX-License-Identifier: Apache-2.0
/// From a scene to its plan: how light travels, in how many layers of depth and tiles. A pure
/// function, printed by `raywave plan` and followed by `raywave render`.
#pragma once

#include <functional>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/memory.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Error of the field, over the field, from which refinement does not find its pictures: 11 to 21
/// dB were measured at 0.66 to 1.06, where 37 and more were predicted.
inline constexpr double hopeless_error = 0.6;

/// The plan of a scene at its own settings. hologram.tiles "auto" is one tile here, unless virtual
/// planes need more; fitting_plan knows how many fit into memory.
///
/// rays_per_axis  of Method::rays: directions across the cone that the SLM's pixels can show
/// has_doubles    whether the device can compute in doubles, for accuracy.precision "auto"
/// moved_from     the plan of the same scene before its objects moved, if any: its tiles and its
///                predicted errors, which take long, are kept
/// throws         InputError when the scene cannot be computed as asked (WRP behind the scene or
///                through the hologram, refinement of a field with a hopeless_error, more than
///                1024 WRPs, tiles that would not add up to the hologram)
Plan make_plan(const Scene& scene, const World& world, Method method = Method::wrp,
               int rays_per_axis = 100, bool has_doubles = false, const Plan* moved_from = nullptr);

/// The plan by which a lens looks at a scene: make_plan's, but for mirrors and glass in scenes that
/// cross the hologram, which have no hologram.
Plan lens_plan(const Scene& scene, const World& world);

/// make_plan of the scene. Where hologram.tiles is open, the plan has the fewest tiles whose needs
/// leave an eighth of the memory to the surface samples: sides are divided in turn, a tile's longer
/// side first, down to least_tile pixels. Where no division fits, it is the last plan tried, whose
/// needs tell why; that in one piece where results or triangles alone are too much.
Plan fitting_plan(const Scene& scene, const World& world, const MemoryLimits& limits,
                  const MemoryUse& use = {}, int rays_per_axis = 100, bool has_doubles = false);

/// A plan from which make_plan, as from `moved_from`, goes on to every pose of a scene that moves:
/// its tiles fit into the memory that each pose needs, and its propagation and depth layers serve
/// all of them. So the plan of a pose does not depend on the poses before it.
///
/// poses    of the scene, the first one first; receives those that the plan needs, by which it can
///          be made again
/// move_to  moves scene and world to a pose; they are left at the last one
/// throws   as make_plan, what `move_to` throws, and InputError when no plan serves all poses
Plan fitting_plan_of_poses(Scene& scene, World& world, std::vector<int>& poses,
                           const std::function<void(int pose)>& move_to, const MemoryLimits& limits,
                           const MemoryUse& use = {}, int rays_per_axis = 100,
                           bool has_doubles = false);

}  // namespace raywave
