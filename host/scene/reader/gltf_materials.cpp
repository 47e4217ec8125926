// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/gltf_materials.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>

#include "host/common/error.hpp"
#include "host/scene/reader/mesh_builder.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {

using nlohmann::json;

/// One material on its way to ours.
class GltfLook {
public:
  GltfLook(GltfMaterials& all, const json& from) : all_(all), gltf_(all.gltf_), from_(from) {}

  MeshMaterial translated(bool has_colours) {
    material_.name = name_or(member(from_, "name"), "");
    auto& look = material_.look;
    look.vertex_colours = has_colours;
    look.two_sided = member(from_, "doubleSided") == json(true);
    look.model = LookModel::metallic_roughness;
    const auto &metal = member(from_, "pbrMetallicRoughness"),
               &gloss = extension(from_, "KHR_materials_pbrSpecularGlossiness");
    if (gloss.is_object())
      read_glossy(gloss);
    else
      read_base(member(metal, "baseColorFactor"), member(metal, "baseColorTexture"),
                "base colour map");
    look.emission = colour_or(member(from_, "emissiveFactor"), glm::dvec3(0));
    look.emission_map = map(member(from_, "emissiveTexture"), "emission map");
    const auto& normal = member(from_, "normalTexture");
    look.normal_map = map(normal, "normal map");
    look.normal_scale = number_or(member(normal, "scale"), 1, -1e6, 1e6);
    if (!gloss.is_object()) {
      look.metallic = share(member(metal, "metallicFactor"), 1);
      look.roughness = share(member(metal, "roughnessFactor"), 1);
      look.metallic_map = map(member(metal, "metallicRoughnessTexture"), "metallic-roughness map");
    }
    const auto mode = text_or(member(from_, "alphaMode"), "OPAQUE");
    look.alpha_mode = mode == "MASK"    ? AlphaMode::mask
                      : mode == "BLEND" ? AlphaMode::blend
                                        : AlphaMode::opaque;
    if (mode != "OPAQUE" && look.alpha_mode == AlphaMode::opaque)
      note("alphaMode " + mode.substr(0, 40) + " is taken as OPAQUE");
    look.alpha_cutoff = number_or(member(from_, "alphaCutoff"), 0.5, 0, 1e30);
    read_extensions();
    if (!member(from_, "occlusionTexture").is_null()) note("occlusion map is ignored");
    return std::move(material_);
  }

  std::optional<std::uint64_t> uvs() const { return uvs_; }

private:
  void note(const std::string& what) { add_note(material_.notes, what); }

  static double share(const json& value, double otherwise) {
    return number_or(value, otherwise, 0, 1);
  }

  void read_base(const json& factor, const json& texture, const char* name) {
    auto& look = material_.look;
    std::array<double, 4> base{1, 1, 1, 1};
    for (std::size_t i = 0; factor.is_array() && i < std::min<std::size_t>(4, factor.size()); ++i)
      base[i] = number_or(factor[i], 1, 0, i < 3 ? 1e30 : 1);
    look.base = {base[0], base[1], base[2]};
    look.alpha = base[3];
    look.base_map = map(texture, name);
  }

  void read_glossy(const json& gloss) {
    auto& look = material_.look;
    look.model = LookModel::specular_roughness;
    read_base(member(gloss, "diffuseFactor"), member(gloss, "diffuseTexture"), "diffuse map");
    look.specular = colour_or(member(gloss, "specularFactor"), glm::dvec3(1));
    look.roughness = 1 - share(member(gloss, "glossinessFactor"), 1);
    if (!member(gloss, "specularGlossinessTexture").is_null()) note("specular map is ignored");
  }

  void read_extensions() {
    auto& look = material_.look;
    const auto& extensions = member(from_, "extensions");
    look.ior = number_or(member(member(extensions, "KHR_materials_ior"), "ior"), 1.5, 1, 100);
    const auto& transmission = member(extensions, "KHR_materials_transmission");
    look.transmission = share(member(transmission, "transmissionFactor"), 0);
    if (!member(transmission, "transmissionTexture").is_null()) note("transmission map is ignored");
    const auto& strong = member(extensions, "KHR_materials_emissive_strength");
    const double strength = number_or(member(strong, "emissiveStrength"), 1, 0, 1e6);
    look.emission = glm::min(look.emission * strength, glm::dvec3(1e30));
    if (!member(extensions, "KHR_materials_unlit").is_null()) look.model = LookModel::unlit;
    if (!extensions.is_object()) return;
    // What this reader knows; the rest is named
    for (const auto& item : extensions.items()) {
      constexpr std::array known{"KHR_materials_ior", "KHR_materials_emissive_strength",
                                 "KHR_materials_unlit", "KHR_materials_transmission",
                                 "KHR_materials_pbrSpecularGlossiness"};
      if (std::find(known.begin(), known.end(), item.key()) == known.end())
        note(item.key() + " is ignored");
    }
  }

  /// The image that a texture shows; null, with a note, where there is none that can be read.
  const json& image_of(const json& texture, const std::string& name) {
    static const json none;
    const auto &own = member(texture, "source"),
               &webp = member(extension(texture, "EXT_texture_webp"), "source");
    const auto& number = own.is_null() ? webp : own;
    std::string other;
    const auto& extensions = member(texture, "extensions");
    if (extensions.is_object())
      for (const auto& item : extensions.items())
        if (item.key() != "EXT_texture_webp" && !member(item.value(), "source").is_null())
          other = item.key();
    const bool is_there = gltf_.of("images", number).is_object();
    if (!is_there)
      note(name + " is ignored: " +
           (other.empty() ? "its texture or its picture is not there"
                          : "it has no picture but that of " + other + ", which is not read"));
    else if (!other.empty())
      note(name + " is the picture in place of that of " + other + ", which is not read");
    return is_there ? number : none;
  }

  MeshMap map(const json& info, const std::string& name) {
    if (!info.is_object()) return {};
    const auto& texture = gltf_.of("textures", member(info, "index"));
    const auto& image = image_of(texture, name);
    if (image.is_null()) return {};
    const auto& transform = extension(info, "KHR_texture_transform");
    const auto set = count_or(member(transform, "texCoord"), count_or(member(info, "texCoord"), 0));
    if (uvs_.value_or(set) != set) {
      note(name + " is ignored: it lies by TEXCOORD_" + std::to_string(set) +
           ", the maps before it by TEXCOORD_" + std::to_string(*uvs_));
      return {};
    }
    MeshMap map;
    map.picture = picture(image, name);
    if (map.picture < 0) return {};
    uvs_ = set;
    const auto& sampler = gltf_.of("samplers", member(texture, "sampler"));
    const auto wrap_of = [](const json& mode) {
      const auto number = count_or(mode, 10497);
      return number == 33071 ? Wrap::clamp : number == 33648 ? Wrap::mirror : Wrap::repeat;
    };
    map.place.wrap_u = wrap_of(member(sampler, "wrapS"));
    map.place.wrap_v = wrap_of(member(sampler, "wrapT"));
    if (transform.is_object()) place(transform, name, map.place);
    return map;
  }

  /// KHR_texture_transform counts v downwards. Angles turn as three.js, Babylon.js and Blender have
  /// them.
  void place(const json& transform, const std::string& name, MapPlace& place) {
    const auto two = [&](const char* key, double otherwise) {
      const auto& value = member(transform, key);
      const auto number = [&](unsigned i) { return number_or(element(value, i), otherwise); };
      return std::pair(number(0), number(1));
    };
    const double angle = number_or(member(transform, "rotation"), 0), c = std::cos(angle),
                 s = std::sin(angle);
    const auto offset = two("offset", 0), scale = two("scale", 1);
    const double sx = scale.first, sy = scale.second;
    const std::array<double, 3> across{c * sx, -s * sy, s * sy + offset.first},
        up{s * sx, c * sy, 1 - c * sy - offset.second};
    const auto is_usable = [](const std::array<double, 3>& row) {
      return std::all_of(row.begin(), row.end(), [](double v) { return std::abs(v) <= 1e6; });
    };
    if (is_usable(across) && is_usable(up))
      place.across = across, place.up = up;
    else
      note(name + ": its transform of texture coordinates is ignored");
  }

  /// Number of a picture in the mesh; -1, with a note: it cannot be had.
  std::int32_t picture(const json& index, const std::string& name) {
    const auto known = all_.pictures_.find(index.get<std::uint64_t>());
    if (known != all_.pictures_.end()) return known->second;
    auto& pictures = all_.mesh_.pictures;
    if (pictures.size() >= most_pictures_of_file) {
      note(name + " is ignored: there are too many pictures");
      return -1;
    }
    const auto& image = gltf_.of("images", index);
    MeshPicture made{name_or(member(image, "name"), ""), {}};
    const auto uri = text_or(member(image, "uri"), "");
    bool is_inside = true;
    if (const auto& view = member(image, "bufferView"); !view.is_null()) {
      const auto bytes = gltf_.view(view, "a picture's bytes");
      made.bytes.assign(bytes.begin(), bytes.end());
    } else {
      const auto found = gltf_.resource(uri);
      made.bytes.assign(found.bytes.begin(), found.bytes.end());
      is_inside = !found.is_file;
      if (found.is_file) made.name = found.name.substr(0, longest_text);
    }
    if (is_inside ? made.bytes.empty() : uri.empty()) {
      note(name + " is ignored: its picture is empty");
      return -1;
    }
    all_.picture_bytes_ += made.bytes.size();
    if (all_.picture_bytes_ > most_picture_bytes) throw InputError("more than 2 GiB of pictures");
    const auto number = static_cast<std::int32_t>(pictures.size());
    pictures.push_back(std::move(made));
    all_.pictures_.emplace(index.get<std::uint64_t>(), number);
    return number;
  }

  GltfMaterials& all_;
  GltfFile& gltf_;
  const json& from_;
  std::optional<std::uint64_t> uvs_;
  MeshMaterial material_;
};

const GltfMaterials::Worn& GltfMaterials::of(const json& primitive, bool has_colours) {
  const auto& index = member(primitive, "material");
  if (!index.is_null() && !gltf_.of("materials", index).is_object())
    throw InputError("material " + index.dump().substr(0, 20) +
                     " is not there; export the file again");
  const auto number = index.is_null() ? -1 : index.get<std::int64_t>();
  const auto [known, is_new] = known_.try_emplace({number, has_colours}, Worn{});
  auto& worn = known->second;
  if (!is_new || (index.is_null() && !has_colours)) return worn;
  MeshMaterial made;
  if (index.is_null()) {
    made = coloured_material("colours of vertices");
  } else {
    GltfLook look(*this, gltf_.of("materials", index));
    made = look.translated(has_colours);
    worn.uvs = look.uvs();
  }
  worn.material = add_material(mesh_, std::move(made));
  return worn;
}

}  // namespace raywave
