// SPDX-License-Identifier: Apache-2.0
/// The JSON part of glTF files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/mat4x4.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "host/scene/read_data.hpp"

namespace raywave {

/// The JSON part of a .gltf or .glb file; a discarded value where there is none.
nlohmann::json gltf_json(const std::filesystem::path& file);

/// True for glTF of version 2.
bool is_gltf2(const nlohmann::json& root);

/// A member of an object, or an element of an array; null where there is none.
const nlohmann::json& member(const nlohmann::json& object, const char* name);
const nlohmann::json& element(const nlohmann::json& array, const nlohmann::json& index);

double number_or(const nlohmann::json& value, double otherwise);
std::string text_or(const nlohmann::json& value, const std::string& otherwise);

/// A node's place in its parent; its number, parent and contents are left as they are.
GltfNode gltf_place_of(const nlohmann::json& node);

/// The numbers of the nodes at the top of a file's scene.
const nlohmann::json& top_nodes_of(const nlohmann::json& root);

/// Visits the nodes of a file's scene, parents first and each once: in sound files they make a
/// tree.
///
/// visit   node, its number in the file, how many were visited before its parent (-1: none), and
///         its pose
/// throws  InputError when a node is nowhere
void for_each_node(
    const nlohmann::json& root,
    const std::function<void(const nlohmann::json& node, std::int32_t number, std::int32_t parent,
                             const glm::dmat4& world_from_node)>& visit);

/// The camera and the light that a node is; null where it is none.
const nlohmann::json& camera_of(const nlohmann::json& root, const nlohmann::json& node);
const nlohmann::json& light_of(const nlohmann::json& root, const nlohmann::json& node);

/// Where a file's name ends, in lower case: ".glb".
std::string lower_extension(const std::filesystem::path& file);

}  // namespace raywave
