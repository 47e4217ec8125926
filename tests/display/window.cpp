// SPDX-License-Identifier: Apache-2.0
// Windows on X servers without hardware: no SLM has shown them, and no refresh is a real one.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <random>
#include <tuple>

#include "host/common/cache.hpp"
#include "host/display/show.hpp"
#include "host/scene/image.hpp"
#include "tests/support/program.hpp"
#include "tests/support/x_server.hpp"

namespace raywave {
namespace {

using test::XServer;

LevelFrame noise(glm::ivec2 size_px, int channels, unsigned seed) {
  LevelFrame frame{size_px, channels, {}, "noise", ""};
  std::mt19937 random(seed);
  for (int i = 0; i < channels * size_px.x * size_px.y; ++i)
    frame.levels.push_back(static_cast<std::uint8_t>(random()));
  return frame;
}

/// Pixels at this place of the screen that are not as the frame has them.
int differences(const test::Screenshot& screen, const LevelFrame& frame, glm::ivec2 place) {
  int wrong = 0;
  for (int y = 0; y < frame.size_px.y; ++y)
    for (int x = 0; x < frame.size_px.x; ++x) {
      const auto i = static_cast<std::size_t>(y * frame.size_px.x + x);
      const std::uint32_t grey = frame.levels[frame.channels == 1 ? i : 0] * 0x010101u;
      const std::uint32_t colour =
          frame.channels == 1
              ? grey
              : static_cast<std::uint32_t>(frame.levels[3 * i] << 16 |
                                           frame.levels[3 * i + 1] << 8 | frame.levels[3 * i + 2]);
      wrong += (screen.at(place.x + x, place.y + y) & 0xffffff) != colour;
    }
  return wrong;
}

/// False, and said aloud, where windows cannot be tested.
bool can_test(bool with_two_outputs = false) {
#ifndef RAYWAVE_SDL2
  test::skip("windows", "libsdl2-dev", true);
  return false;
#endif
  if (!XServer::has_one()) test::skip("windows", "xvfb", true);
  if (with_two_outputs && !XServer::has_two())
    test::skip("windows on two outputs", "xserver-xorg-video-dummy, x11-apps and x11-xserver-utils",
               false);
  return XServer::has_one() && (!with_two_outputs || XServer::has_two());
}

TEST_CASE("the X server has each byte of a frame on its screen, at three sizes") {
  if (!can_test()) return;
  for (const auto size : {glm::ivec2(640, 480), {322, 202}, {1920, 1080}}) {
    for (const std::string driver : {"", "software"}) {
      const test::Environment by("SDL_RENDER_DRIVER", driver);
      const XServer server(size.x, size.y);
      const auto display = window_display();
      const auto output = display->open({"", size, 0, true});
      CAPTURE(size.x, size.y, driver);
      CHECK(output.size_px == size);
      std::uint64_t refresh = 0;
      for (const int channels : {1, 3}) {
        const auto frame = noise(size, channels, static_cast<unsigned>(refresh));
        display->flip(frame, refresh);
        refresh = display->event().refresh + 1;
        CHECK(server.shows([&](const auto& shot) { return differences(shot, frame, {}) == 0; }));
      }
      CHECK(display->describe()["proof"]["read_back"] == 2);
      CHECK(display->describe()["proof"]["swaps_returned"] == 2);
      display->close();
    }
  }
}

TEST_CASE("of two outputs the one that is named shows frames, and the other stays as it was") {
  if (!can_test(true)) return;
  const XServer server;
  if (!server.is_there()) return test::skip("windows on two outputs", "Xorg that starts", false);
  const auto display = window_display();
  const auto before = server.screenshot();
  REQUIRE(display->list().size() == 2);
  for (const auto& [name, size, place] :
       {std::tuple("DUMMY1", glm::ivec2(800, 600), glm::ivec2(640, 0)),
        {"DUMMY0", {640, 480}, {0, 0}}}) {
    CAPTURE(name);
    CHECK(display->open({name, size, 60, false}).place_px == place);
    const auto frame = noise(size, 1, 7);
    display->flip(frame, 0);
    display->event();
    CHECK(server.shows([&, size = size, place = place](const auto& shot) {
      auto rest = shot;
      for (int y = 0; y < size.y; ++y)
        for (int x = 0; x < size.x; ++x) {
          const auto i = static_cast<std::size_t>((place.y + y) * shot.width + place.x + x);
          rest.pixels[i] = before.pixels[i];
        }
      return differences(shot, frame, place) == 0 && rest.pixels == before.pixels;
    }));
    display->close();
    CHECK(server.shows([&](const auto& shot) { return shot.pixels == before.pixels; }));
  }
  // What does not fit is refused with what mends it
  const auto refusal = [&](const WantedOutput& wanted) {
    return input_error_of([&] { display->open(wanted); });
  };
  CHECK_SAYS(refusal({"DUMMY1", {640, 480}, 0, false}), "is 800 x 600 pixels",
             "the frames are 640 x 480", "xrandr --output DUMMY1 --mode 640x480");
  CHECK_SAYS(refusal({"DUMMY1", {800, 600}, 85, false}), "shows 60 ", "85", "--rate 85");
  CHECK_SAYS(refusal({"", {800, 600}, 0, false}), "one of several", "DUMMY0, 640 x 480",
             "DUMMY1, 800 x 600");
}

/// Frames in frames.raw with a report beside them, in which the SLM is `rate_hz` fast.
void write_stream(const test::Desk& desk, glm::ivec2 size, int frames, double rate_hz) {
  std::filesystem::create_directory(desk.file("moving"));
  std::string all;
  for (int i = 0; i < frames; ++i) {
    const auto levels = noise(size, 1, static_cast<unsigned>(i)).levels;
    all.append(levels.begin(), levels.end());
  }
  desk.folder().write("moving/frames.raw", all);
  desk.folder().write(
      "moving/report.json",
      Json{{"scene", {{"slm", {{"rate_per_s", rate_hz}}}}},
           {"animation",
            {{"files", "frames.raw"}, {"shape", {frames, size.y, size.x}}, {"slm_rate", rate_hz}}}}
          .dump());
}

TEST_CASE("600 frames: each refresh is shown, repeated or missed, and each flip has its line",
          "[slow]") {
  if (!can_test()) return;
  const XServer server(320, 200);
  const test::Desk desk;
  write_stream(desk, {320, 200}, 100, 200);
  const auto outcome = desk.succeed({"show", desk.file("moving"), "--loops", "6", "--read-back",
                                     "--events", "-", "--json", desk.file("shown.json")});
  const auto report = Json::parse(bytes_of(desk.file("shown.json")));
  CHECK(report["shown"] == 600);
  CHECK(report["rate_hz"] == 200);
  CHECK(report["display"]["proof"]["read_back"] == 600);
  const auto sum =
      report["shown"].get<int>() + report["repeated"].get<int>() + report["missed"].get<int>();
  CHECK(sum == report["refreshes"]);
  CHECK(report["latency_s"]["median"] <= report["latency_s"]["p99"]);
  std::istringstream lines(outcome.out);
  int flips = 0, missed = 0, last = -1;
  double first_s = 0, last_s = 0;
  for (std::string line; std::getline(lines, line); ++flips) {
    const auto flip = Json::parse(line);
    CHECK(flip["flip"] == flips);
    CHECK(flip["frame"] == "frames.raw:" + std::to_string(flips % 100));
    CHECK(flip["refresh"].get<int>() > last);
    last = flip["refresh"];
    missed += flip["missed"].get<int>();
    last_s = flip["time_s"];
    if (flips == 0) first_s = last_s;
  }
  CHECK(flips == 600);
  CHECK(last + 1 == report["refreshes"]);
  CHECK(missed == report["missed"]);
  CHECK(std::abs((last_s - first_s) * 200 - last) < 1);  // refreshes are of the clock here
}

TEST_CASE("Ctrl-C ends the show with its report, and the screen is as before", "[slow]") {
  if (!can_test()) return;
  const XServer server(320, 200);
  const auto before = server.screenshot();
  const test::Desk desk;
  const auto frame = noise({320, 200}, 1, 0);
  for (const bool is_still : {false, true}) {
    std::filesystem::remove_all(desk.file("moving"));
    write_stream(desk, {320, 200}, is_still ? 1 : 50, 60);
    const auto program =
        desk.start({"show", desk.file("moving"), "--json", "--rate", is_still ? "0.1" : "60"});
    CHECK(server.shows([&](const auto& shot) {
      return is_still ? differences(shot, frame, {}) == 0
                      : std::count(shot.pixels.begin(), shot.pixels.end(), 0u) < 1000;
    }));
    kill(program, SIGINT);
    const double asked_s = now_s();
    const auto outcome = desk.outcome_of(program);
    CHECK(now_s() - asked_s < 6);  // a picture stays ten seconds
    CAPTURE(outcome.err, is_still);
    CHECK(outcome.code == 0);
    CHECK(Json::parse(outcome.out)["shown"] >= 1);
    CHECK(server.shows([&](const auto& shot) { return shot.pixels == before.pixels; }));
  }
}

TEST_CASE("pictures, packed pictures and standard input are shown as they are", "[slow]") {
  if (!can_test()) return;
  const XServer server(64, 48);
  const test::Desk desk;
  const auto shows = [&](const std::string& what, const LevelFrame& frame) {
    CAPTURE(what);
    const auto program = desk.start({"show", what, "--backend", "window", "--output", "screen"});
    CHECK(server.shows([&](const auto& shot) { return differences(shot, frame, {}) == 0; }));
    kill(program, SIGTERM);
    CHECK(desk.outcome_of(program).code == 0);
  };
  const auto grey = noise({64, 48}, 1, 1), packed = noise({64, 48}, 3, 2);
  save_picture(desk.file("grey.png"), 64, 48, grey.levels);
  save_picture(desk.file("grey.tif"), 64, 48, grey.levels);
  save_picture(desk.file("packed.png"), 64, 48, packed.levels);
  shows(desk.file("grey.png"), grey);
  shows(desk.file("grey.tif"), grey);
  shows(desk.file("packed.png"), packed);
  desk.folder().write("raw", std::string(grey.levels.begin(), grey.levels.end()) +
                                 std::string(grey.levels.begin(), grey.levels.end()));
  const auto outcome = desk.shell("$RAYWAVE show - --size 64x48 --events - <raw");
  CHECK(outcome.code == 0);
  CHECK(std::count(outcome.out.begin(), outcome.out.end(), '\n') == 2);
  test::check_refused(desk.shell("head -c 4000 raw | $RAYWAVE show - --size 64x48 --quiet"), 2,
                      "ends within a frame of 64 x 48");
  CHECK_SAYS(desk.run({"show", "--list"}).out, "screen, 64 x 48");
}

TEST_CASE("lines of flips arrive by UDP, at a serial port and in a file, and nobody has to listen",
          "[slow]") {
  if (!can_test()) return;
  const XServer server(64, 48);
  const test::Desk desk;
  write_stream(desk, {64, 48}, 5, 60);
  const auto show = [&](const std::string& where) {
    const auto outcome =
        desk.run({"show", desk.file("moving"), "--loops", "2", "--quiet", "--events", where});
    INFO(where << ": " << outcome.err);
    CHECK(outcome.code == 0);
  };
  const auto receiver = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  REQUIRE(bind(receiver, reinterpret_cast<sockaddr*>(&address), size) == 0);
  REQUIRE(getsockname(receiver, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  const auto udp = "udp:127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  show(udp);
  std::array<char, 1000> bytes{};
  for (int i = 0; i < 10; ++i) {
    const auto got = recv(receiver, bytes.data(), bytes.size(), MSG_DONTWAIT);
    REQUIRE(got > 0);
    CHECK(Json::parse(std::string(bytes.data(), static_cast<std::size_t>(got)))["flip"] == i);
  }
  close(receiver);
  show(udp);

  const int port = posix_openpt(O_RDWR | O_NOCTTY);
  REQUIRE((port >= 0 && grantpt(port) == 0 && unlockpt(port) == 0));
  const int other_end = open(ptsname(port), O_RDWR | O_NOCTTY);  // else what is unread is lost
  show(ptsname(port));
  const auto got = read(port, bytes.data(), bytes.size());
  REQUIRE(got > 0);
  const std::string text(bytes.data(), static_cast<std::size_t>(got));
  CHECK(text.starts_with("{\"flip\":0,"));
  CHECK(text.find('\r') == text.npos);  // as it was sent
  close(other_end);
  close(port);

  show(desk.file("flips"));
  const auto lines = bytes_of(desk.file("flips"));
  CHECK(std::count(lines.begin(), lines.end(), '\n') == 10);
}

TEST_CASE("reports tell the frames, their order, their lasers and the panel's rate", "[slow]") {
  if (!can_test()) return;
  const XServer server(64, 48);
  const test::Desk desk;
  int written = 0;
  const auto write = [&](const std::string& name, int channels = 1) {
    save_picture(desk.file(name), 64, 48, noise({64, 48}, channels, ++written).levels);
  };
  /// "frame laser, frame laser ..." as flips tell, and the rate of the output.
  const auto told = [&](const Json& report) {
    desk.folder().write("report.json", report.dump());
    const auto outcome = desk.succeed({"show", desk.file("report.json"), "--loops", "1", "--events",
                                       "-", "--json", desk.file("shown.json")});
    std::string all;
    std::istringstream lines(outcome.out);
    for (std::string line; std::getline(lines, line);) {
      const auto flip = Json::parse(line);
      all += (all.empty() ? "" : ", ") + flip["frame"].get<std::string>() +
             (flip.contains("laser") ? " " + flip["laser"].get<std::string>() : "");
    }
    return std::pair(all, Json::parse(bytes_of(desk.file("shown.json")))["display"]["rate_hz"]);
  };
  const Json slm{{"rate_per_s", 240}};
  const auto laser = [&](double wavelength_m, const std::vector<std::string>& pictures) {
    return Json{{"wavelength_m", wavelength_m},
                {"pictures", pictures},
                {"report", {{"scene", {{"slm", slm}}}}}};
  };
  for (const char* number : {"00010", "00009"})
    for (const char* name : {"450nm", "638nm"})
      write(std::string("frame_") + number + "_" + name + ".png");
  const Json moving{{"files", "frame_%05d_LASER.png"}, {"shape", {2, 2, 48, 64}}, {"slm_rate", 40}};
  CHECK(told({{"colour", {{"lasers", {laser(638e-9, {}), laser(450e-9, {})}}}},
              {"animation", moving}}) ==
        std::pair<std::string, Json>("frame_00009_638nm.png 638nm, frame_00009_450nm.png 450nm, "
                                     "frame_00010_638nm.png 638nm, frame_00010_450nm.png 450nm",
                                     240.0));
  for (const char* name : {"r.png", "r2.png", "b.png", "b2.png"}) write(name);
  Json colour{
      {"colour",
       {{"lasers", {laser(638e-9, {"r.png", "r2.png"}), laser(450e-9, {"b.png", "b2.png"})}}}}};
  CHECK(told(colour).first == "r.png 638nm, b.png 450nm, r2.png 638nm, b2.png 450nm");
  write("hologram_rgb.png", 3);  // three frames of the panel
  colour["files"] = {{"hologram_rgb.png", digest_of_file(desk.file("hologram_rgb.png"))}};
  CHECK(told(colour) == std::pair<std::string, Json>("hologram_rgb.png", 80.0));
  const Json scene{{"slm", slm}, {"sampling", {{"frames", 2}}}};
  CHECK(told({{"scene", scene}, {"pictures", {"r.png"}}, {"format", "rgb-12x2"}}) ==
        std::pair<std::string, Json>("r.png", 20.0));
  write("hologram.png"), write("hologram_2.png");
  CHECK(told({{"scene", scene}}).first == "hologram.png, hologram_2.png");
  desk.folder().write(
      "report.json",
      Json{{"scene", scene}, {"pictures", {"hologram.npy"}}, {"format", "npy"}}.dump());
  test::check_refused(desk.run({"show", desk.file("report.json")}), 2,
                      "the format npy, which cannot be shown");
}

TEST_CASE("a scene that moves is computed while it is shown, with the bits of animate", "[slow]") {
  if (!can_test()) return;
  const XServer server(48, 32);
  test::Desk desk;
  desk.scene(
      "[animation]\nframes = 3\nrate = 5\n[[animation.track]]\nof = \"object.0.rotation\"\n"
      "at = [0, 2]\nvalues = [[0, 0, 0], [0, 40, 0]]\n");
  const auto scene = desk.file("scene.toml");
  desk.succeed({"animate", scene, "-o", desk.file("out"), "--stream", "--no-preview"});
  const auto stream = bytes_of(desk.out("frames.raw"));
  REQUIRE(stream.size() == 3 * 48 * 32);
  const auto program = desk.start({"show", scene, "--loops", "30", "--events", "-"});
  for (const std::size_t i : {1, 2, 0}) {
    LevelFrame frame{{48, 32}, 1, {}, "", ""};
    frame.levels.assign(stream.begin() + static_cast<std::ptrdiff_t>(48 * 32 * i),
                        stream.begin() + static_cast<std::ptrdiff_t>(48 * 32 * (i + 1)));
    CHECK(server.shows([&](const auto& shot) { return differences(shot, frame, {}) == 0; }));
  }
  kill(program, SIGINT);
  const auto outcome = desk.outcome_of(program);
  CHECK(outcome.code == 0);
  CHECK_SAYS(outcome.out, "\"picture 0\"", "\"picture 2\"");
}

TEST_CASE("show says what is wrong with what it is given", "[slow]") {
  const test::Desk desk;
  const auto refuses = [&](std::vector<std::string> words, const std::string& says) {
    words.insert(words.begin(), "show");
    test::check_refused(desk.run(words), 2, says);
  };
  refuses({}, "give what is to be shown, or --list");
  refuses({desk.file("none.png")}, "there is no such file");
  refuses({desk.file("square.obj")}, "cannot be shown: give pictures");
  refuses({desk.file("scene.toml")}, "nothing moves");
  refuses({desk.file("square.obj"), "--set", "slm.levels=4"}, "there is none");
  refuses({"-"}, "--size is needed");
  refuses({"-", "--size", "64"}, "--size");
  refuses({"-", "--size", "64x0"}, "must be pixels");
  refuses({"-", desk.file("scene.toml")}, "given alone");
#ifdef RAYWAVE_SDL2
  const auto nowhere = {"DISPLAY=", "WAYLAND_DISPLAY=", "SDL_VIDEODRIVER=dummy"};
  test::check_refused(
      desk.run({"show", "--list", "--backend", "window"}, {nowhere.begin(), nowhere.end()}), 3,
      "there is no desktop");
#endif
  std::filesystem::create_directory(desk.file("empty"));
  refuses({desk.file("empty")}, "holds neither report.json nor pictures");
  desk.folder().write("frames.raw", std::string(100, 'x'));
  refuses({desk.file("frames.raw")}, "of which size? Give --size");
  refuses({desk.file("frames.raw"), "--size", "64x48"}, "100 bytes, no whole frames of 64 x 48");
  std::vector<std::uint16_t> ten(64 * 48, 12345);
  save_picture(desk.file("ten.png"), 64, 48, ten);
  refuses({desk.file("ten.png")}, "more than 8 bits");
  save_picture(desk.file("a.png"), 64, 48, std::vector<std::uint8_t>(64 * 48, 1));
  save_picture(desk.file("b.png"), 48, 64, std::vector<std::uint8_t>(64 * 48, 1));
  refuses({desk.file("a.png"), desk.file("b.png")}, "is 48 x 64 pixels, the frames before it");
  refuses({desk.file("a.png"), "--backend", "x"}, "there are window and kms");
  refuses({desk.file("a.png"), "--events", "udp:nowhere"}, "needs a host and a port");
  refuses({desk.file("a.png"), "--events", "-", "--json"}, "both take standard output");
  desk.folder().write("report.json", "{\"animation\": 3}");
  refuses({desk.file("report.json")}, "not a report of raywave");
}

}  // namespace
}  // namespace raywave
