// SPDX-License-Identifier: Apache-2.0
/// The JSON part of glTF files.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

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

/// Where a file's name ends, in lower case: ".glb".
std::string lower_extension(const std::filesystem::path& file);

}  // namespace raywave
