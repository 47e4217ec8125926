// SPDX-License-Identifier: Apache-2.0
/// Clouds of points, which become meshes: a disc or a small ball stands for each point.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "host/scene/read_data.hpp"

namespace raywave {

/// Distance from each point to the fifth nearest of the others, or to the farthest where there are
/// fewer; 0 for a single one. Points that lie in one place count as several.
std::vector<double> distances_to_fifth(std::span<const glm::dvec3> points);

/// A matt material that shows a picture.
MeshMaterial white_material(const std::string& name);

/// A matt material that shows colours of vertices.
MeshMaterial coloured_material(const std::string& name);

/// Gives a mesh of vertices alone its triangles. A point with a normal becomes a disc across it, of
/// six corners; one without becomes a ball of eight triangles, which shows its colour unlit where
/// it has one. Each covers as much as a disc of its radius, the ball in the mean of all directions.
///
/// mesh     of at least one position, without triangles; colours are kept
/// radii    of the points, in the mesh's units; where they are missing or no number above 0, the
///          distance to the fifth neighbour, and at most four times its median: of points strewn
///          over a surface, discs leave less than 1 % of it open
/// returns  what is done, for whoever gave the points
/// throws   InputError for points of no radius that lie in one place, and too many points
std::string cover_points(Mesh& mesh, std::vector<double> radii);

}  // namespace raywave
