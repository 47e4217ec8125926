// SPDX-License-Identifier: Apache-2.0
/// Fans: the paper's bundles of rays that start from every pixel of a plane in the same directions.
#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <vector>

#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Rows or columns of a fan (paper, Eq. 4-7): tangents across an aperture `window_m` wide seen from
/// `distance_m` away, turned by shift / distance, spaced so that neighbours lie `pitch_m` apart at
/// `depth_m` behind the plane.
std::vector<double> fan_tangents(double window_m, double distance_m, double shift_m, double depth_m,
                                 double pitch_m);

/// Gives a WRP of the plan its fan.
///
/// throws  InputError when sampling.pitch needs more than 16777216 rays per pixel
void add_fan(const Scene& scene, const Plan& plan, Wrp& wrp);

/// The plane of Method::points and Method::rays: it stands at the hologram itself, and its fan
/// covers all directions that the SLM's pixels can show.
///
/// tile  number of the tile that it is as large as
Wrp plane_at_hologram(const Plan& plan, std::size_t tile, glm::dvec2 largest_tangent,
                      int rays_per_axis);

}  // namespace raywave
