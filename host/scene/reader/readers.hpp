// SPDX-License-Identifier: Apache-2.0
/// The third-party readers. On damaged files they may print, crash, fail assertions or hang, so
/// only reader programs call them.
#pragma once

#include <cmath>
#include <filesystem>
#include <glm/common.hpp>
#include <optional>

#include "host/scene/mesh.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {

/// All parts of a mesh file (Assimp), triangles without area and missing normals as they are:
/// finish_mesh takes them.
Mesh read_mesh(const std::filesystem::path& file);

/// The same of a glTF 2.0 file, with all that it says; nothing for other formats.
///
/// wants_nodes  sets Mesh::triangle_node
std::optional<Mesh> read_gltf_mesh(const std::filesystem::path& file, bool wants_nodes);

/// Meshes of other kinds, by readers of our own; all as read_mesh has them.
Mesh read_obj(const std::filesystem::path& file);
Mesh read_ply(const std::filesystem::path& file);
Mesh read_stl(const std::filesystem::path& file);
Mesh read_off(const std::filesystem::path& file);

/// Cameras and lights of a glTF 2.0 file, where its nodes put them.
GltfSet read_gltf_set(const std::filesystem::path& file);

/// Nodes and animations of a glTF 2.0 file.
GltfMotion read_gltf_motion(const std::filesystem::path& file);

/// Linear light of an sRGB value, 0 to 1.
inline float linear_from_srgb(float s) {
  return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}

/// The same of a colour with alpha, cut to that range; white for what is not finite.
inline glm::vec4 linear_colour_from_srgb(const glm::vec4& colour) {
  if (!is_finite(colour)) return glm::vec4(1);
  const auto c = glm::clamp(colour, 0.0f, 1.0f);
  return {linear_from_srgb(c.r), linear_from_srgb(c.g), linear_from_srgb(c.b), c.a};
}

}  // namespace raywave
