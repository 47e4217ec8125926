// SPDX-License-Identifier: Apache-2.0
/// Skins and morph targets of glTF files: where vertices are at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <utility>
#include <vector>

#include "host/scene/gltf_motion.hpp"
#include "host/scene/read_data.hpp"

namespace raywave {

/// Places a vertex as glTF 2.0 says: morph targets are added, then the joints' matrices blend
/// (linear blend skinning).
///
/// world_from_mesh  by joint of the part: its pose times joint_from_mesh
/// weights          of the part's morph targets
/// returns          position and normal; the normal is zero where the mesh has none
std::pair<glm::dvec3, glm::dvec3> deformed_vertex(const DeformingPart& part,
                                                  std::span<const glm::dmat4> world_from_mesh,
                                                  std::span<const double> weights,
                                                  std::size_t vertex);

/// True where the part is its own mirror image at a pose, judged at its first vertex: triangles are
/// turned inside out.
bool is_mirrored(const DeformingPart& part, std::span<const glm::dmat4> world_from_mesh);

/// How an object's vertices follow the nodes of its glTF file.
struct DeformingMesh {
  std::vector<DeformingPart> parts;
  std::vector<std::uint32_t> source;  // of each vertex: its number in the parts, one after another
  std::vector<glm::uvec3> flat;       // triangles whose corners have the normal of the face
};

/// The last step of reading an object that deforms, as finish_mesh is of others. Vertices of the
/// file stay apart, since they may part; those without a normal get one of their own for each
/// triangle. Triangles without area are dropped, unless a morph target gives them one.
///
/// raw  with Mesh::deforming, which takes part in all its triangles
std::pair<Mesh, DeformingMesh> finish_deforming(Mesh raw);

/// Positions and normals at a time, in the file's units, normals at unit length.
///
/// throws    InputError when a part becomes its mirror image
/// accuracy  1e-15 of the largest number, where the file's floats are taken as exact
MeshShape deformed_at(const DeformingMesh& mesh, const GltfMoves& moves, double time_s);

}  // namespace raywave
