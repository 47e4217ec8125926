// SPDX-License-Identifier: Apache-2.0
/// Materials and pictures of glTF files.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "host/scene/reader/gltf_file.hpp"

namespace raywave {

/// The materials of a file, translated on demand into those of a mesh.
class GltfMaterials {
public:
  GltfMaterials(GltfFile& gltf, Mesh& mesh) : gltf_(gltf), mesh_(mesh) {}

  /// What a primitive wears.
  struct Worn {
    std::int32_t material = -1;        // of Mesh::materials; -1: the file has none for it
    std::optional<std::uint64_t> uvs;  // number of the texture coordinates that its maps use
  };

  /// throws  InputError when there is no such material
  const Worn& of(const nlohmann::json& primitive, bool has_colours);

private:
  GltfFile& gltf_;
  Mesh& mesh_;
  std::map<std::pair<std::int64_t, bool>, Worn> known_;  // by number, and whether it has colours
  std::map<std::uint64_t, std::int32_t> pictures_;       // by the image's number
  std::size_t picture_bytes_ = 0;

  friend class GltfLook;
};

}  // namespace raywave
