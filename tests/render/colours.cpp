// SPDX-License-Identifier: Apache-2.0
// Scenes of three lasers: their fields, their colours and their brightness (docs/colour.md).
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "host/plan/make_plan.hpp"
#include "host/render.hpp"
#include "host/trace/samples.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

const std::string hologram = R"([hologram]
resolution = [96, 80]
pitch      = "4 um"
wavelength = ["638 nm", "520 nm", "450 nm"]
[sampling]
pitch = "25 um"
[[light]]
type = "ambient"
)";

/// A card that glows in a colour, 0.6 mm wide, or several side by side.
std::string cards(const std::vector<glm::dvec3>& colours) {
  std::string text;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const auto& c = colours[i];
    const auto name = std::to_string(i);
    text +=
        "[materials.m" + name + "]\ndiffuse = 0\nambient = [" + std::to_string(c.r) + ", " +
        std::to_string(c.g) + ", " + std::to_string(c.b) + "]\n[[object]]\nmesh = \"card.obj\"\n" +
        "width = \"" + std::to_string(0.6 / static_cast<double>(colours.size())) +
        " mm\"\nmaterial = \"m" + name + "\"\nposition = [\"" +
        std::to_string(0.6 / static_cast<double>(colours.size()) *
                       (static_cast<double>(i) - (static_cast<double>(colours.size()) - 1) / 2)) +
        " mm\", 0, \"20 mm\"]\n";
  }
  return text;
}

std::filesystem::path scene_file(const Folder& folder, const std::string& text) {
  test::ObjText obj;
  obj.quad({-0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}, {0.5, -0.5, 0});
  folder.write("card.obj", obj.text());
  return folder.write("scene.toml", hologram + text);
}

const std::string lit_teapot =  // highlights, shadows, three colours
    "[trace]\nshadows = true\n[[light]]\ndirection = [0.3, -0.2, 1]\n"
    "[materials.ball]\nambient = [0.1, 0.05, 0.02]\ndiffuse = [0.2, 0.6, 0.9]\nspecular = [0.8, "
    "0.7, "
    "0.3]\nshininess = 20\n[[object]]\nmesh = \"ball.obj\"\nwidth = \"0.4 mm\"\n"
    "position = [0, 0, \"19.5 mm\"]\nmaterial = \"ball\"\n";

TEST_CASE("each laser's hologram is bit-equal to that of its wavelength rendered alone") {
  const Folder folder;
  folder.write("ball.obj", test::ball_obj(24, 12));
  const auto file =
      scene_file(folder, lit_teapot + cards({{0.9, 0.2, 0.1}, {0.1, 0.8, 0.3}, {0.2, 0.3, 0.9}}));
  const std::vector<std::string> set{"slm.encoding=phase", "sampling.frames=2"};
  const auto scenes = load_colours(file, set);
  const auto world = build_world(scenes[0]);
  for (const auto& device : test::all_devices()) {
    const auto all = render_colours(device, scenes, world);
    REQUIRE(all.lasers.size() == 3);
    for (const auto* only : {"638 nm", "520 nm", "450 nm"}) {
      CAPTURE(only);
      auto with = set;
      with.push_back(std::string("colour.only=") + only);
      const auto alone = render(device, load_scene(file, with));
      const auto& together = all.lasers[only[0] == '6' ? 0 : only[0] == '5' ? 1 : 2];
      CHECK(alone.plan.wavelength_m == together.plan.wavelength_m);
      CHECK(alone.samples == together.samples);
      CHECK(alone.field.samples == together.field.samples);
      CHECK(alone.levels == together.levels);
    }
  }
}

TEST_CASE("lasers share samples: the same places, phases and visibility") {
  const Folder folder;
  folder.write("ball.obj", test::ball_obj(24, 12));
  const auto scenes =
      load_colours(scene_file(folder, lit_teapot + cards({{0.9, 0.2, 0.1}, {0.1, 0.8, 0.3}})));
  const auto world = build_world(scenes[0]);
  for (const auto& device : test::all_devices()) {
    std::vector<device::Sample> first;
    std::vector<std::uint32_t> first_masks;
    for (const auto& scene : scenes) {
      const auto plan = make_plan(scene, world);
      const DeviceScene arrays(device, world, plan);
      const SampleTable table(device, plan, arrays);
      auto samples = table.samples.read();
      samples.resize(static_cast<std::size_t>(table.count));
      auto masks = table.visibility_masks.read();
      masks.resize(samples.size() * table.visibility_words());
      if (first.empty()) {
        REQUIRE(samples.size() > 300);
        first = samples;
        first_masks = masks;
        continue;
      }
      REQUIRE(samples.size() == first.size());
      CHECK(masks == first_masks);
      int differing = 0, coloured = 0;
      for (std::size_t i = 0; i < samples.size(); ++i) {
        const auto &a = samples[i], &b = first[i];
        differing += a.x != b.x || a.y != b.y || a.z != b.z || a.nx != b.nx || a.ny != b.ny ||
                     a.nz != b.nz || a.weight != b.weight || a.key != b.key ||
                     a.hidden != b.hidden || a.shininess != b.shininess;
        coloured += a.radiance != b.radiance;
      }
      CHECK(differing == 0);
      CHECK(coloured > 300);
    }
  }
}

TEST_CASE("a white card is D65, and colours are what the lasers mix of them") {
  const Folder folder;
  const std::vector<glm::dvec3> colours{{0.8, 0.8, 0.8}, {0.8, 0, 0},     {0, 0.8, 0},
                                        {0, 0, 0.8},     {0.3, 0.6, 0.1}, {0.05, 0.2, 0.7}};
  for (const auto& device : test::all_devices()) {
    std::array<double, 3> of_white{};
    for (const auto& colour : colours) {
      CAPTURE(colour.r, colour.g, colour.b);
      const auto scenes = load_colours(scene_file(folder, cards({colour})), {"slm.encoding=phase"});
      const auto lasers = scenes[0].colour->lasers;
      const auto result = render_colours(device, scenes, build_world(scenes[0]));
      if (colour == colours[0]) {
        // Mixed by the lasers at the powers that the report states, phases alone
        glm::dvec3 xyz(0), of_fields(0);
        double sum = 0;
        for (std::size_t i = 0; i < 3; ++i) {
          of_white[i] = result.energies[i];
          xyz += result.powers[i] * xyz_of_wavelength(lasers.wavelengths_m[i]);
          of_fields += result.energies[i] * lasers.white_powers[i] *
                       xyz_of_wavelength(lasers.wavelengths_m[i]);
          sum += result.powers[i];
        }
        CHECK(sum == Catch::Approx(1));
        CHECK(glm::length(chromaticity_of(xyz) - glm::dvec2(0.3127, 0.3290)) < 0.003);
        CHECK(glm::length(chromaticity_of(of_fields) - glm::dvec2(0.3127, 0.3290)) < 0.003);
        continue;
      }
      const auto light = glm::max(lasers.lasers_from_rgb * colour, 0.0);
      for (std::size_t i = 0; i < 3; ++i)
        CHECK(result.energies[i] / of_white[i] * 0.8 ==
              Catch::Approx(light[static_cast<int>(i)]).margin(2e-5));
    }
  }
}

TEST_CASE("encodings that show amplitudes have one scale for all lasers") {
  const Folder folder;
  const auto scenes =
      load_colours(scene_file(folder, cards({{0.05, 0.2, 0.7}})), {"slm.encoding=double-phase"});
  const auto world = build_world(scenes[0]);
  for (const auto& device : test::all_devices()) {
    const auto result = render_colours(device, scenes, world);
    const double brightest = result.lasers[2].clip;
    REQUIRE(brightest > 0);
    for (std::size_t i = 0; i < 3; ++i) {
      CAPTURE(i);
      const auto& laser = result.lasers[i];
      CHECK(laser.clip == Catch::Approx(brightest));
      CHECK(result.powers[i] == Catch::Approx(scenes[0].colour->lasers.white_powers[i]));
      // As a render alone that is told the scale
      RenderOptions how;
      how.clip = brightest;
      const auto alone = render(device, scenes[i], world, how);
      std::size_t differing = 0;
      for (std::size_t at = 0; at < alone.levels[0].size(); ++at)
        differing += std::abs(int{alone.levels[0][at]} - int{laser.levels[0][at]}) % 255 > 1;
      CHECK(differing == 0);
    }
  }
}

}  // namespace
}  // namespace raywave
