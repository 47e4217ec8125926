// SPDX-License-Identifier: Apache-2.0
#include "host/scene/points.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <sstream>

#include "host/scene/mesh.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

std::vector<glm::dvec3> strewn(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-1, 1);
  std::vector<glm::dvec3> points;
  for (int i = 0; i < count; ++i) points.emplace_back(place(random), place(random), place(random));
  return points;
}

/// Of a triangle, twice as long as its area.
glm::dvec3 normal_of(const Mesh& mesh, const glm::uvec3& t) {
  return glm::cross(mesh.positions[t.y] - mesh.positions[t.x],
                    mesh.positions[t.z] - mesh.positions[t.x]);
}

Mesh read(const std::string& text, const std::string& name = "cloud.ply") {
  const Folder folder;
  return load_mesh(folder.write(name, text), Normals::file, "here");
}

std::string header(int count, const std::string& properties) {
  std::istringstream names(properties);
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) + "\n", name;
  while (names >> name) text += "property float " + name + "\n";
  return text + "end_header\n";
}

glm::dvec3 middle_of(const Mesh& mesh) {
  glm::dvec3 sum(0);
  for (const auto& p : mesh.positions) sum += p;
  return sum / static_cast<double>(mesh.positions.size());
}

TEST_CASE("the fifth neighbour is that of all distances, sorted") {
  auto points = strewn(300, 1);
  points.insert(points.end(), points.begin(), points.begin() + 20);  // twice in one place
  const auto found = distances_to_fifth(points);
  REQUIRE(found.size() == points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<double> all;
    for (const auto& other : points) all.push_back(glm::length(other - points[i]));
    std::sort(all.begin(), all.end());
    CHECK(found[i] == Catch::Approx(all[5]).epsilon(1e-12));
  }
  CHECK(distances_to_fifth(strewn(1, 2)) == std::vector<double>{0});
}

TEST_CASE("a point with a normal is a disc across it, as large as its radius says") {
  for (const auto& normal : strewn(20, 3)) {
    Mesh mesh;
    mesh.positions = {{3, -2, 5}};
    mesh.normals = {glm::normalize(normal)};
    cover_points(mesh, {0.25});
    double area = 0;
    for (const auto& triangle : mesh.triangles) {
      const auto n = normal_of(mesh, triangle);
      CHECK(glm::dot(glm::normalize(n), mesh.normals[0]) == Catch::Approx(1));
      area += glm::length(n) / 2;
    }
    CHECK(area == Catch::Approx(pi * 0.25 * 0.25));
    CHECK(glm::length(middle_of(mesh) - glm::dvec3(3, -2, 5)) < 1e-12);
  }
}

TEST_CASE("a point without a normal is a closed ball that covers as much as its disc") {
  Mesh mesh;
  mesh.positions = {{3, -2, 5}};
  cover_points(mesh, {0.25});
  CHECK(is_closed(mesh));
  double covered = 0;
  int directions = 0;
  for (auto towards : strewn(20000, 4)) {
    if (glm::length(towards) > 1) continue;  // the rest are even in all directions
    towards = glm::normalize(towards);
    ++directions;
    for (const auto& triangle : mesh.triangles)
      covered += std::max(0.0, glm::dot(normal_of(mesh, triangle), towards)) / 2;
  }
  CHECK(covered / directions == Catch::Approx(pi * 0.25 * 0.25).epsilon(0.01));
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    CHECK(glm::dot(mesh.normals[i], mesh.positions[i] - glm::dvec3(3, -2, 5)) > 0);
}

TEST_CASE("points strewn over a surface leave less than 1 % of it open") {
  Mesh mesh;
  for (auto p : strewn(4000, 5)) {
    mesh.positions.emplace_back(p.x, p.y, 0);
    mesh.normals.emplace_back(0, 0, 1);
  }
  const auto points = mesh.positions;
  cover_points(mesh, {});
  int open = 0, looks = 0;
  for (const auto& p : strewn(4000, 6)) {
    if (std::abs(p.x) > 0.9 || std::abs(p.y) > 0.9) continue;
    ++looks;
    bool is_covered = false;
    for (std::size_t i = 0; i < points.size() && !is_covered; ++i) {
      const double radius = glm::length(mesh.positions[6 * i] - points[i]) * std::sqrt(0.75);
      is_covered =
          std::hypot(points[i].x - p.x, points[i].y - p.y) < radius;  // the hexagon's least
    }
    open += is_covered ? 0 : 1;
  }
  INFO(open << " of " << looks);
  CHECK(open < 0.01 * looks);
}

TEST_CASE("files of vertices alone are points, with their radii and colours, and a note") {
  const auto mesh =
      read(header(2, "x y z radius red green blue") + "0 0 0 0.5 255 0 0\n4 0 0 0.25 0 0 255\n");
  CHECK(mesh.triangles.size() == 16);
  REQUIRE(mesh.materials.size() == 1);
  CHECK(mesh.materials[0].look.model == LookModel::unlit);
  double reach = 0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const bool is_first = mesh.positions[i].x < 2;
    CHECK(mesh.colours[i] == (is_first ? glm::vec4(1, 0, 0, 1) : glm::vec4(0, 0, 1, 1)));
    if (is_first) reach = std::max(reach, mesh.positions[i].x);
  }
  CHECK(reach == Catch::Approx(0.5 * std::sqrt(pi / std::sqrt(3.0))));
  REQUIRE(mesh.notes.size() == 1);
  CHECK(mesh.notes[0].find("2 points without triangles are shown as balls") == 0);

  const std::string places = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 0 0\n2 1 0\n";
  const auto plain = read(header(6, "x y z") + places);
  CHECK(plain.triangles.size() == 6 * 8);
  CHECK(plain.materials.empty());
  CHECK(read(header(6, "x y z nx ny nz") + "0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n1 1 0 0 0 1\n"
                                           "2 0 0 0 0 1\n2 1 0 0 0 1\n")
            .triangles.size() == 6 * 4);
  CHECK_THAT(input_error_of([] { read(header(2, "x y z") + "1 2 3\n1 2 3\n"); }),
             Catch::Matchers::ContainsSubstring("give each a radius"));
}

TEST_CASE("splats have the size, colour and opacity of their Gaussians") {
  const auto mesh = read(header(1, "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2") +
                         "0 0 0 1.7724539 0 -1.7724539 0 -1 -2 -3\n");
  REQUIRE(mesh.materials.size() == 1);
  CHECK(mesh.materials[0].look.alpha_mode == AlphaMode::blend);
  for (const auto& colour : mesh.colours) {
    CHECK(colour.x == Catch::Approx(1).margin(1e-5));
    CHECK(colour.y == Catch::Approx(std::pow((0.5 + 0.055) / 1.055, 2.4)).epsilon(1e-4));  // sRGB
    CHECK(colour.z == Catch::Approx(0).margin(1e-5));
    CHECK(colour.w == Catch::Approx(0.5));
  }
  double reach = 0;
  for (const auto& p : mesh.positions) reach = std::max(reach, p.x);
  CHECK(reach == Catch::Approx(std::exp(-2) * std::sqrt(pi / std::sqrt(3.0))).epsilon(1e-6));
}

}  // namespace
}  // namespace raywave
