// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/normal_cones.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <span>
#include <tuple>

namespace raywave {
namespace {

/// Normals of all triangles below a node: their cone, and their sum, each as long as twice the
/// triangle's area.
struct Normals {
  glm::dvec3 sum{0};
  NormalCone cone;
};

glm::dvec3 direction_of(const glm::dvec3& v) {
  const double length = glm::length(v);
  return length > 0 ? v / length : glm::dvec3(0, 0, 1);
}

Normals normals_of_leaf(const Bvh& bvh, const std::vector<std::int32_t>& sides, std::size_t first,
                        std::size_t count) {
  Normals leaf;
  std::array<glm::dvec3, BVH_COUNT(-1)> normals;
  for (std::size_t i = first; i < first + count; ++i) {
    const auto& t = bvh.triangles[i];
    const auto a = point_of(t.a);
    const auto normal =
        static_cast<double>(sides[i]) * glm::cross(point_of(t.b) - a, point_of(t.c) - a);
    if (glm::length(normal) == 0) return leaf;
    leaf.sum += normal;
    normals[i - first] = direction_of(normal);
  }
  leaf.cone = {direction_of(leaf.sum), 0};
  for (const auto& n : std::span(normals).first(count))
    leaf.cone.spread = std::max(leaf.cone.spread, glm::length(n - leaf.cone.axis));
  return leaf;
}

Normals together(const Normals& one, const Normals& other) {
  Normals both{one.sum + other.sum, {}};
  both.cone.axis = direction_of(both.sum);
  both.cone.spread = std::max(one.cone.spread + glm::length(one.cone.axis - both.cone.axis),
                              other.cone.spread + glm::length(other.cone.axis - both.cone.axis));
  return both;
}

/// For each vertex of the triangles, one number for all at its position.
std::vector<std::uint32_t> welded(const std::vector<glm::dvec3>& positions_m,
                                  const std::vector<glm::uvec3>& triangles) {
  std::vector<std::uint32_t> used;
  used.reserve(3 * triangles.size());
  for (const auto& t : triangles) used.insert(used.end(), {t.x, t.y, t.z});
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  const auto place = [&](std::uint32_t i) {
    return std::tie(positions_m[i].x, positions_m[i].y, positions_m[i].z);
  };
  std::sort(used.begin(), used.end(), [&](std::uint32_t a, std::uint32_t b) {
    return place(a) != place(b) ? place(a) < place(b) : a < b;
  });
  std::vector<std::uint32_t> weld(positions_m.size());
  for (std::size_t i = 0; i < used.size(); ++i)
    weld[used[i]] = i > 0 && place(used[i]) == place(used[i - 1]) ? weld[used[i - 1]] : used[i];
  return weld;
}

struct Edge {
  std::uint32_t low, high;
  bool upwards;         // from low to high
  std::uint32_t place;  // 3 times the triangle, plus 0 to 2
};

}  // namespace

void store_normal_cones(Bvh& bvh, const std::vector<std::int32_t>& sides) {
  std::vector<Normals> of_nodes(bvh.nodes.size());
  for (auto i = bvh.nodes.size(); i-- > 0;) {  // children come behind their parents
    auto& node = bvh.nodes[i];
    const auto mark = [&](std::int32_t child, std::int32_t& count) {
      const auto number = static_cast<std::size_t>(child);
      const auto normals =
          count > 0 ? normals_of_leaf(bvh, sides, number, static_cast<std::size_t>(count))
                    : of_nodes[number];
      count |= normal_cone_bits(normals.cone);
      return normals;
    };
    const auto left = mark(node.left_child, node.left_count);
    // The missing half of a tree of one leaf.
    of_nodes[i] = node.right_min[0] > node.right_max[0]
                      ? left
                      : together(left, mark(node.right_child, node.right_count));
  }
}

std::int32_t normal_cone_bits(const NormalCone& cone) {
  std::int32_t bits = 0;
  glm::dvec3 axis;
  for (int i = 0; i < 3; ++i) {
    axis[i] = std::round(NORMAL_CONE_STEPS * cone.axis[i]);
    bits |= (static_cast<std::int32_t>(axis[i]) + NORMAL_CONE_STEPS) << (4 + 7 * i);
  }
  const double spread =
      NORMAL_CONE_STEPS * cone.spread + glm::length(double{NORMAL_CONE_STEPS} * cone.axis - axis);
  const double halves = std::ceil(2 * spread * (1 + 1e-9));
  return halves < 127 ? bits | static_cast<std::int32_t>(halves) << 25 : 0;
}

void set_view(device::Instance& instance, glm::dvec3 middle_m, double radius_m, glm::dvec3 eye_m,
              int side) {
  const auto path = static_cast<double>(side) * (middle_m - eye_m);
  const double distance_m = glm::length(path);
  instance.view_margin = INT32_MAX / 2;  // nothing is known
  if (side == 0 || !(radius_m < 0.5 * distance_m)) return;
  const auto view = path * (VIEW_STEPS / distance_m);
  glm::dvec3 rounded;
  for (int i = 0; i < 3; ++i) {
    rounded[i] = std::round(view[i]);
    instance.view[i] = static_cast<std::int32_t>(rounded[i]);
  }
  // Unit vectors to points of a sphere differ from that to its middle by at most radius / distance
  // / sqrt(1 - 1/4), for a radius below half the distance.
  const double stray = 1.16 * VIEW_STEPS * radius_m / distance_m + glm::length(view - rounded);
  instance.view_margin =
      static_cast<std::int32_t>(std::ceil(2 * NORMAL_CONE_STEPS * stray * (1 + 1e-9)));
}

std::vector<std::int32_t> neighbours_of(const std::vector<glm::dvec3>& positions_m,
                                        const std::vector<glm::uvec3>& triangles) {
  const auto weld = welded(positions_m, triangles);
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const auto& t : triangles) {
    for (int i = 0; i < 3; ++i) {
      const auto from = weld[t[i]], to = weld[t[(i + 1) % 3]];
      edges.push_back({std::min(from, to), std::max(from, to), from < to,
                       static_cast<std::uint32_t>(edges.size())});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.place) < std::tie(b.low, b.high, b.place);
  });
  std::vector<std::int32_t> neighbours(edges.size(), -1);
  for (std::size_t first = 0, next = 0; first < edges.size(); first = next) {
    while (next < edges.size() && edges[next].low == edges[first].low &&
           edges[next].high == edges[first].high)
      ++next;
    const auto &a = edges[first], &b = edges[next - 1];
    if (next - first != 2 || a.upwards == b.upwards || a.place / 3 == b.place / 3) continue;
    neighbours[a.place] = static_cast<std::int32_t>(b.place / 3);
    neighbours[b.place] = static_cast<std::int32_t>(a.place / 3);
  }
  return neighbours;
}

}  // namespace raywave
