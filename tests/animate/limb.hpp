// SPDX-License-Identifier: Apache-2.0
/// A limb that bends and bulges, as a glTF file, and its vertices by closed forms.
#pragma once

#include <functional>
#include <numbers>

#include "host/animate/timeline.hpp"
#include "host/geometry/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/scenes.hpp"

namespace raywave::test {

using glm::dvec3;

constexpr double right_angle = std::numbers::pi / 2;

/// A limb along x, 2 long and 0.6 thick, that bends at x = 0.
struct Limb {
  static constexpr int sectors = 24, rings = 32;
  std::vector<dvec3> positions, normals;
  std::vector<glm::u32vec3> triangles;

  Limb() {
    const auto put = [&](double a, double b) {
      const dvec3 n(std::cos(b), std::sin(b) * std::cos(a), std::sin(b) * std::sin(a));
      positions.emplace_back(glm::vec3(n.x, 0.3 * n.y, 0.3 * n.z));
      normals.emplace_back(glm::normalize(dvec3(n.x, n.y / 0.3, n.z / 0.3)));
    };
    put(0, 0);
    for (int j = 1; j < rings; ++j)
      for (int i = 0; i < sectors; ++i)
        put(2 * std::numbers::pi * i / sectors, std::numbers::pi * j / rings);
    put(0, std::numbers::pi);
    const auto at = [](int i, int j) {
      return static_cast<std::uint32_t>(j == 0       ? 0
                                        : j == rings ? sectors * (rings - 1) + 1
                                                     : 1 + (j - 1) * sectors + i % sectors);
    };
    for (int j = 0; j < rings; ++j) {
      for (int i = 0; i < sectors; ++i) {
        if (j > 0) triangles.emplace_back(at(i, j), at(i + 1, j), at(i, j + 1));
        if (j + 1 < rings) triangles.emplace_back(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
    }
  }

  Gltf::Part part(bool has_normals = true) const {
    Gltf::Part made;
    for (const auto& p : positions) made.positions.emplace_back(p);
    for (const auto& n : normals)
      if (has_normals) made.normals.emplace_back(n);
    for (const auto& t : triangles)
      for (int i = 0; i < 3; ++i) made.indices.push_back(t[i]);
    return made;
  }
};

/// Share of the second joint, in steps that bytes and floats have.
inline double share_at(double x) { return std::round(255 * std::clamp(0.5 + x, 0.0, 1.0)) / 255; }

/// What a morph target adds.
inline dvec3 bulge(dvec3 p) { return glm::vec3(0, 0.5 * p.y, 0.25 + p.x * p.x); }
inline dvec3 tilt(dvec3 p) { return glm::vec3(0.25 * p.y, 0, -0.5 * p.x); }

struct Vertex {
  dvec3 position, normal;
};

/// A vertex that is turned about z at x = 0: the mean of two rigid motions, (1 - w) 1 + w R, whose
/// inverse transpose turns normals.
inline Vertex bent(const Vertex& v, double w, double angle) {
  const double a = 1 - w + w * std::cos(angle), b = w * std::sin(angle), s = a * a + b * b;
  const auto [p, n] = v;
  return {{a * p.x - b * p.y, b * p.x + a * p.y, p.z},
          glm::normalize(dvec3((a * n.x - b * n.y) / s, (b * n.x + a * n.y) / s, n.z))};
}

/// How the file stores influences: bytes or more, and in one set or two.
struct Storage {
  int joints = 5121, weights = 5126;
  bool two_sets = false;
};

/// A camera (node 0) looks along -z from 10 at the limb (node 1), whose own place must not matter;
/// its joints are hips (node 2) and elbow (node 3), whose keys are elsewhere in the tree (node 4).
constexpr double rest_angle = 0.5;

inline Gltf limb_file(const Storage& storage = {}, bool has_skin = true, bool has_normals = true) {
  Gltf file;
  file.add_camera(0.01, {{"translation", {0, 0, 10}}});
  const Limb limb;
  file.add(limb.part(has_normals), {{"name", "arm"}, {"translation", {5, 6, 7}}});
  file.root["meshes"][0]["name"] = "Limb";
  if (!has_skin) {
    file.root["nodes"][1].erase("translation");
    return file;
  }
  // At the bind the hips are at -1 and the elbow at 0; at rest it is bent
  file.root["nodes"].push_back({{"translation", {0.5, 0, 0}}, {"children", {3}}});
  file.root["nodes"].push_back(
      {{"name", "elbow"},
       {"translation", {0.5, 0, 0}},
       {"rotation", {0, 0, std::sin(rest_angle / 2), std::cos(rest_angle / 2)}}});
  file.root["nodes"].push_back({{"translation", {-1, 0, 0}}, {"children", {2}}});
  file.root["scenes"][0]["nodes"].push_back(4);
  file.root["nodes"][1]["skin"] = 0;
  std::vector<double> matrices;
  for (const double x : {0.5, 0.0})
    for (const double m :
         {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, 0.0, 0.0, 1.0})
      matrices.push_back(m);
  file.root["skins"] = {
      {{"joints", {2, 3}}, {"inverseBindMatrices", file.numbers(matrices, 5126, "MAT4", 16)}}};
  const double whole = storage.weights == 5121 ? 255 : storage.weights == 5123 ? 65535 : 1;
  std::vector<double> joints, weights;
  const auto add = [&](double joint, double weight) {
    joints.push_back(joint);
    weights.push_back(whole > 1 ? std::round(whole * weight) : weight);
  };
  auto& attributes = file.root["meshes"][0]["primitives"][0]["attributes"];
  const auto put = [&](const std::string& set) {
    const int j = file.numbers(joints, storage.joints, "VEC4", 4),
              w = file.numbers(weights, storage.weights, "VEC4", 4);
    if (storage.weights != 5126) file.root["accessors"][w]["normalized"] = true;
    attributes["JOINTS_" + set] = j;
    attributes["WEIGHTS_" + set] = w;
    joints.clear();
    weights.clear();
  };
  for (const auto& p : limb.positions) {
    const double w = share_at(p.x);
    for (const double one : {storage.two_sets ? 0.0 : w, 0.0, 0.0}) add(1, one);
    add(0, 1 - w);
  }
  put("0");
  for (const auto& p : limb.positions)
    for (const double one : {0.0, share_at(p.x), 0.0, 0.0}) add(1, one);
  if (storage.two_sets) put("1");
  return file;
}

/// The elbow turns by two right angles in a second.
inline Gltf& bends(Gltf& file) {
  std::vector<glm::vec4> turns;
  for (const double angle : {0.0, 2 * right_angle})
    turns.emplace_back(0, 0, std::sin(angle / 2), std::cos(angle / 2));
  return file.animate<glm::vec4>(0, 3, "rotation", "LINEAR", {0, 1}, turns);
}

/// Morph targets: bulge, tilt, and three more of which the last moves vertex 7 alone.
inline Gltf& add_targets(Gltf& file) {
  const Limb limb;
  const auto target = [&](dvec3 (*to)(dvec3)) {
    std::vector<double> positions, normals;
    for (std::size_t i = 0; i < limb.positions.size(); ++i) {
      const auto d = to(limb.positions[i]), n = 0.5 * to(limb.normals[i]);
      for (int k = 0; k < 3; ++k) positions.push_back(d[k]);
      for (int k = 0; k < 3; ++k) normals.push_back(static_cast<float>(n[k]));
    }
    return nlohmann::json{{"POSITION", file.numbers(positions, 5126, "VEC3", 3)},
                          {"NORMAL", file.numbers(normals, 5126, "VEC3", 3)}};
  };
  auto& primitive = file.root["meshes"][0]["primitives"][0];
  auto targets = nlohmann::json::array({target(bulge), target(tilt), target(bulge), target(bulge)});
  targets.push_back({{"POSITION", file.sparse(limb.positions.size(), {7}, {0, 0, 2})}});
  primitive["targets"] = targets;
  file.root["meshes"][0]["weights"] = {0.25, 0, 0, 0, 0};
  return file;
}

/// A limb that bends while a morph target makes it bulge.
inline Gltf bulging_limb_file() {
  auto file = limb_file();
  add_targets(file);
  bends(file);
  file.animate_weights(0, 1, "LINEAR", {0, 1}, {0, 0, 0, 0, 0, 0.5, 0, 0, 0, 0});
  return file;
}

/// A vertex of the limb with weights of bulge, tilt and the last target.
inline Vertex morphed(std::size_t i, double of_bulge, double of_tilt, double of_last) {
  static const Limb limb;
  const auto p = limb.positions[i], n = dvec3(glm::vec3(limb.normals[i]));
  return {p + of_bulge * bulge(p) + of_tilt * tilt(p) + dvec3(0, 0, i == 7 ? 2 * of_last : 0),
          glm::normalize(n + of_bulge * 0.5 * bulge(limb.normals[i]) +
                         of_tilt * 0.5 * tilt(limb.normals[i]))};
}
inline Vertex at_bind(std::size_t i) { return morphed(i, 0, 0, 0); }

constexpr double scale = 0.01;
/// The file's place in the world: the camera looks from z = 10 along -z, and its right is -x.
inline Vertex in_world(const Vertex& v) {
  return {scale * dvec3(-v.position.x, v.position.y, 10 - v.position.z),
          dvec3(-v.normal.x, v.normal.y, -v.normal.z)};
}

inline constexpr const char* plays = "[animation]\nrate = 10\ngltf = true\n";

inline Scene scene_with(const Folder& folder, const Gltf& file, const std::string& more,
                        bool as_gltf = false) {
  const char* name = as_gltf ? "limb.gltf" : "limb.glb";
  folder.write(name, as_gltf ? file.gltf() : file.glb());
  return load_scene(folder.write("scene.toml", "[scene]\ngltf = \"" + std::string(name) +
                                                   "\"\nscale = 0.01\n[[light]]\ndirection = [0.3, "
                                                   "-0.2, 1]\n" +
                                                   more));
}

/// The largest distance of a vertex from where `of` has it, over the limb's size; normals count as
/// positions do.
inline double error_of(const World& world, const std::function<Vertex(std::size_t)>& of) {
  const Limb limb;
  const auto positions = positions_now(world);
  const auto normals = normals_now(world);
  REQUIRE(positions.size() == limb.positions.size());
  // Vertices come in the order in which triangles name them
  std::vector<std::size_t> order(positions.size(), SIZE_MAX);
  REQUIRE(world.triangles.size() == limb.triangles.size());
  for (std::size_t i = 0; i < limb.triangles.size(); ++i)
    for (int k = 0; k < 3; ++k) order[world.triangles[i][k]] = limb.triangles[i][k];
  double largest = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto expected = in_world(of(order[i]));
    largest = std::max({largest, glm::distance(positions[i], expected.position) / (2 * scale),
                        glm::distance(dvec3(normals[i]), expected.normal)});
  }
  return largest;
}

inline World world_at(const Scene& scene, double picture) {
  auto world = build_world(scene);
  move_objects(scene_at(scene, picture), world);
  return world;
}

}  // namespace raywave::test
