// SPDX-License-Identifier: Apache-2.0
/// Objects that deform: the same triangles between vertices that move.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace raywave {

/// Vertices of an object where place_objects puts them.
struct VertexKey {
  std::vector<glm::dvec3> positions_m;
  std::vector<glm::vec3> normals;  // unit length
};

/// What an object that deforms has been and can become.
struct Deforming {
  VertexKey rest;                   // as it was placed
  std::vector<std::uint32_t> weld;  // of its vertices: equal numbers for equal places at rest
  bool closed = false;              // at rest
  std::vector<VertexKey> keys;      // of Object::shapes
};

/// The vertices at a place among the keys: 1.25 is a quarter of the way from key 1 to key 2, in
/// straight lines; normals are those between, at unit length. Places beyond the ends count as the
/// ends.
VertexKey shape_at(std::span<const VertexKey> keys, double place);

/// True where vertices with equal numbers are at one place.
bool are_together(std::span<const glm::dvec3> positions_m, std::span<const std::uint32_t> weld);

}  // namespace raywave
