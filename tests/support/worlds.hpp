// SPDX-License-Identifier: Apache-2.0
/// Worlds built in test code, without mesh files, and their sample tables.
#pragma once

#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "host/reference/gathering.hpp"
#include "host/reference/surfaces.hpp"
#include "host/trace/gatherer.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave::test {

using reference::box;
using reference::flipped;
using reference::free_path;
using reference::grid;
using reference::normal;
using reference::place;
using reference::Random;
using reference::rectangle;
using reference::Rig;
using reference::Seen;
using reference::sphere;
using reference::Stage;
using reference::Surface;
using reference::uniform;

/// A mesh as from a file: smooth normals of the surface's places, moved by `to`.
inline Mesh mesh_of(const Surface& s, const std::function<glm::dvec3(glm::dvec3)>& to = {}) {
  Mesh raw{.positions = s.positions};
  if (to)
    for (auto& p : raw.positions) p = to(p);
  raw.normals.assign(raw.positions.size(), glm::dvec3(0));
  raw.uvs.assign(raw.positions.size(), glm::dvec2(0));
  raw.triangles = s.triangles;
  return finish_mesh(std::move(raw), Normals::smooth);
}

/// Scene and meshes of several objects, each with a mesh of its own.
struct Fleet {
  Scene scene;
  Meshes meshes;

  void add(Mesh mesh, const Object& object) {
    scene.objects.push_back(object);
    meshes.of_object.push_back(meshes.meshes.size());
    meshes.closed.push_back(is_closed(mesh));
    meshes.meshes.push_back(std::move(mesh));
  }
};

}  // namespace raywave::test
