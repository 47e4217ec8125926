// SPDX-License-Identifier: Apache-2.0
/// Material libraries of OBJ files.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "host/scene/reader/mesh_builder.hpp"

namespace raywave {

/// The file that a file means by a name: in its own folder, also where the name is that of a folder
/// on another machine.
std::optional<std::filesystem::path> file_beside(const std::filesystem::path& file,
                                                 std::string name);

/// Adds the materials of a library that are not known yet.
///
/// mesh  the OBJ file
void read_mtl(const std::filesystem::path& file, const std::filesystem::path& mesh,
              MeshBuilder& builder, std::map<std::string, MeshMaterial>& materials);

}  // namespace raywave
