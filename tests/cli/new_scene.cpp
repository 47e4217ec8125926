// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Matchers::ContainsSubstring;

TEST_CASE("new scenes plan without a warning for every mesh of data/, before SLMs of three kinds",
          "[slow]") {
  const Desk desk;
  desk.folder().write(
      "bench.toml",
      "[hologram]\nresolution = [1920, 1200]\npitch = \"8 um\"\nwavelength = "
      "\"532 nm\"\n[slm]  # of the bench\nlevels_per_turn = 250\n[viewer]\ndistance "
      "= \"50 cm\"\n");
  desk.folder().write("stopped.toml", "[slm]\nstop = [0.5, 0.5]\n");
  for (const auto& entry : std::filesystem::directory_iterator(RAYWAVE_DATA_DIR)) {
    const auto mesh = entry.path();
    if (mesh.extension() != ".ply" && mesh.extension() != ".glb") continue;
    for (const char* slm : {"", "bench.toml", "stopped.toml"}) {
      INFO(mesh << " before " << slm);
      const auto scene = desk.file("new.toml");
      std::filesystem::remove(scene);
      std::vector<std::string> words{"new", mesh.string(), "-o", scene};
      if (*slm) words.insert(words.end(), {"--slm", desk.file(slm)});
      const auto made = desk.succeed(words);
      CHECK(made.err.empty());
      const auto plan = desk.succeed({"plan", scene, "--json", "--strict"});
      const auto json = nlohmann::json::parse(plan.out);
      CHECK(json.at("warnings").empty());
      CHECK_THAT(bytes_of(scene),
                 ContainsSubstring("shift = [") || ContainsSubstring("stop = [0.5, 0.5]"));
    }
  }
}

TEST_CASE("a new scene behind an eyepiece stands at dioptres, where the eye sees it") {
  const Desk desk;
  desk.folder().write("near.toml",
                      "[hologram]\nresolution = [640, 400]\npitch = \"8 um\"\nwavelength = "
                      "\"532 nm\"\n[viewer]\neyepiece = \"50 mm\"\npupil = \"1.5 mm\"\n");
  const auto made = desk.succeed({"new", desk.file("square.obj"), "-o", desk.file("new.toml"),
                                  "--slm", desk.file("near.toml")});
  CHECK_THAT(made.err, !ContainsSubstring("beyond infinity") && !ContainsSubstring("missing"));
  CHECK_THAT(bytes_of(desk.file("new.toml")), ContainsSubstring("position = [0, 0, \"1.5 D\"]"));
  const auto plan = desk.run({"plan", desk.file("new.toml")});
  CHECK_THAT(plan.out, ContainsSubstring("eyepiece  shows it at 1.5 D"));
}

TEST_CASE(
    "a new scene takes the SLM's sections with files where they are, and overwrites nothing") {
  const Desk desk;
  std::filesystem::create_directory(desk.folder() / "lab");
  desk.folder().write("lab/lut.txt", "");
  desk.folder().write("lab/slm.toml",
                      "[[object]]\nmesh = \"other.obj\"\n[slm]\nlevels_per_turn = 240\n# lut = "
                      "\"lut.txt\"\n[sampling]\nframes = 7\n");
  const std::vector<std::string> words{"new",   desk.file("square.obj"),
                                       "-o",    desk.file("new.toml"),
                                       "--slm", desk.file("lab/slm.toml")};
  desk.succeed(words);
  const auto text = bytes_of(desk.file("new.toml"));
  CHECK_THAT(text, ContainsSubstring("levels_per_turn = 240") &&
                       ContainsSubstring("\"lab/lut.txt\"") && !ContainsSubstring("other.obj") &&
                       !ContainsSubstring("frames = 7"));
  CHECK_THAT(text, ContainsSubstring("mesh = \"square.obj\""));
  check_refused(desk.run(words), 2, "is there already, and is not overwritten");
  CHECK(bytes_of(desk.file("new.toml")) == text);
  check_refused(desk.run({"new", desk.file("none.obj"), "-o", desk.file("other.toml")}), 2,
                "none.obj");
  CHECK_FALSE(std::filesystem::exists(desk.file("other.toml")));
}

TEST_CASE("keys under no section of --slm, which would be lost, are refused with their line") {
  const Desk desk;
  desk.folder().write("keys.toml", "# panel\n\npitch = \"8 um\"\n[slm]\nbits = 8\n");
  desk.folder().write("other.toml", "[trace]\nshadows = false\n");
  const auto made = [&](const char* slm) {
    return desk.run(
        {"new", desk.file("square.obj"), "-o", desk.file("new.toml"), "--slm", desk.file(slm)});
  };
  check_refused(made("keys.toml"), 2, "keys.toml:3: stands under no section");
  check_refused(made("other.toml"), 2, "other.toml: has nothing for a new scene");
  desk.folder().write("metres.toml", "[hologram]\npitch = 8e-3\n");
  check_refused(made("metres.toml"), 2, "metres.toml: hologram: pitch 8 mm shows meshes no nearer");
  desk.folder().write("kind.toml", "[slm]\nkind = \"phase\"\n");
  check_refused(made("kind.toml"), 2, "kind.toml: slm: unknown key \"kind\"");
  CHECK_FALSE(std::filesystem::exists(desk.file("new.toml")));
  check_refused(desk.run({"new", desk.file("kind.toml"), "-o", desk.file("of_scene.toml")}), 2,
                "is a scene; new makes one for a mesh");
  check_refused(
      desk.run({"reconstruct", desk.file("kind.toml"), "-z", "10mm", "-o", desk.file("out")}), 2,
      "is a scene; raywave render makes its hologram");
}

}  // namespace
}  // namespace raywave
