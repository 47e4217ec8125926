// SPDX-License-Identifier: Apache-2.0
// raywave view in a window of an X server, driven as by a person.
#include "host/display/side_panel.hpp"
#include "host/scene/scene.hpp"
#include "tests/support/program.hpp"
#include "tests/support/x_server.hpp"

namespace raywave {
namespace {

/// What is on the screen beside the panel.
std::vector<std::uint32_t> picture_of(const test::Screenshot& shot) {
  std::vector<std::uint32_t> pixels;
  for (int y = 0; y < shot.height; ++y)
    for (int x = SidePanel::width_px; x < shot.width; ++x) pixels.push_back(shot.at(x, y) & 255);
  return pixels;
}

/// view in a window as large as the screen, with its panel.
struct Viewed {
  // Its pictures are squares of 640 pixels
  const test::XServer server{SidePanel::width_px + 640, std::max(640, 2 * SidePanel::width_px)};
  const test::Desk desk{};
  const pid_t program = desk.start({"view", desk.file("scene.toml"), "--set",
                                    "hologram.resolution=[256,256]", "-o", desk.file("")});

  Viewed() {
    REQUIRE(server.shows([](const auto& shot) {
      const auto picture = picture_of(shot);
      return *std::max_element(picture.begin(), picture.end()) > 200;
    }));
    server.run("xdotool search --sync --name 'scene.toml' windowfocus");
  }
  void mouse(const std::string& doing, int x, int y) const {
    server.run("xdotool mousemove " + std::to_string(x) + " " + std::to_string(y) + " " + doing);
  }
  bool changes_from(const std::vector<std::uint32_t>& picture) const {
    return server.shows([&](const auto& shot) { return picture_of(shot) != picture; });
  }
  bool has_saved(const std::string& name) const {
    for (int i = 0; i < 100 && !std::filesystem::exists(desk.file(name)); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return std::filesystem::exists(desk.file(name));
  }
  std::string ended() const {
    server.run("xdotool key q");
    const auto outcome = desk.outcome_of(program);
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    return outcome.out;
  }
};

/// False, and said aloud, where windows cannot be tested.
bool can_view() {
  const bool can = test::XServer::has_one() && test::has_program("xdotool");
  if (!can) test::skip("view in a window", "xvfb and xdotool", true);
  return can;
}

}  // namespace

TEST_CASE("view shows a scene, follows keys and mouse, and ends", "[slow]") {
  if (!can_view()) return;
  const Viewed view;
  const auto first = picture_of(view.server.screenshot());
  constexpr int x = SidePanel::width_px + 300;

  SECTION("focus") {
    view.mouse("click --repeat 20 --delay 5 4", x, 200);
    CHECK(view.changes_from(first));
    view.server.run("xdotool key 0");
    CHECK(view.server.shows([&](const auto& shot) { return picture_of(shot) == first; }));
  }
  SECTION("turn, levels, save") {
    view.mouse("mousedown 1 mousemove_relative --sync 60 0 mouseup 1", x, 200);
    CHECK(view.changes_from(first));
    const auto turned = picture_of(view.server.screenshot());
    view.server.run("xdotool key h");
    CHECK(view.changes_from(turned));
    view.server.run("xdotool key s");
    CHECK(view.has_saved("view_0.toml"));
    CHECK(load_scenes(view.desk.file("view_0.toml"))[0].objects[0].rotation_deg.y != 0);
  }
  CHECK_SAYS(view.ended(), "drag: turn the object");
}

TEST_CASE("the panel of view changes what is seen, keeps the mouse, and goes", "[slow]") {
  if (SidePanel::width_px == 0) return test::skip("the panel of view", "libimgui-dev", false);
  if (!can_view()) return;
  const Viewed view;
  const auto first = view.server.screenshot();
  const auto row = [](int number) { return 17 + 23 * number; };  // of fields
  const auto width_of = [&](const std::string& name) {           // of a PNG below 65536 pixels
    const auto bytes = bytes_of(view.desk.file(name));
    return static_cast<unsigned char>(bytes.at(18)) * 256 +
           static_cast<unsigned char>(bytes.at(19));
  };

  view.server.run("xdotool key m");
  CHECK(view.server.shows([&](const auto& shot) {  // the picture is in the middle of it all
    return shot.at(10, 10) == 0 && shot.pixels != first.pixels;
  }));
  view.server.run("xdotool key m");
  CHECK(view.server.shows([&](const auto& shot) { return shot.pixels == first.pixels; }));

  view.mouse("mousedown 1 mousemove_relative --sync 60 0 mouseup 1", 100, row(7) + 12);
  view.mouse("click 1", 17, row(1));
  REQUIRE(view.has_saved("view_0.png"));
  CHECK(width_of("view_0.png") == 640);
  view.mouse("click 1", 17, row(0));
  CHECK(view.changes_from(picture_of(first)));
  const auto doubled = picture_of(view.server.screenshot());
  view.mouse("mousedown 1 mousemove_relative --sync 40 0 mouseup 1", 100, row(5));
  CHECK(view.changes_from(doubled));
  view.mouse("click 1", 17, row(1));
  REQUIRE(view.has_saved("view_1.png"));
  CHECK(width_of("view_1.png") == 1280);
  const auto said = view.ended();
  const auto second = said.substr(said.find("view_1.png"));
  CHECK(said.find("object.0.rotation") > said.find("view_1.png"));
  CHECK_SAYS(second, "view_1.toml", "--set 'object.0.rotation=[");
}

TEST_CASE("view without a desktop says what can be done") {
  const test::Desk desk;
  const auto outcome =
      desk.run({"view", desk.file("scene.toml")}, {"DISPLAY=", "WAYLAND_DISPLAY="});
  CHECK(outcome.code == 3);
  CHECK_SAYS(outcome.err, "no window can be opened", "--record");
  CHECK_SAYS(desk.run({"view", desk.file("scene.toml"), "--record", "x"}).err, "needs -o");
}

TEST_CASE("a script saves scenes that render takes") {
  const test::Desk desk;
  desk.folder().write("steps.toml",
                      "[[step]]\nturn = [0, 30, 0]\nintensity = 0.5\nsave = true\nrepeat = 2\n");
  const auto out = desk.succeed({"view", desk.file("scene.toml"), "--record",
                                 desk.file("steps.toml"), "-o", desk.file("out")})
                       .out;
  CHECK_SAYS(out, "view_00001.png", "view_00001.toml");
  const auto saved = bytes_of(desk.out("view_00001.toml"));
  CHECK_SAYS(saved, "scene.toml as raywave view showed it", "intensity = 0.5", "../square.obj");
  const auto report = desk.succeed({"render", desk.out("view_00001.toml").string(), "-o",
                                    desk.file("again"), "--json", "-"})
                          .out;
  CHECK_SAYS(report, "\"intensity\": 0.5");
  CHECK_SAYS(bytes_of(desk.out("report.json")), "stages_s", "propagate");
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
