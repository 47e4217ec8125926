// SPDX-License-Identifier: Apache-2.0
/// Plans of scenes, and worlds for them.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <vector>

#include "host/forecast/presets.hpp"
#include "host/geometry/world.hpp"

namespace raywave::test {

/// The plan of a scene of one wavelength.
inline Planned plan_scene(const Scene& scene, const World& world, const DeviceFigures& device = {},
                          const Goal& goal = {}, KeptResults kept = {}) {
  return plan_scenes({scene}, world, device, goal, kept)[0];
}

/// A square that faces the hologram, or leans back by depth_m from its bottom to its top.
struct Square {
  double side_m;
  glm::dvec3 centre_m;
  double depth_m = 0;
};

/// A world of squares, each an object of its own; `is_one`: all are one object.
inline World world_of_squares(const std::vector<Square>& squares, bool is_one = false) {
  World world;
  world.min_m = glm::dvec3(INFINITY);
  world.max_m = -world.min_m;
  for (const auto& square : squares) {
    const auto first = static_cast<std::uint32_t>(world.positions.size());
    for (const glm::dvec3 corner : {glm::dvec3(-1, -1, -1), {1, -1, -1}, {1, 1, 1}, {-1, 1, 1}}) {
      const auto half_m = glm::dvec3(square.side_m, square.side_m, square.depth_m) / 2.0;
      world.positions.push_back(square.centre_m + corner * half_m);
      world.min_m = glm::min(world.min_m, world.positions.back());
      world.max_m = glm::max(world.max_m, world.positions.back());
    }
    world.triangles.push_back(glm::uvec3(0, 1, 2) + first);
    world.triangles.push_back(glm::uvec3(0, 2, 3) + first);
    if (world.object_closed.empty() || !is_one) world.object_closed.push_back(false);
    const auto object = static_cast<std::int32_t>(world.object_closed.size()) - 1;
    world.triangle_object.insert(world.triangle_object.end(), {object, object});
  }
  world.normals.assign(world.positions.size(), glm::vec3(0, 0, -1));
  world.uvs.assign(world.positions.size(), glm::vec2(0));
  return world;
}

}  // namespace raywave::test
