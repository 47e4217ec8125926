// SPDX-License-Identifier: Apache-2.0
/// Materials and pictures of a mesh file, as Assimp gives them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "host/scene/read_data.hpp"

struct aiScene;
struct aiMesh;

namespace raywave {

/// What Assimp does not pass on of the materials of a glTF file, by the materials' names.
struct GltfExtras {
  struct OfMaterial {
    double ior = 1.5, emissive_strength = 1, transmission = 0;
    bool differs = false;  // several materials of this name do not agree
    std::vector<std::string> extensions;
  };
  bool is_gltf2 = false;
  std::map<std::string, OfMaterial> materials;
};

/// Reads the JSON part of a .gltf or .glb file; nothing of other files. A part that is no JSON is
/// left for Assimp to refuse.
GltfExtras gltf_extras_of(const std::filesystem::path& file);

/// The materials of a file, translated on demand.
class MaterialReader {
public:
  MaterialReader(const aiScene& scene, const std::filesystem::path& file, Mesh& mesh);

  /// Number of the part's material in Mesh::materials; -1: the file has none for it.
  std::int32_t material_of(const aiMesh& part);

  /// The set of texture coordinates that the maps of a part's material use.
  unsigned coordinates_of(const aiMesh& part) const;

  /// Vertex colours of this kind of file are linear; those of others are sRGB.
  bool has_linear_colours() const { return extras_.is_gltf2; }

private:
  const aiScene& scene_;
  bool is_obj_ = false, is_ply_ = false;
  GltfExtras extras_;
  Mesh& mesh_;
  // By Assimp's number of the material, and whether the part has colours
  std::map<std::pair<unsigned, bool>, std::int32_t> known_;
  std::map<std::string, std::int32_t> pictures_;

  friend class MaterialTranslation;
};

}  // namespace raywave
