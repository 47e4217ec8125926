// SPDX-License-Identifier: Apache-2.0
/// Surfaces made in code, harmless and not, and rays at them: what tests and the self-test feed to
/// a device.
#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <random>
#include <span>
#include <vector>

#include "host/reference/rays.hpp"

namespace raywave::reference {

using Random = std::mt19937;
double uniform(Random& random, double low, double high);
glm::dvec3 in_box(Random& random, double half);
glm::dvec3 unit_vector(Random& random);

/// A surface in world coordinates.
struct Surface {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<glm::vec3> normals;  // empty: of the faces
  bool closed = false;

  void triangle(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c);
};

/// columns x rows squares, each cut in two; `point` maps [0, 1]^2, (0, 0) to (1, 1).
Surface grid(int columns, int rows, const std::function<glm::dvec3(double s, double t)>& point);

/// A rectangle of two triangles, at `centre` with half axes `u` and `v`.
Surface rectangle(glm::dvec3 centre, glm::dvec3 u, glm::dvec3 v);

/// A closed sphere, longitude and latitude, with its true normals. It lies within radius (1 -
/// cos(pi / 2 rings)) 2 of the true sphere.
Surface sphere(glm::dvec3 centre, double radius, int rings);

/// A closed ring around the z axis, 48 x 24 squares; its radii are 0.7 and 0.3 of `size`.
Surface torus(double size);

/// A closed axis-parallel box.
Surface box(glm::dvec3 centre, glm::dvec3 half);

/// The surface with the other winding.
Surface flipped(Surface s);

/// Random triangles, among them slivers, points, lines and triangles that are there twice.
Surface soup(Random& random, int count, double size);

/// Rays through the box of half edge `size`, whose directions are unit vectors times 1e-3 to 1e3, a
/// third of them parallel to an axis.
std::vector<Ray> random_rays(Random& random, int count, double size);

/// Rays from three times `size` away at random points of random edges, and at random vertices, of a
/// closed mesh about the origin. None is so nearly tangential that it may rightly pass outside.
std::vector<Ray> rays_at_edges(Random& random, std::span<const Corners> triangles,
                               std::size_t count, double size);

/// The rays as floats hold them.
std::vector<Ray> as_float(std::vector<Ray> rays);

}  // namespace raywave::reference
