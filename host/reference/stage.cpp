// SPDX-License-Identifier: Apache-2.0
#include "host/reference/stage.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "host/planning/make_plan.hpp"
#include "host/reference/looks.hpp"

namespace raywave::reference {

Stage::Stage() {
  scene.hologram = {{96, 80}, {8e-6, 8e-6}, 638e-9};
  scene.sampling.pitch_m = 25e-6;
  scene.sampling.antialias = 0;
  scene.wrp.propagation = WrpPropagation::spectrum;
}

Stage& Stage::add(const Surface& s, const Material& material) {
  const auto first = static_cast<std::uint32_t>(world.positions.size());
  const auto object = static_cast<int>(scene.objects.size());
  std::vector<glm::vec3> normals = s.normals;
  if (normals.empty()) {
    normals.resize(s.positions.size());
    for (const auto& t : s.triangles) {
      const auto n = normalize(
          cross(s.positions[t.y] - s.positions[t.x], s.positions[t.z] - s.positions[t.x]));
      for (int i = 0; i < 3; ++i) normals[t[i]] = glm::vec3(n);
    }
  }
  for (const auto& p : s.positions) {
    if (world.positions.empty()) world.min_m = world.max_m = p;
    world.min_m = min(world.min_m, p);
    world.max_m = max(world.max_m, p);
    world.positions.push_back(p);
  }
  world.normals.insert(world.normals.end(), normals.begin(), normals.end());
  world.uvs.resize(world.positions.size());
  for (const auto& t : s.triangles) world.triangles.push_back(t + first);
  world.triangle_object.resize(world.triangles.size(), object);
  world.object_closed.push_back(s.closed);
  scene.materials.push_back(material);
  Object o;
  o.material = object;
  scene.objects.push_back(o);
  return *this;
}

Stage ball_before_wall(double z_m) {
  Stage stage;
  stage.scene.hologram = {{61, 47}, {8e-6, 10e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 50e-6;
  stage.scene.trace.shadows = true;
  Material shiny;
  shiny.specular = glm::dvec3(2.0);
  shiny.shininess = 20;
  stage.add(sphere({0.05e-3, 0, z_m}, 0.3e-3, 8), shiny);
  stage.add(rectangle({0, 0, z_m + 0.5e-3}, {0.7e-3, 0, 0.1e-3}, {0, 0.6e-3, 0}));
  Light sun, lamp;
  sun.direction = {0.1, -0.2, 1};
  lamp.type = LightType::point;
  lamp.position_m = {0.5e-3, 0.5e-3, z_m - 1e-3};
  lamp.intensity = 0.5;
  stage.scene.lights = {sun, lamp};
  return stage;
}

std::vector<Corners> corners_of(const DeviceTree& tree) {
  const auto positions = tree.positions.read();
  std::vector<Corners> all;
  for (const auto& t : tree.triangles.read()) {
    Corners corners{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      corners.a[axis] = positions[3 * static_cast<std::size_t>(t.corner_a) + axis];
      corners.b[axis] = positions[3 * static_cast<std::size_t>(t.corner_b) + axis];
      corners.c[axis] = positions[3 * static_cast<std::size_t>(t.corner_c) + axis];
    }
    all.push_back(corners);
  }
  return all;
}

Rig::Rig(const cl::Device& device, const Stage& stage, Method method, bool keep_unseen)
    : scene(stage.scene),
      plan(make_plan(scene, stage.world, method)),
      lights(lights_of(scene, stage.world)),
      arrays(device, stage.world, plan),
      table(device, plan, arrays, keep_unseen),
      samples(table.samples.read()),
      first_of_cell(table.first_of_cell.read()),
      visibility_masks(table.visibility_masks.read()),
      lit(table.lit.read()),
      triangles(arrays.tree.triangles.read()),
      corners(corners_of(arrays.tree)) {
  samples.resize(static_cast<std::size_t>(table.count));
  visibility_masks.resize(samples.size() * table.visibility_words());
  lit.resize(samples.size() * arrays.light_words());
}

}  // namespace raywave::reference
