// SPDX-License-Identifier: Apache-2.0
/// Materials and pictures of a mesh file, as Assimp gives them.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "host/scene/read_data.hpp"

struct aiScene;
struct aiMesh;

namespace raywave {

/// False also where Assimp gives a file without colours black ones that nothing shows (AMF).
bool has_colours(const aiMesh& part);

/// The materials of a file, translated on demand.
class MaterialReader {
public:
  MaterialReader(const aiScene& scene, Mesh& mesh) : scene_(scene), mesh_(mesh) {}

  /// Number of the part's material in Mesh::materials; -1: the file has none for it.
  std::int32_t material_of(const aiMesh& part);

  /// The set of texture coordinates that the maps of a part's material use.
  unsigned coordinates_of(const aiMesh& part) const;

private:
  const aiScene& scene_;
  Mesh& mesh_;
  // By Assimp's number of the material, and whether the part has colours
  std::map<std::pair<unsigned, bool>, std::int32_t> known_;
  std::map<std::string, std::int32_t> pictures_;

  friend class MaterialTranslation;
};

}  // namespace raywave
