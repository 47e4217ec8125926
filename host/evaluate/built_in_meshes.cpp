// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/built_in_meshes.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace raywave {

Mesh unit_sphere(int rings) {
  const int sectors = 2 * rings;
  Mesh mesh;
  for (int j = 0; j <= rings; ++j) {
    for (int i = 0; i <= sectors; ++i) {
      const double a = 2 * std::numbers::pi * (i % sectors) / sectors,
                   b = std::numbers::pi * j / rings, r = j % rings ? std::sin(b) : 0;
      mesh.positions.push_back(0.5 * glm::dvec3(r * std::cos(a), std::cos(b), r * std::sin(a)));
      mesh.normals.push_back(2.0 * mesh.positions.back());
      mesh.uvs.emplace_back(0);
    }
  }
  const auto at = [&](int i, int j) { return static_cast<unsigned>(j * (sectors + 1) + i); };
  for (int j = 0; j < rings; ++j) {
    for (int i = 0; i < sectors; ++i) {
      if (j > 0) mesh.triangles.emplace_back(at(i, j), at(i + 1, j), at(i, j + 1));
      if (j + 1 < rings) mesh.triangles.emplace_back(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return finish_mesh(std::move(mesh), Normals::file);
}

Mesh flat_rectangle(double height) {
  Mesh mesh;
  for (const double y : {-height / 2, height / 2}) {
    for (const double x : {-0.5, 0.5}) mesh.positions.emplace_back(x, y, 0);
  }
  mesh.normals.resize(4, glm::dvec3(0));  // zero: the normal of the face is used
  mesh.uvs.resize(4, glm::dvec2(0));
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}};
  return finish_mesh(std::move(mesh), Normals::flat);
}

}  // namespace raywave
