// SPDX-License-Identifier: Apache-2.0
// What meshes bring along: materials, pictures and colours, as they are read and as Phong
// materials.
#include <glm/common.hpp>
#include <numbers>
#include <sstream>

#include "host/reference/looks.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/mesh_files.hpp"

namespace raywave {
namespace {

using std::numbers::pi;
using test::Gltf;
using Json = nlohmann::json;

/// A scene of this mesh alone, 1 mm wide at 20 mm.
Scene scene_of(const std::filesystem::path& mesh, double wavelength_m = 638e-9) {
  Scene scene;
  scene.hologram.wavelength_m = wavelength_m;
  scene.lights.emplace_back();
  scene.materials.emplace_back();
  scene.objects.emplace_back();
  scene.objects[0].mesh = mesh;
  scene.objects[0].width_m = 1e-3;
  scene.objects[0].position_m = {0, 0, 20e-3};
  scene.objects[0].where = "object 0";
  return scene;
}

/// A square with this material of glTF.
Gltf square_of(const Json& material) {
  Gltf file;
  file.add(Gltf::square(1, {0, 0, 0}, file.material(material)));
  return file;
}

const Material& only_material(const World& world) {
  REQUIRE(world.materials.size() == 1);
  return world.materials[0];
}

/// The material of a square that has this one in glTF.
Material read_material(const Folder& folder, const Json& material) {
  return only_material(
      build_world(scene_of(folder.write("material.gltf", square_of(material).gltf()))));
}

std::string notes_of(const Scene& scene, const World& world) {
  std::string all;
  for (const auto& note : material_notes(scene, world)) all += note + "\n";
  return all;
}

TEST_CASE(
    "a highlight carries the reflectance of its surface, and is as wide as microfacets make") {
  // Light from the normal, seen from all directions: the integral of radiance cos over them
  for (const double roughness : {0.1, 0.3, 0.5, 0.7}) {
    const double m = shininess_of(roughness), strength = specular_of(0.3, m);
    double reflected = 0;
    constexpr int steps = 200000;
    for (int i = 0; i < steps; ++i) {
      const double cosine = (i + 0.5) / steps;
      reflected += strength * std::pow(cosine, m) * 2 * pi * cosine / steps;
    }
    CHECK(reflected == Catch::Approx(0.3 * pi).epsilon(1e-4));  // of irradiance pi
    // A microfacet distribution exp(-tan^2(h) / alpha^2), alpha = roughness^2, falls to 1/e at
    // tan(h) = alpha; mirrored light turns by twice the angle.
    if (roughness < 0.4) {
      const double angle = 2 * std::atan(roughness * roughness);
      CHECK(std::pow(std::cos(angle), m) == Catch::Approx(std::exp(-1.0)).epsilon(0.03));
    }
  }
  CHECK(shininess_of(0) == shininess_of(0.05));  // a limit for floats
  CHECK(shininess_of(1) == 0);
}

TEST_CASE("a glTF material becomes Phong's by the rule of docs/materials.md") {
  const Folder folder;
  // A rough dielectric: base colour, 4 %, and its width
  const auto clay = read_material(folder, {{"name", "clay"},
                                           {"pbrMetallicRoughness",
                                            {{"baseColorFactor", {0.5, 0.25, 0.125, 1}},
                                             {"metallicFactor", 0},
                                             {"roughnessFactor", 0.5}}},
                                           {"emissiveFactor", {0.1, 0.2, 0.3}}});
  CHECK(clay.name == "clay");
  CHECK(clay.diffuse == glm::dvec3(0.5, 0.25, 0.125));
  CHECK(glm::distance(clay.ambient, 0.1 * clay.diffuse) < 1e-12);  // the scene has no ambient light
  CHECK(clay.shininess == Catch::Approx(7.5));                     // 1 / (2 / 16) - 1/2
  CHECK(clay.specular.x == Catch::Approx(0.04 * (7.5 + 2) / 2));
  CHECK(clay.specular.z == clay.specular.x);
  CHECK(glm::distance(clay.emission, glm::dvec3(0.1, 0.2, 0.3)) < 1e-7);
  CHECK(clay.transparency == 0);

  // A metal: its colour is that of its highlight
  const auto gold = read_material(
      folder, {{"pbrMetallicRoughness",
                {{"baseColorFactor", {1, 0.75, 0.25, 1}}, {"roughnessFactor", 0.5}}}});
  CHECK(gold.diffuse == glm::dvec3(0));
  CHECK(glm::distance(gold.specular, glm::dvec3(1, 0.75, 0.25) * 4.75) < 1e-9);

  // What is rougher than roughness 0.76 scatters
  const auto rough =
      read_material(folder, {{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}}}});
  CHECK(rough.specular == glm::dvec3(0));
  CHECK(glm::distance(rough.diffuse, glm::dvec3(0.5)) < 1e-9);

  // Extensions: glass of another index, light stronger than 1
  const auto glass = read_material(
      folder, {{"name", "glass"},
               {"emissiveFactor", {1, 0, 0}},
               {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0.5}}},
               {"extensions",
                {{"KHR_materials_transmission", {{"transmissionFactor", 0.75}}},
                 {"KHR_materials_emissive_strength", {{"emissiveStrength", 5}}},
                 {"KHR_materials_ior", {{"ior", 2}}}}}});
  CHECK(glass.transparency.channels.x == Catch::Approx(0.75));
  CHECK(glass.ior == Spectrum(2));
  CHECK(glass.specular.x == Catch::Approx(1 / 9.0 * 4.75));  // ((n - 1) / (n + 1))^2
  CHECK(glass.emission.x == Catch::Approx(5));

  // A map decides how metallic glass is, not its factor alone, which is 1 unless given
  for (const int metallic : {0, 51}) {
    Gltf file;
    const int map = file.texture(
        test::tga_picture(2, 2, [&](int, int) { return glm::u8vec4(0, 128, metallic, 255); }));
    file.add(Gltf::square(
        1, {0, 0, 0},
        file.material(
            {{"pbrMetallicRoughness", {{"metallicRoughnessTexture", test::texture_info(map)}}},
             {"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0.75}}}}}})));
    const auto mapped = only_material(build_world(scene_of(folder.write("f.glb", file.glb()))));
    CHECK(mapped.transparency.channels.x == Catch::Approx(0.75 * (1 - metallic / 255.0)));
  }

  // Unlit: the base colour shines
  const auto unlit =
      read_material(folder, {{"pbrMetallicRoughness", {{"baseColorFactor", {0.25, 0.5, 1, 1}}}},
                             {"extensions", {{"KHR_materials_unlit", Json::object()}}}});
  CHECK(glm::distance(unlit.emission, glm::dvec3(0.25, 0.5, 1)) < 1e-9);
  CHECK(unlit.diffuse == glm::dvec3(0));
  CHECK(unlit.ambient == glm::dvec3(0));
}

TEST_CASE("ambient light shows all of a mesh's colour; without one it shows a tenth") {
  const Folder folder;
  auto scene = scene_of(folder.write(
      "a.glb", square_of({{"pbrMetallicRoughness",
                           {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"metallicFactor", 1}}}})
                   .glb()));
  CHECK(only_material(build_world(scene)).ambient.x == Catch::Approx(0.05));
  scene.lights.push_back({LightType::ambient});
  CHECK(only_material(build_world(scene)).ambient.x == Catch::Approx(0.5));
}

TEST_CASE("a scene's own material overrides all that a mesh brings; without one the mesh decides") {
  const Folder folder;
  Gltf file;
  auto part = Gltf::square(1, {0, 0, 0}, file.material({{"name", "own"}}));
  part.colours.resize(4, glm::vec4(0.5f));
  file.add(part).add(Gltf::square(1, {0, 0, 1}));  // the second part has no material
  auto scene = scene_of(folder.write("a.glb", file.glb()));
  scene.materials.emplace_back();
  scene.materials[1].name = "mine";
  const auto own = build_world(scene);
  REQUIRE(own.triangle_material.size() == 4);
  CHECK(std::count(own.triangle_material.begin(), own.triangle_material.end(), 0) == 2);
  CHECK(std::count(own.triangle_material.begin(), own.triangle_material.end(), -1) == 2);
  CHECK(own.colours.size() == own.positions.size());
  scene.objects[0].material = 1;
  const auto overridden = build_world(scene);
  CHECK(overridden.materials.empty());
  CHECK(overridden.triangle_material.empty());
  CHECK(overridden.colours.empty());
  CHECK(overridden.found[0].overridden == 1);
  // Objects side by side: each as it says
  scene.objects.push_back(scene.objects[0]);
  scene.objects[1].material = 0;
  const auto both = build_world(scene);
  REQUIRE(both.triangle_material.size() == 8);
  CHECK(std::all_of(both.triangle_material.begin(), both.triangle_material.begin() + 4,
                    [](int m) { return m == -1; }));
  CHECK(both.found[1].materials[0].triangles == 2);
}

TEST_CASE("pictures in a GLB, in a data URI and beside the file are the same, linear from sRGB") {
  const Folder folder;
  const auto level = [](int i, int j) { return static_cast<std::uint8_t>(10 + 60 * i + 7 * j); };
  const auto picture =
      test::tga_picture(4, 3, [&](int i, int j) { return glm::u8vec4(level(i, j), 200, 30, 255); });
  folder.write("a picture.tga", picture);
  const auto file_with = [&](auto texture_of) {
    Gltf file;
    const int texture = texture_of(file);
    file.add(Gltf::square(1, {0, 0, 0},
                          file.material({{"pbrMetallicRoughness",
                                          {{"baseColorTexture", test::texture_info(texture)},
                                           {"metallicFactor", 0}}}})));
    return file;
  };
  const auto inside = file_with([&](Gltf& file) { return file.texture(picture); });
  const auto in_uri = file_with([&](Gltf& file) {
    return file.texture_at("data:image/png;base64," + test::base64_of(picture));
  });
  const auto beside = file_with([&](Gltf& file) { return file.texture_at("a%20picture.tga"); });
  for (const auto& mesh :
       {folder.write("a.glb", inside.glb()), folder.write("b.gltf", inside.gltf()),
        folder.write("c.gltf", in_uri.gltf()), folder.write("d.glb", beside.glb())}) {
    INFO(mesh);
    const auto red = build_world(scene_of(mesh));
    REQUIRE(red.maps.size() == 1);
    REQUIRE(red.maps[0].colour);
    const auto& image = *red.maps[0].colour.image;
    REQUIRE(image.width == 4);
    REQUIRE(image.height == 3);
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 4; ++i)
        CHECK(double{image.pixels[4 * j + i]} ==
              Catch::Approx(test::linear(level(i, j) / 255.0)).epsilon(1e-5));
    // Another wavelength sees another channel
    const auto blue = build_world(scene_of(mesh, 450e-9));
    CHECK(double{blue.maps[0].colour.image->pixels[5]} ==
          Catch::Approx(test::linear(30 / 255.0)).epsilon(1e-5));
  }
}

TEST_CASE("the maps of a glTF material lie where its transforms and wrap modes put them") {
  const Folder folder;
  const auto picture = test::tga_picture(
      16, 8, [](int i, int j) { return glm::u8vec4(16 * i, 31 * j, 9 * (i + j), 255); });
  const double angle = 0.3, sx = 1.5, sy = 0.75, ox = 0.2, oy = -0.1;
  Gltf file;
  const Json mirrored{{"wrapS", 33648}, {"wrapT", 33071}};
  const int placed = file.texture(picture, mirrored), plain = file.texture(picture);
  Json info = test::texture_info(placed);
  info["extensions"]["KHR_texture_transform"] = {
      {"offset", {ox, oy}}, {"rotation", angle}, {"scale", {sx, sy}}};
  file.root["extensionsUsed"] = {"KHR_texture_transform"};
  file.add(Gltf::square(
      1, {0, 0, 0},
      file.material({{"pbrMetallicRoughness",
                      {{"metallicRoughnessTexture", info}, {"baseColorFactor", {1, 1, 1, 1}}}},
                     {"emissiveTexture", test::texture_info(plain)},
                     {"emissiveFactor", {1, 1, 1}},
                     {"normalTexture", test::texture_info(plain)}})));
  const auto scene = scene_of(folder.write("a.glb", file.glb()));
  const auto world = build_world(scene);
  const auto& maps = world.maps.at(0);
  CHECK_FALSE(maps.colour);
  REQUIRE(maps.roughness);
  REQUIRE(maps.metallic);
  REQUIRE(maps.emission);
  REQUIRE(maps.normal[2]);
  CHECK(maps.emission.place.is_plain());

  // A bilinear picture of texels, by hand: mirrored along u, its edge repeated along v
  const auto wrapped = [](int i, int n, bool mirrors) {
    if (!mirrors) return std::clamp(i, 0, n - 1);
    const int twice = ((i % (2 * n)) + 2 * n) % (2 * n);
    return twice < n ? twice : 2 * n - 1 - twice;
  };
  const auto sample = [&](double u, double v, auto texel) {
    const double x = u * 16 - 0.5, y = v * 8 - 0.5;
    double sum = 0;
    for (int dj = 0; dj < 2; ++dj)
      for (int di = 0; di < 2; ++di) {
        const int i = static_cast<int>(std::floor(x)) + di,
                  j = static_cast<int>(std::floor(y)) + dj;
        sum += (1 - std::abs(x - i)) * (1 - std::abs(y - j)) *
               texel(wrapped(i, 16, true), wrapped(j, 8, false));
      }
    return sum;
  };
  // Places of the mesh, counted as glTF does: v downwards
  for (const auto& [u, v] : std::vector<std::pair<double, double>>{
           {0.1, 0.2}, {0.9, 0.4}, {0.5, 0.95}, {-0.4, 0.3}, {1.7, -0.6}, {2.3, 1.8}}) {
    INFO(u << ", " << v);
    const double x = std::cos(angle) * sx * u + std::sin(angle) * sy * v + ox,
                 y = -std::sin(angle) * sx * u + std::cos(angle) * sy * v + oy;
    CHECK(reference::map_at(maps.roughness, {u, 1 - v}) ==
          Catch::Approx(sample(x, y, [](int, int j) { return 31 * j / 255.0; })).margin(1e-5));
    CHECK(
        reference::map_at(maps.metallic, {u, 1 - v}) ==
        Catch::Approx(sample(x, y, [](int i, int j) { return 9 * (i + j) / 255.0; })).margin(1e-5));
  }
  // Colours are decoded from sRGB, numbers are not
  CHECK(double{maps.emission.image->pixels[3]} ==
        Catch::Approx(test::linear(48 / 255.0)).epsilon(1e-5));
  CHECK(double{maps.normal[0].image->pixels[3]} == Catch::Approx(48 / 255.0));
}

TEST_CASE("an OBJ's materials are Phong's numbers of its MTL file") {
  const Folder folder;
  folder.write("paint.tga",
               test::tga_picture(2, 2, [](int, int) { return glm::u8vec4(188, 188, 188, 255); }));
  folder.write("things.mtl",
               "newmtl shiny\nKa 0.2 0.2 0.2\nKd 0.4 0.3 0.2\nKs 0.5 0.6 0.7\nNs 40\nillum 2\n"
               "newmtl dull\nKd 0.6 0.6 0.6\nKs 0.5 0.5 0.5\nNs 40\nKe 0.25 0 0\nillum 1\n"
               "map_Kd paint.tga\n"
               "newmtl thin\nKd 1 1 1\nd 0.25\nillum 2\nmap_Ks paint.tga\nbump paint.tga\n");
  std::string obj = "mtllib things.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n";
  for (const char* name : {"shiny", "dull", "thin"})
    obj += std::string("usemtl ") + name + "\nf 1/1 2/2 3/3\n";
  const auto scene = scene_of(folder.write("things.obj", obj));
  const auto world = build_world(scene);
  REQUIRE(world.materials.size() == 3);
  const auto named = [&](const std::string& name) {
    const auto found = std::find_if(world.materials.begin(), world.materials.end(),
                                    [&](const Material& m) { return m.name == name; });
    REQUIRE(found != world.materials.end());
    return static_cast<std::size_t>(found - world.materials.begin());
  };
  const auto &shiny = world.materials[named("shiny")], &dull = world.materials[named("dull")],
             &thin = world.materials[named("thin")];
  CHECK(glm::distance(shiny.ambient, glm::dvec3(0.02)) < 1e-7);
  CHECK(glm::distance(shiny.diffuse, glm::dvec3(0.4, 0.3, 0.2)) < 1e-7);
  CHECK(glm::distance(shiny.specular, glm::dvec3(0.5, 0.6, 0.7)) < 1e-7);
  CHECK(shiny.shininess == Catch::Approx(40));
  CHECK(dull.specular == glm::dvec3(0));  // "illum 1": without highlights
  CHECK(dull.emission.x == Catch::Approx(0.25));
  REQUIRE(world.maps[named("dull")].colour);
  CHECK(double{world.maps[named("dull")].colour.image->pixels[0]} ==
        Catch::Approx(test::linear(188 / 255.0)).epsilon(1e-5));
  CHECK(thin.alpha == Catch::Approx(0.25));
  CHECK(thin.alpha_mode == AlphaMode::blend);
  for (const auto& found : world.found[0].materials) CHECK(found.triangles == 1);
  const auto notes = notes_of(scene, world);
  CHECK_SAYS(notes, "material \"thin\": specular map is ignored");
  CHECK_SAYS(notes, "material \"thin\": bump map is ignored");
}

TEST_CASE("colours of vertices multiply white, and lie in the world at their corners") {
  const Folder folder;
  const auto world = build_world(
      scene_of(folder.write("a.obj", "v 0 0 0 1 0 0\nv 1 0 0 0.5 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n")));
  const auto& m = only_material(world);
  CHECK(m.vertex_colours);
  CHECK(m.diffuse == glm::dvec3(1));
  CHECK(glm::distance(m.ambient, glm::dvec3(0.1)) < 1e-12);
  REQUIRE(world.colours.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& p = world.positions[i];
    CHECK(double{world.colours[i].x} == Catch::Approx(p.y > 0   ? 0
                                                      : p.x > 0 ? test::linear(0.5)
                                                                : 1)
                                            .epsilon(1e-5));
  }
  // Of glTF with their alpha
  Gltf file;
  auto part = Gltf::square(1, {0, 0, 0}, file.material({{"name", "painted"}}));
  part.colours.resize(4, {0.5f, 0.25f, 0, 0.75f});
  const auto gltf = build_world(scene_of(folder.write("b.glb", file.add(part).glb())));
  CHECK(only_material(gltf).vertex_colours);
  CHECK(gltf.colours.at(0) == glm::vec4(0.5f, 0.5f, 0.5f, 0.75f));  // the laser's channel
}

TEST_CASE("a mesh without materials has the scene's, as ever") {
  const Folder folder;
  const char* triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const auto& mesh :
       {folder.write("a.obj", triangle),
        folder.write("b.obj", std::string("mtllib none.mtl\nusemtl x\n") + triangle),
        std::filesystem::path(RAYWAVE_DATA_DIR) / "square.ply",
        std::filesystem::path(RAYWAVE_DATA_DIR) / "teapot.ply",
        folder.write("c.glb", Gltf().add(Gltf::square(1, {0, 0, 0})).glb())}) {
    INFO(mesh);
    const auto world = build_world(scene_of(mesh));
    CHECK(world.materials.empty());
    CHECK(world.triangle_material.empty());
    CHECK(world.colours.empty());
    CHECK(world.found.at(0).materials.empty());
  }
}

TEST_CASE("what is left out of a material is named") {
  const Folder folder;
  auto file = square_of({{"name", "lacquer"},
                         {"occlusionTexture", test::texture_info(0)},
                         {"pbrMetallicRoughness", {{"baseColorTexture", test::texture_info(1)}}},
                         {"extensions",
                          {{"KHR_materials_clearcoat", {{"clearcoatFactor", 1}}},
                           {"KHR_materials_anisotropy", {{"anisotropyStrength", 1}}},
                           {"KHR_materials_sheen", Json::object()}}}});
  file.texture(test::tga_picture(2, 2, [](int, int) { return glm::u8vec4(255); }));
  file.texture_at("lost.png");
  const auto scene = scene_of(folder.write("a.gltf", file.gltf()));
  const auto world = build_world(scene);
  const auto notes = notes_of(scene, world);
  for (const char* what :
       {"KHR_materials_clearcoat is ignored", "KHR_materials_anisotropy is ignored",
        "KHR_materials_sheen is ignored", "occlusion map is ignored",
        "picture \"lost.png\" is ignored: there is no such file",
        "is single-sided and is shown from both sides"})
    CHECK_SAYS(notes, what);
  CHECK_SAYS(notes, "object 0 (a.gltf): material \"lacquer\": ");
}

/// A cube from -1 to 1.
Gltf::Part cube(int material = -1) {
  Gltf::Part part;
  for (int i = 0; i < 8; ++i)
    part.positions.emplace_back(i % 2 * 2 - 1, i / 2 % 2 * 2 - 1, i / 4 * 2 - 1);
  for (const auto& [a, b, c, d] : std::vector<std::array<std::uint32_t, 4>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
    for (const auto corner : {a, b, c, a, c, d}) part.indices.push_back(corner);
  part.material = material;
  return part;
}

TEST_CASE("alpha: what is the same everywhere needs no test") {
  const Folder folder;
  const auto material_of = [&](const Json& more, double alpha) {
    Json material = more;
    material["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, alpha};
    return read_material(folder, material);
  };
  CHECK(material_of({{"alphaMode", "BLEND"}}, 1).alpha_mode == AlphaMode::opaque);
  CHECK(material_of({{"alphaMode", "BLEND"}}, 0.5).alpha_mode == AlphaMode::blend);
  CHECK(material_of({{"alphaMode", "MASK"}}, 0.5).alpha_mode == AlphaMode::opaque);
  CHECK(material_of({{"alphaMode", "MASK"}}, 0.4).alpha_mode == AlphaMode::mask);
  CHECK(material_of({{"alphaMode", "MASK"}, {"alphaCutoff", 0.3}}, 0.4).alpha_mode ==
        AlphaMode::opaque);
  CHECK(material_of({{"alphaMode", "OPAQUE"}}, 0.1).alpha_mode == AlphaMode::opaque);
  // A cutoff of 0 leaves everything
  CHECK(material_of({{"alphaMode", "MASK"}, {"alphaCutoff", 0}}, 0).alpha_mode ==
        AlphaMode::opaque);
  CHECK(material_of({{"alphaMode", "BLEND"}}, 0).alpha_mode == AlphaMode::blend);

  // Colours of vertices and pictures of opacity count where they say less than 1
  for (const float alpha : {1.0f, 0.75f}) {
    INFO(alpha);
    const auto expected = alpha < 1 ? AlphaMode::blend : AlphaMode::opaque;
    Gltf file;
    auto part = Gltf::square(1, {0, 0, 0}, file.material({{"alphaMode", "BLEND"}}));
    part.colours.resize(4, {0.5f, 0.25f, 0, 1});
    part.colours[2].a = alpha;
    const auto coloured =
        only_material(build_world(scene_of(folder.write("b.glb", file.add(part).glb()))));
    CHECK(coloured.vertex_colours);
    CHECK(coloured.alpha_mode == expected);
    const auto grey = static_cast<std::uint8_t>(255 * alpha);
    folder.write("opacity.tga", test::tga_picture(2, 2, [&](int i, int) {
                   return glm::u8vec4(glm::u8vec3(i == 0 ? grey : 255), 255);
                 }));
    folder.write("thin.mtl", "newmtl thin\nKd 1 1 1\nillum 1\nmap_d opacity.tga\n");
    const auto thin = build_world(scene_of(folder.write(
        "a.obj",
        "mtllib thin.mtl\nusemtl thin\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")));
    CHECK(only_material(thin).alpha_mode == expected);
    CHECK(bool{thin.maps[0].opacity} == (alpha < 1));
  }
}

TEST_CASE("a closed mesh counts as open where its alpha leaves holes") {
  const Folder folder;
  for (const auto& [mode, alpha, is_closed] :
       std::vector<std::tuple<const char*, double, bool>>{{"OPAQUE", 0.5, true},
                                                          {"BLEND", 1, true},
                                                          {"BLEND", 0.5, false},
                                                          {"MASK", 0.6, true},
                                                          {"MASK", 0.4, false}}) {
    INFO(mode << ", " << alpha);
    Gltf file;
    const int material = file.material(
        {{"alphaMode", mode}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, alpha}}}}});
    const auto world = build_world(scene_of(folder.write("a.glb", file.add(cube(material)).glb())));
    CHECK(world.triangles.size() == 12);
    CHECK(world.object_closed.at(0) == is_closed);
  }
}

TEST_CASE("hostile files are refused in a line, or read as far as they make sense") {
  const Folder folder;
  const auto message = [&](const std::string& name, const std::string& bytes) {
    const auto mesh = folder.write(name, bytes);
    const auto text = input_error_of([&] { build_world(scene_of(mesh)); });
    CHECK(text.find('\n') == std::string::npos);
    return text;
  };
  const auto sound = square_of({{"name", "a"}});

  // Indices and numbers that are not there
  for (const auto& [path, value] :
       std::vector<std::pair<std::string, Json>>{{"/meshes/0/primitives/0/material", 7},
                                                 {"/meshes/0/primitives/0/indices", 99},
                                                 {"/meshes/0/primitives/0/attributes/POSITION", 99},
                                                 {"/accessors/0/count", 4'000'000'000u},
                                                 {"/accessors/3/count", 4'000'000'000u},
                                                 {"/bufferViews/0/byteLength", 4'000'000'000u},
                                                 {"/bufferViews/0/buffer", 12},
                                                 {"/nodes/0/mesh", 44},
                                                 {"/nodes/0/children", Json::array({0})}}) {
    INFO(path);
    auto file = sound;
    file.root[Json::json_pointer(path)] = value;
    CHECK_SAYS(message("a.gltf", file.gltf()), "mesh ");
  }
  // A cycle of nodes
  auto cycle = sound;
  cycle.root["nodes"][0]["children"] = {1};
  cycle.add_node({{"children", {0}}});
  CHECK_SAYS(message("a.gltf", cycle.gltf()), "mesh ");

  // Pictures: damaged, enormous by claim, and text
  const auto with_picture = [&](const std::string& picture) {
    Gltf file;
    const int texture = file.texture(picture);
    file.add(Gltf::square(1, {0, 0, 0},
                          file.material({{"pbrMetallicRoughness",
                                          {{"baseColorTexture", test::texture_info(texture)}}}})));
    return file.glb();
  };
  const auto whole = test::tga_picture(8, 8, [](int, int) { return glm::u8vec4(9); });
  CHECK(message("a.glb", with_picture(whole)).empty());
  CHECK_SAYS(message("a.glb", with_picture(whole.substr(0, 100))), "picture");
  CHECK_SAYS(message("a.glb", with_picture("not a picture at all")), "picture");
  auto large = whole;
  large[13] = large[15] = '\x7f';  // 32520 a side
  CHECK_SAYS(message("a.glb", with_picture(large)), "picture");
  // Texture and image numbers that are not there
  for (const char* path : {"/textures/0/source", "/images/0/bufferView",
                           "/materials/0/pbrMetallicRoughness/baseColorTexture/index"}) {
    INFO(path);
    auto file = sound;
    const int texture = file.texture(whole);
    file.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] =
        test::texture_info(texture);
    file.root[Json::json_pointer(path)] = 1234;
    const auto text = message("a.gltf", file.gltf());
    CHECK((text.empty() || text.find("mesh ") != std::string::npos));
  }
  // Numbers beyond their range are brought back into it
  const auto wild = build_world(
      scene_of(folder.write("a.gltf", square_of({{"pbrMetallicRoughness",
                                                  {{"baseColorFactor", {-1, 1e38, 0.5, 5}},
                                                   {"metallicFactor", -3},
                                                   {"roughnessFactor", 1e30}}},
                                                 {"alphaCutoff", -7}})
                                          .gltf())));
  for (int c = 0; c < 3; ++c) {
    CHECK(std::isfinite(wild.materials.at(0).diffuse[c]));
    CHECK(wild.materials.at(0).diffuse[c] >= 0);
  }
}

}  // namespace
}  // namespace raywave
