// SPDX-License-Identifier: Apache-2.0
// Materials and lights as the lens shows them, against the double-precision oracle
// (host/reference/lens.hpp), which shades the same world one ray at a time.
#include "host/common/error.hpp"
#include "host/geometry/world.hpp"
#include "host/planning/make_plan.hpp"
#include "host/reference/lens.hpp"
#include "host/view/lens.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
using Json = nlohmann::json;

Scene scene_of(const std::filesystem::path& mesh, double width_m) {
  Scene scene{.hologram = {{40, 40}, {20e-6, 20e-6}, 638e-9}};
  scene.materials.emplace_back();
  scene.objects.emplace_back();
  scene.objects[0].mesh = mesh;
  scene.objects[0].width_m = width_m;
  scene.objects[0].position_m = {0, 0, 20 * mm};
  scene.objects[0].rotation_deg = {0, 180, 0};  // glTF's front looks at the hologram
  scene.objects[0].where = "object 0";
  return scene;
}

Light light_of(LightType type, glm::dvec3 direction, double intensity) {
  return Light{.type = type, .direction = direction, .intensity = intensity};
}

struct Compared {
  int pixels = 0;    // that show something, and that rounding does not decide
  double worst = 0;  // difference over the oracle's value
  double brightest = 0;
  double light = 0;  // sum of the oracle's picture
};

/// A picture in focus of what is at z_m, device against oracle.
Compared compare(const cl::Device& device, const Scene& scene, const World& world, double z_m,
                 double width_m, int pixels = 32, int points = 2) {
  const auto plan = make_plan(scene, world);
  LensSpec spec{.z_m = z_m,
                .window_m = glm::dvec2(width_m),
                .points = points,
                .pixel_m = glm::dvec2(width_m / pixels)};
  const DeviceScene arrays(device, world, plan);
  const auto image = lens_picture(device, plan, arrays, spec);
  const auto exact = reference::seen_by_lens(
      scene, world, plan, {z_m, {image.width, image.height}, *spec.pixel_m, points});
  Compared result;
  result.brightest = *std::max_element(exact.radiance.begin(), exact.radiance.end());
  for (std::size_t i = 0; i < exact.radiance.size(); ++i) {
    result.light += exact.radiance[i];
    if (exact.unsure[i] || exact.radiance[i] == 0) continue;
    ++result.pixels;
    const double difference = std::abs(double{image.pixels[i]} - exact.radiance[i]);
    // What is darker than a hundredth of the picture is held to that
    result.worst =
        std::max(result.worst, difference / std::max(exact.radiance[i], 0.01 * result.brightest));
  }
  return result;
}

/// Every kind of map, wrap and colour, side by side on quads.
Gltf all_looks() {
  const auto pattern = tga_picture(16, 16, [](int i, int j) {
    return glm::u8vec4(60 + 12 * i, 250 - 9 * j, 16 * ((i + j) % 16), 255);
  });
  // A normal map with slopes up to 25 degrees
  const auto slopes = tga_picture(16, 16, [](int i, int j) {
    const auto n = glm::normalize(glm::dvec3(0.4 * std::sin(0.8 * i), 0.4 * std::cos(0.5 * j), 1));
    return glm::u8vec4(glm::round(127.5 * (n + 1.0)), 255);
  });
  Gltf file;
  const int repeated = file.texture(pattern), bumps = file.texture(slopes),
            mirrored = file.texture(pattern, {{"wrapS", 33648}, {"wrapT", 33071}});
  file.root["extensionsUsed"] = {"KHR_texture_transform"};
  const auto turned = [&](int texture) {
    Json info = texture_info(texture);
    info["extensions"]["KHR_texture_transform"] = {
        {"offset", {0.3, 0.1}}, {"rotation", 0.5}, {"scale", {2.3, 1.7}}};
    return info;
  };
  const Json looks[] = {
      {{"pbrMetallicRoughness",
        {{"baseColorTexture", texture_info(repeated)}, {"metallicFactor", 0}}}},
      {{"pbrMetallicRoughness",
        {{"baseColorTexture", turned(mirrored)},
         {"metallicFactor", 0.6},
         {"roughnessFactor", 0.5}}}},
      {{"pbrMetallicRoughness",
        {{"metallicRoughnessTexture", texture_info(repeated)},
         {"baseColorFactor", {0.9, 0.6, 0.3, 1}}}}},
      {{"emissiveTexture", turned(repeated)},
       {"emissiveFactor", {0.7, 0.7, 0.7}},
       {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0.4}}}},
      {{"normalTexture", {{"index", bumps}, {"scale", 0.8}}},
       {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0.45}}}},
      {{"normalTexture", turned(bumps)},
       {"pbrMetallicRoughness",
        {{"metallicFactor", 1},
         {"roughnessFactor", 0.35},
         {"baseColorFactor", {0.8, 0.5, 0.3, 1}}}}},
      {{"pbrMetallicRoughness", {{"baseColorFactor", {0.6, 0.6, 0.6, 1}}}},
       {"extensions", {{"KHR_materials_unlit", Json::object()}}}},
      {{"pbrMetallicRoughness", {{"metallicFactor", 0.3}, {"roughnessFactor", 0.5}}}}};
  int number = 0;
  for (const auto& look : looks) {
    auto part = Gltf::square(
        0.45f, {-1.0f + static_cast<float>(number % 3), -1.0f + static_cast<float>(number / 3), 0},
        file.material(look));
    if (number == 7)
      for (int i = 0; i < 4; ++i)
        part.colours.emplace_back(0.25f * static_cast<float>(i) + 0.1f, 1, 1, 1);
    file.add(part);
    ++number;
  }
  return file;
}

DEVICE_TEST("all that materials of meshes have, and all lights, look as the oracle says") {
  const Folder folder;
  folder.write("sky.tga", tga_picture(16, 8, [](int i, int j) {
                 return glm::u8vec4(10 + 14 * i, 20, 20, 255) /
                        (j == 2 ? std::uint8_t{1} : std::uint8_t{3});
               }));
  auto scene = scene_of(folder.write("looks.glb", all_looks().glb()), 2.9 * mm);
  Light spot = light_of(LightType::spot, {0.1, -0.2, 1}, 2e-4);
  spot.position_m = {-1 * mm, 2 * mm, 8 * mm};
  spot.inner_deg = 3;
  spot.outer_deg = 9;
  spot.falls_off = true;
  Light panel = light_of(LightType::area, {0, 0, 1}, 0.5);
  panel.position_m = {4 * mm, -3 * mm, 15 * mm};
  panel.edges_m = {glm::dvec3(3 * mm, 0, 1 * mm), glm::dvec3(0, 2 * mm, 0)};
  panel.samples = 6;
  Light disc = light_of(LightType::area, {0.3, -0.5, 1}, 0.4);
  disc.position_m = {-3 * mm, 4 * mm, 12 * mm};
  disc.radius_m = 2 * mm;
  disc.samples = 4;
  Light sky = light_of(LightType::environment, {0, 0, 1}, 0.8);
  sky.picture = folder / "sky.tga";
  sky.rotation_deg = 40;
  sky.samples = 12;
  sky.highlights = false;
  scene.lights = {sky,  light_of(LightType::directional, {0.3, -0.4, 1}, 0.7), spot, panel,
                  disc, light_of(LightType::ambient, {0, 0, 1}, 0.4)};
  for (const double z_m : {20 * mm, -20 * mm}) {
    if (z_m < 0) {
      scene.objects[0].position_m.z -= 40 * mm;
      for (auto& light : scene.lights) light.position_m.z -= 40 * mm;
    }
    const auto world = build_world(scene);
    REQUIRE(world.materials.size() == 8);
    for (const bool shadows : {false, true}) {
      scene.trace.shadows = shadows;
      const auto found = compare(device, scene, world, z_m, 3 * mm, 48, 4);
      INFO("z " << z_m << ", shadows " << shadows << ", " << found.pixels << " pixels, worst "
                << found.worst);
      CHECK(found.pixels > 1200);
      CHECK(found.worst < 2e-3);
    }
  }
}

DEVICE_TEST("in colour, the light of a laser is that of light times colour, as the oracle says") {
  const Folder folder;
  folder.write("sky.tga", tga_picture(16, 8, [](int i, int j) {
                 return glm::u8vec4(10 + 14 * i, 20 + 20 * j, 90, 255);
               }));
  auto scene = scene_of(folder.write("looks.glb", all_looks().glb()), 2.9 * mm);
  Light lamp = light_of(LightType::directional, {0.3, -0.4, 1}, 0.7);
  lamp.colour = {1, 0.7, 0.3};
  Light sky = light_of(LightType::environment, {0, 0, 1}, 0.8);
  sky.picture = folder / "sky.tga";
  sky.samples = 12;
  scene.lights = {sky, lamp, light_of(LightType::ambient, {0, 0, 1}, 0.4)};
  ColourSpec colour{.lasers = laser_set({638e-9, 520e-9, 450e-9})};
  for (const std::size_t laser : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
    CAPTURE(laser);
    colour.laser = laser;
    scene.colour = colour;
    scene.hologram.wavelength_m = colour.lasers.wavelengths_m[laser];
    const auto world = build_world(scene);
    const auto found = compare(device, scene, world, 20 * mm, 3 * mm, 40, 2);
    INFO(found.pixels << " pixels, worst " << found.worst);
    CHECK(found.pixels > 700);
    CHECK(found.worst < 2e-3);
  }
}

DEVICE_TEST("materials of meshes in mirrors and behind glass look as the oracle says") {
  const Folder folder;
  auto looks = all_looks();
  // A clear pane before one of them
  looks.root["extensionsUsed"].push_back("KHR_materials_transmission");
  looks.add(Gltf::square(
      0.4f, {-1, -1, 0.3f},
      looks.material(
          {{"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0.5}}},
           {"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0.8}}}}}})));
  auto scene = scene_of(folder.write("looks.glb", looks.glb()), 1.2 * mm);
  Material mirror, glass;
  mirror.name = "mirror";
  mirror.reflectivity = 0.8;
  glass.name = "glass";
  glass.transparency = 0.9;
  glass.attenuation = 0.7;
  scene.materials = {Material{}, mirror, glass};
  auto& front = scene.objects[0];
  front.position_m = {-0.8 * mm, 0, 19.5 * mm};
  auto back = front;  // faces the mirror
  back.position_m = {0.8 * mm, 0.1 * mm, 20 * mm};
  back.rotation_deg = {0, 0, 0};
  auto wall = front;
  wall.mesh =
      folder.write("wall.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n");
  wall.width_m = 3.4 * mm;
  wall.position_m = {0, 0, 22.5 * mm};
  wall.rotation_deg = {0, 12, 0};
  wall.material = 1;
  auto slab = front;
  slab.mesh =
      folder.write("slab.obj",
                   "v -1 -0.2 -0.2\nv 1 -0.2 -0.2\nv 1 0.2 -0.2\nv -1 0.2 -0.2\nv -1 -0.2 0.2\n"
                   "v 1 -0.2 0.2\nv 1 0.2 0.2\nv -1 0.2 0.2\nf 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf "
                   "1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\n"
                   "f 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n");
  slab.width_m = 3 * mm;
  slab.position_m = {0, -0.4 * mm, 18 * mm};
  slab.rotation_deg = {20, 10, 0};
  slab.material = 2;
  scene.objects = {front, back, wall, slab};
  Light panel = light_of(LightType::area, {0, 0, 1}, 0.5);
  panel.position_m = {3 * mm, 3 * mm, 15 * mm};
  panel.edges_m = {glm::dvec3(2 * mm, 0, 1 * mm), glm::dvec3(0, 2 * mm, 0)};
  panel.samples = 16;
  scene.lights = {panel, light_of(LightType::directional, {0.3, -0.4, -1}, 0.7)};
  scene.trace.depth = 4;
  scene.trace.shadows = true;
  const auto world = build_world(scene);
  auto dark = scene;
  dark.trace.depth = 0;
  const auto found = compare(device, scene, world, 20 * mm, 3.2 * mm, 48, 2),
             direct = compare(device, dark, world, 20 * mm, 3.2 * mm, 48, 2);
  CAPTURE(found.pixels, found.light, direct.light, found.worst);
  CHECK(found.pixels > 1200);
  CHECK(found.light > 1.2 * direct.light);
  CHECK(found.worst < 5e-3);
}

DEVICE_TEST("moved objects keep their materials", "[slow]") {
  const Folder folder;
  auto scene = scene_of(folder.write("looks.glb", all_looks().glb()), 2.9 * mm);
  scene.lights = {light_of(LightType::directional, {0.3, -0.4, 1}, 0.7)};
  auto world = build_world(scene);
  scene.objects[0].position_m = {0.2 * mm, -0.1 * mm, 22 * mm};
  scene.objects[0].rotation_deg = {20, 160, 30};
  move_objects(scene, world);
  const auto found = compare(device, scene, world, 22 * mm, 3 * mm, 32, 2);
  INFO(found.pixels << " pixels, worst " << found.worst);
  CHECK(found.pixels > 400);
  CHECK(found.worst < 2e-3);
}

DEVICE_TEST("sample models of others look as the oracle says, where their package is installed",
            "[slow]") {
  const std::filesystem::path models = "/usr/share/assimp/models";
  if (!std::filesystem::is_directory(models)) {
    WARN("the package assimp-testmodels is not installed: the cases above stand for its models");
    return;
  }
  const char* files[] = {"glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb",
                         "glTF2/BoxBadNormals-glTF-Binary/BoxBadNormals.glb",
                         "glTF2/BoxTexcoords-glTF/boxTexcoords.gltf",
                         "glTF2/BoxTextured-glTF/BoxTextured.gltf",
                         "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb",
                         "glTF2/BoxTextured-glTF-Embedded/BoxTextured.gltf",
                         "glTF2/BoxTextured-glTF-pbrSpecularGlossiness/BoxTextured.gltf",
                         "glTF2/draco/2CylinderEngine.gltf",
                         "glTF2/ClearCoat-glTF/ClearCoatTest.gltf",
                         "glTF2/glTF-Sample-Models/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf",
                         "glTF2/simple_skin/simple_skin.gltf",
                         "glTF2/textureTransform/TextureTransformTest.gltf",
                         "glTF/BoxTextured-glTF/BoxTextured.gltf",
                         "glTF/BoxTextured-glTF-MaterialsCommon/BoxTextured.gltf",
                         "glTF/BoxTextured-glTF-Embedded/BoxTextured.gltf",
                         "glTF/CesiumMilkTruck/CesiumMilkTruck.gltf",
                         "glTF/TwoBoxes/TwoBoxes.gltf",
                         "OBJ/spider.obj",
                         "FBX/maxPbrMaterial_metalRough.fbx",
                         "FBX/phong_cube.fbx",
                         "Collada/duck.dae",
                         "PLY/float-color.ply",
                         "3DS/cube_with_diffuse_texture.3DS",
                         "OBJ/cube_with_vertexcolors.obj"};
  int compared = 0;
  for (const char* file : files) {
    INFO(file);
    auto scene = scene_of(models / file, 2 * mm);
    scene.objects[0].rotation_deg = {25, 150, 0};
    scene.lights = {light_of(LightType::directional, {0.3, -0.4, 1}, 0.8)};
    Compared found;
    for (const double wavelength : {638e-9, 450e-9}) {  // some are black in red light
      scene.hologram.wavelength_m = wavelength;
      if (found.pixels == 0)
        found = compare(device, scene, build_world(scene), 20 * mm, 2.4 * mm, 24, 2);
    }
    INFO(found.pixels << " pixels, worst " << found.worst);
    CHECK(found.pixels > 20);
    CHECK(found.worst < 0.01);
    ++compared;
  }
  CHECK(compared >= 20);
}

}  // namespace
}  // namespace raywave
