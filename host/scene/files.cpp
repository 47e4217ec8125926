// SPDX-License-Identifier: Apache-2.0
#include "host/scene/files.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "host/common/colour.hpp"
#include "host/common/error.hpp"

namespace raywave {
namespace {

/// A picture that lights as grey.
Image luminance_of(const std::filesystem::path& file, const std::string& where) {
  const auto channels = load_channels(file, "rgb", where);
  const auto xyz = xyz_from_srgb();
  Image grey = channels[0];
  for (std::size_t i = 0; i < grey.pixels.size(); ++i) {
    double sum = 0;
    for (int c = 0; c < 3; ++c)  // Y is the luminance
      sum += xyz[c][1] * double{channels[static_cast<std::size_t>(c)].pixels[i]};
    grey.pixels[i] = static_cast<float>(sum);
  }
  return grey;
}

std::shared_ptr<const Image> load(const std::filesystem::path& file, Channels channels,
                                  bool as_grey, const std::string& where) {
  Image image = !channels.all ? load_texture(file, channels.first, where)
                : as_grey     ? luminance_of(file, where)
                              : stacked(load_channels(file, "rgb", where));
  limit_texels(image, file.string(), where);
  return std::make_shared<const Image>(std::move(image));
}

}  // namespace

Textures load_textures(const Scene& scene) {
  const auto channels = scene.channels();
  Textures textures;
  std::map<std::pair<std::filesystem::path, bool>, std::shared_ptr<const Image>> known;
  std::uint64_t texels = 0;
  const auto add = [&](const std::filesystem::path& file, bool as_grey, const std::string& where) {
    std::error_code error;
    const auto whole = std::filesystem::weakly_canonical(file, error);
    auto& texture = known[{error ? file : whole, as_grey && channels.all}];
    if (!texture) texture = load(file, channels, as_grey, where);
    texels += texture->pixels.size();
    if (texels > INT32_MAX)
      throw InputError(where + ": with its texture the scene has more than 2147483647 texels");
    textures.back() = texture;
  };
  for (const Material& material : scene.materials) {
    textures.emplace_back();
    if (material.texture) add(*material.texture, false, material.where);
  }
  for (const Light& light : scene.lights) {
    textures.emplace_back();
    if (light.type == LightType::environment) add(light.picture, true, light.where);
  }
  return textures;
}

const Image* texture_of(const std::vector<Material>& materials, const Textures& textures,
                        std::size_t material) {
  if (!materials.at(material).texture) return nullptr;
  if (material >= textures.size() || !textures[material])
    throw std::logic_error("the textures of the scene have not been read");
  return textures[material].get();
}

SceneFiles load_files(const Scene& scene) {
  auto meshes = load_meshes(scene);
  return {std::move(meshes), load_textures(scene)};
}

}  // namespace raywave
