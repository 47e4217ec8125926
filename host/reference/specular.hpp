// SPDX-License-Identifier: Apache-2.0
/// Paths over mirrors and through glass between two points, solved in double precision on perfect
/// planes and spheres: the oracle of kernels/samples/paths.cl.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

namespace raywave::reference {

/// A perfect mirror or the surface of glass.
struct PerfectSurface {
  glm::dvec3 centre{0};         // centre of the sphere; a point of the plane
  glm::dvec3 normal{0, 0, -1};  // normal of the plane, of any length
  // Radius of the sphere; 0: a plane. Negative: the side that is farther along the ray is met
  double radius = 0;
  // Index of refraction beyond it; 0: a mirror
  double beyond = 0;
};

/// The path of light from a point to a place on the hologram, followed backwards.
struct SolvedPath {
  glm::dvec2 tangents{0};  // at the hologram, of the way back
  // From the hologram on; negative where the light converges to a point before it
  double optical_m = 0;
  double share = 1;       // by Fresnel's formulas; mirrors reflect all
  glm::dvec3 arrival{0};  // direction of the way back at the point, unit length
  double spread_m2 = 0;   // |d (point, across the path) / d (tangents)|
};

/// Solves by Newton's method, with differences of rays.
///
/// place_m  on the hologram z = 0
/// point_m  where the light comes from
/// from     tangents to begin with
/// start_m  z from which rays are followed: before the scene where that stands before the hologram
/// Nothing where no path is found near these.
std::optional<SolvedPath> solve_path(const std::vector<PerfectSurface>& surfaces,
                                     glm::dvec2 place_m, glm::dvec3 point_m, glm::dvec2 from,
                                     double start_m = 0);

}  // namespace raywave::reference
