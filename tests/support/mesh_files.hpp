// SPDX-License-Identifier: Apache-2.0
/// Meshes as their files say, looked at by their areas, colours and notes.
#pragma once

#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <string>
#include <utility>

#include "host/scene/mesh.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"

namespace raywave::test {

inline const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", face = "f 1 2 3\n";

inline Mesh load(const std::filesystem::path& file) {
  return load_mesh(file, Normals::file, "here");
}

inline std::string refusal(const std::filesystem::path& file) {
  return input_error_of([&] { load(file); });
}

/// Area of the triangles, and of what they show towards `up`.
inline std::pair<double, double> areas_of(const Mesh& mesh, const glm::dvec3& up = {0, 0, 1}) {
  std::pair<double, double> sum{0, 0};
  for (const auto& t : mesh.triangles) {
    const auto twice = glm::cross(mesh.positions[t.y] - mesh.positions[t.x],
                                  mesh.positions[t.z] - mesh.positions[t.x]);
    sum.first += glm::length(twice) / 2;
    sum.second += glm::dot(twice, up) / 2;
  }
  return sum;
}

inline double area_of(const Mesh& mesh) { return areas_of(mesh).first; }

inline const MeshMaterial& material_of(const Mesh& mesh, std::size_t triangle) {
  REQUIRE(triangle < mesh.triangle_material.size());
  REQUIRE(mesh.triangle_material[triangle] >= 0);
  return mesh.materials.at(static_cast<std::size_t>(mesh.triangle_material[triangle]));
}

inline std::string notes_of(const Mesh& mesh) {
  std::string all;
  for (const auto& note : mesh.notes) all += note + "\n";
  for (const auto& material : mesh.materials)
    for (const auto& note : material.notes) all += material.name + ": " + note + "\n";
  return all;
}

inline float linear(double srgb) {
  return static_cast<float>(srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4));
}

/// All vertices have this colour, given in sRGB.
inline void check_colour(const Mesh& mesh, const glm::vec3& srgb) {
  REQUIRE(mesh.colours.size() == mesh.positions.size());
  for (const auto& c : mesh.colours)
    for (int i = 0; i < 3; ++i) CHECK(std::abs(c[i] - linear(srgb[i])) < 2e-5f);
  CHECK(material_of(mesh, 0).look.vertex_colours == 1);
}

}  // namespace raywave::test
