// SPDX-License-Identifier: Apache-2.0
/// A glTF 2.0 file: its JSON, its nodes, and the numbers and bytes that it names.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/scene/read_data.hpp"
#include "host/scene/reader/mesh_text.hpp"

namespace raywave {

// All throw InputError where a value is of another type.

/// A member of an object, or an element of an array; null where there is none.
const nlohmann::json& member(const nlohmann::json& object, const char* name);
const nlohmann::json& element(const nlohmann::json& array, const nlohmann::json& index);
const nlohmann::json& extension(const nlohmann::json& object, const char* name);

double number_or(const nlohmann::json& value, double otherwise);
/// A whole number, >= 0; `otherwise` where there is none.
std::uint64_t count_or(const nlohmann::json& value, std::uint64_t otherwise);
std::string text_or(const nlohmann::json& value, const std::string& otherwise);
/// A name as replies may hold it.
std::string name_or(const nlohmann::json& value, const std::string& otherwise);
/// The same between two others.
double number_or(const nlohmann::json& value, double otherwise, double low, double high);
/// Three numbers of at most 1e15.
glm::dvec3 vector_or(const nlohmann::json& value, glm::dvec3 otherwise);
/// The same, >= 0.
glm::dvec3 colour_or(const nlohmann::json& value, glm::dvec3 otherwise);

/// Adds a note that is not there yet, up to the number that replies may hold.
void add_note(std::vector<std::string>& notes, const std::string& note);

/// The elements of an accessor where they lie, which is the file's memory or a decoder's. Elements
/// of a sparse part replace others; elements that are nowhere are zero.
struct GltfNumbers {
  static constexpr std::uint64_t floats = 5126;
  std::uint64_t count = 0;
  std::uint64_t components = 1;
  std::uint64_t type = floats;  // glTF's componentType
  std::uint64_t bytes = 4;      // of a component
  bool is_share = false;        // whole numbers stand for 0 to 1, or -1 to 1
  const char* first = nullptr;
  std::uint64_t step = 0;                                        // bytes between elements
  std::vector<std::pair<std::uint64_t, const char*>> changed{};  // by their numbers, ascending

  double (*read)(const char* at, bool is_share) = nullptr;

  /// returns  false where glTF has no such type
  bool set_type(std::uint64_t component_type);
  double at(std::uint64_t element, std::uint64_t component) const;
  glm::dvec3 vector_at(std::uint64_t i) const { return {at(i, 0), at(i, 1), at(i, 2)}; }
};

/// Where a picture or a buffer is.
struct GltfResource {
  std::string name;   // of the file, as its folder has it where it is there
  std::string bytes;  // of a data URI
  bool is_file = true, is_there = true;
};

class GltfFile {
public:
  /// returns  null for other formats, and for glTF 1
  /// throws   InputError for other versions, damaged JSON, and a file that requires an extension
  ///          that is not read
  static std::unique_ptr<GltfFile> open(const std::filesystem::path& file);

  const nlohmann::json& root() const { return root_; }
  const nlohmann::json& of(const char* array, const nlohmann::json& index) const {
    return element(member(root_, array), index);
  }

  /// Extensions that are used and not read.
  const std::vector<std::string>& notes() const { return notes_; }

  /// An accessor, checked: all its elements can be read.
  ///
  /// kind   as the file names it: "SCALAR", "VEC3", "VEC4", "MAT4"
  /// what   for messages: "keys of an animation"
  /// whole  whole numbers count as they are, unless the accessor is normalized
  /// most   elements
  /// throws InputError when there is no such accessor, or it does not lie in its buffer
  GltfNumbers numbers(const nlohmann::json& index, const std::string& kind, const std::string& what,
                      bool whole, std::uint64_t most);

  /// The bytes of a view of a buffer, decompressed.
  std::string_view view(const nlohmann::json& index, const std::string& what);

  /// What a URI names (RFC 3986): the bytes in it, or a file beside this one.
  ///
  /// throws  InputError for damaged base64
  GltfResource resource(const std::string& uri) const;

  /// Visits the nodes of the file's scene, parents first and each once.
  ///
  /// visit    node, its number in the file, how many were visited before its parent (-1: none), its
  ///          pose, and whether it is shown (KHR_node_visibility)
  /// returns  what is wrong where a node is in several places or missing; else nothing
  /// throws   InputError when a node is nowhere
  using Visit = std::function<void(const nlohmann::json& node, std::int32_t number,
                                   std::int32_t parent, const glm::dmat4& pose, bool is_shown)>;
  std::string for_each_node(const Visit& visit) const;

private:
  explicit GltfFile(std::filesystem::path file) : file_(std::move(file)) {}
  void check_extensions();
  std::string_view buffer(std::uint64_t index, const std::string& what);
  std::string decompressed(const nlohmann::json& how, const std::string& what);
  const char* elements(const nlohmann::json& where, std::uint64_t count, std::uint64_t each,
                       std::uint64_t& step, const std::string& what);
  std::vector<nlohmann::json> top_nodes() const;

  std::filesystem::path file_;
  nlohmann::json root_;
  std::string_view binary_;  // a GLB's second chunk
  std::vector<std::unique_ptr<MappedFile>> files_;
  std::deque<std::string> decoded_;  // bytes of data URIs
  std::map<std::uint64_t, std::string_view> buffers_;
  std::map<std::uint64_t, std::string> decompressed_;
  std::vector<std::string> notes_;
};

/// A node's place in its parent; its number, parent and contents are left as they are.
GltfNode gltf_place_of(const nlohmann::json& node);

/// A primitive of KHR_draco_mesh_compression, decoded.
struct DracoMesh {
  std::vector<std::uint32_t> corners;
  std::map<std::string, std::pair<std::string, GltfNumbers>> attributes;  // bytes, and their view
};

/// attributes  of the extension: Draco's numbers by glTF's names
/// throws      InputError when the bytes are damaged
DracoMesh decode_draco(std::string_view bytes, const nlohmann::json& attributes);

/// What a node says of the skin and the morph targets of its mesh; GltfWearer::node and joints are
/// numbers of the file. Empty where the mesh has neither.
///
/// throws   InputError when there is no such skin, or weights and targets differ in number
GltfWearer wearer_of(const GltfFile& gltf, const nlohmann::json& node, std::int32_t number);

// Primitives of the meshes of glTF files: their vertices and triangles, skins and morph targets.

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
  [[noreturn]] void refuse(const std::string& why) const { fail(what(why)); }
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
