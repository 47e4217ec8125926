// SPDX-License-Identifier: Apache-2.0
#include "host/scene/mesh_materials.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <map>
#include <numeric>
#include <optional>
#include <sstream>
#include <utility>

#include "host/common/text.hpp"
#include "host/common/uri.hpp"
#include "host/scene/image.hpp"

namespace raywave {
namespace {

namespace fs = std::filesystem;

constexpr double most_shininess = 1e4;  // roughness 0.084

/// Share of light that an index of refraction reflects at normal incidence.
double reflectance_of(double ior) { return std::pow((ior - 1) / (ior + 1), 2); }

/// The file that a mesh means by a picture's name: beside the mesh, also where the name is that of
/// a folder on another machine.
std::optional<fs::path> file_of(const fs::path& mesh, std::string name) {
  if (name.empty() || name.find('\0') != std::string::npos) return {};
  std::replace(name.begin(), name.end(), '\\', '/');
  const auto folder = mesh.parent_path();
  for (const auto& written : {name, without_escapes(name)}) {
    if (written.find('\0') != std::string::npos) continue;
    for (const auto& candidate : {folder / written, folder / fs::path(written).filename()}) {
      std::error_code error;
      if (fs::is_regular_file(candidate, error)) return candidate;
    }
  }
  return {};
}

/// The decoded channels of a mesh's pictures, each picture read once for a set of channels.
class Pictures {
public:
  Pictures(const Mesh& mesh, const fs::path& file, const std::string& where)
      : mesh_(mesh), file_(file), where_(where) {}

  /// One channel for each letter of load_channels, but "rgb" in front makes one of three; empty
  /// where the picture is missing.
  std::vector<SurfaceMap> channels(const MeshMap& map, const std::string& letters,
                                   std::vector<std::string>& notes) {
    if (map.picture < 0) return {};
    const auto& picture = mesh_.pictures[static_cast<std::size_t>(map.picture)];
    auto& images = known_[{map.picture, letters}];
    if (images.empty()) {
      std::vector<Image> read;
      if (!picture.bytes.empty()) {
        read = load_channels(picture.bytes, picture.name.empty() ? "inside the mesh" : picture.name,
                             letters, where_);
      } else if (const auto file = file_of(file_, picture.name)) {
        read = load_channels(*file, letters, where_);
      } else {
        notes.push_back("picture " + in_quotes(picture.name) +
                        " is ignored: there is no such file");
        return {};
      }
      if (letters.starts_with("rgb")) {
        read[0] = stacked(read);
        read.erase(read.begin() + 1, read.begin() + 3);
      }
      for (auto& image : read) {
        limit_texels(image, picture.name, where_);
        images.push_back(std::make_shared<const Image>(std::move(image)));
      }
    }
    std::vector<SurfaceMap> maps;
    for (const auto& image : images) maps.push_back({image, map.place});
    return maps;
  }

private:
  const Mesh& mesh_;
  const fs::path& file_;
  const std::string& where_;
  std::map<std::pair<std::int32_t, std::string>, std::vector<std::shared_ptr<const Image>>> known_;
};

double mean_of(const SurfaceMap& map) {
  if (!map) return 1;
  const auto& pixels = map.image->pixels;
  return std::accumulate(pixels.begin(), pixels.end(), 0.0) / static_cast<double>(pixels.size());
}

double least_of(const SurfaceMap& map) {
  return map ? *std::min_element(map.image->pixels.begin(), map.image->pixels.end()) : 1;
}

/// Gives a material what a surface of this reflectance and roughness reflects.
void reflect(glm::dvec3 reflectance, double roughness, Material& m) {
  m.shininess = shininess_of(roughness);
  if (m.shininess < least_shininess) {
    m.diffuse += reflectance;
    return;
  }
  for (int c = 0; c < 3; ++c) m.specular[c] = specular_of(reflectance[c], m.shininess);
}

bool is_opaque(const Image& alpha) {
  return std::all_of(alpha.pixels.begin(), alpha.pixels.end(), [](float a) { return a >= 1; });
}

}  // namespace

double shininess_of(double roughness) {
  const double fourth = std::pow(roughness, 4);
  return fourth * (2 * most_shininess + 1) <= 1 ? most_shininess : (1 / fourth - 1) / 2;
}

double specular_of(double reflectance, double shininess) {
  return reflectance * (shininess + 2) / 2;
}

Material phong_of(const MeshMaterial& from, const MaterialMaps& maps, bool colours_have_alpha,
                  double ambient_share, const std::string& where) {
  const auto& look = from.look;
  Material m;
  m.name = from.name;
  m.where = where;
  m.emission = look.emission;
  m.vertex_colours = look.vertex_colours != 0;
  m.normal_scale = look.normal_scale;
  m.alpha_mode = look.alpha_mode;
  m.alpha = look.alpha;
  m.alpha_cutoff = look.alpha_cutoff;
  if (!maps.alpha && !maps.opacity &&
      !(m.vertex_colours && colours_have_alpha)) {  // the same everywhere
    const bool is_there =
        look.alpha_mode == AlphaMode::blend ? look.alpha >= 1 : look.alpha >= look.alpha_cutoff;
    if (is_there) m.alpha_mode = AlphaMode::opaque;
  }
  m.ior = look.ior;
  m.ambient = ambient_share * look.base;
  m.diffuse = look.base;
  switch (look.model) {
    case LookModel::phong:
      m.ambient = ambient_share * look.ambient;
      m.specular = look.specular;
      m.shininess = look.shininess;
      break;
    case LookModel::metallic_roughness: {
      const double reflectance = reflectance_of(look.ior);
      const double metallic = look.metallic * mean_of(maps.metallic);
      m.diffuse = (1 - metallic) * look.base;
      reflect(glm::mix(glm::dvec3(reflectance), look.base, metallic),
              look.roughness * mean_of(maps.roughness), m);
      m.transparency = look.transmission * (1 - metallic);
      if (maps.roughness || (look.metallic > 0 && (maps.colour || m.vertex_colours))) {
        const double sharpest = shininess_of(look.roughness * least_of(maps.roughness));
        m.metallic_roughness = {look.base,      look.metallic,
                                look.roughness, reflectance,
                                ambient_share,  sharpest < least_shininess ? 0 : sharpest};
      }
      break;
    }
    case LookModel::specular_roughness:
      reflect(look.specular, look.roughness, m);
      break;
    case LookModel::unlit:
      m.unlit = true;
      m.emission = look.base;
      m.ambient = m.diffuse = glm::dvec3(0);
      break;
  }
  return m;
}

std::vector<MaterialMaps> load_maps(const Mesh& mesh, const fs::path& file, Channels channels,
                                    const std::string& where) {
  const std::string colour = channels.all ? "rgb" : std::string(1, "rgb"[channels.first]);
  Pictures pictures(mesh, file, where);
  std::vector<MaterialMaps> all;
  for (const auto& material : mesh.materials) {
    const auto& look = material.look;
    auto& maps = all.emplace_back();
    const auto read = [&](const MeshMap& map, const std::string& letters) {
      return pictures.channels(map, letters, maps.notes);
    };
    const bool has_alpha = look.alpha_mode != AlphaMode::opaque;
    if (const auto base = read(look.base_map, has_alpha ? colour + "A" : colour); !base.empty()) {
      maps.colour = base[0];
      if (has_alpha && !is_opaque(*base[1].image)) maps.alpha = base[1];
    }
    if (has_alpha) {
      if (const auto opacity = read(look.alpha_map, "R");
          !opacity.empty() && !is_opaque(*opacity[0].image))
        maps.opacity = opacity[0];
    }
    if (look.model != LookModel::unlit) {
      if (const auto emission = read(look.emission_map, colour); !emission.empty())
        maps.emission = emission[0];
      if (const auto two = read(look.metallic_map, "GB"); !two.empty())
        maps.roughness = two[0], maps.metallic = two[1];
      if (const auto three = read(look.normal_map, "RGB"); !three.empty())
        maps.normal = {three[0], three[1], three[2]};
    }
  }
  return all;
}

std::string description_of(const MeshMaterial& from, const Material& material,
                           const MaterialMaps& maps, int channel) {
  const auto& look = from.look;
  auto out = text_stream();
  const auto map = [&](const SurfaceMap& of, const char* name) {
    if (of) out << ", " << name << " " << of.image->width << " x " << of.image->height;
  };
  switch (look.model) {
    case LookModel::phong:
      out << "Phong";
      break;
    case LookModel::metallic_roughness:
      out << "metallic " << number_text(look.metallic) << ", roughness "
          << number_text(look.roughness);
      break;
    case LookModel::specular_roughness:
      out << "specular " << number_text(look.specular[channel]) << ", roughness "
          << number_text(look.roughness);
      break;
    case LookModel::unlit:
      out << "unlit";
      break;
  }
  map(maps.colour, "colour map");
  if (material.vertex_colours) out << ", colours of vertices";
  map(maps.roughness, "metallic-roughness map");
  map(maps.emission, "emission map");
  map(maps.normal[0], "normal map");
  map(maps.opacity, "opacity map");
  if (material.alpha_mode == AlphaMode::mask)
    out << ", cut out where alpha < " << number_text(look.alpha_cutoff);
  if (material.alpha_mode == AlphaMode::blend)
    out << ", there with the probability alpha, " << number_text(look.alpha)
        << (maps.alpha || maps.opacity ? " times its map" : "");
  out << " -> ";
  if (material.metallic_roughness) {
    out << "of colour " << number_text(material.metallic_roughness->base[channel])
        << ", place by place";
  } else if (!material.unlit) {
    out << "diffuse " << number_text(material.diffuse[channel]) << ", specular "
        << number_text(material.specular[channel]) << ", shininess "
        << number_text(material.shininess);
  }
  if (material.emission[channel] > 0)
    out << (material.unlit ? "" : ", ") << "emission " << number_text(material.emission[channel]);
  if (material.transparency.is_positive())
    out << ", transparency " << number_text(material.transparency.channels[channel]) << ", ior "
        << number_text(material.ior.channels[channel]);
  return out.str();
}

}  // namespace raywave
