// SPDX-License-Identifier: Apache-2.0
/// Objects that deform: the same triangles between vertices that move.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "host/geometry/motion.hpp"
#include "host/scene/gltf_motion.hpp"
#include "host/scene/read_data.hpp"

namespace raywave {

/// Vertices of an object where place_objects puts them.
struct VertexKey {
  std::vector<glm::dvec3> positions_m;
  std::vector<glm::vec3> normals;  // unit length
};

/// The states that an object that deforms has been in and can take.
struct Deforming {
  VertexKey rest;                   // as it was placed
  std::vector<std::uint32_t> weld;  // of its vertices: equal numbers for equal places at rest
  bool closed = false;              // at rest
  std::vector<VertexKey> keys;      // of Object::shapes
  // Object that a glTF file deforms: how, and where place_objects puts it
  std::shared_ptr<const DeformingMesh> mesh;
  std::shared_ptr<const GltfMoves> moves;
  Motion placing{};

  /// True where it has shapes to become.
  bool has_shapes() const { return !keys.empty() || mesh; }
};

/// A shape of a mesh where an object's placing puts it.
VertexKey placed_shape(const MeshShape& shape, const Motion& placing);

/// The vertices at a place among the keys: 1.25 is a quarter of the way from key 1 to key 2, in
/// straight lines; normals are those between, at unit length. Places beyond the ends count as the
/// ends.
VertexKey shape_at(std::span<const VertexKey> keys, double place);

/// The vertices that Object::shape stands for: a place among the keys, or a time in seconds.
VertexKey shape_at(const Deforming& deforming, double shape);

/// True where vertices with equal numbers are at one place.
bool are_together(std::span<const glm::dvec3> positions_m, std::span<const std::uint32_t> weld);

// Cutting away what of a mesh lies before a plane: rooms that a camera stands in.

/// The part of a mesh on which a height is at least `least`. Triangles across the limit are cut;
/// positions, normals, texture coordinates and colours of new corners lie between those of the old
/// ones. Materials and pictures are left behind.
///
/// heights  of the mesh's positions, linear in them
Mesh part_above(const Mesh& mesh, const std::vector<double>& heights, double least);

}  // namespace raywave
