// SPDX-License-Identifier: Apache-2.0
// Against a kernel of the tests' own: what a real one does is not proved here.
#include <random>
#include <tuple>

#include "host/display/show.hpp"
#include "tests/support/edids.hpp"
#include "tests/support/files.hpp"
#include "tests/support/kernel.hpp"

namespace raywave {
namespace {

using test::device_error_of;
using test::FakeKernel;
using test::Fate;

constexpr glm::ivec2 size_px(64, 48);
const WantedOutput second{"HDMI-A-2", size_px, 0, false};

LevelFrame noise(int channels, unsigned seed = 1) {
  LevelFrame frame{size_px, channels, {}, "noise", ""};
  std::mt19937 random(seed);
  for (int i = 0; i < channels * size_px.x * size_px.y; ++i)
    frame.levels.push_back(static_cast<std::uint8_t>(random()));
  return frame;
}

/// Shows so many frames; the rate is 60 refreshes a second.
ShownFrames show(Display& display, int frames, double rate_hz = 0) {
  const std::atomic<bool> never{false};
  return show_frames(
      display, 60, rate_hz,
      [&]() -> std::shared_ptr<const LevelFrame> {
        return frames-- > 0 ? std::make_shared<LevelFrame>(noise(1)) : nullptr;
      },
      never);
}

TEST_CASE("levels are on the screen when the kernel tells of their flip") {
  FakeKernel kernel;
  const auto display = kernel.display();
  display->open({"HDMI-A-2", size_px, 0, true});
  std::uint64_t refresh = 0;
  for (const int channels : {1, 3, 1}) {
    const auto frame = noise(channels, static_cast<unsigned>(refresh));
    display->flip(frame, refresh);
    const auto flip = display->event();
    CHECK(flip.refresh == refresh);
    refresh = flip.refresh + 1;
    int wrong = 0;
    for (int y = 0; y < size_px.y; ++y)
      for (int x = 0; x < size_px.x; ++x)
        for (int c = 0; c < 3; ++c)  // red first in frames, last in memory
          wrong += kernel.shown(x, y, 2 - c) !=
                   frame.levels[static_cast<std::size_t>(
                       channels == 1 ? y * size_px.x + x : 3 * (y * size_px.x + x) + c)];
    CHECK(wrong == 0);
  }
  display->close();
  CHECK(kernel.is_as_before());
  CHECK(display->describe()["restored"] == true);
  CHECK(display->describe()["proof"]["flip_events"] == 3);
  CHECK(display->describe()["proof"]["read_back"] == 3);
}

TEST_CASE("late flips are missed refreshes, and shown, repeated and missed are all refreshes") {
  FakeKernel kernel;
  kernel.first_sequence = 0xfffffff0u;  // the kernel's number begins anew
  kernel.fates = {{}, {.late = 2}, {}, {.late = 1}, {.late = 5}};
  const auto display = kernel.display();
  display->open(second);
  const double begin = kernel.sequence_now() + 1;
  const auto shown = show(*display, 20);
  CHECK(shown.count.shown == 20);
  CHECK(shown.count.repeated == 0);
  CHECK(shown.count.missed == 8);
  CHECK(shown.count.refreshes == 28);
  CHECK(kernel.sequence_now() - begin + 1 == 28);  // as the kernel counts
  CHECK(display->describe()["proof"]["counted_by_time"] == 0);
  CHECK(shown.seconds == Catch::Approx(27 / 60.0).epsilon(1e-4));
  CHECK(shown.latency_s(0) >= 0);
  CHECK(shown.latency_s(1) == Catch::Approx(6 / 60.0).epsilon(0.02));
}

TEST_CASE("frames stay as long as the rate wants, evenly where it is no divisor") {
  for (const auto& [rate_hz, frames, repeated] :
       {std::tuple(30.0, 8, 8u), {24.0, 8, 12u}, {60.0, 8, 0u}, {59.94, 8, 0u}, {1.0, 2, 118u}}) {
    FakeKernel kernel;
    const auto display = kernel.display();
    display->open(second);
    const double begin = kernel.sequence_now() + 1;
    const auto count = show(*display, frames, rate_hz).count;
    CAPTURE(rate_hz);
    CHECK(count.repeated == repeated);
    CHECK(count.missed == 0);
    CHECK(count.shown + count.repeated == count.refreshes);
    // The last frame begins when those before it have had their time
    CHECK(kernel.sequence_now() - begin == std::floor((frames - 1) * 60 / rate_hz + 1e-6));
  }
  FakeKernel kernel;
  const auto display = kernel.display();
  display->open(second);
  CHECK_SAYS(input_error_of([&] { show(*display, 1, 90); }), "90", "shows 60");
}

TEST_CASE("an event that is lost ends the show, and the screen is as before") {
  FakeKernel kernel;
  kernel.fates = {{}, {}, {.is_lost = true}};
  const auto display = kernel.display();
  display->open(second);
  CHECK_SAYS(device_error_of([&] { show(*display, 5); }), "HDMI-A-2", "no event of flip 2");
  CHECK(kernel.is_as_before());
}

TEST_CASE("an event that comes twice is no other flip's") {
  FakeKernel kernel;
  kernel.fates = {{}, {.comes_twice = true}, {.late = 1}};
  const auto display = kernel.display();
  display->open(second);
  const auto shown = show(*display, 12);
  display->close();
  CHECK(shown.count.shown == 12);
  CHECK(shown.count.missed == 1);
  CHECK(display->describe()["proof"]["stray_events"] == 1);
}

TEST_CASE("a driver that does not count is counted for, by its times") {
  FakeKernel kernel;
  kernel.counts = false;
  kernel.fates = {{}, {.late = 3}};
  const auto display = kernel.display();
  display->open(second);
  const auto shown = show(*display, 10);
  CHECK(shown.count.missed == 3);
  CHECK(shown.count.refreshes == 13);
  CHECK(display->describe()["proof"]["counted_by_time"] == 9);
}

TEST_CASE("unplugging, and another program that takes the screens, end the show and say so") {
  for (const auto& [fate, says] :
       {std::pair(Fate{.error = EINVAL, .unplugs = true}, "was unplugged"),
        {Fate{.is_lost = true, .unplugs = true}, "was unplugged"},
        {Fate{.error = EACCES}, "another program has taken the screens"},
        {Fate{.error = EBUSY}, "a flip is refused: "}}) {
    FakeKernel kernel;
    kernel.fates = {{}, fate};
    const auto display = kernel.display();
    display->open(second);
    CHECK_SAYS(device_error_of([&] { show(*display, 5); }), "HDMI-A-2", says);
    CHECK(kernel.is_as_before());
    CHECK_SAYS(device_error_of([&] { show(*display, 1); }), "HDMI-A-2", "was closed");
  }
}

TEST_CASE("what cannot be opened is refused, and the screen is as before") {
  FakeKernel kernel;
  const auto open = [&](const WantedOutput& wanted) { kernel.display()->open(wanted); };
  CHECK_SAYS(input_error_of([&] {
               open({"HDMI-A-2", {1920, 1080}, 0, false});
             }),
             "1920 x 1080", "64 x 48 at 60 Hz, 64 x 48 at 75 Hz, 32 x 16 at 60 Hz");
  CHECK_SAYS(input_error_of([&] { open({"HDMI-A-2", size_px, 120, false}); }), "64 x 48 at 120 Hz");
  CHECK_SAYS(input_error_of([&] {
               open({"", size_px, 0, false});
             }),
             "one of several", "HDMI-A-1, 1920 x 1200", "HDMI-A-2, 64 x 48");
  CHECK_SAYS(input_error_of([&] { open({"DP-1", size_px, 0, false}); }), "no such output");
  CHECK(kernel.is_as_before());
  kernel.refuses_mode = true;
  CHECK_SAYS(device_error_of([&] { open(second); }), "64 x 48 at 60 Hz is refused: Invalid");
  CHECK(kernel.is_as_before());
  kernel.refuses_mode = false;
  kernel.keeps_lut = true;
  CHECK_SAYS(device_error_of([&] { open(second); }), "GAMMA_LUT changes levels");
  kernel.is_held_by_other = true;
  CHECK_SAYS(device_error_of([&] { open(second); }), "another program holds the screens");
  CHECK(kernel.open_files == 0);
  kernel.screens[0].is_plugged = kernel.screens[1].is_plugged = false;
  CHECK_SAYS(device_error_of([&] { open(second); }), "no output is connected");
  kernel.may_be_opened = false;
  CHECK_SAYS(device_error_of([&] { open(second); }), "/dev/dri/card0", "group video");
}

TEST_CASE("levels pass unchanged: tables are taken off, HDMI's range is full, all is given back") {
  for (const bool has_lut : {true, false}) {
    FakeKernel kernel;
    kernel.has_lut = has_lut;
    const auto display = kernel.display();
    CHECK(display->open({"HDMI-A-2", size_px, 75, false}).rate_hz ==
          Catch::Approx(75).epsilon(0.001));
    CHECK(kernel.screens[1].mode.hdisplay == 64);
    CHECK(kernel.properties[23] == 1);
    CHECK(display->describe()["knows_gamma"] == has_lut);
    if (has_lut) CHECK(kernel.properties[21] == 0);
    if (has_lut) CHECK(kernel.properties[22] == 0);
    display->close();
    CHECK(kernel.is_as_before());
  }
}

TEST_CASE("an output is found by what its EDID says, whichever socket it is in") {
  FakeKernel kernel;
  kernel.screens[0].edid = test::edid("DEL", 0xd0c1, 77, "DELL U2415", "");
  kernel.screens[1].edid = test::edid("HOL", 0x6013, 12, "PLUTO", "");
  const auto all = kernel.display()->list();
  REQUIRE(all.size() == 2);
  CHECK(text_of(all[1]) == "HDMI-A-2, 64 x 48 at 60 Hz, HOL-6013-12 (PLUTO)");
  for (const std::string name : {"HOL", "HOL-6013", "HOL-6013-12"})
    CHECK(kernel.display()->open({name, size_px, 0, false}).name == "HDMI-A-2");
  kernel.screens[0].edid = kernel.screens[1].edid;
  CHECK_SAYS(input_error_of([&] {
               kernel.display()->open({"HOL", size_px, 0, false});
             }),
             "several are meant");
}

TEST_CASE("a frame of another size than those before it is refused") {
  FakeKernel kernel;
  const auto display = kernel.display();
  display->open(second);
  const std::atomic<bool> never{false};
  int count = 0;
  const auto next = [&] {
    auto frame = std::make_shared<LevelFrame>(noise(1));
    if (++count == 3) frame->size_px = {48, 64};
    return std::shared_ptr<const LevelFrame>(frame);
  };
  CHECK_SAYS(input_error_of([&] { show_frames(*display, 60, 0, next, never); }), "48 x 64",
             "64 x 48");
}

}  // namespace
}  // namespace raywave
