// SPDX-License-Identifier: Apache-2.0
#include "host/scene/gltf_deform.hpp"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <map>

#include "host/common/error.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {
namespace {

constexpr const char* changed = "the glTF file has changed while it was read; start again";

/// The mean of the joints' matrices for a vertex.
glm::dmat4 blend_of(const DeformingPart& part, std::span<const glm::dmat4> world_from_mesh,
                    std::size_t vertex) {
  glm::dmat4 sum(0);
  double weights = 0;
  for (auto k = vertex * part.influences; k < (vertex + 1) * part.influences; ++k) {
    const double weight = part.weight_of[k];
    if (weight == 0) continue;
    sum += weight * world_from_mesh[part.joint_of[k]];
    weights += weight;
  }
  return weights > 0 ? sum / weights : world_from_mesh[0];
}

std::array<glm::dvec3, 3> corners_of(std::span<const glm::dvec3> positions, const glm::uvec3& t) {
  return {positions[t.x], positions[t.y], positions[t.z]};
}

}  // namespace

std::pair<glm::dvec3, glm::dvec3> deformed_vertex(const DeformingPart& part,
                                                  std::span<const glm::dmat4> world_from_mesh,
                                                  std::span<const double> weights,
                                                  std::size_t vertex) {
  const auto count = part.positions.size();
  glm::dvec3 position = part.positions[vertex], normal = part.normals[vertex];
  const bool has_normal = normal != glm::dvec3(0);
  for (std::size_t target = 0; target < weights.size(); ++target) {
    if (weights[target] == 0) continue;
    position += weights[target] * glm::dvec3(part.target_positions[target * count + vertex]);
    if (has_normal && !part.target_normals.empty())
      normal += weights[target] * glm::dvec3(part.target_normals[target * count + vertex]);
  }
  const auto blend = blend_of(part, world_from_mesh, vertex);
  position = glm::dvec3(blend * glm::dvec4(position, 1));
  if (!has_normal) return {position, glm::dvec3(0)};
  const glm::dmat3 linear(blend);
  // The cofactor matrix turns normals also where the transform has no inverse
  const glm::dmat3 cofactor(glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
                            glm::cross(linear[0], linear[1]));
  const auto turned =
      unit_or_zero((glm::determinant(linear) < 0 ? -1.0 : 1.0) * (cofactor * normal));
  return {position, turned != glm::dvec3(0) ? turned : unit_or_zero(part.normals[vertex])};
}

bool is_mirrored(const DeformingPart& part, std::span<const glm::dmat4> world_from_mesh) {
  return !part.positions.empty() &&
         glm::determinant(glm::dmat3(blend_of(part, world_from_mesh, 0))) < 0;
}

std::pair<Mesh, DeformingMesh> finish_deforming(Mesh raw) {
  constexpr std::uint32_t none = UINT32_MAX;
  DeformingMesh deforming;
  // Numbers of the file's vertices in the parts, and of those in the mesh
  std::vector<std::uint32_t> source(raw.positions.size(), none), known(raw.positions.size(), none);
  std::vector<const DeformingPart*> part_of(raw.positions.size(), nullptr);
  std::uint32_t count = 0;
  for (const auto& part : raw.deforming) {
    for (std::uint32_t i = 0; i < part.positions.size(); ++i) {
      source[part.first_vertex + i] = count++;
      part_of[part.first_vertex + i] = &part;
    }
  }
  const auto has_area = [&](const glm::uvec3& triangle) {
    if (face_normal(corners_of(raw.positions, triangle)) != glm::dvec3(0)) return true;
    const auto* part = part_of[triangle.x];
    for (std::size_t target = 0; target < part->weights.size(); ++target) {
      std::array<glm::dvec3, 3> corners;
      for (int i = 0; i < 3; ++i) {
        const auto vertex = triangle[i] - part->first_vertex;
        corners[static_cast<std::size_t>(i)] =
            glm::dvec3(part->positions[vertex]) +
            glm::dvec3(part->target_positions[target * part->positions.size() + vertex]);
      }
      if (face_normal(corners) != glm::dvec3(0)) return true;
    }
    return false;
  };

  Mesh mesh;
  for (std::size_t i = 0; i < raw.triangles.size(); ++i) {
    const auto& triangle = raw.triangles[i];
    for (int c = 0; c < 3; ++c)
      if (!part_of[triangle[c]] || part_of[triangle[c]] != part_of[triangle.x])
        throw InputError(changed);
    if (!has_area(triangle)) continue;
    glm::uvec3 joined;
    bool is_flat = false;
    for (int c = 0; c < 3; ++c) {
      const auto vertex = triangle[c];
      const bool has_normal = raw.normals[vertex] != glm::dvec3(0);
      if (has_normal && known[vertex] != none) {
        joined[c] = known[vertex];
        continue;
      }
      joined[c] = known[vertex] = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back(raw.positions[vertex]);
      mesh.normals.push_back(has_normal ? raw.normals[vertex]
                                        : face_normal(corners_of(raw.positions, triangle)));
      mesh.uvs.push_back(raw.uvs[vertex]);
      if (!raw.colours.empty()) mesh.colours.push_back(raw.colours[vertex]);
      deforming.source.push_back(source[vertex]);
      is_flat = is_flat || !has_normal;
    }
    mesh.triangles.push_back(joined);
    if (is_flat) deforming.flat.push_back(joined);
    if (!raw.triangle_material.empty()) mesh.triangle_material.push_back(raw.triangle_material[i]);
  }
  mesh.materials = std::move(raw.materials);
  mesh.pictures = std::move(raw.pictures);
  mesh.notes = std::move(raw.notes);
  deforming.parts = std::move(raw.deforming);
  return {std::move(mesh), std::move(deforming)};
}

MeshShape deformed_at(const DeformingMesh& mesh, const GltfMoves& moves, double time_s) {
  const auto rest = poses_at(moves.nodes, {}, 0),
             now = poses_at(moves.nodes, moves.channels, time_s);
  std::map<std::int32_t, std::size_t> place;  // of nodes, by their numbers
  for (std::size_t i = 0; i < moves.nodes.size(); ++i) place.emplace(moves.nodes[i].number, i);
  const auto place_of = [&](std::int32_t number) {
    const auto found = place.find(number);
    if (found == place.end()) throw InputError(changed);
    return found->second;
  };
  std::vector<std::pair<glm::dvec3, glm::dvec3>> all;
  for (const auto& part : mesh.parts) {
    const auto placed = [&](const std::vector<glm::dmat4>& poses) {
      std::vector<glm::dmat4> world_from_mesh;
      for (std::size_t i = 0; i < part.joints.size(); ++i)
        world_from_mesh.push_back(poses[place_of(part.joints[i])] * part.joint_from_mesh[i]);
      return world_from_mesh;
    };
    const auto world_from_mesh = placed(now);
    // Triangles stay as they are wound, and would show their inner sides
    if (is_mirrored(part, world_from_mesh) != is_mirrored(part, placed(rest)))
      throw InputError("it becomes its mirror image; keep the signs of its nodes' scales");
    const auto weights = weights_at(moves.channels, static_cast<std::int32_t>(place_of(part.node)),
                                    part.weights, time_s);
    for (std::size_t i = 0; i < part.positions.size(); ++i)
      all.push_back(deformed_vertex(part, world_from_mesh, weights, i));
  }
  MeshShape shape;
  shape.positions.reserve(mesh.source.size());
  shape.normals.reserve(mesh.source.size());
  for (const auto vertex : mesh.source) {
    shape.positions.push_back(all[vertex].first);
    shape.normals.push_back(all[vertex].second);
  }
  for (const auto& triangle : mesh.flat) {
    const auto normal = face_normal(corners_of(shape.positions, triangle));
    for (int i = 0; i < 3; ++i)
      if (all[mesh.source[triangle[i]]].second == glm::dvec3(0))
        shape.normals[triangle[i]] = normal != glm::dvec3(0) ? normal : glm::dvec3(0, 0, 1);
  }
  return shape;
}

}  // namespace raywave
