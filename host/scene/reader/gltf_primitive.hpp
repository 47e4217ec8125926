// SPDX-License-Identifier: Apache-2.0
/// Primitives of the meshes of glTF files: their vertices and triangles, skins and morph targets.
#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <map>
#include <string>
#include <vector>

#include "host/scene/reader/gltf_file.hpp"

namespace raywave {

class GltfPrimitive {
public:
  /// node   that shows its mesh
  /// draco  what of it is compressed; null: nothing
  /// throws InputError, as all below, with the mesh's name
  GltfPrimitive(GltfFile& gltf, const nlohmann::json& node, const nlohmann::json& primitive,
                bool deforms, const DracoMesh* draco);

  std::uint64_t count() const { return positions_.count; }
  const GltfNumbers& positions() const { return positions_; }
  const nlohmann::json& object() const { return json_; }
  bool has(const std::string& attribute) const {
    return !member(member(json_, "attributes"), attribute.c_str()).is_null();
  }

  /// An attribute of all its vertices.
  GltfNumbers attribute(const std::string& name, const char* kind, bool whole = true) const;
  GltfNumbers numbers(const nlohmann::json& accessor, const char* kind, const std::string& name,
                      bool whole = true) const;

  /// Three vertices for each triangle, also of strips and fans.
  std::vector<std::uint32_t> corners() const;

  std::string what(const std::string& name) const { return mesh_ + ": " + name; }
  [[noreturn]] void fail(const std::string& why) const;
  void require_count(const std::string& name, std::uint64_t count) const;

private:
  GltfFile& gltf_;
  const nlohmann::json& json_;
  bool deforms_;
  const DracoMesh* draco_;
  std::string mesh_;  // "mesh "body"", for messages
  GltfNumbers positions_;
};

/// A primitive that deforms.
struct GltfPart {
  DeformingPart part;
  std::vector<glm::dmat4> world_from_mesh;  // by joint, with all nodes at rest
};

/// The vertices that `order` names, with the skin and the morph targets of the node's mesh.
///
/// poses     of all nodes, by their numbers
/// instance  node from mesh, of a mesh without a skin
/// left      vertices that may deform yet, of all targets; reduced
GltfPart deforming_part(GltfFile& gltf, const GltfPrimitive& from, const nlohmann::json& node,
                        const GltfWearer& wearer, const std::map<std::int32_t, glm::dmat4>& poses,
                        const glm::dmat4& instance, const std::vector<std::uint32_t>& order,
                        std::uint64_t& left);

/// "mesh "body"": a node's mesh, for messages.
std::string name_of_mesh(const GltfFile& gltf, const nlohmann::json& node);

}  // namespace raywave
