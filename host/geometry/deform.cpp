// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/deform.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "host/common/threads.hpp"

namespace raywave {

VertexKey shape_at(std::span<const VertexKey> keys, double place) {
  const double last = static_cast<double>(keys.size() - 1), at = std::clamp(place, 0.0, last);
  const auto from = static_cast<std::size_t>(at);
  const double share = at - static_cast<double>(from);
  if (share == 0) return keys[from];
  const auto &a = keys[from], &b = keys[from + 1];
  VertexKey shape = a;
  cl::Threads::shared().for_ranges(
      shape.positions_m.size(), [&](std::size_t, std::size_t first, std::size_t end) {
        for (auto i = first; i < end; ++i) {
          shape.positions_m[i] += share * (b.positions_m[i] - a.positions_m[i]);
          const auto n = glm::mix(glm::dvec3(a.normals[i]), glm::dvec3(b.normals[i]), share);
          const double length = glm::length(n);
          // Opposite normals have none between them
          if (length > 1e-6) shape.normals[i] = n / length;
        }
      });
  return shape;
}

VertexKey placed_shape(const MeshShape& shape, const Motion& placing) {
  VertexKey key;
  key.positions_m.reserve(shape.positions.size());
  key.normals.reserve(shape.normals.size());
  for (const auto& p : shape.positions) key.positions_m.push_back(placing(p));
  for (const auto& n : shape.normals) key.normals.emplace_back(placing.turn * n);
  return key;
}

VertexKey shape_at(const Deforming& deforming, double shape) {
  if (!deforming.mesh) return shape_at(deforming.keys, shape);
  return placed_shape(deformed_at(*deforming.mesh, *deforming.moves, shape), deforming.placing);
}

bool are_together(std::span<const glm::dvec3> positions_m, std::span<const std::uint32_t> weld) {
  std::vector<std::uint32_t> first(weld.size(), UINT32_MAX);  // vertex of each number
  for (std::uint32_t i = 0; i < weld.size(); ++i) {
    auto& other = first[weld[i]];
    if (other == UINT32_MAX) other = i;
    if (positions_m[other] != positions_m[i]) return false;
  }
  return true;
}

}  // namespace raywave
