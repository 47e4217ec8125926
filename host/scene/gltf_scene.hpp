// SPDX-License-Identifier: Apache-2.0
/// Section [scene]: a whole glTF file, seen from one of its cameras.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/scene/document.hpp"
#include "host/scene/gltf_motion.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// What has become of a glTF file.
struct GltfScene {
  std::filesystem::path file;
  std::string where;  // "scene.toml:2: scene: gltf "room.glb"", the start of messages
  Similarity world_from_file;
  std::size_t object = 0, first_light = 0;  // of the scene
  std::vector<GltfLight> lights;            // in the order of the scene's
  std::int32_t camera = 0;                  // of GltfSet::cameras
};

/// Reads the section, and adds the file's meshes as one object and its lights to the scene. The
/// hologram's plane stands at the camera and the scene before it: the camera's -z is +z, its y is
/// y, and its x is -x, since the viewer looks from the other side.
///
/// returns  nothing where the section names no file
/// throws   InputError when the file has no camera, or cannot be read
std::optional<GltfScene> read_gltf_scene(Section section, Scene& scene);

/// Key `gltf` of [animation]: true for all animations of the file, or the name or number of one.
/// Meshes that move together become an object of their own, behind those of the scene; its first
/// object keeps those that stay.
///
/// returns  nothing for false
/// throws   InputError when there is no such animation, or it moves nothing
std::optional<GltfMoves> read_gltf_moves(const Value& which, const std::optional<GltfScene>& gltf,
                                         Scene& scene);

/// A light of a glTF scene whose node has a pose.
///
/// world_from_light  in the file's units
void place_light(const glm::dmat4& world_from_light, const Similarity& world_from_file,
                 Light& light);

}  // namespace raywave
