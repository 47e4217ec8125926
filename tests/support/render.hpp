// SPDX-License-Identifier: Apache-2.0
/// Renders for tests that compare many of them.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "host/render.hpp"
#include "host/scene/files.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

namespace raywave::test {

/// A scene's world as build_world makes it. A mesh file is read once per program and again when its
/// bytes change, because a reader process takes longer than a small hologram.
inline World world_of(const Scene& scene) {
  static std::map<std::pair<std::string, Normals>, std::pair<Mesh, bool>> known;
  Meshes meshes;
  for (const auto& object : scene.objects) {
    const auto [entry, is_new] = known.try_emplace(
        {object.mesh.extension().string() + bytes_of(object.mesh), object.normals});
    if (is_new) {
      try {
        entry->second.first = load_mesh(object.mesh, object.normals, object.where);
        entry->second.second = is_closed(entry->second.first);
      } catch (...) {
        known.erase(entry);
        throw;
      }
    }
    meshes.of_object.push_back(meshes.meshes.size());
    meshes.meshes.push_back(entry->second.first);
    meshes.closed.push_back(entry->second.second);
  }
  return place_objects(scene, meshes, load_textures(scene));
}

/// Calls render() with the world of world_of.
inline RenderResult rendered(const cl::Device& device, const Scene& scene,
                             const RenderOptions& options = {}) {
  return render(device, scene, world_of(scene), options);
}

/// A shiny ball in front of a wall that glows, tilted, before a hologram with pixels of 4 um.
inline Scene ball_and_wall(const Folder& folder, glm::ivec2 resolution, double sampling_pitch_m,
                           int rings, double ball_m, glm::dvec3 ball_at_m, double wall_m,
                           double wall_z_m) {
  Scene scene;
  scene.hologram.resolution = resolution;
  scene.hologram.pitch_m = {4 * um, 4 * um};
  scene.sampling.pitch_m = sampling_pitch_m;
  scene.materials = {Material{.specular = glm::dvec3(0.4)}, glowing()};
  scene.objects = {
      object_at(folder.write("ball.obj", ball_obj(2 * rings, rings)), ball_m, ball_at_m, 0),
      object_at(folder.write("wall.obj", square_obj()), wall_m, {0, 0, wall_z_m}, 1)};
  scene.objects[1].rotation_deg = {5, -8, 0};
  scene.lights = {Light{.direction = {0.4, -0.5, 0.8}}};
  return scene;
}

/// The brightest pixel of a picture about the axis.
struct Peak {
  double x_m = 0, y_m = 0, intensity = 0;
};

inline Peak peak_of(const Image& image, glm::dvec2 pitch_m) {
  const auto it = std::max_element(image.pixels.begin(), image.pixels.end());
  const auto at = static_cast<int>(it - image.pixels.begin());
  return {(at % image.width - (image.width - 1) / 2.0) * pitch_m.x,
          ((image.height - 1) / 2.0 - at / image.width) * pitch_m.y, *it};
}

}  // namespace raywave::test
