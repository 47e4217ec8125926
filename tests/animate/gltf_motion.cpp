// SPDX-License-Identifier: Apache-2.0
// [animation] gltf: keys of nodes, poses between them, and the objects and lights that they move.
#include "host/scene/gltf_motion.hpp"

#include <glm/gtc/constants.hpp>

#include "host/animate/animate.hpp"
#include "host/animate/timeline.hpp"
#include "host/render.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/forked_reader.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using test::Gltf;
using Json = nlohmann::json;
using glm::dmat3;
using glm::dvec3;
using glm::dvec4;
using Path = GltfChannel::Path;
using Steps = GltfChannel::Steps;

/// Rodrigues' formula.
dvec3 turned(double angle, dvec3 axis, dvec3 v) {
  axis = axis / std::sqrt(glm::dot(axis, axis));
  return std::cos(angle) * v + std::sin(angle) * glm::cross(axis, v) +
         (1 - std::cos(angle)) * glm::dot(axis, v) * axis;
}

/// The quaternion of a turn: x, y, z, w.
dvec4 quaternion(double angle, dvec3 axis) {
  return {std::sin(angle / 2) * axis / std::sqrt(glm::dot(axis, axis)), std::cos(angle / 2)};
}

dvec3 turned_by(dvec4 q, dvec3 v) {
  const dvec3 u(q);
  return v + 2.0 * glm::cross(u, glm::cross(u, v) + q.w * v);
}

double distance_between(const dvec4& a, const dvec4& b) {
  return std::max(
      {std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z), std::abs(a.w - b.w)});
}

TEST_CASE(
    "linear steps of rotations turn evenly, by the shorter way, about the axis between keys") {
  const dvec3 axis(1, -2, 0.5);
  // 100 degrees from 1 s to 3 s, then 170 degrees back; a quaternion of the other sign is the same
  const auto angle_at = [](double t) {
    return glm::radians(t < 3 ? 20 + 50 * (t - 1) : 120 - 170 * (t - 3) / 0.5);
  };
  const GltfChannel channel{0,
                            Path::rotation,
                            Steps::linear,
                            {1, 3, 3.5},
                            {quaternion(angle_at(1), axis), -quaternion(angle_at(3), axis),
                             quaternion(angle_at(3.5), axis)}};
  const dvec3 v(0.3, 1, -2);
  for (double t = 1; t <= 3.5; t += 0.03125)
    CHECK(glm::distance(turned_by(value_at(channel, t), v), turned(angle_at(t), axis, v)) < 1e-14);
  CHECK(value_at(channel, 0) == channel.values.front());
  CHECK(value_at(channel, 9) == channel.values.back());
}

TEST_CASE(
    "cubic steps of a glTF file follow every cubic curve, and steps stay until the next key") {
  const auto f = [](double t) { return dvec4(t * t * t - 2 * t, 3 - t * t, 0.5 * t, 0); };
  const auto slope = [](double t) { return dvec4(3 * t * t - 2, -2 * t, 0.5, 0); };
  GltfChannel cubic{0, Path::translation, Steps::cubic, {0, 0.5, 2, 2.25}, {}};
  for (const double t : cubic.times_s)
    for (const auto& v : {slope(t), f(t), slope(t)}) cubic.values.push_back(v);
  for (double t = 0; t <= 2.25; t += 0.01)
    CHECK(distance_between(value_at(cubic, t), f(t)) < 1e-13);
  const GltfChannel steps{0, Path::scale, Steps::step, {1, 2}, {dvec4(3), dvec4(5)}};
  for (const auto& [t, value] :
       {std::pair{0.0, 3.0}, {1.5, 3.0}, {1.99, 3.0}, {2.0, 5.0}, {4.0, 5.0}})
    CHECK(value_at(steps, t) == dvec4(value));
  // Rotations: Hermite's curve of the four numbers, its length made 1
  const dvec4 from = quaternion(0.1, {0, 0, 1}), to = quaternion(1.3, {0, 1, 0}),
              out(0.2, 0, 0.1, 0), in(0, -0.3, 0.2, 0.1);
  const GltfChannel turn{
      0, Path::rotation, Steps::cubic, {0, 2}, {dvec4(9), from, out, in, to, dvec4(9)}};
  for (const double s : {0.25, 0.5, 0.8}) {
    // By de Casteljau's construction
    const dvec4 b1 = from + out * (2.0 / 3), b2 = to - in * (2.0 / 3);
    const auto mix = [s](dvec4 a, dvec4 b) { return (1 - s) * a + s * b; };
    const auto p01 = mix(from, b1), p12 = mix(b1, b2), p23 = mix(b2, to);
    const auto p = mix(mix(p01, p12), mix(p12, p23));
    CHECK(distance_between(value_at(turn, 2 * s), p / std::sqrt(glm::dot(p, p))) < 1e-14);
  }
}

TEST_CASE("angles about fixed axes make the rotation again, also where two axes become one") {
  for (const double y : {0.0, 30.0, 89.9, 90.0, 90 - 1e-7, -90.0, -90 + 1e-10, 135.0}) {
    for (const double x : {0.0, 47.0, -160.0}) {
      for (const double z : {0.0, 71.0}) {
        const auto turn = [](dvec3 deg, dvec3 v) {
          v = turned(glm::radians(deg.x), {1, 0, 0}, v);
          v = turned(glm::radians(deg.y), {0, 1, 0}, v);
          return turned(glm::radians(deg.z), {0, 0, 1}, v);
        };
        dmat3 matrix;
        for (int i = 0; i < 3; ++i) {
          dvec3 e(0);
          e[i] = 1;
          matrix[i] = turn({x, y, z}, e);
        }
        const auto angles = fixed_axis_angles_deg(matrix);
        for (const dvec3 v : {dvec3(1, 2, 3), dvec3(-2, 1, 0.5)})
          CHECK(glm::distance(turn(angles, v), turn({x, y, z}, v)) < 1e-14);
      }
    }
  }
}

constexpr const char* light = "[[light]]\ndirection = [0, 0, 1]\n";

/// A room whose camera looks along -z from 10: a card that stays, and an arm (node 2) that carries
/// a card and a hand (node 3) with another one; the hand has a lamp (node 4).
Gltf moving_room() {
  Gltf room;
  room.add_camera(0.01, {{"translation", {0, 0, 10}}});
  room.add(Gltf::square(1, {-2, 0, -1}));  // node 1
  const int arm = room.mesh(Gltf::square(0.5f, {0.25f, 0, 0})),
            hand = room.mesh(Gltf::square(0.25f, {0, 1, 0}));
  room.root["nodes"].push_back(
      {{"name", "arm"}, {"mesh", arm}, {"translation", {1, 0.5, 0}}, {"children", {3}}});
  room.root["nodes"].push_back({{"name", "hand"},
                                {"mesh", hand},
                                {"translation", {0, 1, 0}},
                                {"scale", {2, 2, 2}},
                                {"children", {4}}});
  room.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
  room.root["nodes"].push_back(
      {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}, {"translation", {0, 0, 0.5}}});
  room.root["scenes"][0]["nodes"].push_back(2);
  return room;
}

const dvec3 arm_axis(0, 0, 1), hand_axis(1, 1, 0);

/// The arm slides and turns evenly for 2 s, and the hand turns and grows.
Gltf& animate(Gltf& room) {
  room.animate<glm::vec3>(0, 2, "translation", "LINEAR", {0, 2}, {{1, 0.5f, 0}, {1.5f, 0.5f, 1}});
  std::vector<glm::vec4> turns;
  for (const double angle : {0.0, 1.0}) turns.emplace_back(quaternion(angle, arm_axis));
  room.animate<glm::vec4>(0, 2, "rotation", "LINEAR", {0, 2}, turns);
  turns.clear();
  for (const double angle : {0.0, 0.75}) turns.emplace_back(quaternion(angle, hand_axis));
  room.animate<glm::vec4>(0, 3, "rotation", "LINEAR", {1, 2}, turns);
  return room.animate<glm::vec3>(0, 3, "scale", "STEP", {0, 1.5f}, {glm::vec3(2), glm::vec3(3)});
}

/// A turn as floats have it.
struct Turn {
  explicit Turn(dvec4 q) {
    const dvec4 kept = glm::vec4(q);
    const dvec3 v(kept);
    angle = 2 * std::atan2(std::sqrt(glm::dot(v, v)), kept.w);
    axis = v;
  }
  double angle = 0;
  dvec3 axis{0};
};

struct Pose {
  std::function<dvec3(dvec3)> arm, hand;
};

/// Where node coordinates are in the file, by hand.
Pose pose_at(double t) {
  Pose pose;
  pose.arm = [t](dvec3 p) {
    const double s = std::clamp(t / 2, 0.0, 1.0);
    const Turn turn(quaternion(1, arm_axis));
    return dvec3(1 + 0.5 * s, 0.5, s) + turned(s * turn.angle, turn.axis, p);
  };
  pose.hand = [t, arm = pose.arm](dvec3 p) {
    const Turn turn(quaternion(0.75, hand_axis));
    const double s = std::clamp(t - 1, 0.0, 1.0), scale = t < 1.5 ? 2 : 3;
    return arm(dvec3(0, 1, 0) + turned(s * turn.angle, turn.axis, scale * p));
  };
  return pose;
}

/// The file's place in the world: the camera looks from z = 10 along -z, and its right is -x.
dvec3 world_of(dvec3 p, double scale) { return scale * dvec3(-p.x, p.y, 10 - p.z); }

Scene scene_from(const Folder& folder, const Gltf& room, const std::string& animation,
                 const std::string& more = light, double scale = 0.01, bool as_gltf = false) {
  const char* name = as_gltf ? "room.gltf" : "room.glb";
  folder.write(name, as_gltf ? room.gltf() : room.glb());
  return load_scene(folder.write("scene.toml", "[scene]\ngltf = \"" + std::string(name) +
                                                   "\"\nscale = " + std::to_string(scale) + "\n" +
                                                   more + animation));
}

constexpr const char* plays = "[animation]\nrate = 10\ngltf = true\n";

double distance_to_corner(const std::vector<dvec3>& corners, dvec3 place_m) {
  double nearest = 1e9;
  for (const auto& p : corners) nearest = std::min(nearest, glm::distance(p, place_m));
  return nearest;
}

TEST_CASE("objects and lights of a glTF file go where its keys put their nodes") {
  const Folder folder;
  auto room = moving_room();
  animate(room);
  for (const bool as_gltf : {false, true}) {
    const double scale = as_gltf ? 1 : 0.01;
    const auto scene = scene_from(folder, room, plays, light, scale, as_gltf);
    const auto& animation = scene.animation.value();
    CHECK(animation.pictures == 20);     // 2 s
    REQUIRE(scene.objects.size() == 3);  // what stays, the arm, the hand
    CHECK(moving_objects(animation) == std::set<std::size_t>{1, 2});
    CHECK(moving_lights(animation) == std::set<std::size_t>{1});
    auto world = build_world(scene);
    CHECK(world.triangles.size() == 6);
    for (const double picture : {0.0, 3.0, 10.0, 14.0, 15.0, 17.25, 20.0, 30.0}) {
      INFO(picture);
      const auto moved = scene_at(scene, picture);
      move_objects(moved, world);
      const auto pose = pose_at(picture / 10);
      const auto corners = positions_now(world);
      for (const double x : {-1, 1}) {
        for (const double y : {-1, 1}) {
          for (const auto& place : {dvec3(-2 + x, y, -1), pose.arm({0.25 + 0.5 * x, 0.5 * y, 0}),
                                    pose.hand({0.25 * x, 1 + 0.25 * y, 0})})
            CHECK(distance_to_corner(corners, world_of(place, scale)) < 1e-12 * scale);
        }
      }
      CHECK(glm::distance(moved.lights[1].position_m, world_of(pose.hand({0, 0, 0.5}), scale)) <
            1e-7 * scale);
    }
  }
  // Other commands show the file at rest, as one object
  CHECK(scene_from(folder, room, "").objects.size() == 1);
  CHECK(scene_from(folder, room, "[animation]\nframes = 3\ngltf = false\n").objects.size() == 1);
}

DEVICE_TEST("a picture of a moving glTF file is that of a file whose nodes rest there") {
  const Folder folder, other;
  const std::string hologram =
      "[hologram]\nresolution = [64, 64]\npitch = \"1 um\"\n[sampling]\npitch = \"0.3 mm\"\n";
  auto room = moving_room();
  auto still = moving_room();
  animate(room);
  constexpr double t = 1.25;
  const auto put = [&](int node, const char* path, dvec4 v, int size) {
    auto& to = still.root["nodes"][node][path] = Json::array();
    for (int i = 0; i < size; ++i) to.push_back(v[i]);
  };
  put(2, "translation", {1.3125, 0.5, 0.625, 0}, 3);
  put(2, "rotation", quaternion(t / 2, arm_axis), 4);
  put(3, "rotation", quaternion(0.75 * (t - 1), hand_axis), 4);
  const auto moving = scene_from(folder, room, plays, light + hologram, 0.002),
             resting = scene_from(other, still, "", light + hologram, 0.002);
  RenderOptions how;
  Renderer renderer(device, scene_at(moving, 0), how);
  const auto scene = scene_at(moving, 10 * t);
  for (const auto i : moving_objects(*moving.animation)) {
    const auto& object = scene.objects[i];
    renderer.set_solid_pose(i, object.position_m, object.rotation_deg, object.solid_scale.value());
  }
  for (const auto i : moving_lights(*moving.animation)) renderer.set_light(i, scene.lights[i]);
  const auto shown = renderer.render(), expected = render(device, resting, how);
  CHECK(shown.samples == expected.samples);
  CHECK(shown.samples > 50);
  // Measured 0.0036: as for all objects that move (tests/render/pipeline.cpp)
  CHECK(test::relative_l2(shown.field.samples, expected.field.samples) < 0.02);
}

TEST_CASE("keys of a glTF file are read from whole numbers, strides and files beside it") {
  const Folder folder;
  Gltf room = moving_room();
  // Rotations as normalized 16-bit numbers, 12 bytes apart, in a file of its own
  std::string bytes;
  const std::vector<dvec4> turns{quaternion(0, arm_axis), quaternion(1.2, arm_axis)};
  for (const auto& q : turns) {
    for (int i = 0; i < 4; ++i) {
      const auto word = static_cast<std::int16_t>(std::lround(32767 * q[i]));
      bytes.append(reinterpret_cast<const char*>(&word), 2);
    }
    bytes.append(4, 'x');
  }
  const float times[] = {0, 1};
  bytes.append(reinterpret_cast<const char*>(times), 8);
  folder.write("keys.bin", bytes);
  room.root["bufferViews"].push_back({{"buffer", 1}, {"byteLength", 24}, {"byteStride", 12}});
  room.root["bufferViews"].push_back({{"buffer", 1}, {"byteOffset", 24}, {"byteLength", 8}});
  const auto views = room.root["bufferViews"].size(), first = room.root["accessors"].size();
  room.root["accessors"].push_back({{"bufferView", views - 2},
                                    {"componentType", 5122},
                                    {"normalized", true},
                                    {"count", 2},
                                    {"type", "VEC4"}});
  room.root["accessors"].push_back(
      {{"bufferView", views - 1}, {"componentType", 5126}, {"count", 2}, {"type", "SCALAR"}});
  room.root["animations"] = {
      {{"name", "wave"},
       {"samplers", {{{"input", first + 1}, {"output", first}}}},
       {"channels", {{{"sampler", 0}, {"target", {{"node", 2}, {"path", "rotation"}}}}}}}};
  const auto load = [&](const std::string& more) {
    Json whole = room.root;
    whole["buffers"] = {
        {{"byteLength", room.data.size()},
         {"uri", "data:application/octet-stream;base64," + test::base64_of(room.data)}},
        {{"byteLength", 32}, {"uri", "keys.bin"}}};
    folder.write("room.gltf", whole.dump());
    return load_scene(folder.write("scene.toml", "[scene]\ngltf = \"room.gltf\"\n" +
                                                     std::string(light) + "[animation]\n" + more));
  };
  const auto scene = load("gltf = \"wave\"\n");
  REQUIRE(scene.objects.size() == 2);  // arm and hand move together
  CHECK(scene.animation->pictures == 24);
  auto world = build_world(scene);
  for (const double t : {0.0, 0.5, 1.0}) {
    move_objects(scene_at(scene, 24 * t), world);
    const auto place = dvec3(1, 0.5, 0) + turned(1.2 * t, arm_axis, dvec3(0.75, 0.5, 0));
    CHECK(distance_to_corner(positions_now(world), world_of(place, 1)) < 3e-5);  // 16 bits
  }
  // Of a sound file each number may be wrong
  const std::pair<std::function<void(Json&)>, const char*> damages[] = {
      {[&](Json& r) { r["accessors"][first]["count"] = 3; }, "beyond the end of their buffer"},
      {[&](Json& r) {
         r["bufferViews"][views - 2]["byteLength"] = 25;
         r["accessors"][first]["byteOffset"] = 1u << 31;
       },
       "beyond the end"},
      {[&](Json& r) { r["bufferViews"][views - 1]["byteOffset"] = 28; }, "beyond the end"},
      {[&](Json& r) { r["accessors"][first]["type"] = "VEC3"; }, "no list of VEC4"},
      {[&](Json& r) { r["accessors"][first]["componentType"] = 5125; }, "of a type"},
      {[&](Json& r) { r["accessors"][first]["sparse"] = Json::object(); }, "sparse"},
      {[&](Json& r) { r["accessors"][first].erase("bufferView"); }, "in no buffer"},
      {[&](Json& r) { r["bufferViews"][views - 1]["buffer"] = 7; }, "not there"},
      {[&](Json& r) { r["accessors"][first]["count"] = 1; }, "as many values as times"},
      {[&](Json& r) {
         r["nodes"][2]["matrix"] = Json::array({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0.5, 0, 1});
         r["nodes"][2].erase("translation");
       },
       "has a matrix"},
  };
  const auto sound = room.root;
  for (const auto& [damage, says] : damages) {
    room.root = sound;
    damage(room.root);
    CHECK_REFUSED(load("gltf = true\n"), says);
  }
}

TEST_CASE("an animation of a glTF file that cannot be shown is refused, and says what could be") {
  const Folder folder;
  auto room = moving_room();
  const auto refusal = [&](const std::string& lines) {
    return input_error_of([&] { scene_from(folder, room, "[animation]\n" + lines); });
  };
  CHECK_SAYS(refusal("gltf = true\n"),
             "scene.toml:7: animation: gltf must be left out: the file has no animation");
  CHECK_SAYS(refusal("gltf = false\n"), "frames is missing");
  animate(room);
  room.root["animations"][0]["name"] = "walk";
  CHECK_SAYS(refusal("gltf = \"run\"\n"),
             "one of its animations \"walk\", or its number, 0 to 0, got \"run\"");
  CHECK_SAYS(refusal("gltf = true\n[[animation.track]]\nof = \"object.1.position\"\nat = "
                     "[0]\nvalues = [[0, 0, 1]]\n"),
             "track 0: moves what the glTF file moves");
  CHECK_SAYS(refusal("gltf = true\n[[animation.track]]\nof = \"light.1.position\"\nat = "
                     "[0]\nvalues = [[0, 0, 1]]\n"),
             "track 0: moves what the glTF file moves");
  CHECK(scene_from(
            folder, room,
            std::string(plays) +
                "[[animation.track]]\nof = \"light.1.intensity\"\nat = [0, 9]\nvalues = [1, 2]\n")
            .animation->tracks.size() == 1);
  // Two animations may move different nodes at once
  room.animate<glm::vec3>(1, 1, "translation", "STEP", {0, 1}, {{0, 0, 0}, {1, 0, 0}});
  CHECK(scene_from(folder, room, plays).objects.size() == 3);  // all of them move
  CHECK(scene_from(folder, room, "[animation]\ngltf = 1\n").objects.size() == 2);
  room.animate<glm::vec3>(1, 2, "translation", "STEP", {0, 1}, {{0, 0, 0}, {1, 0, 0}});
  CHECK_SAYS(refusal("gltf = true\n"), "since two of them move the same node");
  auto bezier = moving_room();
  bezier.animate<glm::vec3>(0, 2, "translation", "BEZIER", {0, 1}, {{0, 0, 0}, {1, 0, 0}});
  CHECK_REFUSED(scene_from(folder, bezier, plays), "is none of LINEAR, STEP and CUBICSPLINE");
  // Keys that say what the file says anyway move nothing
  auto baked = moving_room();
  baked.animate<glm::vec3>(0, 2, "translation", "LINEAR", {0, 1}, {{1, 0.5f, 0}, {1, 0.5f, 0}});
  CHECK_REFUSED(scene_from(folder, baked, plays), "nothing that shows or shines moves");
  // What is no similarity is said for the picture
  for (const auto& scale : {glm::vec3(1, 2, 1), glm::vec3(-1, 1, 1)}) {
    auto stretched = moving_room();
    stretched.animate<glm::vec3>(0, 2, "scale", "LINEAR", {0, 1}, {glm::vec3(1), scale});
    const auto scene = scene_from(folder, stretched, plays);
    scene_at(scene, 0);
    CHECK_REFUSED(scene_at(scene, 8), "node \"arm\": at picture 8: it is stretched unevenly");
  }
  auto gone = moving_room();
  gone.animate<glm::vec3>(0, 2, "scale", "STEP", {0, 1}, {glm::vec3(1), glm::vec3(0)});
  CHECK(scene_at(scene_from(folder, gone, plays), 10).objects[1].solid_scale == smallest_scale);
}

TEST_CASE("holograms of another motion are told apart, also where the meshes are the same") {
  const Folder folder;
  auto room = moving_room();
  animate(room);
  const auto digest = [&] {
    const auto scene = scene_from(folder, room, plays);
    return digest_of_contents(scene, build_world(scene));
  };
  const auto before = digest();
  CHECK(digest() == before);
  room.root["animations"][0]["channels"][0]["target"]["node"] = 3;
  CHECK(digest() != before);
}

TEST_CASE("a reader's reply about motion is refused where nodes or keys cannot be") {
  GltfMotion sound;
  sound.nodes.resize(2);
  sound.nodes[1].parent = 0;
  sound.names.resize(2);
  sound.animations.push_back(
      {"a", {{1, Path::rotation, Steps::linear, {0, 1}, {dvec4(0, 0, 0, 1), dvec4(1, 0, 0, 0)}}}});
  const auto passes = [](const GltfMotion& motion) {
    return test::is_received(motion, receive_gltf_motion);
  };
  CHECK(passes(sound));
  void (*const damages[])(GltfMotion&) = {
      [](auto& m) { m.nodes[1].parent = 1; },
      [](auto& m) { m.nodes[0].parent = -2; },
      [](auto& m) { m.nodes[0].rotation = dvec4(0); },
      [](auto& m) { m.nodes[0].translation.x = NAN; },
      [](auto& m) { m.animations[0].channels[0].node = 2; },
      [](auto& m) { m.animations[0].channels[0].path = Path{4}; },
      [](auto& m) { m.animations[0].channels[0].steps = Steps::cubic; },
      [](auto& m) {
        m.animations[0].channels[0].times_s = {1, 1};
      },
      [](auto& m) {
        m.animations[0].channels[0].times_s = {-1, 1};
      },
      [](auto& m) { m.animations[0].channels[0].values[1].x = 2; },
      [](auto& m) { m.animations[0].channels[0].values.pop_back(); },
      [](auto& m) {
        m.animations[0].channels[0] = {0, Path::scale, Steps::step, {}, {}};
      }};
  for (const auto damage : damages) {
    auto motion = sound;
    damage(motion);
    CHECK_FALSE(passes(motion));
  }
}

}  // namespace
}  // namespace raywave
