// SPDX-License-Identifier: Apache-2.0
// Scenes of several lasers: hologram.wavelength as a list, and [colour].

#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

using namespace raywave;

namespace {

std::string text_of(const std::string& wavelength, const std::string& more = "") {
  return "[hologram]\nresolution = [64, 64]\nwavelength = " + wavelength + "\n" + more +
         "[[light]]\ntype = \"ambient\"\n[[object]]\nmesh = \"m.obj\"\nposition = [0, 0, 0.1]\n";
}

const std::string three = R"(["638 nm", "520 nm", "450 nm"])";

struct Files {
  Folder folder;
  std::filesystem::path with(const std::string& text) {
    folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    return folder.write("scene.toml", text);
  }
  std::string refusal(const std::string& text) {
    return input_error_of([&] { load_scenes(with(text)); });
  }
};

}  // namespace

TEST_CASE("a list of wavelengths makes a scene for each laser, which differ in it alone") {
  Files files;
  const auto scenes = load_scenes(files.with(text_of(
      three, "[materials.g]\ntransparency = 1\nior = {\"450 nm\" = 1.53, \"650 nm\" = 1.51}\n")));
  REQUIRE(scenes.size() == 3);
  const double wavelengths_m[] = {638e-9, 520e-9, 450e-9};
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(scenes[i].hologram.wavelength_m == Catch::Approx(wavelengths_m[i]));
    REQUIRE(scenes[i].colour);
    CHECK(scenes[i].colour->laser == i);
    CHECK(!scenes[i].colour->only);
    CHECK(scenes[i].colour->longest_m() == scenes[0].hologram.wavelength_m);
    CHECK(scenes[i].digest == scenes[0].digest);
    CHECK(scenes[i].channels().count() == 3);
  }
  // A laser cannot take light away: blue of sRGB is beyond what these mix
  CHECK(scenes[0].colour->light_of({0, 0, 1}) == 0);
  CHECK(scenes[2].colour->light_of({0, 0, 1}) > 0.9);
  CHECK(scenes[1].colour->light_of(glm::dvec3(0.5)) == Catch::Approx(0.5));
}

TEST_CASE("colour.only takes one laser of the list") {
  Files files;
  const auto file = files.with(text_of(three));
  const auto scene = load_scene(file, {"colour.only=520 nm"});
  CHECK(scene.hologram.wavelength_m == Catch::Approx(520e-9));
  REQUIRE(scene.colour);
  CHECK(scene.colour->laser == 1);
  CHECK(load_scenes(file, {"colour.only=450 nm"}).size() == 1);
  CHECK(load_scenes(file, {"colour.only=all"}).size() == 3);
  CHECK(load_scenes(files.with(text_of("\"520 nm\""))).size() == 1);
  CHECK(!load_scene(files.with(text_of("\"520 nm\""))).colour);
}

TEST_CASE("LUTs are those of each laser's wavelength") {
  Files files;
  std::string ramp, steep;
  for (int level = 0; level < 256; ++level) {
    ramp += std::to_string(level / 256.0) + "\n";
    steep += std::to_string(level / 200.0) + "\n";
  }
  files.folder.write("red.csv", ramp);
  files.folder.write("green.csv", steep);
  files.folder.write("blue.csv", ramp);
  const auto scenes = load_scenes(
      files.with(text_of(three,
                         "[slm]\nlut = {\"638 nm\" = \"red.csv\", \"520 nm\" = \"green.csv\", "
                         "\"450 nm\" = \"blue.csv\"}\n")));
  REQUIRE(scenes.size() == 3);
  CHECK(scenes[0].slm.lut == scenes[2].slm.lut);
  CHECK(scenes[0].slm.lut != scenes[1].slm.lut);
}

TEST_CASE("a list may have one laser, which is one wavelength, two, or up to eight") {
  Files files;
  const auto with = [&](const char* list) { return load_scenes(files.with(text_of(list))); };
  CHECK(!with(R"(["638 nm"])").at(0).colour);
  const auto two = with(R"(["520 nm", "638 nm"])");
  REQUIRE(two.size() == 2);
  CHECK(two[1].hologram.wavelength_m == Catch::Approx(638e-9));
  CHECK(two[0].colour->longest_m() == two[1].hologram.wavelength_m);
  for (const auto& scene : two) {
    CHECK(scene.colour->light_of(glm::dvec3(0.5)) == Catch::Approx(0.5));
    CHECK(scene.colour->light_of({0, 0, 1}) == 0);  // neither shows blue
  }
  CHECK(with(R"(["450 nm", "488 nm", "520 nm", "532 nm", "561 nm", "589 nm", "638 nm", "660 nm"])")
            .size() == 8);
}

TEST_CASE("wrong lists of wavelengths say what would be right") {
  Files files;
  const std::pair<std::string, const char*> wrong[] = {
      {text_of("[]"), "scene.toml:3: hologram: wavelength must be a length, or 1 to 8 of them"},
      {text_of(R"(["450 nm", "488 nm", "520 nm", "532 nm", "561 nm", "589 nm",
                                        "638 nm", "660 nm", "473 nm"])"),
       "1 to 8 of them"},
      {text_of(R"(["638 nm", "520 nm", "450 nm", "520 nm"])"),
       "wavelength[3] must be another colour than 520 nm"},
      {text_of(R"(["850 nm", "520 nm", "450 nm"])"), "780 nm"},
      {text_of(R"(["638 nm", "300 nm"])"), "380 nm"},
      {text_of(R"(["638 nm", "600 nm", "580 nm"])"), "lasers must mix white"},
      {text_of(R"(["638 nm", "620 nm"])"), "has no light of 638 nm"},
      {text_of("\"520 nm\"", "[colour]\nwhite = \"D65\"\n"), "colour: is for several lasers"},
      {text_of(three, "[colour]\nwhite = \"D50\"\n"), "white must be \"D65\""},
      {text_of(three, "[colour]\nonly = \"532 nm\"\n"), "\"638 nm\" or \"520 nm\" or \"450 nm\""},
      {text_of(three, "[colour]\npower = [1, 2]\n"), "power must be a number for each of 3 lasers"},
      {text_of(three, "[colour]\nduty = [0.5, 0.4, 0.3]\n"),
       "duty must be shares of the time that add up to 1 or less"},
  };
  for (const auto& [text, says] : wrong) CHECK_SAYS(files.refusal(text), says);
}

TEST_CASE(
    "grey levels to a turn that several lasers share get a note, those of one or a table not") {
  Files files;
  const auto notes = [&](const std::string& wavelength, const std::string& value) {
    const auto text = text_of(wavelength, "[slm]\nlevels_per_turn = " + value + "\n");
    return load_scenes(files.with(text)).front().notes;
  };
  const auto shared = notes(three, "200");
  REQUIRE(shared.size() == 1);
  CHECK_SAYS(shared[0], "a turn of red takes more grey levels than one of blue");
  CHECK(notes(three, R"({"638 nm" = 254, "520 nm" = 206, "450 nm" = 168})").empty());
  CHECK(notes(R"("638 nm")", "200").empty());
}
