// SPDX-License-Identifier: Apache-2.0
/// Scenes of data/ and of squares, and what is planned for them.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "host/forecast/presets.hpp"
#include "host/planning/make_plan.hpp"
#include "tests/support/plans.hpp"
#include "tests/support/scenes.hpp"

namespace raywave::test {

inline Scene data_scene(const std::string& name, const std::vector<std::string>& set = {}) {
  return load_scene(std::filesystem::path(RAYWAVE_DATA_DIR) / name, set);
}

inline Plan plan_of(const Scene& scene, const World& world) { return make_plan(scene, world); }

inline Planned planned(const Scene& scene, const Goal& goal = {}) {
  return plan_scene(scene, build_world(scene), {}, goal);
}

/// The same with light over WRPs.
inline Scene over_wrps(const std::string& name, std::vector<std::string> set = {}) {
  set.push_back("wrp.propagation=spectrum");
  return data_scene(name, set);
}

/// Squares of 2 mm that face the hologram, centred at these places.
inline World squares_at(const std::vector<glm::dvec2>& centres_m, double z_m = 100 * mm) {
  std::vector<Square> squares;
  for (const auto& centre : centres_m) squares.push_back({2 * mm, {centre, z_m}});
  return world_of_squares(squares, true);
}

inline Scene glowing_scene() {
  Scene scene;
  scene.file = "scene.toml";
  scene.wrp.propagation = WrpPropagation::spectrum;
  scene.lights.emplace_back();
  scene.materials = {glowing()};
  scene.objects = {object_at("", 1, {})};
  return scene;
}

inline bool says(const std::vector<std::string>& lines, const std::string& text) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const auto& line) { return line.find(text) != std::string::npos; });
}

inline bool warns(const Planned& p, const std::string& text) { return says(p.warnings, text); }

}  // namespace raywave::test
