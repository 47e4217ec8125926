// SPDX-License-Identifier: Apache-2.0
/// What an eye sees of the scene through the middle of the hologram, all depths in focus.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>

#include "host/plan/plan.hpp"
#include "host/view/lens.hpp"

namespace raywave {

/// The picture of `raywave preview`, for lens_picture: one ray to a pixel, at most 320 pixels to a
/// side.
///
/// vertices  of the scene, as it stands
/// z_m       of the plane that is measured; empty: the middle of the scene's extent
/// window_m  empty: all of the scene that the hologram's pixels can show
/// viewer    whose eyepiece and pupil, where there is one, are looked through instead
LensSpec preview_spec(std::span<const glm::dvec3> vertices, const Plan& plan,
                      std::optional<double> z_m, std::optional<glm::dvec2> window_m,
                      glm::dvec2 view, const ViewerSpec& viewer);

}  // namespace raywave
