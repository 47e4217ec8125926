// SPDX-License-Identifier: Apache-2.0
// Skins and morph targets of glTF files: vertices against closed forms, pictures against meshes at
// rest, files that are damaged.
#include "host/animate/animate.hpp"
#include "host/render.hpp"
#include "host/scene/gltf_motion.hpp"
#include "tests/animate/limb.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/forked_reader.hpp"

namespace raywave {
namespace {

using namespace test;
using Json = nlohmann::json;

TEST_CASE("a skin bends as the mean of its joints' motions, whatever numbers store its weights") {
  const Folder folder;
  const Limb limb;
  for (const bool as_gltf : {false, true}) {
    for (const auto& storage : {Storage{5121, 5126, false}, Storage{5123, 5121, false},
                                Storage{5121, 5123, true}, Storage{5123, 5126, true}}) {
      auto file = limb_file(storage);
      const auto at_angle = [&](double angle) {
        return [&limb, angle](std::size_t i) {
          return bent(at_bind(i), share_at(limb.positions[i].x), angle);
        };
      };
      INFO(storage.joints << " " << storage.weights << " " << storage.two_sets);
      // At rest in the pose of its nodes, with the place of its own node left out
      CHECK(error_of(build_world(scene_with(folder, file, "", as_gltf)), at_angle(rest_angle)) <
            1e-6);
      bends(file);
      const auto scene = scene_with(folder, file, plays, as_gltf);
      REQUIRE(scene.objects.size() == 1);
      CHECK(scene.objects[0].deforms);
      CHECK(scene.animation->pictures == 10);
      CHECK(error_of(build_world(scene), at_angle(rest_angle)) < 1e-6);
      auto world = build_world(scene);
      for (const double picture : {0.0, 5.0, 3.0, 10.0, 11.0}) {
        move_objects(scene_at(scene, picture), world);
        CHECK(error_of(world, at_angle(2 * right_angle * std::min(picture / 10, 1.0))) < 1e-6);
      }
      CHECK(world.object_closed[0]);
    }
  }
}

TEST_CASE("a mesh file with a skin and morph targets is read as its nodes and weights have it") {
  const Folder folder;
  auto file = limb_file();
  add_targets(file);
  const Limb limb;
  for (const bool node_says : {false, true}) {
    // The node's weights go before those of the mesh
    if (node_says) file.root["nodes"][1]["weights"] = {0, 0.5, 0, 0, 1};
    const auto mesh = load_mesh(folder.write("limb.glb", file.glb()), Normals::file, "here");
    REQUIRE(mesh.positions.size() == limb.positions.size());
    for (std::size_t i = 0; i < limb.triangles.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        const auto vertex = limb.triangles[i][k];
        const auto expected =
            bent(node_says ? morphed(vertex, 0, 0.5, 1) : morphed(vertex, 0.25, 0, 0),
                 share_at(limb.positions[vertex].x), rest_angle);
        const auto found = mesh.triangles[i][k];
        CHECK(glm::distance(mesh.positions[found], expected.position) < 2e-6);
        CHECK(glm::distance(mesh.normals[found], expected.normal) < 1e-6);
      }
    }
    CHECK(mesh.notes == std::vector<std::string>{});
  }
}

TEST_CASE("morph targets are added by their weights at each time, before joints bend the mesh") {
  const Folder folder;
  const Limb limb;
  for (const bool has_skin : {false, true}) {
    auto file = limb_file({}, has_skin);
    add_targets(file);
    const auto expected = [&](double of_bulge, double of_tilt, double of_last, double angle) {
      return [&limb, of_bulge, of_tilt, of_last, angle](std::size_t i) {
        return bent(morphed(i, of_bulge, of_tilt, of_last), share_at(limb.positions[i].x), angle);
      };
    };
    const double rest = has_skin ? rest_angle : 0;
    CHECK(error_of(build_world(scene_with(folder, file, "")), expected(0.25, 0, 0, rest)) < 1e-6);
    const auto check = [&](const char* steps, const std::vector<double>& values,
                           const std::vector<std::pair<double, std::pair<double, double>>>& at) {
      auto moving = file;
      moving.animate_weights(0, 1, steps, {0, 1}, values);
      if (has_skin) bends(moving);
      const auto scene = scene_with(folder, moving, plays);
      REQUIRE(scene.objects.size() == 1);
      for (const auto& [t, weights] : at) {
        INFO(steps << " " << t);
        CHECK(error_of(world_at(scene, 10 * t), expected(weights.first, 0.3, weights.second,
                                                         has_skin ? 2 * right_angle * t : 0)) <
              1e-6);
      }
    };
    // Of five targets: bulge goes from 0 to 1, tilt stays at 0.3, the last from 2 to 0
    check("LINEAR", {0, 0.3, 0, 0, 2, 1, 0.3, 0, 0, 0}, {{0.3, {0.3, 1.4}}, {1, {1, 0}}});
    check("STEP", {0, 0.3, 0, 0, 2, 1, 0.3, 0, 0, 0}, {{0.9, {0, 2}}, {1, {1, 0}}});
    // t^3 - t + 0.5 and 2 - t^2, by their slopes
    check("CUBICSPLINE", {9, 9, 9, 9, 9,  0.5, 0.3, 0, 0, 2, -1, 0, 0, 0, 0,  //
                          2, 0, 0, 0, -2, 0.5, 0.3, 0, 0, 1, 9,  9, 9, 9, 9},
          {{0.2, {0.2 * 0.2 * 0.2 - 0.2 + 0.5, 2 - 0.04}},
           {0.7, {0.7 * 0.7 * 0.7 - 0.7 + 0.5, 2 - 0.49}}});
  }
}

TEST_CASE(
    "a mesh whose morph targets change goes with its node, stretched, too, but not mirrored") {
  const Folder folder;
  auto file = limb_file({}, false);
  add_targets(file);
  file.animate_weights(0, 1, "LINEAR", {0, 1}, {0, 0, 0, 0, 0, 1, 0, 0, 0, 0});
  file.animate<glm::vec3>(0, 1, "scale", "LINEAR", {0, 1}, {{1, 1, 1}, {0.25f, 3, 1}});
  file.animate<glm::vec3>(0, 1, "translation", "LINEAR", {0, 1}, {{0, 0, 0}, {0, 1, 0}});
  const auto scene = scene_with(folder, file, plays);
  for (const double t : {0.25, 0.75}) {
    const dvec3 stretch(1 - 0.75 * t, 1 + 2 * t, 1);
    CHECK(
        error_of(world_at(scene, 10 * t), [&](std::size_t i) {
          const auto v = morphed(i, t, 0, 0);
          return Vertex{stretch * v.position + dvec3(0, t, 0), glm::normalize(v.normal / stretch)};
        }) < 1e-6);
  }
  file.animate<glm::vec3>(1, 1, "scale", "LINEAR", {0, 1}, {{1, 1, 1}, {-1, 1, 1}});
  file.animate_weights(1, 1, "LINEAR", {0, 1}, {0, 0, 0, 0, 0, 1, 0, 0, 0, 0});
  const auto mirrored = scene_with(folder, file, "[animation]\nrate = 10\ngltf = 1\n");
  CHECK_NOTHROW(world_at(mirrored, 4));
  CHECK_REFUSED(world_at(mirrored, 6), "node \"arm\": it becomes its mirror image");
}

TEST_CASE("a skin without normals is flat in every picture") {
  const Folder folder;
  auto file = limb_file({}, true, false);
  bends(file);
  const auto world = world_at(scene_with(folder, file, plays), 5);
  const Limb limb;
  REQUIRE(world.triangles.size() == limb.triangles.size());
  double largest = 0;
  for (std::size_t i = 0; i < limb.triangles.size(); ++i) {
    dvec3 p[3];
    for (int k = 0; k < 3; ++k) {
      const auto vertex = limb.triangles[i][k];
      p[k] =
          in_world(bent(at_bind(vertex), share_at(limb.positions[vertex].x), right_angle)).position;
      largest = std::max(largest,
                         glm::distance(p[k], world.positions[world.triangles[i][k]]) / (2 * scale));
    }
    const auto normal = glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
    for (int k = 0; k < 3; ++k)
      largest =
          std::max(largest, glm::distance(dvec3(world.normals[world.triangles[i][k]]), normal));
  }
  CHECK(largest < 2e-6);
}

TEST_CASE("what a skin hangs on moves as before, and skins whose joints stay are at rest") {
  const Folder folder;
  auto file = limb_file();
  // A card in the hand, and one that stays
  const int card = file.mesh(Gltf::square(0.1f, {0, 0, 0}));
  file.root["nodes"].push_back({{"mesh", card}, {"translation", {1, 0, 0}}});
  file.root["nodes"][3]["children"] = {5};
  file.add(Gltf::square(0.2f, {0, 0, -3}));
  // The skinned mesh's own node may move without effect
  auto still = file;
  still.animate<glm::vec3>(0, 1, "translation", "LINEAR", {0, 1}, {{5, 6, 7}, {0, 0, 0}});
  still.animate<glm::vec3>(0, 6, "translation", "LINEAR", {0, 1}, {{0, 0, 0}, {0, 1, 0}});
  const auto resting = scene_with(folder, still, plays);
  REQUIRE(resting.objects.size() == 2);
  CHECK_FALSE(resting.objects[0].deforms);
  CHECK_FALSE(resting.objects[1].deforms);
  bends(file);
  const auto scene = scene_with(folder, file, plays);
  REQUIRE(scene.objects.size() == 3);  // the card that stays, that in the hand, the limb
  CHECK(scene.objects[2].deforms);
  CHECK(moving_objects(*scene.animation) == std::set<std::size_t>{1, 2});
  const auto world = world_at(scene, 5);
  const auto positions = positions_now(world);
  const auto first = world.placed[1].first_vertex;
  dvec3 middle(0);
  for (std::size_t i = 0; i < world.placed[1].vertices; ++i)
    middle += positions[first + i] / static_cast<double>(world.placed[1].vertices);
  CHECK(glm::distance(middle, in_world({{0, 1, 0}, {}}).position) < 1e-6 * scale);
}

/// The limb as a mesh of its own.
std::string obj_of(const std::function<Vertex(std::size_t)>& of) {
  const Limb limb;
  std::ostringstream text;
  text.precision(9);
  for (std::size_t i = 0; i < limb.positions.size(); ++i) {
    const auto [p, n] = of(i);
    text << "v " << p.x << ' ' << p.y << ' ' << p.z << "\nvn " << n.x << ' ' << n.y << ' ' << n.z
         << '\n';
  }
  for (const auto& t : limb.triangles) {
    text << 'f';
    for (int k = 0; k < 3; ++k) text << ' ' << t[k] + 1 << "//" << t[k] + 1;
    text << '\n';
  }
  return text.str();
}

DEVICE_TEST("a picture of a skin that moves is that of the deformed mesh at rest") {
  const Folder folder;
  auto file = bulging_limb_file();
  // Shows as a diffuse 0.54 and an ambient 0.05 (docs/materials.md)
  file.root["meshes"][0]["primitives"][0]["material"] = file.material(
      {{"pbrMetallicRoughness",
        {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 1}}}});
  const std::string hologram =
      "[hologram]\nresolution = [64, 48]\npitch = \"4 um\"\n[sampling]\npitch = \"0.4 mm\"\n";
  const auto moving = scene_with(folder, file, plays + hologram);
  const Limb limb;
  Renderer renderer(device, scene_at(moving, 0));
  for (const double t : {0.5, 0.9, 0.25}) {
    // Around its middle: files keep floats
    folder.write("bent.obj", obj_of([&](std::size_t i) {
                   auto v = in_world(bent(morphed(i, t / 2, 0, 0), share_at(limb.positions[i].x),
                                          2 * right_angle * t));
                   v.position.z -= 10 * scale;
                   return v;
                 }));
    const auto resting = load_scene(folder.write(
        "rest.toml", hologram +
                         "[[light]]\ndirection = [0.3, -0.2, 1]\n[[object]]\nmesh = "
                         "\"bent.obj\"\nunit = \"1 m\"\nanchor = \"origin\"\nposition = [0, "
                         "0, \"100 mm\"]\nmaterial = \"white\"\n[materials.white]\ndiffuse = "
                         "0.54\nambient = 0.05\n"));
    const auto scene = scene_at(moving, 10 * t);
    const auto& object = scene.objects[0];
    renderer.set_solid_pose(0, object.position_m, object.rotation_deg, object.solid_scale.value());
    renderer.set_shape(0, object.shape.value());
    const auto shown = renderer.render(), expected = render(device, resting);
    const double off = test::relative_l2(shown.field.samples, expected.field.samples);
    INFO("at " << t << ": off by " << off << ", " << shown.samples << " samples");
    CHECK(shown.samples > 300);
    CHECK(off <= 0.02);  // measured up to 0.0048
  }
}

TEST_CASE("holograms of another skin are told apart") {
  const Folder folder;
  const auto digest = [&](const Gltf& file) {
    const auto scene = scene_with(folder, file, plays);
    return digest_of_contents(scene, build_world(scene));
  };
  auto file = bulging_limb_file();
  const auto before = digest(file);
  CHECK(digest(file) == before);
  for (const char* damaged : {"WEIGHTS_0", "POSITION"}) {
    auto other = file;
    const auto& primitive = other.root["meshes"][0]["primitives"][0];
    const auto& of =
        std::string(damaged) == "POSITION" ? primitive["targets"][3] : primitive["attributes"];
    // A target that no weight shows, and one vertex's weights that are the same ever so little off
    const auto view = other.root["accessors"][of[damaged].get<std::size_t>()]["bufferView"];
    const auto at = other.root["bufferViews"][view.get<std::size_t>()]["byteOffset"];
    other.data[at.get<std::size_t>() + 12] ^= 1;
    CHECK(digest(other) != before);
  }
}

/// A change of the limb's file and of its primitive.
using Damage = std::function<void(Gltf&, Json&)>;

/// What is said of the limb that bends and bulges after a damage.
std::string said_of(const Damage& damage, const std::string& more = plays) {
  const Folder folder;
  auto file = bulging_limb_file();
  damage(file, file.root["meshes"][0]["primitives"][0]);
  const auto message = input_error_of([&] { build_world(scene_with(folder, file, more)); });
  CHECK_SAYS(message, "limb.glb\": ");
  return message;
}

const std::string export_again =
    "; export the file again, or without the skin or the morph targets";

/// Puts these values in place of a vertex attribute's.
Damage with_attribute(const char* name, const std::vector<double>& values, int type) {
  return [=](Gltf& file, Json& primitive) {
    primitive["attributes"][name] = file.numbers(values, type, "VEC4", 4);
  };
}

/// The same, with four values that all vertices have.
Damage with_all(const char* name, glm::dvec4 of_each, int type) {
  std::vector<double> values;
  for (std::size_t i = 0; i < Limb().positions.size(); ++i)
    values.insert(values.end(), {of_each.x, of_each.y, of_each.z, of_each.w});
  return with_attribute(name, values, type);
}

TEST_CASE("where a skin's weight is 0 no joint is asked for, and a sound limb is not refused") {
  const Folder folder;
  auto file = bulging_limb_file();
  CHECK_NOTHROW(build_world(scene_with(folder, file, plays)));
  with_all("JOINTS_0", {1, 9, 9, 0}, 5121)(file, file.root["meshes"][0]["primitives"][0]);
  CHECK(error_of(build_world(scene_with(folder, file, "")), [](std::size_t i) {
          return bent(morphed(i, 0.25, 0, 0), share_at(Limb().positions[i].x), rest_angle);
        }) < 1e-6);
}

TEST_CASE("a damaged skin or morph target is refused with the mesh's name and what to do") {
  const auto count = Limb().positions.size();
  const std::string mesh = "mesh \"Limb\": ", &tail = export_again;
  const std::pair<Damage, std::string> damages[] = {
      {with_all("JOINTS_0", {2, 0, 0, 0}, 5121),
       mesh + "a joint of vertex 0 is not among the 2 of its skin" + tail},
      {with_all("WEIGHTS_0", glm::dvec4(0), 5126),
       mesh + "the weights of vertex 0 are all 0" + tail},
      {with_all("WEIGHTS_0", {1, NAN, 0, 0}, 5126),
       "a weight of vertex 0 is no number >= 0" + tail},
      {with_all("WEIGHTS_0", {-1, 2, 0, 0}, 5126), "a weight of vertex 0 is no number >= 0" + tail},
      {with_attribute("WEIGHTS_0", {1, 0, 0, 0}, 5126),
       "WEIGHTS_0 is given for 1 vertices, and POSITION for " + std::to_string(count) + tail},
      {[](auto&, Json& p) { p["attributes"].erase("JOINTS_0"); },
       "it has a skin, but not JOINTS_0" + tail},
      {[](Gltf& file, Json&) {
         file.root["skins"][0]["inverseBindMatrices"] =
             file.numbers(std::vector<double>(32, NAN), 5126, "MAT4", 16);
       },
       "inverse bind matrix 0 has no numbers" + tail},
      {[](Gltf& file, Json& p) {
         p["targets"][1]["POSITION"] = file.numbers({1, 2, 3}, 5126, "VEC3", 3);
       },
       "POSITION of a morph target is given for 1 vertices, and POSITION for "},
      {[count](Gltf& file, Json& p) {
         p["targets"][4]["POSITION"] = file.sparse(count, {static_cast<double>(count)}, {0, 0, 2});
       },
       "a sparse part of " + mesh +
           "POSITION of a morph target names an element that is not there"},
      {[](Gltf& file, Json&) {  // a cycle
         file.root["nodes"][3]["children"] = {4};
         file.root["nodes"][4]["children"] = {2};
       },
       ""}};
  for (const auto& [damage, words] : damages) CHECK_SAYS(said_of(damage), words);
}

TEST_CASE("a skin or morph target with a wrong value in its file is refused with what it lacks") {
  const auto made = bulging_limb_file().root;
  const auto& mesh = made["meshes"][0]["primitives"][0];
  const auto accessor = [](const Json& number, const char* key) {
    return "/accessors/" + std::to_string(number.get<std::size_t>()) + "/" + key;
  };
  const std::string& tail = export_again;
  const auto& moved = mesh["targets"][4]["POSITION"];
  const std::tuple<std::string, Json, std::string> replaced[] = {
      {"/meshes/0/primitives/0/attributes/JOINTS_1", 0, "it has a skin, but not WEIGHTS_1" + tail},
      {"/skins/0/joints", {2, 3, 4}, "its skin has 3 joints and 2 inverse bind matrices" + tail},
      {"/skins/0/joints", Json::array(), "its skin has no joints, or more than 65536" + tail},
      {"/nodes/1/skin", 7, "its skin has no joints"},
      {"/skins/0/joints", {2, -3}, "a joint of its skin is no number of a node" + tail},
      {"/skins/0/joints", {2, 77}, "node 77 is a joint of a skin, and not in the scene"},
      {accessor(made["skins"][0]["inverseBindMatrices"], "componentType"), 5121,
       "inverse bind matrices are no floats"},
      {"/meshes/0/weights", {1, 2}, "it has not as many weights as morph targets" + tail},
      {"/meshes/0/weights/1", "much", "a weight of a morph target is no number" + tail},
      {"/meshes/0/primitives/0/targets/4/POSITION", made["accessors"].size() + 5,
       "mesh \"Limb\": POSITION of a morph target are no list of VEC3"},
      {accessor(moved, "sparse/count"), 1u << 30, "has no count that fits"},
      {accessor(mesh["attributes"]["POSITION"], "componentType"), 5124,
       "mesh \"Limb\": POSITION are of a type that glTF does not have there"},
      // Many vertices from few bytes
      {accessor(moved, "count"), std::uint64_t{1} << 62, "more than 100000000"},
      {"/animations/0/samplers/1/output", made["animations"][0]["samplers"][1]["input"],
       "an animation has not as many values as times"},
  };
  for (const auto& [place, value, words] : replaced) {
    INFO(place << " = " << value);
    const auto put = [&at = place, &to = value](Gltf& file, Json&) {
      file.root[Json::json_pointer(at)] = to;
    };
    CHECK_SAYS(said_of(put), words);
  }
  CHECK_SAYS(said_of(
                 [](Gltf& file, Json&) {
                   file.root["skins"][0]["joints"] = {2, 77};
                 },
                 ""),
             "mesh \"Limb\": joint 1 of its skin is node 77, which is not in the scene" + tail);
}

TEST_CASE("damaged files with skins and morph targets are shown or refused with one line") {
  const Folder folder;
  auto file = bulging_limb_file();
  auto whole = file.root;
  whole["buffers"] = {{{"byteLength", file.data.size()}, {"uri", "limb.bin"}}};
  folder.write("limb.bin", file.data);
  const auto [shown, refused] = read_damaged(
      folder, folder.write("limb.gltf", whole.dump()), 12, 150, [&](const auto& damaged) {
        const auto scene = load_scene(
            folder.write("scene.toml", "[scene]\ngltf = \"" + damaged.string() +
                                           "\"\n[[light]]\ndirection = [0, 0, 1]\n" + plays));
        auto world = build_world(scene);
        move_objects(scene_at(scene, 5), world);
        for (const auto& p : world.positions) REQUIRE(glm::length(p) < 1e5);
      });
  CHECK(shown > 3);
  CHECK(refused > 30);
}

TEST_CASE("a reader's reply about a mesh that deforms is refused where it cannot be") {
  Mesh sound;
  sound.positions.resize(3, dvec3(0));
  sound.normals.resize(3, dvec3(0));
  sound.uvs.resize(3, glm::dvec2(0));
  sound.triangles.emplace_back(0, 1, 2);
  sound.triangle_node = {1};
  DeformingPart part{.node = 1, .joints = {2, 3}};
  part.joint_from_mesh.resize(2, glm::dmat4(1));
  part.positions.resize(3, glm::vec3(0));
  part.normals.resize(3, glm::vec3(0));
  part.influences = 4;
  part.joint_of.resize(12, 1);
  part.weight_of.resize(12, 0.25f);
  part.weights = {0.5};
  part.target_positions.resize(3, glm::vec3(1));
  sound.deforming.push_back(part);
  const auto passes = [](const Mesh& mesh) { return is_received(mesh, receive_mesh); };
  CHECK(passes(sound));
  void (*const damages[])(DeformingPart&) = {[](auto& p) { p.node = -1; },
                                             [](auto& p) { p.first_vertex = 1; },
                                             [](auto& p) { p.influences = 3; },
                                             [](auto& p) { p.influences = 1000; },
                                             [](auto& p) { p.joints = {}; },
                                             [](auto& p) { p.joints[0] = -1; },
                                             [](auto& p) { p.joint_from_mesh[1][2][0] = NAN; },
                                             [](auto& p) { p.joint_from_mesh.pop_back(); },
                                             [](auto& p) { p.positions[0].x = INFINITY; },
                                             [](auto& p) { p.normals.pop_back(); },
                                             [](auto& p) { p.joint_of[5] = 2; },
                                             [](auto& p) { p.weight_of[5] = -1; },
                                             [](auto& p) { p.weight_of[5] = NAN; },
                                             [](auto& p) { p.weights[0] = NAN; },
                                             [](auto& p) { p.weights.push_back(0); },
                                             [](auto& p) { p.target_positions.pop_back(); },
                                             [](auto& p) { p.target_normals.resize(1); }};
  for (const auto damage : damages) {
    auto mesh = sound;
    damage(mesh.deforming[0]);
    CHECK_FALSE(passes(mesh));
  }
}

}  // namespace
}  // namespace raywave
