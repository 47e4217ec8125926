// SPDX-License-Identifier: Apache-2.0
#include <assimp/DefaultIOStream.h>
#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "host/common/error.hpp"
#include "host/scene/gltf_deform.hpp"
#include "host/scene/mesh.hpp"
#include "host/scene/reader/gltf_deform.hpp"
#include "host/scene/reader/gltf_json.hpp"
#include "host/scene/reader/materials_assimp.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {
namespace {

constexpr std::size_t kMaxNodes = 1'000'000;

glm::dmat4 to_glm(const aiMatrix4x4& m) {  // Assimp stores rows, glm columns
  return {m.a1, m.b1, m.c1, m.d1, m.a2, m.b2, m.c2, m.d2,
          m.a3, m.b3, m.c3, m.d3, m.a4, m.b4, m.c4, m.d4};
}

glm::dvec3 to_glm(const aiVector3D& v) { return {v.x, v.y, v.z}; }

/// The colour of a vertex, linear; white where the file has nonsense.
glm::vec4 colour_of(const aiColor4D& c, bool is_linear) {
  glm::vec4 colour(c.r, c.g, c.b, c.a);
  for (int i = 0; i < 4; ++i) {
    if (!std::isfinite(colour[i])) return glm::vec4(1);
    colour[i] = std::clamp(colour[i], 0.0f, i < 3 ? 1e6f : 1.0f);
    if (!is_linear && i < 3) colour[i] = linear_from_srgb(std::min(colour[i], 1.0f));
  }
  return colour;
}

void note_once(Mesh& mesh, const char* what) {
  if (std::find(mesh.notes.begin(), mesh.notes.end(), what) == mesh.notes.end())
    mesh.notes.emplace_back(what);
}

/// Appends one part of the file. `raw` keeps a normal of zero where the file has none.
///
/// deforms  place_deforming takes it from here
void append(const aiMesh& part, const glm::dmat4& world_from_part, bool deforms,
            MaterialReader& materials, Mesh& raw) {
  const auto material = materials.material_of(part);
  const unsigned coordinates = materials.coordinates_of(part);
  if (part.HasVertexColors(0)) raw.colours.resize(raw.positions.size(), glm::vec4(1));
  if (part.HasBones() && !deforms) note_once(raw, "bones are ignored");
  if (part.mNumAnimMeshes > 0 && !deforms) note_once(raw, "morph targets are ignored");
  const auto first = static_cast<glm::uint>(raw.positions.size());
  const glm::dmat3 linear(world_from_part);
  const double orientation = glm::determinant(linear) < 0 ? -1 : 1;
  // The cofactor matrix turns normals also where the transform has no inverse.
  const glm::dmat3 cofactor(glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
                            glm::cross(linear[0], linear[1]));

  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const glm::dvec3 position =
        glm::dvec3(world_from_part * glm::dvec4(to_glm(part.mVertices[i]), 1));
    if (!is_finite(position))
      throw InputError("vertex " + std::to_string(i) + " is NaN or infinite");
    raw.positions.push_back(position);
    raw.normals.push_back(part.HasNormals()
                              ? unit_or_zero(orientation * (cofactor * to_glm(part.mNormals[i])))
                              : glm::dvec3(0));
    const glm::dvec3 uv = part.HasTextureCoords(coordinates)
                              ? to_glm(part.mTextureCoords[coordinates][i])
                              : glm::dvec3(0);
    raw.uvs.push_back(is_finite(uv) ? glm::dvec2(uv) : glm::dvec2(0));
    if (part.HasVertexColors(0))
      raw.colours.push_back(colour_of(part.mColors[0][i], materials.has_linear_colours()));
  }
  if (!raw.colours.empty()) raw.colours.resize(raw.positions.size(), glm::vec4(1));
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices != 3) continue;  // points and lines
    std::array<unsigned, 3> corner{face.mIndices[0], face.mIndices[1], face.mIndices[2]};
    if (*std::max_element(corner.begin(), corner.end()) >= part.mNumVertices)
      throw InputError("face " + std::to_string(i) + " names a vertex that is not there");
    if (orientation < 0) std::swap(corner[1], corner[2]);  // a mirror turns triangles inside out
    raw.triangles.emplace_back(first + corner[0], first + corner[1], first + corner[2]);
    raw.triangle_material.push_back(material);
  }
}

std::string name_of(const aiMesh& mesh) { return '"' + std::string(mesh.mName.C_Str()) + '"'; }

/// The file's numbers of the vertices of a part as Assimp has it: all of them (5.2), or, in later
/// versions, those that triangles use, in the order in which these name them first.
std::vector<std::uint32_t> order_of(const GltfPart& deforming, const aiMesh& found) {
  std::vector<std::uint32_t> all(deforming.part.positions.size()), used;
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  std::vector<bool> is_used(all.size(), false);
  for (const auto corner : deforming.corners) {
    if (!is_used[corner]) used.push_back(corner);
    is_used[corner] = true;
  }
  const auto fits = [&](const std::vector<std::uint32_t>& order) {
    if (order.size() != found.mNumVertices) return false;
    for (unsigned i = 0; i < found.mNumVertices; ++i) {
      const auto& p = found.mVertices[i];
      if (deforming.part.positions[order[i]] != glm::vec3(p.x, p.y, p.z)) return false;
    }
    // Strips and fans have other corners than their triangles
    if (deforming.corners.size() != std::size_t{3} * found.mNumFaces) return true;
    for (std::size_t i = 0; i < deforming.corners.size(); ++i) {
      const auto& face = found.mFaces[i / 3];
      if (face.mNumIndices == 3 && face.mIndices[i % 3] < order.size() &&
          order[face.mIndices[i % 3]] != deforming.corners[i])
        return false;
    }
    return true;
  };
  if (fits(all)) return all;
  if (fits(used)) return used;
  throw InputError("mesh " + name_of(found) +
                   ": its vertices are not those that Assimp has found; export the file again, or "
                   "without the skin or the morph targets");
}

/// Puts the last part that has been appended where its skin and its morph targets have it at rest.
///
/// first_vertex, first_triangle  of it
void place_deforming(GltfPart deforming, const aiMesh& found, std::size_t first_vertex,
                     std::size_t first_triangle, bool keeps_part, Mesh& raw) {
  auto& part = deforming.part;
  reorder(part, order_of(deforming, found));
  for (std::size_t i = 0; i < part.positions.size(); ++i) {
    const auto [position, normal] =
        deformed_vertex(part, deforming.world_from_mesh, part.weights, i);
    if (!(glm::length(position) <= 1e30))
      throw InputError("mesh " + name_of(found) + ": vertex " + std::to_string(i) +
                       " is nowhere; look at the scales of its joints");
    raw.positions[first_vertex + i] = position;
    raw.normals[first_vertex + i] = normal;
  }
  if (is_mirrored(part, deforming.world_from_mesh))
    for (auto i = first_triangle; i < raw.triangles.size(); ++i)
      std::swap(raw.triangles[i].y, raw.triangles[i].z);
  part.first_vertex = static_cast<std::uint32_t>(first_vertex);
  if (keeps_part) raw.deforming.push_back(std::move(part));
}

/// The numbers that a glTF file gives Assimp's nodes: both trees are walked side by side.
std::map<const aiNode*, std::int32_t> numbers_of_nodes(const aiScene& scene,
                                                       const nlohmann::json& root) {
  using nlohmann::json;
  std::map<const aiNode*, std::int32_t> numbers;
  std::vector<std::pair<const aiNode*, json>> pending;
  const auto refuse = [] { throw InputError("its nodes are not those that Assimp has found"); };
  const auto add_all = [&](const aiNode* const* nodes, unsigned count, const json& indices) {
    if ((indices.is_array() ? indices.size() : 0) != count) refuse();
    for (unsigned i = 0; i < count; ++i) pending.emplace_back(nodes[i], indices[i]);
  };
  const auto& top = top_nodes_of(root);
  if (top.is_array() && top.size() == 1)
    add_all(&scene.mRootNode, 1, top);
  else
    add_all(scene.mRootNode->mChildren, scene.mRootNode->mNumChildren, top);
  while (!pending.empty()) {
    const auto [found, index] = pending.back();
    pending.pop_back();
    const auto& node = element(member(root, "nodes"), index);
    const auto at = glm::dvec3(matrix_of(gltf_place_of(node))[3]),
               found_at = glm::dvec3(to_glm(found->mTransformation)[3]);
    if (!node.is_object() || glm::length(at - found_at) > 1e-4 * (1 + glm::length(at)) ||
        (found->mNumMeshes > 0 && member(node, "mesh").is_null()))
      refuse();
    numbers.emplace(found, index.get<std::int32_t>());
    add_all(found->mChildren, found->mNumChildren, member(node, "children"));
  }
  return numbers;
}

/// What Assimp does not say of a glTF file.
struct GltfFile {
  nlohmann::json root;
  GltfParts parts;
};

GltfFile gltf_file(const std::filesystem::path& file) {
  GltfFile gltf;
  if (const auto type = lower_extension(file); type != ".gltf" && type != ".glb") return gltf;
  gltf.root = gltf_json(file);
  if (is_gltf2(gltf.root)) gltf.parts = read_gltf_parts(gltf.root, file);
  return gltf;
}

/// Merges all parts as the file places them. Without recursion, for a file may nest its nodes to
/// any depth.
Mesh flatten(const aiScene& scene, const std::filesystem::path& file, const GltfFile& gltf,
             bool wants_nodes) {
  Mesh raw;
  const auto numbers = wants_nodes || !gltf.parts.empty() ? numbers_of_nodes(scene, gltf.root)
                                                          : std::map<const aiNode*, std::int32_t>{};
  MaterialReader materials(scene, file, raw);
  if (scene.mNumAnimations > 0 && !wants_nodes) raw.notes.emplace_back("animations are ignored");
  std::vector<std::pair<const aiNode*, glm::dmat4>> pending{{scene.mRootNode, glm::dmat4(1)}};
  for (std::size_t visited = 0; !pending.empty(); ++visited) {
    const auto [node, world_from_parent] = pending.back();
    pending.pop_back();
    const glm::dmat4 world_from_node = world_from_parent * to_glm(node->mTransformation);
    const auto number = numbers.find(node);  // Assimp's own root has none
    const auto found = number == numbers.end() ? gltf.parts.end() : gltf.parts.find(number->second);
    const bool deforms = found != gltf.parts.end();
    if (deforms && node->mNumMeshes != found->second.size())
      throw InputError(
          "parts of a mesh with a skin or morph targets are not those that Assimp has "
          "found; export the file again, without parts that are empty");
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      const aiMesh& part = *scene.mMeshes[node->mMeshes[i]];
      if (visited > kMaxNodes || raw.triangles.size() + part.mNumFaces > most_triangles_of_file ||
          raw.positions.size() + part.mNumVertices > most_vertices_of_file)
        throw InputError("more than " + std::to_string(most_triangles_of_file) + " triangles");
      const auto first_vertex = raw.positions.size(), first_triangle = raw.triangles.size();
      const auto* deforming = deforms && found->second[i] ? &*found->second[i] : nullptr;
      append(part, deforming ? glm::dmat4(1) : world_from_node, deforming != nullptr, materials,
             raw);
      if (deforming)
        place_deforming(*deforming, part, first_vertex, first_triangle, wants_nodes, raw);
    }
    if (wants_nodes && node->mNumMeshes > 0)
      raw.triangle_node.resize(raw.triangles.size(), numbers.at(node));
    for (unsigned i = 0; i < node->mNumChildren; ++i)
      pending.emplace_back(node->mChildren[i], world_from_node);
  }
  if (raw.materials.empty()) raw.triangle_material.clear();
  return raw;
}

/// Deletes the entries of one of Assimp's lists that `keep` refuses. Returns the new places of the
/// others, -1 for those.
template <class T, class Keep>
std::vector<int> delete_from(T**& list, unsigned& count, Keep keep) {
  std::vector<int> place(count, -1);
  unsigned kept = 0;
  for (unsigned i = 0; i < count; ++i) {
    if (keep(*list[i])) {
      place[i] = static_cast<int>(kept);
      list[kept++] = list[i];
    } else {
      delete list[i];
    }
  }
  count = kept;
  if (kept == 0) {  // validation wants none then
    delete[] list;
    list = nullptr;
  }
  return place;
}

/// Takes out what shows no surface, and what validation may refuse: cameras, lights, empty parts.
void keep_surfaces(aiScene& scene) {
  const auto none = [](const auto&) { return false; };
  delete_from(scene.mCameras, scene.mNumCameras, none);
  delete_from(scene.mLights, scene.mNumLights, none);
  const auto place = delete_from(scene.mMeshes, scene.mNumMeshes, [](const aiMesh& part) {
    return part.mNumVertices > 0 && part.mNumFaces > 0;
  });
  std::vector<aiNode*> pending{scene.mRootNode};
  while (!pending.empty()) {
    aiNode& node = *pending.back();
    pending.pop_back();
    unsigned kept = 0;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const auto part = node.mMeshes[i];
      // One that is not there is left for validation to find
      const int now = part < place.size() ? place[part] : static_cast<int>(scene.mNumMeshes);
      if (now >= 0) node.mMeshes[kept++] = static_cast<unsigned>(now);
    }
    node.mNumMeshes = kept;
    pending.insert(pending.end(), node.mChildren, node.mChildren + node.mNumChildren);
  }
}

/// A file that throws at its end: Assimp's PLY reader reads for ever when the end of the header or
/// of the data is missing.
class EndingStream : public Assimp::DefaultIOStream {
public:
  EndingStream(std::FILE* file, const char* name) : DefaultIOStream(file, name) {}
  std::size_t Read(void* buffer, std::size_t size, std::size_t count) override {
    const std::size_t done = DefaultIOStream::Read(buffer, size, count);
    if (done == 0 && ++empty_reads_ > 1000) throw std::runtime_error("the file ends too soon");
    return done;
  }

private:
  int empty_reads_ = 0;
};

class EndingFiles : public Assimp::DefaultIOSystem {
public:
  Assimp::IOStream* Open(const char* name, const char* mode) override {
    std::FILE* file = std::fopen(name, mode);
    return file ? new EndingStream(file, name) : nullptr;  // Close deletes it
  }
};

void prepare(Assimp::Importer& importer) {
  importer.SetIOHandler(new EndingFiles);  // which the importer deletes
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
#ifdef AI_CONFIG_IMPORT_COLLADA_IGNORE_UNIT_SIZE
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UNIT_SIZE, true);
#endif
#ifdef AI_CONFIG_IMPORT_FBX_IGNORE_UP_DIRECTION
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_IGNORE_UP_DIRECTION, true);
#endif
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& file, bool wants_nodes) {
  // Not aiProcess_JoinIdenticalVertices: it merges what lies within 1e-5 units, which eats a mesh
  // of micrometres.
  constexpr unsigned steps = aiProcess_ValidateDataStructure | aiProcess_Triangulate;
  // First: Assimp sees no skin or morph target that is damaged
  const auto gltf = gltf_file(file);
  Assimp::Importer importer;
  prepare(importer);
  if (const auto* scene = importer.ReadFile(file.string(), steps); scene && scene->mRootNode)
    return flatten(*scene, file, gltf, wants_nodes);

  // Once more without what is no surface, such as empty solids or a camera without a place; by an
  // importer of its own, since some readers keep what the first has left
  const std::string why = importer.GetErrorString();
  if (why.find("Validation failed") == std::string::npos) throw InputError(why);
  Assimp::Importer again;
  prepare(again);
  if (!again.ReadFile(file.string(), 0) || !again.GetScene()->mRootNode) throw InputError(why);
  keep_surfaces(*const_cast<aiScene*>(again.GetScene()));
  if (again.GetScene()->mNumMeshes == 0) throw InputError("holds no triangle");
  const auto* scene = again.ApplyPostProcessing(steps);
  if (!scene || !scene->mRootNode) throw InputError(again.GetErrorString());
  return flatten(*scene, file, gltf, wants_nodes);
}

}  // namespace raywave
