// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Matchers::ContainsSubstring;

TEST_CASE("--strict makes an error of what is not understood, and of nothing else") {
  const Desk desk;
  desk.folder().write("square.obj", "mtllib none.mtl\nusemtl red\n" + square_obj());
  const auto scene = desk.file("scene.toml");
  for (const char* command : {"plan", "render", "quality"}) {
    const bool makes = std::string(command) == "render";
    const auto run = [&](bool strict) {
      std::vector<std::string> words{command, scene};
      if (makes) words.insert(words.end(), {"-o", desk.file("out")});
      if (strict) words.push_back("--strict");
      return desk.run(words);
    };
    const auto refused = run(true);
    CHECK(refused.code == 1);
    CHECK(refused.out.empty());
    for (const char* note : {"library \"none.mtl\" is not there", "material \"red\" is in no"})
      CHECK_THAT(refused.err, ContainsSubstring(note));
    if (std::string(command) != "quality") CHECK(run(false).code == 0);  // it leaves files
  }
  desk.folder().write("square.obj", square_obj());
  desk.succeed({"plan", scene, "--strict"});
}

}  // namespace
}  // namespace raywave
