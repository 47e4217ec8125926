// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/deform.hpp"

#include <algorithm>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <utility>

#include "host/common/threads.hpp"

namespace raywave {
namespace {

class Cut {
public:
  Cut(const Mesh& mesh, const std::vector<double>& heights, double least)
      : mesh_(mesh), heights_(heights), least_(least) {}

  Mesh part() {
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) add(i);
    return std::move(part_);
  }

private:
  bool is_above(std::uint32_t corner) const { return heights_[corner] >= least_; }

  void add(std::size_t triangle) {
    // The polygon that is left of it, in the triangle's sense
    const auto t = mesh_.triangles[triangle];
    std::vector<std::uint32_t> polygon;
    for (int i = 0; i < 3; ++i) {
      const auto here = t[i], next = t[(i + 1) % 3];
      if (is_above(here)) polygon.push_back(kept(here));
      // The upper end of an edge may lie on the cut itself
      if (is_above(here) != is_above(next) && std::max(heights_[here], heights_[next]) > least_)
        polygon.push_back(between(here, next));
    }
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      part_.triangles.emplace_back(polygon[0], polygon[i - 1], polygon[i]);
      if (!mesh_.triangle_material.empty())
        part_.triangle_material.push_back(mesh_.triangle_material[triangle]);
    }
  }

  std::uint32_t kept(std::uint32_t corner) {
    return corner_of({corner, corner}, [&] { return 0.0; });
  }

  /// Neighbours that share an edge get the same corner on it.
  std::uint32_t between(std::uint32_t a, std::uint32_t b) {
    if (a > b) std::swap(a, b);
    return corner_of({a, b}, [&] { return (least_ - heights_[a]) / (heights_[b] - heights_[a]); });
  }

  template <class Share>
  std::uint32_t corner_of(std::pair<std::uint32_t, std::uint32_t> ends, Share share) {
    const auto [known, is_new] =
        known_.try_emplace(ends, static_cast<std::uint32_t>(part_.positions.size()));
    if (!is_new) return known->second;
    const auto [a, b] = ends;
    const double t = share();
    part_.positions.push_back(glm::mix(mesh_.positions[a], mesh_.positions[b], t));
    const auto normal = glm::mix(mesh_.normals[a], mesh_.normals[b], t);
    const double length = glm::length(normal);
    part_.normals.push_back(length > 1e-6 ? normal / length : mesh_.normals[a]);
    part_.uvs.push_back(glm::mix(mesh_.uvs[a], mesh_.uvs[b], t));
    if (!mesh_.colours.empty())
      part_.colours.push_back(glm::mix(mesh_.colours[a], mesh_.colours[b], static_cast<float>(t)));
    return known->second;
  }

  const Mesh& mesh_;
  const std::vector<double>& heights_;
  double least_;
  Mesh part_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known_;
};

}  // namespace

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

Mesh part_above(const Mesh& mesh, const std::vector<double>& heights, double least) {
  return Cut(mesh, heights, least).part();
}

}  // namespace raywave
