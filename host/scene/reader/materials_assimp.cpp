// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/materials_assimp.hpp"

#include <assimp/material.h>
#include <assimp/mesh.h>
#include <assimp/scene.h>
#include <assimp/texture.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <utility>

#include "host/common/error.hpp"
#include "host/scene/reader/mesh_builder.hpp"
#include "host/scene/reader_reply.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {
namespace {

std::string cut(std::string text) {
  text.resize(std::min(text.size(), longest_text));
  return text;
}

}  // namespace

/// One material of Assimp's on its way to ours.
class MaterialTranslation {
public:
  MaterialTranslation(MaterialReader& reader, const aiMaterial& from, unsigned coordinates)
      : reader_(reader), from_(from), coordinates_(coordinates) {}

  MeshMaterial translated(bool has_colours) {
    material_.name = cut(from_.GetName().C_Str());
    auto& look = material_.look;
    look.vertex_colours = has_colours;
    look.two_sided = 1;
    if (has(AI_MATKEY_METALLIC_FACTOR) && has(AI_MATKEY_ROUGHNESS_FACTOR))
      read_metallic();
    else
      read_phong();
    look.emission = colour(AI_MATKEY_COLOR_EMISSIVE, glm::dvec3(0));
    look.emission_map = map(aiTextureType_EMISSIVE, "emission map");
    if (look.emission_map.picture >= 0 && look.emission == glm::dvec3(0))
      look.emission = glm::dvec3(1);  // a map alone: "map_Ke" of OBJ
    look.normal_map = map(aiTextureType_NORMALS, "normal map");
    int shading = 0;
    if (from_.Get(AI_MATKEY_SHADING_MODEL, shading) == aiReturn_SUCCESS &&
        shading == aiShadingMode_NoShading)
      look.model = LookModel::unlit;
    read_ignored();
    return std::move(material_);
  }

private:
  bool has(const char* key, unsigned type, unsigned index) const {
    const aiMaterialProperty* property = nullptr;
    return aiGetMaterialProperty(&from_, key, type, index, &property) == aiReturn_SUCCESS;
  }

  /// Not finite numbers count as missing.
  double number(const char* key, unsigned type, unsigned index, double otherwise) const {
    ai_real value = 0;
    return from_.Get(key, type, index, value) == aiReturn_SUCCESS && std::isfinite(value)
               ? double{value}
               : otherwise;
  }

  double share(const char* key, unsigned type, unsigned index, double otherwise) const {
    return std::clamp(number(key, type, index, otherwise), 0.0, 1.0);
  }

  glm::dvec3 colour(const char* key, unsigned type, unsigned index, glm::dvec3 otherwise) const {
    aiColor3D value;
    if (from_.Get(key, type, index, value) != aiReturn_SUCCESS) return otherwise;
    const glm::dvec3 c(value.r, value.g, value.b);
    return is_finite(c) ? glm::clamp(c, 0.0, 1e30) : otherwise;
  }

  void note(const std::string& what) {
    if (material_.notes.size() < most_notes_of_file) material_.notes.push_back(cut(what));
  }

  Wrap wrap_of(const char* key, unsigned type, unsigned index) const {
    int mode = aiTextureMapMode_Wrap;
    from_.Get(key, type, index, mode);
    return mode == aiTextureMapMode_Mirror  ? Wrap::mirror
           : mode == aiTextureMapMode_Clamp ? Wrap::clamp
                                            : Wrap::repeat;
  }

  MeshMap map(aiTextureType type, const char* name) {
    aiString file;
    if (from_.GetTextureCount(type) == 0 ||
        from_.Get(AI_MATKEY_TEXTURE(type, 0), file) != aiReturn_SUCCESS || file.length == 0)
      return {};
    MeshMap map;
    int set = 0;
    from_.Get(AI_MATKEY_UVWSRC(type, 0), set);
    if (static_cast<unsigned>(std::max(set, 0)) != coordinates_) {
      note(std::string(name) + " is ignored: it has texture coordinates of its own");
      return {};
    }
    map.picture = picture(file.C_Str());
    if (map.picture < 0) {
      note(std::string(name) + " is ignored: there are too many pictures");
      return {};
    }
    map.place.wrap_u = wrap_of(AI_MATKEY_MAPPINGMODE_U(type, 0));
    map.place.wrap_v = wrap_of(AI_MATKEY_MAPPINGMODE_V(type, 0));
    aiUVTransform transform;
    if (from_.Get(AI_MATKEY_UVTRANSFORM(type, 0), transform) == aiReturn_SUCCESS &&
        !(transform.mTranslation == aiVector2D(0, 0) && transform.mScaling == aiVector2D(1, 1) &&
          transform.mRotation == 0))
      note(std::string(name) + ": its transform of texture coordinates is ignored");
    return map;
  }

  /// Number of a picture in the mesh; -1: there are too many.
  std::int32_t picture(const std::string& name) {
    const auto found = reader_.pictures_.find(name);
    if (found != reader_.pictures_.end()) return found->second;
    auto& pictures = reader_.mesh_.pictures;
    if (pictures.size() >= most_pictures_of_file) return -1;
    MeshPicture picture{cut(name), {}};
    if (const aiTexture* embedded = reader_.scene_.GetEmbeddedTexture(name.c_str()))
      embed(*embedded, picture);
    const auto number = static_cast<std::int32_t>(pictures.size());
    pictures.push_back(std::move(picture));
    reader_.pictures_.emplace(name, number);
    return number;
  }

  static void embed(const aiTexture& from, MeshPicture& picture) {
    if (from.mFilename.length > 0) picture.name = cut(from.mFilename.C_Str());
    const auto* bytes = reinterpret_cast<const char*>(from.pcData);
    if (from.mHeight == 0) {
      picture.bytes.assign(bytes, bytes + from.mWidth);
      return;
    }
    // Texels without a format become a TGA file: 32 bits, blue first, row 0 on top
    if (from.mWidth > 65535 || from.mHeight > 65535)
      throw InputError("a picture in it is larger than 65535 a side");
    picture.bytes.resize(12, 0);
    picture.bytes[2] = 2;
    for (const unsigned n :
         {from.mWidth, from.mWidth >> 8, from.mHeight, from.mHeight >> 8, 32u, 0x28u})
      picture.bytes.push_back(static_cast<char>(n & 255));
    picture.bytes.insert(picture.bytes.end(), bytes,
                         bytes + std::size_t{4} * from.mWidth * from.mHeight);
  }

  void read_alpha(double alpha) {
    auto& look = material_.look;
    look.alpha = alpha;
    look.alpha_map = map(aiTextureType_OPACITY, "opacity map");
    if (look.alpha < 1 || look.alpha_map.picture >= 0) look.alpha_mode = AlphaMode::blend;
  }

  void read_metallic() {
    auto& look = material_.look;
    look.model = LookModel::metallic_roughness;
    look.base = colour(AI_MATKEY_BASE_COLOR, colour(AI_MATKEY_COLOR_DIFFUSE, glm::dvec3(1)));
    look.base_map = map(aiTextureType_BASE_COLOR, "base colour map");
    if (look.base_map.picture < 0) look.base_map = map(aiTextureType_DIFFUSE, "diffuse map");
    look.metallic = share(AI_MATKEY_METALLIC_FACTOR, 0);
    look.roughness = share(AI_MATKEY_ROUGHNESS_FACTOR, 1);
    read_alpha(share(AI_MATKEY_OPACITY, 1));
  }

  void read_phong() {
    auto& look = material_.look;
    look.base = colour(AI_MATKEY_COLOR_DIFFUSE, glm::dvec3(1));
    look.base_map = map(aiTextureType_DIFFUSE, "diffuse map");
    look.ambient = colour(AI_MATKEY_COLOR_AMBIENT, glm::dvec3(0));
    look.specular = colour(AI_MATKEY_COLOR_SPECULAR, glm::dvec3(0)) *
                    std::max(0.0, number(AI_MATKEY_SHININESS_STRENGTH, 1));
    look.shininess = std::clamp(number(AI_MATKEY_SHININESS, 0), 0.0, 1e30);
    if (look.shininess == 0) look.specular = glm::dvec3(0);  // none meant
    read_alpha(share(AI_MATKEY_OPACITY, 1));
  }

  /// Names what is there and nobody reads.
  void read_ignored() {
    const auto& look = material_.look;
    const std::pair<aiTextureType, const char*> kinds[] = {
        {aiTextureType_SPECULAR, "specular map"},
        {aiTextureType_HEIGHT, "bump map"},
        {aiTextureType_SHININESS, "shininess map"},
        {aiTextureType_DISPLACEMENT, "displacement map"},
        {aiTextureType_LIGHTMAP, "occlusion map"},
        {aiTextureType_AMBIENT_OCCLUSION, "occlusion map"},
        {aiTextureType_REFLECTION, "reflection map"},
        {aiTextureType_TRANSMISSION, "transmission map"}};
    for (const auto& [type, name] : kinds)
      if (from_.GetTextureCount(type) > 0) note(std::string(name) + " is ignored");
    aiString ambient, base;
    if (from_.Get(AI_MATKEY_TEXTURE(aiTextureType_AMBIENT, 0), ambient) == aiReturn_SUCCESS &&
        !(from_.Get(AI_MATKEY_TEXTURE(aiTextureType_DIFFUSE, 0), base) == aiReturn_SUCCESS &&
          ambient == base))
      note("ambient map is ignored");
    if (number(AI_MATKEY_REFLECTIVITY, 0) > 0) note("reflectivity is ignored");
    if (look.model != LookModel::phong && number(AI_MATKEY_CLEARCOAT_FACTOR, 0) > 0)
      note("clearcoat is ignored");
    for (const auto& [type, name] : {std::pair{aiTextureType_METALNESS, "metalness map"},
                                     std::pair{aiTextureType_DIFFUSE_ROUGHNESS, "roughness map"}})
      if (from_.GetTextureCount(type) > 0) note(std::string(name) + " is ignored");
  }

  MaterialReader& reader_;
  const aiMaterial& from_;
  unsigned coordinates_;
  MeshMaterial material_;
};

namespace {

/// True where a material is only Assimp's own, of a file or a part without one.
bool is_default(const aiMaterial& material) {
  for (unsigned type = 1; type <= AI_TEXTURE_TYPE_MAX; ++type)
    if (material.GetTextureCount(static_cast<aiTextureType>(type)) > 0) return false;
  const std::string name = material.GetName().C_Str();
  return name.empty() || name == AI_DEFAULT_MATERIAL_NAME;
}

}  // namespace

unsigned MaterialReader::coordinates_of(const aiMesh& part) const {
  if (part.mMaterialIndex >= scene_.mNumMaterials) return 0;
  const auto& material = *scene_.mMaterials[part.mMaterialIndex];
  for (const auto type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE, aiTextureType_EMISSIVE,
                          aiTextureType_NORMALS, aiTextureType_UNKNOWN}) {
    if (material.GetTextureCount(type) == 0) continue;
    int set = 0;
    material.Get(AI_MATKEY_UVWSRC(type, 0), set);
    return set > 0 && set < AI_MAX_NUMBER_OF_TEXTURECOORDS ? static_cast<unsigned>(set) : 0;
  }
  return 0;
}

bool has_colours(const aiMesh& part) {
  const auto* colours = part.mColors[0];
  return colours && std::any_of(colours, colours + part.mNumVertices,
                                [](const aiColor4D& c) { return c != aiColor4D(0, 0, 0, 0); });
}

std::int32_t MaterialReader::material_of(const aiMesh& part) {
  if (part.mMaterialIndex >= scene_.mNumMaterials) return -1;
  const bool coloured = has_colours(part);
  const auto [known, is_new] = known_.try_emplace({part.mMaterialIndex, coloured}, -1);
  if (!is_new) return known->second;
  const auto& from = *scene_.mMaterials[part.mMaterialIndex];
  MeshMaterial material;
  if (is_default(from)) {
    if (!coloured) return -1;
    material = coloured_material("colours of vertices");
  } else {
    material = MaterialTranslation(*this, from, coordinates_of(part)).translated(coloured);
  }
  return known->second = add_material(mesh_, std::move(material));
}

}  // namespace raywave
