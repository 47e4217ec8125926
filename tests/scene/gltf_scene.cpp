// SPDX-License-Identifier: Apache-2.0
// [scene] gltf: cameras, lights and units of a glTF file; anchors, units and cuts of objects.
#include "host/scene/gltf_scene.hpp"

#include <glm/common.hpp>

#include "host/geometry/deform.hpp"
#include "host/render.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/forked_reader.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using std::numbers::pi;
using test::Gltf;
using Json = nlohmann::json;
using glm::dvec3;

Json quaternion(double angle, dvec3 axis) {
  const auto n = glm::normalize(axis) * std::sin(angle / 2);
  return {n.x, n.y, n.z, std::cos(angle / 2)};
}

dvec3 turned(double angle, dvec3 axis, dvec3 v) {
  return glm::angleAxis(angle, glm::normalize(axis)) * v;
}

/// A square 10 units before a camera, in a file that may have lights.
Gltf room_for_lights() {
  Gltf room;
  room.add_camera(0.01, {{"translation", {0, 0, 10}}});
  room.add(Gltf::square(1, {0, 0, 0}));
  room.root["extensionsUsed"] = {"KHR_lights_punctual"};
  return room;
}

/// Loads a scene file that asks for room.glb and says `more`.
Scene scene_with(const Folder& folder, const Gltf& room, const std::string& more = "",
                 const std::string& section = "") {
  folder.write("room.glb", room.glb());
  return load_scene(
      folder.write("scene.toml", "[scene]\ngltf = \"room.glb\"\n" + section + "\n" + more));
}

constexpr const char* light = "[[light]]\ndirection = [0, 0, 1]\n";

/// The corner of the world nearest to a place.
double distance_to_corner(const World& world, dvec3 place_m) {
  double nearest = 1e9;
  for (const auto& p : world.positions) nearest = std::min(nearest, glm::distance(p, place_m));
  return nearest;
}

TEST_CASE("the hologram stands at the file's camera and sees along it, in the unit of its scale") {
  const Folder folder;
  // The camera is turned about a slanted axis and hangs in a node that moves, turns and stretches
  // it
  const dvec3 axis(1, 2, -0.5), at(3, -1, 2);
  const double angle = 0.7;
  Gltf room;
  room.root["cameras"] = {
      {{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.01}}}}};
  room.root["nodes"].push_back({{"camera", 0}, {"name", "eye"}});
  room.add_node({{"children", {0}},
                 {"translation", {at.x, at.y, at.z}},
                 {"rotation", quaternion(angle, axis)},
                 {"scale", {3, 3, 3}}});
  // A triangle 5 before the camera, 0.3 to the right, 0.2 up, and two more corners
  const std::vector<dvec3> of_camera{{0.3, 0.2, -5}, {-0.4, 0.1, -5}, {0.1, -0.5, -6}};
  Gltf::Part part;
  for (const auto& p : of_camera) part.positions.emplace_back(at + turned(angle, axis, p));
  part.indices = {0, 1, 2};
  room.add(part);
  for (const double scale : {1.0, 0.01}) {
    const auto scene = scene_with(folder, room, light, "scale = " + std::to_string(scale));
    REQUIRE(scene.objects.size() == 1);
    const auto world = build_world(scene);
    for (const auto& p : of_camera)
      // Right of the camera is -x: the viewer looks from the other side of the hologram
      CHECK(distance_to_corner(world, scale * dvec3(-p.x, p.y, -p.z)) < 1e-6 * scale);
  }
}

TEST_CASE("lights of a glTF file shine on surfaces with the illuminance that the file says") {
  const Folder folder;
  auto room = room_for_lights();
  room.root["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "directional"}, {"intensity", 2.0}, {"color", {0.5, 1, 1}}},
      {{"type", "point"}, {"intensity", 40.0}, {"range", 100}},
      {{"type", "spot"},
       {"intensity", 7.0},
       {"spot", {{"innerConeAngle", pi / 12}, {"outerConeAngle", pi / 6}}}}};
  const auto shining = [](int number) {
    return Json{{"KHR_lights_punctual", {{"light", number}}}};
  };
  room.add_node({{"extensions", shining(0)}, {"rotation", quaternion(-pi / 2, {1, 0, 0})}});
  room.add_node({{"extensions", shining(1)}, {"translation", {1, 2, 4}}});
  room.add_node({{"extensions", shining(2)}, {"translation", {-1, 0, 3}}});
  const auto scene =
      scene_with(folder, room, std::string(light) + "intensity = 9\n", "scale = 0.02");
  REQUIRE(scene.lights.size() == 4);
  CHECK(scene.lights[0].intensity == 9);  // those of the scene file come first
  const auto of = [&](LightType type) {
    return *std::find_if(scene.lights.begin() + 1, scene.lights.end(),
                         [&](const Light& l) { return l.type == type; });
  };
  const auto sun = of(LightType::directional), lamp = of(LightType::point),
             spot = of(LightType::spot);
  // -z of its node, turned to -y in the file, which stays -y; its red is half
  CHECK(glm::distance(sun.direction, dvec3(0, -1, 0)) < 1e-12);
  CHECK(sun.intensity == Catch::Approx(2 * 0.5 / pi));
  // At 3 m of the file from the lamp: 40 cd / 9 m^2
  CHECK(lamp.falls_off);
  CHECK(glm::distance(lamp.position_m, 0.02 * dvec3(-1, 2, 6)) < 1e-12);
  CHECK(lamp.intensity / std::pow(0.02 * 3, 2) == Catch::Approx(40.0 / 9 / pi));
  CHECK(glm::distance(spot.position_m, 0.02 * dvec3(1, 0, 7)) < 1e-12);
  CHECK(glm::distance(spot.direction, dvec3(0, 0, 1)) < 1e-12);  // as the camera looks
  CHECK(spot.inner_deg == Catch::Approx(15));
  CHECK(spot.outer_deg == Catch::Approx(30));
  CHECK(std::any_of(scene.notes.begin(), scene.notes.end(), [](const std::string& note) {
    return note.find("range of lights is ignored") != std::string::npos;
  }));
  // No other light is needed
  CHECK(scene_with(folder, room).lights.size() == 3);
}

TEST_CASE("spots of a glTF file are no narrower than floats tell, nor those of a reader's reply") {
  const Folder folder;
  auto room = room_for_lights();
  room.add_node({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  for (const double outer : {0.0, 0.001, 0.01}) {
    INFO(outer);
    room.root["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "spot"}, {"spot", {{"innerConeAngle", 0}, {"outerConeAngle", outer}}}}};
    const auto scene = scene_with(folder, room);
    REQUIRE(scene.lights.size() == 1);
    CHECK(scene.lights[0].outer_deg == Catch::Approx(std::max(0.5, outer * 180 / pi)));
    CHECK(scene.lights[0].inner_deg < scene.lights[0].outer_deg);
    CHECK(std::any_of(scene.notes.begin(), scene.notes.end(), [](const std::string& note) {
            return note.find("spots narrower than 0.5 degrees are widened") != std::string::npos;
          }) == (outer < 0.005));
  }
  // A reader that a file has taken over may say anything
  for (const double outer : {0.0, 0.4, 0.5, 90.0, 91.0}) {
    INFO(outer);
    GltfSet set;
    set.lights.push_back({.type = GltfLight::Type::spot, .outer_deg = outer});
    CHECK(test::is_received(set, receive_gltf_set) == (outer >= 0.5 && outer <= 90));
  }
}

TEST_CASE("a camera is chosen by its name or number, and objects of the scene file come first") {
  const Folder folder;
  Gltf room;
  room.add_camera(0.1, {{"name", "near"}, {"translation", {0, 0, 5}}});
  room.add_node({{"camera", 0}, {"name", "far"}, {"translation", {0, 0, 9}}});
  room.add(Gltf::square(1, {0, 0, 0}));
  const auto depth = [](const Scene& scene) {
    const auto world = build_world(scene);
    return world.min_m.z;
  };
  CHECK(depth(scene_with(folder, room, light)) == Catch::Approx(5));
  CHECK(depth(scene_with(folder, room, light, "camera = \"far\"")) == Catch::Approx(9));
  CHECK(depth(scene_with(folder, room, light, "camera = 1")) == Catch::Approx(9));
  folder.write("thing.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto both = scene_with(
      folder, room,
      std::string(light) +
          "[[object]]\nmesh = \"thing.obj\"\nwidth = \"1 mm\"\nposition = [0, 0, \"3 m\"]\n");
  REQUIRE(both.objects.size() == 2);
  CHECK(both.objects[0].mesh.filename() == "thing.obj");
  CHECK(build_world(both).triangles.size() == 3);

  const auto refusal = [&](const std::string& section) {
    return input_error_of([&] { scene_with(folder, room, light, section); });
  };
  CHECK_SAYS(refusal("camera = \"none\""),
             "scene.toml:3: scene: camera must be one of \"near\", \"far\"");
  CHECK_SAYS(refusal("camera = 2"), "0 to 1");
  CHECK_SAYS(refusal("scale = 0"), "scale must be");
  CHECK_SAYS(refusal("lens = 1"), "unknown key \"lens\"");
  Gltf blind;
  blind.add(Gltf::square(1, {0, 0, 0}));
  CHECK_REFUSED(scene_with(folder, blind, light), "it has no camera");
  for (const char* key : {"scale = 2", "scale = 1", "cut = \"1 m\"", "camera = 0"})
    CHECK_REFUSED(load_scene(folder.write("a.toml", "[scene]\n" + std::string(key) + "\n")),
                  "gltf is missing");
  CHECK_SAYS(input_error_of(
                 [&] { load_scene(folder.write("a.toml", "[scene]\ngltf = \"thing.obj\"\n")); }),
             "it is no glTF of version 2");
  // Nodes in a circle are visited once
  auto circle = room;
  circle.root["nodes"][0]["children"] = {1};
  circle.root["nodes"][1]["children"] = {0};
  CHECK(scene_with(folder, circle, light).objects.size() == 1);
}

TEST_CASE("what lies nearer than a camera sees is cut away, to the place") {
  const Folder folder;
  // A floor from 1 behind the camera to 4 before it, 2 wide and 0.5 below
  Gltf room;
  room.add_camera(0.25);
  Gltf::Part floor;
  floor.positions = {{-1, -0.5f, 1}, {1, -0.5f, 1}, {1, -0.5f, -4}, {-1, -0.5f, -4}};
  floor.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  floor.normals.resize(4, {0, 1, 0});
  floor.indices = {0, 1, 2, 0, 2, 3};
  floor.material = room.material({{"name", "boards"}});
  room.add(floor);
  for (const double cut : {0.25, 1.5}) {
    const auto scene = scene_with(folder, room, light,
                                  cut == 0.25 ? "" : "cut = \"" + std::to_string(cut) + " m\"");
    const auto world = build_world(scene);
    CHECK(world.min_m.z == Catch::Approx(cut));
    CHECK(world.max_m.z == Catch::Approx(4));
    CHECK_FALSE(world.object_closed[0]);
    REQUIRE(world.triangle_material.size() == world.triangles.size());
    double area = 0;
    for (std::size_t i = 0; i < world.triangles.size(); ++i) {
      const auto p = world.corners_m(i);
      area += glm::length(glm::cross(p[1] - p[0], p[2] - p[0])) / 2;
      CHECK(world.triangle_material[i] == 0);
      for (int k = 0; k < 3; ++k) {
        const auto vertex = world.triangles[i][k];
        // glTF counts v downwards: at z = 1 of the file 1, at z = -4 0
        CHECK(double{world.uvs[vertex].y} == Catch::Approx((4 - p[k].z) / 5).margin(1e-6));
        CHECK(glm::distance(dvec3(world.normals[vertex]), dvec3(0, 1, 0)) < 1e-6);
      }
    }
    CHECK(area == Catch::Approx(2 * (4 - cut)));
  }
  CHECK_REFUSED(build_world(scene_with(folder, room, light, "cut = \"9 m\"")),
                "nothing of it lies beyond cut");
  // Cut objects stay where they are
  auto scene = scene_with(folder, room, light);
  CHECK(build_world(scene).placed[0].is_cut);
  auto world = build_world(scene);
  move_objects(scene, world);
  scene.objects[0].position_m.x += 1;
  CHECK_REFUSED(move_objects(scene, world), "cannot be moved");
}

/// A card 1 wide, 1 before a camera that sees from 0.25 on.
Gltf card_before_camera() {
  Gltf room;
  room.add_camera(0.25);
  room.add(Gltf::square(0.5f, {0.2f, 0, -1}));
  return room;
}

TEST_CASE("an object of a glTF scene moves as if it had been placed there, up to its cut") {
  const Folder folder;
  auto scene = scene_with(folder, card_before_camera(), light);
  const auto first = scene.objects[0];
  auto world = build_world(scene);
  const auto [min_m, max_m] = std::pair(world.min_m, world.max_m);
  CHECK_FALSE(world.placed[0].is_cut);
  for (const bool solid : {false, true}) {
    INFO(solid);
    auto& object = scene.objects[0];
    object = first;
    if (solid) object.solid_scale = 1;
    object.position_m += dvec3(0.1, -0.2, 0.5);
    move_objects(scene, world);
    CHECK(glm::distance(world.min_m, min_m + dvec3(0.1, -0.2, 0.5)) < 1e-12);
    CHECK(glm::distance(world.max_m, max_m + dvec3(0.1, -0.2, 0.5)) < 1e-12);
    // Turned about the origin of its mesh, which is the camera
    object.rotation_deg += dvec3(0, 20, 0);
    move_objects(scene, world);
    const auto there = build_world(scene);
    for (std::size_t i = 0; i < world.triangles.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c)
        CHECK(glm::distance(world.corners_m(i)[c], there.corners_m(i)[c]) < 1e-9);
    // To the cut and no further
    object = first;
    if (solid) object.solid_scale = 1;
    object.position_m.z += 0.25 - min_m.z;
    move_objects(scene, world);
    CHECK(world.min_m.z == Catch::Approx(0.25));
    object.position_m.z -= 1e-6;
    CHECK_REFUSED(move_objects(scene, world), "must be >= cut, 250 mm");
  }
}

DEVICE_TEST("a renderer refuses a pose that cannot be, and renders the one before") {
  const Folder folder;
  const std::string hologram = "[hologram]\nresolution = [32, 32]\npitch = \"8 um\"\n";
  for (const bool is_cut : {false, true}) {
    INFO(is_cut);
    // A part of the card lies nearer than 0.9 of the file's metres where it is turned
    auto room = card_before_camera();
    room.root["nodes"].back()["rotation"] = quaternion(is_cut ? 0.5 : 0, {0, 1, 0});
    const auto scene =
        scene_with(folder, room, std::string(light) + hologram, "scale = 0.01\ncut = \"9 mm\"");
    const auto at = scene.objects[0].position_m, turn = scene.objects[0].rotation_deg;
    Renderer renderer(device, scene);
    auto before = renderer.render().field.samples;
    const auto refusal = [&](dvec3 by_m, bool solid) {
      return input_error_of([&] {
        solid ? renderer.set_solid_pose(0, at + by_m, turn) : renderer.set_pose(0, at + by_m, turn);
      });
    };
    if (!is_cut) {
      renderer.set_pose(0, at + dvec3(0, 0, 2e-3), turn);
      const auto moved = renderer.render().field.samples;
      CHECK(test::relative_l2(moved, before) > 0.1);
      before = moved;
    }
    for (const bool solid : {false, true}) {
      CHECK_SAYS(refusal({0, 0, -2e-3}, solid),
                 is_cut ? "a part of it is cut away" : "must be >= cut, 9 mm");
      if (is_cut) CHECK_SAYS(refusal({0, 0, 2e-3}, solid), "cannot be moved");
      CHECK_SAYS(refusal({0, 0, -30e-3}, solid),
                 is_cut ? "cannot be moved" : "must be >= cut, 9 mm");
    }
    CHECK(test::relative_l2(renderer.render().field.samples, before) < 1e-6);
  }
}

TEST_CASE("objects with a unit and their mesh's origin as anchor lie where their numbers say") {
  const Folder folder;
  folder.write("a.obj", "v 10 0 0\nv 12 0 0\nv 10 3 0\nf 1 2 3\n");
  const auto scene_of = [&](const std::string& more) {
    return load_scene(folder.write(
        "scene.toml",
        std::string(light) + "[[object]]\nmesh = \"a.obj\"\nposition = [0, 0, \"1 m\"]\n" + more));
  };
  const auto centred = build_world(scene_of("unit = \"1 mm\"\n"));
  CHECK(glm::distance(centred.min_m, dvec3(-1e-3, -1.5e-3, 1)) < 1e-12);
  auto scene = scene_of("unit = \"1 mm\"\nanchor = \"origin\"\nrotation = [0, 0, 90]\n");
  auto world = build_world(scene);
  CHECK(glm::distance(world.min_m, dvec3(-3e-3, 10e-3, 1)) < 1e-12);
  CHECK(glm::distance(world.max_m, dvec3(0, 12e-3, 1)) < 1e-12);
  // Moves turn about the origin, too
  scene.objects[0].rotation_deg = {0, 0, 180};
  scene.objects[0].position_m = {1e-3, 0, 2};
  move_objects(scene, world);
  CHECK(glm::distance(world.min_m, dvec3(-11e-3, -3e-3, 2)) < 1e-12);
  CHECK(glm::distance(world.max_m, dvec3(-9e-3, 0, 2)) < 1e-12);
  CHECK_REFUSED(scene_of("width = \"1 mm\"\nunit = \"1 mm\"\n"),
                "unit must be left out where width is given");
}

TEST_CASE("a mesh above a height is the mesh with its lower part cut off, and stays joined") {
  // A strip of squares along x, cut at many heights
  Mesh mesh;
  for (int i = 0; i <= 10; ++i) {
    for (int j = 0; j < 2; ++j) {
      mesh.positions.emplace_back(i, j, 0);
      mesh.normals.emplace_back(0, 0, 1);
      mesh.uvs.emplace_back(i, j);
      mesh.colours.emplace_back(0.1f * static_cast<float>(i), 0, 0, 1);
    }
  }
  for (unsigned i = 0; i < 10; ++i) {
    mesh.triangles.emplace_back(2 * i, 2 * i + 2, 2 * i + 3);
    mesh.triangles.emplace_back(2 * i, 2 * i + 3, 2 * i + 1);
  }
  for (const double slant : {0.0, 0.4}) {
    std::vector<double> heights;
    for (const auto& p : mesh.positions) heights.push_back(p.x + slant * p.y);
    for (const double least : {-1.0, 0.0, 2.0, 2.5, 7.3, 10.0}) {
      const auto part = part_above(mesh, heights, least);
      double area = 0;
      for (const auto& t : part.triangles)
        area += glm::cross(part.positions[t.y] - part.positions[t.x],
                           part.positions[t.z] - part.positions[t.x])
                    .z /
                2;
      double expected = 0;  // the integral of 10 - (least - slant y) over y, cut to 0 to 10
      for (int k = 0; k < 10000; ++k)
        expected += (10 - std::clamp(least - slant * (k + 0.5) / 10000, 0.0, 10.0)) / 10000;
      INFO(slant << ", " << least);
      CHECK(area == Catch::Approx(expected).epsilon(1e-4).margin(1e-9));
      for (std::size_t i = 0; i < part.positions.size(); ++i) {
        CHECK(part.positions[i].x + slant * part.positions[i].y >= least - 1e-9);
        CHECK(part.uvs[i].x == Catch::Approx(part.positions[i].x).margin(1e-12));
        CHECK(double{part.colours[i].x} == Catch::Approx(0.1 * part.positions[i].x).margin(1e-6));
      }
      // Corners on the cut are shared: no place is there twice
      for (std::size_t i = 0; i < part.positions.size(); ++i)
        for (std::size_t k = 0; k < i; ++k)
          CHECK(glm::distance(part.positions[i], part.positions[k]) > 1e-9);
    }
  }
}

}  // namespace
}  // namespace raywave
