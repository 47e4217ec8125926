// SPDX-License-Identifier: Apache-2.0
/// Where the nodes of a glTF file are at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/scene/read_data.hpp"

namespace raywave {

/// p becomes turn (scale p) + shift.
struct Similarity {
  glm::dmat3 turn{1};
  double scale = 1;
  glm::dvec3 shift{0};

  glm::dvec3 operator()(const glm::dvec3& p) const { return turn * (scale * p) + shift; }
};

/// What of a scene moves as the nodes of its glTF file do.
struct GltfMoves {
  struct Moved {
    std::size_t index = 0;  // of the scene's objects or lights
    std::int32_t node = 0;  // of `nodes`
    std::string name;       // of the node, for messages
    bool deforms = false;   // an object: Object::shape is the time, in seconds
  };
  std::vector<GltfNode> nodes;        // parents first
  std::vector<GltfChannel> channels;  // of the animations that are shown
  Similarity world_from_file;         // metres
  std::vector<Moved> objects;         // meshes are given with all nodes at rest
  std::vector<Moved> lights;
};

/// Parent from node.
inline glm::dmat4 matrix_of(const GltfNode& node) {
  if (node.has_matrix != 0) return node.matrix;
  const auto& q = node.rotation;
  return glm::translate(glm::dmat4(1), node.translation) *
         glm::mat4_cast(glm::dquat(q.w, q.x, q.y, q.z)) * glm::scale(glm::dmat4(1), node.scale);
}

/// Value of a channel at a time: before its first key that of the first, after its last one that of
/// the last. Linear steps of rotations go the shorter way round at an even speed; cubic steps are
/// Hermite's curves, for rotations of all four numbers, whose length is made 1.
glm::dvec4 value_at(const GltfChannel& channel, double time_s);

/// Weights of a node's morph targets at a time.
///
/// node  of the channels' nodes
/// rest  of all its targets; those without a channel keep them
std::vector<double> weights_at(const std::vector<GltfChannel>& channels, std::int32_t node,
                               std::vector<double> rest, double time_s);

/// World from node of all nodes, in the file's units.
std::vector<glm::dmat4> poses_at(const std::vector<GltfNode>& nodes,
                                 const std::vector<GltfChannel>& channels, double time_s);

/// The similarity from one pose to another one. A scale below `smallest_scale` counts as that,
/// without a turn.
///
/// returns  nothing where the scales of the three axes change unevenly, by more than 1e-6, where
///          one pose is the other's mirror image, or where `from` has no extent
std::optional<Similarity> similarity_between(const glm::dmat4& from, const glm::dmat4& to);
inline constexpr double smallest_scale = 1e-6;

/// Angles about the x, then the y, then the z axis that make a rotation, to a rounding.
glm::dvec3 fixed_axis_angles_deg(const glm::dmat3& turn);

// Skins and morph targets of glTF files: where vertices are at a time.

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
