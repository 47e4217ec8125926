// SPDX-License-Identifier: Apache-2.0
/// Skins and morph targets as glTF files hold them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "host/scene/read_data.hpp"

namespace raywave {

/// What a node says of the skin and the morph targets of its mesh; GltfWearer::node and joints are
/// numbers of the file.
///
/// returns  nothing where the mesh has neither
/// throws   InputError when there is no such skin, or weights and targets differ in number
std::optional<GltfWearer> wearer_of(const nlohmann::json& root, const nlohmann::json& node,
                                    std::int32_t number);

/// A primitive that deforms.
struct GltfPart {
  DeformingPart part;
  std::vector<std::uint32_t> corners;       // vertices of the triangles, where the file lists them
  std::vector<glm::dmat4> world_from_mesh;  // by joint, with all nodes at rest
};

/// The primitives of all nodes that wear a skin or morph targets, by the node's number; nothing for
/// points and lines.
///
/// throws  InputError with the mesh's name when they are damaged
using GltfParts = std::map<std::int32_t, std::vector<std::optional<GltfPart>>>;
GltfParts read_gltf_parts(const nlohmann::json& root, const std::filesystem::path& file);

/// Puts the vertices of a part into another order.
///
/// order  numbers of those that are wanted
void reorder(DeformingPart& part, const std::vector<std::uint32_t>& order);

}  // namespace raywave
