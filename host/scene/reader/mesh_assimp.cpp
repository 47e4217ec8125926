// SPDX-License-Identifier: Apache-2.0
#include <assimp/config.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <fstream>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <utility>
#include <vector>

#include "host/common/error.hpp"
#include "host/scene/mesh.hpp"
#include "host/scene/reader/materials_assimp.hpp"
#include "host/scene/reader/mesh_builder.hpp"
#include "host/scene/reader/mesh_polygon.hpp"
#include "host/scene/reader/mesh_text.hpp"
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

glm::vec4 to_glm(const aiColor4D& c) { return {c.r, c.g, c.b, c.a}; }

void note_once(Mesh& mesh, const char* what) {
  if (std::find(mesh.notes.begin(), mesh.notes.end(), what) == mesh.notes.end())
    mesh.notes.emplace_back(what);
}

std::string name_of(const aiMesh& mesh) { return '"' + std::string(mesh.mName.C_Str()) + '"'; }

/// Appends one part of the file. `raw` keeps a normal of zero where the file has none.
void append(const aiMesh& part, const glm::dmat4& world_from_part, MaterialReader& materials,
            Mesh& raw) {
  const auto material = materials.material_of(part);
  const unsigned coordinates = materials.coordinates_of(part);
  const bool coloured = has_colours(part);
  if (coloured) raw.colours.resize(raw.positions.size(), glm::vec4(1));
  if (part.HasBones()) note_once(raw, "bones are ignored");
  if (part.mNumAnimMeshes > 0) note_once(raw, "morph targets are ignored");
  const auto first = static_cast<glm::uint>(raw.positions.size());
  const glm::dmat3 linear(world_from_part);
  const double orientation = glm::determinant(linear) < 0 ? -1 : 1;
  const auto cofactor = cofactor_of(linear);

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
    if (coloured) raw.colours.push_back(linear_colour_from_srgb(to_glm(part.mColors[0][i])));
  }
  if (!raw.colours.empty()) raw.colours.resize(raw.positions.size(), glm::vec4(1));
  std::vector<glm::dvec3> corners;
  std::vector<glm::uvec3> triangles;
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices < 3) continue;  // points and lines
    const auto where = [&] { return "mesh " + name_of(part) + ": face " + std::to_string(i); };
    corners.clear();
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      if (face.mIndices[k] >= part.mNumVertices)
        throw InputError(where() + " names a vertex that is not there");
      corners.push_back(raw.positions[first + face.mIndices[k]]);
    }
    const auto cut = cut_polygon(corners, triangles);
    if (cut == Cut::crossing)
      throw InputError(where() + ": its outline crosses itself; triangulate it in the program " +
                       "that made it");
    if (cut == Cut::twisted)
      note_once(raw, "twisted faces of four corners are cut along the shorter diagonal");
    for (auto t : triangles) {
      if (orientation < 0) std::swap(t.y, t.z);  // a mirror turns triangles inside out
      raw.triangles.emplace_back(first + face.mIndices[t.x], first + face.mIndices[t.y],
                                 first + face.mIndices[t.z]);
      raw.triangle_material.push_back(material);
    }
  }
}

/// The length of the file's unit in metres; 0: it gives none. Takes out what Assimp makes of it:
/// Collada's scales the root, FBX's nothing.
double take_unit(aiScene& scene, const std::filesystem::path& file) {
  float scale = 0;
  if (lower(file.extension().string()) != ".dae") {
    double centimetres = 0;
    if (!scene.mMetaData) return 0;
    if (scene.mMetaData->Get("UnitScaleFactor", scale)) return scale / 100;
    return scene.mMetaData->Get("UnitScaleFactor", centimetres) ? centimetres / 100 : 0;
  }
  std::string head(65536, '\0');
  std::ifstream(file, std::ios::binary).read(head.data(), std::ssize(head));
  const auto start = std::min(head.find("<unit"), head.size());
  const auto tag = head.substr(start, head.find('>', start) - start);
  const auto quote = tag.find_first_of("\"'", std::min(tag.find("meter"), tag.size()));
  double unit = 0;
  if (quote == tag.npos ||
      !is_number(tag.substr(quote + 1, tag.find(tag[quote], quote + 1) - quote - 1), unit))
    return 0;
  auto& root = scene.mRootNode->mTransformation;
  if (std::abs(root.a1 - unit) < 1e-6 * unit) root = aiMatrix4x4();
  return unit;
}

/// Merges all parts as the file places them. Without recursion, for a file may nest its nodes to
/// any depth.
Mesh flatten(aiScene& scene, const std::filesystem::path& file) {
  Mesh raw;
  if (const double unit = take_unit(scene, file); unit > 0 && unit != 1)
    raw.notes.push_back("its unit of " + digits_of(unit) + " m is not applied, and its numbers " +
                        "are taken as metres; unit = \"" + digits_of(unit) +
                        " m\" gives it its own size");
  MaterialReader materials(scene, raw);
  if (scene.mNumAnimations > 0) raw.notes.emplace_back("animations are ignored");
  std::vector<std::pair<const aiNode*, glm::dmat4>> pending{{scene.mRootNode, glm::dmat4(1)}};
  for (std::size_t visited = 0; !pending.empty(); ++visited) {
    const auto [node, world_from_parent] = pending.back();
    pending.pop_back();
    const glm::dmat4 world_from_node = world_from_parent * to_glm(node->mTransformation);
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      const aiMesh& part = *scene.mMeshes[node->mMeshes[i]];
      if (visited > kMaxNodes || raw.triangles.size() + part.mNumFaces > most_triangles_of_file ||
          raw.positions.size() + part.mNumVertices > most_vertices_of_file)
        throw InputError("more than " + std::to_string(most_triangles_of_file) + " triangles");
      append(part, world_from_node, materials, raw);
    }
    for (unsigned i = 0; i < node->mNumChildren; ++i)
      pending.emplace_back(node->mChildren[i], world_from_node);
  }
  if (const auto note = keep_visible(raw.materials, "an opacity of 0"); !note.empty())
    raw.notes.push_back(note);
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
    auto* const there = pending.back();
    pending.pop_back();
    if (!there) continue;  // left for validation, as of RAW files with several parts
    aiNode& node = *there;
    unsigned kept = 0;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const auto part = node.mMeshes[i];
      // One that is not there is left for validation, too
      const int now = part < place.size() ? place[part] : static_cast<int>(scene.mNumMeshes);
      if (now >= 0) node.mMeshes[kept++] = static_cast<unsigned>(now);
    }
    node.mNumMeshes = kept;
    pending.insert(pending.end(), node.mChildren, node.mChildren + node.mNumChildren);
  }
}

void prepare(Assimp::Importer& importer) {
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
#ifdef AI_CONFIG_IMPORT_COLLADA_IGNORE_UNIT_SIZE
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UNIT_SIZE, true);
#endif
#ifdef AI_CONFIG_IMPORT_FBX_IGNORE_UP_DIRECTION
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_IGNORE_UP_DIRECTION, true);
#endif
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& file) {
  // Not aiProcess_JoinIdenticalVertices: it merges what lies within 1e-5 units, which eats a mesh
  // of micrometres.
  constexpr unsigned steps = aiProcess_ValidateDataStructure;
  const auto refuse = [](const std::string& why) {
    throw InputError("Assimp cannot read it: " + why + "; export it as glTF, OBJ or PLY");
  };
  Assimp::Importer importer;
  prepare(importer);
  if (importer.ReadFile(file.string(), steps) && importer.GetScene()->mRootNode)
    return flatten(*const_cast<aiScene*>(importer.GetScene()), file);

  // Once more without what is no surface, such as a camera without a place; by an importer of its
  // own, since some readers keep what the first has left
  const std::string why = importer.GetErrorString();
  if (why.find("Validation failed") == std::string::npos) refuse(why);
  Assimp::Importer again;
  prepare(again);
  if (!again.ReadFile(file.string(), 0) || !again.GetScene()->mRootNode) refuse(why);
  auto& scene = *const_cast<aiScene*>(again.GetScene());
  keep_surfaces(scene);
  if (scene.mNumMeshes == 0) throw InputError("holds no triangle");
  if (!again.ApplyPostProcessing(steps) || !scene.mRootNode) refuse(again.GetErrorString());
  return flatten(scene, file);
}

}  // namespace raywave
