// SPDX-License-Identifier: Apache-2.0
#include "host/scene/gltf_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <map>

#include "host/common/error.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {
namespace {

using Path = GltfChannel::Path;
using Steps = GltfChannel::Steps;

glm::dquat quaternion_of(const glm::dvec4& q) { return {q.w, q.x, q.y, q.z}; }

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

}  // namespace

glm::dvec4 value_at(const GltfChannel& channel, double time_s) {
  const bool is_cubic = channel.steps == Steps::cubic;
  const auto at = [&](std::size_t key) { return channel.values[is_cubic ? 3 * key + 1 : key]; };
  const auto [k, s, span] = place_among(channel.times_s, time_s);
  if (channel.steps == Steps::step || span == 0) return at(k);
  const auto next = k + 1;
  const bool is_turn = channel.path == Path::rotation;
  if (is_cubic) {
    const auto value =
        hermite(at(k), channel.values[3 * k + 2], at(next), channel.values[3 * next], span, s);
    const double length = glm::length(value);
    return !is_turn ? value : length > 0 ? value / length : at(k);
  }
  if (!is_turn) return at(k) + s * (at(next) - at(k));
  const auto q = glm::normalize(glm::slerp(quaternion_of(at(k)), quaternion_of(at(next)), s));
  return {q.x, q.y, q.z, q.w};
}

std::vector<double> weights_at(const std::vector<GltfChannel>& channels, std::int32_t node,
                               std::vector<double> rest, double time_s) {
  for (const auto& channel : channels) {
    if (channel.node != node || channel.path != Path::weights) continue;
    const auto value = value_at(channel, time_s);
    const auto first = static_cast<std::size_t>(channel.target);
    for (std::size_t i = 0; i < 4 && first + i < rest.size(); ++i)
      rest[first + i] = value[static_cast<int>(i)];
  }
  return rest;
}

std::vector<glm::dmat4> poses_at(const std::vector<GltfNode>& nodes,
                                 const std::vector<GltfChannel>& channels, double time_s) {
  auto moved = nodes;
  for (const auto& channel : channels) {
    auto& node = moved[static_cast<std::size_t>(channel.node)];
    const auto value = value_at(channel, time_s);
    if (channel.path == Path::translation) node.translation = glm::dvec3(value);
    if (channel.path == Path::rotation) node.rotation = value;
    if (channel.path == Path::scale) node.scale = glm::dvec3(value);
  }
  std::vector<glm::dmat4> poses;
  poses.reserve(moved.size());
  for (const auto& node : moved)
    poses.push_back(node.parent < 0
                        ? matrix_of(node)
                        : poses[static_cast<std::size_t>(node.parent)] * matrix_of(node));
  return poses;
}

std::optional<Similarity> similarity_between(const glm::dmat4& from, const glm::dmat4& to) {
  constexpr double most_uneven = 1e-6;
  const glm::dmat3 before(from), after(to);
  const double stretch = glm::length(before[0]) * glm::length(before[1]) * glm::length(before[2]);
  if (!(std::abs(glm::determinant(before)) > 1e-12 * stretch)) return {};
  const auto linear = after * glm::inverse(before);
  const double determinant = glm::determinant(linear), scale = std::cbrt(determinant);
  Similarity motion;
  const double largest =
      std::max({glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2])});
  if (largest < smallest_scale) {
    motion.scale = smallest_scale;
  } else {
    if (!(scale > 0)) return {};
    const auto x = linear[0] / scale, y = linear[1] / scale, z = linear[2] / scale;
    const double uneven = std::max({std::abs(glm::dot(x, x) - 1), std::abs(glm::dot(y, y) - 1),
                                    std::abs(glm::dot(z, z) - 1), std::abs(glm::dot(x, y)),
                                    std::abs(glm::dot(y, z)), std::abs(glm::dot(z, x))});
    if (!(uneven <= 2 * most_uneven)) return {};
    motion.scale = scale;
    motion.turn[0] = glm::normalize(x);
    motion.turn[1] = glm::normalize(y - glm::dot(y, motion.turn[0]) * motion.turn[0]);
    motion.turn[2] = glm::cross(motion.turn[0], motion.turn[1]);
  }
  motion.shift = glm::dvec3(to[3]) - motion.turn * (motion.scale * glm::dvec3(from[3]));
  return motion;
}

glm::dvec3 fixed_axis_angles_deg(const glm::dmat3& turn) {
  // Rz Ry Rx. Where x and z become one axis, z makes up for any error of x
  const double x = std::atan2(turn[1][2], turn[2][2]),
               y = std::atan2(-turn[0][2], std::hypot(turn[1][2], turn[2][2]));
  const auto second = turn * glm::dvec3(0, std::cos(x), -std::sin(x));
  return glm::degrees(glm::dvec3(x, y, std::atan2(-second.x, second.y)));
}

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
  const double orientation = glm::determinant(linear) < 0 ? -1 : 1;
  const auto turned = unit_or_zero(orientation * (cofactor_of(linear) * normal));
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
