// SPDX-License-Identifier: Apache-2.0
/// The plan of one choice: where planes stand, which rays start on them, what it leaves wrong.
#pragma once

#include <optional>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// True for scenes that reach to the hologram's plane from both sides, or cross it.
bool crosses_hologram(const World& world);

/// From so far on, surfaces do not meet the hologram.
double near_distance_m(const Plan& plan);

/// True for scenes in or near the hologram that are sampled from before them and gathered there.
/// Mirrors, glass and refinement know the lattice from the hologram's centre alone.
bool meets_hologram(const Scene& scene, const World& world);

/// True for scenes that cross it with mirrors or glass, which samples do not follow there: they
/// have no hologram, and rays show what a lens sees of them.
bool shows_lens_alone(const Scene& scene, const World& world);

/// True for scenes farther away that can be gathered there, too: their light spreads little on the
/// way to the hologram, and nothing asks for WRPs.
bool serves_at_hologram(const Scene& scene, const Plan& plan);

/// The plan with the scene's own propagation, which is not "auto" of Method::wrp, layers and tiles.
///
/// is_near     of Method::points: surfaces are sampled from before the hologram; of Method::rays:
///             they cross it
/// moved_from  as make_plan
/// samples     the lattice, where another plan's is shared
/// images      none: they are found, and kept there
/// throws      as make_plan
Plan assess(const Scene& scene, const World& world, Method method, bool is_near, int rays_per_axis,
            bool has_doubles, const Plan* moved_from, const std::optional<LatticePlan>& samples,
            std::optional<Images>& images);

}  // namespace raywave
