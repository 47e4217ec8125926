// SPDX-License-Identifier: Apache-2.0
#include "host/scene/scene.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

using namespace raywave;

namespace {

constexpr const char* hologram =
    "[hologram]\nresolution = [64, 64]\nwavelength = \"520 nm\"\n[[light]]\ntype = \"ambient\"\n";

Scene scene_with(const Folder& folder, const std::string& text) {
  folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  return load_scene(folder.write("scene.toml", hologram + text +
                                                   "[[object]]\nmesh = \"m.obj\"\n"
                                                   "position = [0, 0, 0.1]\n"));
}

Material material_with(const std::string& keys) {
  const Folder folder;
  return scene_with(folder, "[materials.m]\n" + keys + "\n").materials.at(1);
}

}  // namespace

TEST_CASE("a table by wavelength lies on Cauchy's formula, and keeps its ends beyond them") {
  // Between 450 and 650 nm: n = a + b / wavelength^2
  const double b = 4200e-18, a = 1.504;
  const auto cauchy = [&](double wavelength_m) { return a + b / (wavelength_m * wavelength_m); };
  Spectrum ior;
  for (const double wavelength : {450e-9, 520e-9, 650e-9})
    ior.table.emplace_back(wavelength, cauchy(wavelength));
  for (const double wavelength : {450e-9, 470e-9, 520e-9, 600e-9, 650e-9}) {
    CHECK(std::abs(ior.at(wavelength) - cauchy(wavelength)) < 1e-14);
    CHECK(ior.holds(wavelength));
  }
  CHECK(ior.at(400e-9) == ior.at(450e-9));
  CHECK(ior.at(700e-9) == ior.at(650e-9));
  CHECK_FALSE(ior.holds(449e-9));
  CHECK_FALSE(ior.holds(651e-9));
}

TEST_CASE("a colour gives each wavelength its channel") {
  Spectrum colour;
  colour.channels = {0.1, 0.2, 0.3};
  CHECK(colour.at(580e-9) == 0.1);
  CHECK(colour.at(579e-9) == 0.2);
  CHECK(colour.at(490e-9) == 0.2);
  CHECK(colour.at(489e-9) == 0.3);
  CHECK(colour.is_positive());
  CHECK_FALSE(Spectrum(0.0).is_positive());
}

TEST_CASE("mirrors and glass have numbers, colours and tables") {
  const auto m = material_with(
      "reflectivity = [0.2, 0.3, 0.4]\ntransparency = 0.5\n"
      "ior = {\"450 nm\" = 1.53, \"650 nm\" = 1.51}\n"
      "attenuation = 0.8\nattenuation_distance = \"2 mm\"\n");
  CHECK(m.is_specular());
  CHECK(m.reflectivity.at(520e-9) == 0.3);
  CHECK(m.transparency.at(520e-9) == 0.5);
  CHECK(m.ior.at(450e-9) == 1.53);
  CHECK(m.ior.at(520e-9) > 1.51);
  CHECK(m.ior.at(520e-9) < 1.53);
  CHECK(m.attenuation.at(520e-9) == 0.8);
  CHECK(m.attenuation_distance_m == 2e-3);
  CHECK_FALSE(material_with("diffuse = 0.5\n").is_specular());
}

TEST_CASE("what no mirror or glass can be is refused with its line") {
  struct Case {
    const char *keys, *message;
  };
  const Case cases[] = {
      {"reflectivity = 1.1", "reflectivity must be 0 to 1, got 1.1"},
      {"reflectivity = [0, 0.6, 0]\ntransparency = 0.5",
       "transparency must be <= 1 - reflectivity (0.6)"},
      {"ior = 0.9", "ior must be 1 to 100, got 0.9"},
      {"ior = {\"600 nm\" = 1.5, \"650 nm\" = 1.4}",
       "ior must be given on both sides of the wavelength, 520 nm"},
      {"ior = {}", "ior must be given on both sides of the wavelength, 520 nm"},
      {"ior = {\"blue\" = 1.5}", "must be a length such as"},
      {"ior = {\"450 nm\" = 0.5, \"650 nm\" = 1.4}", "must be 1 to 100, got 0.5"},
      {"attenuation = 0", "attenuation must be 1e-06 to 1, got 0"},
      {"attenuation_distance = 0", "attenuation_distance must be"},
  };
  for (const auto& one : cases) {
    const auto said = input_error_of([&] { material_with(one.keys); });
    CHECK_SAYS(said, one.message);
    CHECK_SAYS(said, "scene.toml:");
  }
}

TEST_CASE("light passes eight mirrors unless a scene says otherwise, and becomes what it says") {
  const Folder folder;
  CHECK_FALSE(scene_with(folder, "").trace.depth);
  CHECK_FALSE(scene_with(folder, "[trace]\ndepth = \"auto\"\n").trace.depth);
  CHECK(scene_with(folder, "[trace]\ndepth = 2\n").trace.depth == 2);
  CHECK(scene_with(folder, "").trace.bounces == Bounces::automatic);
  CHECK(scene_with(folder, "[trace]\nbounces = \"paths\"\n").trace.bounces == Bounces::paths);
  CHECK_REFUSED(scene_with(folder, "[trace]\nbounces = \"rays\"\n"),
                "trace: bounces must be \"auto\" or \"points\" or \"paths\", got \"rays\"");
}
