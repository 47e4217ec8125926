// SPDX-License-Identifier: Apache-2.0
/// Worlds made in the test itself, without mesh files, and their sample tables.
#pragma once

#include <cmath>
#include <complex>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include "host/bvh.hpp"
#include "host/gatherer.hpp"
#include "host/mesh.hpp"
#include "host/plan.hpp"
#include "host/reference/rays.hpp"
#include "host/samples.hpp"
#include "host/scene.hpp"

namespace raywave::test {

/// A surface in world coordinates.
struct Surface {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<glm::vec3> normals;  // empty: of the faces
  bool closed = false;

  void triangle(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
  }
};

/// columns x rows squares, each cut in two; `point` maps [0, 1]^2, (0, 0) to (1, 1).
inline Surface grid(int columns, int rows, const std::function<glm::dvec3(double s, double t)>& point) {
  Surface g;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i) g.positions.push_back(point(double(i) / columns, double(j) / rows));
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (columns + 1) + i); };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      g.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      g.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return g;
}

/// A rectangle of two triangles, at `centre` with half axes `u` and `v`.
inline Surface rectangle(glm::dvec3 centre, glm::dvec3 u, glm::dvec3 v) {
  return grid(1, 1, [=](double s, double t) { return centre + (2 * s - 1) * u + (2 * t - 1) * v; });
}

/// A closed sphere, longitude and latitude, with its true normals. It lies within radius (1 - cos(pi / 2 rings)) 2 of the true sphere.
inline Surface sphere(glm::dvec3 centre, double radius, int rings) {
  Surface s;
  s.closed = true;
  const int sectors = 2 * rings;
  for (int j = 0; j <= rings; ++j) {
    const double a = std::numbers::pi * j / rings, r = j == 0 || j == rings ? 0 : std::sin(a);
    for (int i = 0; i < sectors; ++i) {
      const double b = std::numbers::pi * i / rings;
      const glm::dvec3 n(r * std::cos(b), std::cos(a), r * std::sin(b));
      s.positions.push_back(centre + radius * n);
      s.normals.emplace_back(n);
    }
  }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * sectors + i % sectors); };
  for (int j = 0; j < rings; ++j) {
    for (int i = 0; i < sectors; ++i) {
      if (j > 0) s.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (j < rings - 1) s.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return s;
}

/// A closed axis-parallel box.
inline Surface box(glm::dvec3 centre, glm::dvec3 half) {
  Surface b;
  b.closed = true;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      glm::dvec3 n(0), u(0), v(0);
      n[axis] = side * half[axis];
      u[(axis + 1) % 3] = half[(axis + 1) % 3];
      v[(axis + 2) % 3] = side * half[(axis + 2) % 3];
      const auto c = centre + n;
      b.triangle(c - u - v, c + u - v, c + u + v);
      b.triangle(c - u - v, c + u + v, c - u + v);
    }
  }
  return b;
}

inline Surface flipped(Surface s) {
  for (auto& t : s.triangles) std::swap(t.y, t.z);
  return s;
}

/// Scene and world that grow together.
struct Stage {
  Scene scene;
  World world;

  Stage() {
    scene.hologram = {{96, 80}, {8e-6, 8e-6}, 638e-9};
    scene.sampling.pitch_m = 25e-6;
    scene.sampling.antialias = false;  // closed forms speak of the rays through the cells' centres
  }

  Stage& add(const Surface& s, const Material& material = {}) {
    const auto first = static_cast<std::uint32_t>(world.positions.size());
    const auto object = static_cast<int>(scene.objects.size());
    std::vector<glm::vec3> normals = s.normals;
    if (normals.empty()) {
      normals.resize(s.positions.size());
      for (const auto& t : s.triangles) {
        const auto n = normalize(cross(s.positions[t.y] - s.positions[t.x], s.positions[t.z] - s.positions[t.x]));
        for (int i = 0; i < 3; ++i) normals[t[i]] = glm::vec3(n);
      }
    }
    for (const auto& p : s.positions) {
      if (world.positions.empty()) world.min_m = world.max_m = p;
      world.min_m = min(world.min_m, p);
      world.max_m = max(world.max_m, p);
      world.positions.push_back(p);
    }
    world.normals.insert(world.normals.end(), normals.begin(), normals.end());
    world.uvs.resize(world.positions.size());
    for (const auto& t : s.triangles) world.triangles.push_back(t + first);
    world.triangle_object.resize(world.triangles.size(), object);
    world.object_closed.push_back(s.closed);
    scene.materials.push_back(material);
    Object o;
    o.material = object;
    scene.objects.push_back(o);
    return *this;
  }
};

/// The stage on a device, its sample table read back, and the triangles as the device has them.
struct Rig {
  Scene scene;
  Plan plan;
  DeviceScene arrays;
  SampleTable table;
  std::vector<device::Sample> samples;
  std::vector<std::int32_t> first_of_cell;
  std::vector<std::uint32_t> lit;
  std::vector<device::Triangle> triangles;
  std::vector<device::TriangleShading> shading;

  Rig(const cl::Device& device, const Stage& stage, Method method = Method::wrp)
      : scene(stage.scene),
        plan(make_plan(scene, stage.world, cl::FftBackend::host, method)),
        arrays(device, scene, stage.world, plan),
        table(device, plan, arrays),
        samples(table.samples.read()),
        first_of_cell(table.first_of_cell.read()),
        lit(table.lit.read()),
        triangles(arrays.triangles.read()),
        shading(arrays.shading.read()) {
    samples.resize(static_cast<std::size_t>(table.count));
  }
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  int object_of(const device::Sample& s) const { return shading[static_cast<std::size_t>(s.triangle)].material; }
};

inline glm::dvec3 place(const device::Sample& s) { return {s.x, s.y, s.z}; }
inline glm::dvec3 normal(const device::Sample& s) { return {s.nx, s.ny, s.nz}; }

using Random = std::mt19937;
inline double uniform(Random& random, double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

using reference::free_way;
using reference::Seen;

}  // namespace raywave::test
