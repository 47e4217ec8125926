// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/neighbours.hpp"

#include <algorithm>
#include <cstddef>
#include <tuple>

namespace raywave {
namespace {

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
