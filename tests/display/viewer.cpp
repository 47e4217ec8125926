// SPDX-License-Identifier: Apache-2.0
// raywave view in a window of an X server, driven as by a person.
#include "tests/support/program.hpp"
#include "tests/support/x_server.hpp"

namespace raywave {
namespace {

/// Brightness of the brightest pixel of a screen.
std::uint32_t brightest(const test::Screenshot& shot) {
  std::uint32_t most = 0;
  for (const auto pixel : shot.pixels) most = std::max(most, pixel & 255);
  return most;
}

}  // namespace

TEST_CASE("view shows a scene, follows keys and mouse, and ends", "[slow]") {
  if (!test::XServer::has_one() || !test::has_program("xdotool"))
    return test::skip("view in a window", "xvfb and xdotool", true);
  const test::XServer server(800, 600);
  const test::Desk desk;
  const auto program = desk.start({"view", desk.file("scene.toml"), "--set",
                                   "hologram.resolution=[256,256]", "-o", desk.file("")});
  const auto differs_from = [&](const test::Screenshot& before) {
    return server.shows([&](const auto& shot) { return shot.pixels != before.pixels; });
  };
  REQUIRE(server.shows([](const auto& shot) { return brightest(shot) > 200; }));
  server.run("xdotool search --sync --name 'scene.toml' windowfocus");
  const auto first = server.screenshot();

  SECTION("focus") {
    server.run("xdotool mousemove 300 200 click --repeat 20 --delay 5 4");
    CHECK(differs_from(first));
    server.run("xdotool key 0");
    CHECK(server.shows([&](const auto& shot) { return shot.pixels == first.pixels; }));
  }
  SECTION("turn, levels, save") {
    server.run("xdotool mousemove 300 200 mousedown 1 mousemove_relative --sync 60 0 mouseup 1");
    CHECK(differs_from(first));
    const auto turned = server.screenshot();
    server.run("xdotool key h");
    CHECK(differs_from(turned));
    server.run("xdotool key s");
    for (int i = 0; i < 100 && !std::filesystem::exists(desk.file("view_0.png")); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    CHECK(std::filesystem::exists(desk.file("view_0.png")));
  }
  server.run("xdotool key q");
  const auto outcome = desk.outcome_of(program);
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK_SAYS(outcome.out, "drag: turn the object");
}

TEST_CASE("view without a desktop says what can be done") {
  const test::Desk desk;
  const auto outcome =
      desk.run({"view", desk.file("scene.toml")}, {"DISPLAY=", "WAYLAND_DISPLAY="});
  CHECK(outcome.code == 3);
  CHECK_SAYS(outcome.err, "no window can be opened", "--record");
  CHECK_SAYS(desk.run({"view", desk.file("scene.toml"), "--record", "x"}).err, "needs -o");
}

TEST_CASE("pictures of a script name what is new to say, with other numbers once") {
  const test::Desk desk;
  desk.folder().write("steps.toml", "[[step]]\n[[step]]\nmove = [\"50 mm\", 0, 0]\nrepeat = 2\n");
  const auto err = desk.run({"view", desk.file("scene.toml"), "--record", desk.file("steps.toml"),
                             "-o", desk.file("out")})
                       .err;
  CHECK_SAYS(err, "view_00000.png: sampling.pitch", "view_00001.png: the hologram is dark: no ray");
  CHECK_SAYS(err, "view_00001.png: the scene begins 49.9 mm beside");
  CHECK(err.find("view_00002.png") == err.npos);
}

}  // namespace raywave
