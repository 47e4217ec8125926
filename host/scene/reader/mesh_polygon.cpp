// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/mesh_polygon.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace raywave {
namespace {

double twice_area(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// All triangles from corner `first` on, where the polygon is seen whole from there.
///
/// twice  its area
bool cut_as_fan(std::span<const glm::dvec2> outline, std::size_t first, double twice,
                std::vector<glm::uvec3>& triangles) {
  const auto n = outline.size();
  const auto at = [&](std::size_t i) { return outline[(first + i) % n]; };
  for (std::size_t i = 1; i + 1 < n; ++i)
    if (!(twice_area(at(0), at(i), at(i + 1)) > 1e-9 * twice) ||
        !(twice_area(at(0), at(1), at(i + 1)) > -1e-12 * twice))
      return false;
  for (std::size_t i = 1; i + 1 < n; ++i)
    triangles.emplace_back(first, (first + i) % n, (first + i + 1) % n);
  return true;
}

/// The axis with the smallest part of a direction.
glm::dvec3 axis_across(const glm::dvec3& n) {
  const auto size = glm::abs(n);
  if (size.x <= size.y && size.x <= size.z) return {1, 0, 0};
  return size.y <= size.z ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
}

bool are_in_line(std::span<const glm::dvec3> points) {
  glm::dvec3 far(0);
  for (const auto& p : points)
    if (glm::length(p) > glm::length(far)) far = p;
  const double reach = glm::length(far);
  return std::all_of(points.begin(), points.end(), [&](const glm::dvec3& p) {
    return !(glm::length(glm::cross(p, far)) > 1e-9 * reach * reach);
  });
}

/// What is no outline in its best plane.
///
/// places  from the first on, about 1 in size
Cut cut_twisted(std::span<const glm::dvec3> places, std::span<const glm::uint> number,
                std::vector<glm::uvec3>& triangles) {
  triangles.clear();
  if (places.size() != 4) return Cut::crossing;
  const auto &p = places[1], &q = places[2], &r = places[3];
  if (!(std::abs(glm::dot(glm::cross(p, q), r)) > 1e-5)) return Cut::crossing;
  const std::size_t first = glm::length(q) <= glm::length(r - p) ? 0 : 1;
  for (const std::size_t i : {1, 2})
    triangles.emplace_back(number[first], number[first + i], number[(first + i + 1) % 4]);
  return Cut::twisted;
}

}  // namespace

Cut cut_polygon(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles) {
  triangles.clear();
  if (corners.size() == 3) {
    triangles.emplace_back(0, 1, 2);
    return Cut::whole;
  }
  // From the first corner on, and about 1 in size: what is small and far away keeps its shape
  std::vector<glm::dvec3> places;
  std::vector<glm::uint> number;
  double size = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!places.empty() && corners[i] == corners[number.back()]) continue;
    places.push_back(corners[i] - corners[0]);
    number.push_back(static_cast<glm::uint>(i));
    for (int k = 0; k < 3; ++k) size = std::max(size, std::abs(places.back()[k]));
  }
  while (places.size() > 1 && places.back() == places.front()) places.pop_back();
  const auto n = places.size();
  if (n < 3) return Cut::whole;
  for (auto& p : places) p /= size;

  glm::dvec3 normal(0);  // Newell's: as long as twice the area
  for (std::size_t i = 0; i < n; ++i) normal += glm::cross(places[i], places[(i + 1) % n]);
  const double twice = glm::length(normal);
  if (!(twice > 1e-12))
    return are_in_line(places) ? Cut::whole : cut_twisted(places, number, triangles);
  const glm::dvec3 up = normal / twice, u = glm::normalize(glm::cross(axis_across(up), up)),
                   v = glm::cross(up, u);
  std::vector<glm::dvec2> outline;
  for (const auto& p : places) outline.emplace_back(glm::dot(p, u), glm::dot(p, v));

  bool is_cut = false;
  for (std::size_t first = 0; first < (n == 4 ? n : 1) && !is_cut; ++first)
    is_cut = cut_as_fan(outline, first, twice, triangles);
  if (!is_cut && !cut_outline(outline, triangles)) return cut_twisted(places, number, triangles);
  double covered = 0;
  for (auto& t : triangles) {
    covered += std::abs(twice_area(outline[t.x], outline[t.y], outline[t.z]));
    t = {number[t.x], number[t.y], number[t.z]};
  }
  if (std::abs(covered - twice) <= 1e-6 * twice) return Cut::whole;
  return cut_twisted(places, number, triangles);
}

}  // namespace raywave
