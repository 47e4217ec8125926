// SPDX-License-Identifier: Apache-2.0
/// Renders for tests that compare many of them.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "host/render.hpp"
#include "host/scene/files.hpp"
#include "tests/support/files.hpp"

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

}  // namespace raywave::test
