// SPDX-License-Identifier: Apache-2.0
#include "host/scene/files.hpp"

#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "host/common/error.hpp"

namespace raywave {
namespace {

std::shared_ptr<const Image> load(const std::filesystem::path& file, Channels channels,
                                  const std::string& where) {
  Image image = channels.all ? stacked(load_channels(file, "rgb", where))
                             : load_texture(file, channels.first, where);
  limit_texels(image, file.string(), where);
  return std::make_shared<const Image>(std::move(image));
}

}  // namespace

Textures load_textures(const Scene& scene) {
  const auto channels = scene.channels();
  Textures textures;
  std::map<std::filesystem::path, std::shared_ptr<const Image>> known;
  std::uint64_t texels = 0;
  const auto add = [&](const std::filesystem::path& file, const std::string& where) {
    std::error_code error;
    const auto whole = std::filesystem::weakly_canonical(file, error);
    auto& texture = known[error ? file : whole];
    if (!texture) texture = load(file, channels, where);
    texels += texture->pixels.size();
    if (texels > INT32_MAX)
      throw InputError(where + ": with its texture the scene has more than 2147483647 texels");
    textures.back() = texture;
  };
  for (const Material& material : scene.materials) {
    textures.emplace_back();
    if (material.texture) add(*material.texture, material.where);
  }
  for (const Light& light : scene.lights) {
    textures.emplace_back();
    if (light.type == LightType::environment) add(light.picture, light.where);
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
  auto textures = std::async(std::launch::async, [&] { return load_textures(scene); });
  auto meshes = load_meshes(scene);
  return {std::move(meshes), textures.get()};
}

}  // namespace raywave
