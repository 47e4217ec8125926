// SPDX-License-Identifier: Apache-2.0
/// All files that a scene names, read once: nothing after the scene stage opens a file.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "host/scene/image.hpp"
#include "host/scene/mesh.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Textures of a scene's materials, by material, then the pictures of its lights, by light; null
/// where there is none. Each is the channel that the hologram's wavelength sees, linear, >= 0; in
/// colour red, green and blue. Copies share the pixels.
using Textures = std::vector<std::shared_ptr<const Image>>;

/// Reads a file that several materials name once.
///
/// throws  InputError when a texture is unusable, or all together hold more than 2^31 - 1 texels
Textures load_textures(const Scene& scene);

/// The texture of a material; null where it has none.
///
/// throws  std::logic_error when the material has one that `textures` lacks
const Image* texture_of(const std::vector<Material>& materials, const Textures& textures,
                        std::size_t material);

struct SceneFiles {
  Meshes meshes;
  Textures textures;
};

/// throws  InputError when a mesh or a texture is unusable, or when the scene has no object
SceneFiles load_files(const Scene& scene);

}  // namespace raywave
