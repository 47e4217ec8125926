// SPDX-License-Identifier: Apache-2.0
#include "host/scene/points.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>

#include "host/common/error.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

/// A convex body covers a quarter of its surface, in the mean of all directions.
const double reach_of_ball = std::sqrt(std::numbers::pi / std::sqrt(3.0)),
             reach_of_disc = std::sqrt(std::numbers::pi / (1.5 * std::sqrt(3.0)));

/// Corners around one point, and triangles of their numbers.
struct Shape {
  std::vector<glm::dvec3> corners;  // from the point, in its radii
  std::vector<glm::uvec3> triangles;
};

Shape ball() {
  const double r = reach_of_ball;
  Shape shape{{{r, 0, 0}, {-r, 0, 0}, {0, r, 0}, {0, -r, 0}, {0, 0, r}, {0, 0, -r}}, {}};
  for (unsigned octant = 0; octant < 8; ++octant) {
    const unsigned x = octant & 1, y = 2 + (octant >> 1 & 1), z = 4 + (octant >> 2);
    const bool is_turned = ((octant ^ octant >> 1 ^ octant >> 2) & 1) != 0;
    shape.triangles.push_back(is_turned ? glm::uvec3(x, z, y) : glm::uvec3(x, y, z));
  }
  return shape;
}

Shape disc(const glm::dvec3& normal) {
  const auto least = glm::abs(normal);
  const glm::dvec3 other = least.x < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const auto across = glm::normalize(glm::cross(other, normal)), up = glm::cross(normal, across);
  Shape shape{{}, {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}};
  for (int i = 0; i < 6; ++i) {
    const double angle = i * std::numbers::pi / 3;
    shape.corners.push_back(reach_of_disc * (std::cos(angle) * across + std::sin(angle) * up));
  }
  return shape;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Of three digits. The readers, which use this, link nothing that has number_text.
std::string short_text(double value) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 3);
  return {text.data(), end.ptr};
}

/// Where a file's points have colours: a material that shows them.
void wear_colours(Mesh& mesh, bool is_lit) {
  if (mesh.colours.empty() || !mesh.materials.empty()) return;
  auto material = coloured_material("colours of points");
  if (!is_lit) material.look.model = LookModel::unlit;
  if (std::any_of(mesh.colours.begin(), mesh.colours.end(), [](const auto& c) { return c.w < 1; }))
    material.look.alpha_mode = AlphaMode::blend;
  mesh.materials.push_back(material);
}

}  // namespace

MeshMaterial white_material(const std::string& name) {
  MeshMaterial material{name, {}, {}};
  material.look.ambient = glm::dvec3(1);
  material.look.two_sided = 1;
  return material;
}

MeshMaterial coloured_material(const std::string& name) {
  auto material = white_material(name);
  material.look.vertex_colours = 1;
  return material;
}

std::string cover_points(Mesh& mesh, std::vector<double> radii) {
  const auto points = std::move(mesh.positions), normals = std::move(mesh.normals);
  const auto colours = std::move(mesh.colours);
  const auto count = points.size();
  require_at_most(count, most_triangles_of_file / 8, "points");
  const auto is_radius = [](double r) { return r > 0 && std::isfinite(r); };
  radii.resize(count, 0);
  if (!std::all_of(radii.begin(), radii.end(), is_radius)) {
    const auto apart = distances_to_fifth(points);
    const double most = 4 * median_of(apart);  // an outlier is no larger than the others
    for (std::size_t i = 0; i < count; ++i)
      if (!is_radius(radii[i])) radii[i] = std::min(apart[i], most);
    if (!std::any_of(radii.begin(), radii.end(), is_radius))
      throw InputError(
          "points in one place: no distance tells how large they are; "
          "give each a radius");
  }

  mesh.positions.clear();
  mesh.normals.clear();
  mesh.uvs.clear();
  mesh.colours.clear();
  const auto a_ball = ball();
  std::size_t discs = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto normal = i < normals.size() ? normals[i] : glm::dvec3(0);
    const bool is_disc = glm::dot(normal, normal) > 0.5;
    discs += is_disc ? 1 : 0;
    const auto& shape = is_disc ? disc(normal) : a_ball;
    const auto first = static_cast<glm::uint>(mesh.positions.size());
    for (const auto& corner : shape.corners) {
      mesh.positions.push_back(points[i] + radii[i] * corner);
      mesh.normals.push_back(is_disc ? normal : glm::normalize(corner));
      if (!colours.empty()) mesh.colours.push_back(colours[i]);
    }
    for (const auto& triangle : shape.triangles) mesh.triangles.push_back(first + triangle);
  }
  mesh.uvs.resize(mesh.positions.size(), glm::dvec2(0));
  wear_colours(mesh, discs == count);
  mesh.triangle_material.assign(mesh.triangles.size(), mesh.materials.empty() ? -1 : 0);
  return std::to_string(count) + " points without triangles are shown as " +
         (discs == count ? "discs"
          : discs == 0   ? "balls"
                         : "discs and balls") +
         " of radius " + short_text(median_of(radii)) + " (median, in the units of the mesh)";
}

}  // namespace raywave
