// SPDX-License-Identifier: Apache-2.0
/// Surfaces made in code, harmless and not, and rays at them: what tests and the self-test feed to
/// a device.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <random>
#include <span>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/reference/rays.hpp"
#include "host/scene/scene.hpp"
#include "host/trace/samples.hpp"

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

// Scenes made in code, without mesh files, and their sample tables, for tests and the self-test.

/// Scene and world that grow together.
struct Stage {
  Scene scene;
  World world;

  /// 96 x 80 pixels of 8 um, 638 nm, samples 25 um apart without antialiasing: closed forms speak
  /// of the rays through the cells' centres. Light travels over WRPs.
  Stage();

  /// One more object of that material.
  Stage& add(const Surface& s, const Material& material = {});
};

/// A shiny ball before a tilted wall that lies 0.5 mm behind its centre, lit by a sun and a lamp:
/// 61 x 47 pixels of 8 um x 10 um, samples 50 um apart, with shadows.
Stage ball_before_wall(double z_m);

/// Corners of the triangles of a tree on a device, in leaf order.
std::vector<Corners> corners_of(const DeviceTree& tree);

/// The stage on a device, its sample table read back, and the triangles as the device has them.
struct Rig {
  Scene scene;
  Plan plan;
  std::vector<PlacedLight> lights;
  DeviceScene arrays;
  SampleTable table;
  std::vector<device::Sample> samples;
  std::vector<std::int32_t> first_of_cell;
  std::vector<std::uint32_t> visibility_masks, lit;
  std::vector<device::Triangle> triangles;
  std::vector<Corners> corners;  // corners of the triangles

  /// keep_unseen  as SampleTable has it
  Rig(const cl::Device& device, const Stage& stage, Method method = Method::wrp,
      bool keep_unseen = true);
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  /// True when part (i, j) of the hologram's window sees a sample.
  bool sees(std::size_t sample, int i, int j) const {
    const auto bit = static_cast<std::size_t>(j * table.visibility_parts + i);
    return visibility_masks[sample * table.visibility_words() + bit / 32] >> (bit % 32) & 1u;
  }

  int object_of(const device::Sample& s) const {
    return triangles[static_cast<std::size_t>(s.triangle)].material;
  }
};

/// Scene frame.
inline glm::dvec3 place(const device::Sample& s) { return {s.x, s.y, s.z}; }
inline glm::dvec3 normal(const device::Sample& s) { return {s.nx, s.ny, s.nz}; }

}  // namespace raywave::reference
