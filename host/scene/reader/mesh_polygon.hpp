// SPDX-License-Identifier: Apache-2.0
/// Polygons in space, cut into triangles.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace raywave {

enum class Cut { whole, twisted, crossing };

/// Cuts a polygon into triangles that cover as much of its best plane as its outline encloses
/// there, to 1e-6. Corners may repeat, and outlines may reach holes along an edge and back.
///
/// triangles  receives the numbers of corners, turning as the polygon does; nothing of a polygon
///            without area
/// returns    twisted: four corners that no plane shows as an outline, cut along the shorter
///            diagonal; crossing: the outline crosses itself, and triangles mean nothing
Cut cut_polygon(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles);

/// The same in the plane, by constrained Delaunay triangulation (CGAL), of an outline that runs
/// counter-clockwise. The area is for the caller to check.
bool cut_outline(std::span<const glm::dvec2> outline, std::vector<glm::uvec3>& triangles);

}  // namespace raywave
