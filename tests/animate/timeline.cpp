// SPDX-License-Identifier: Apache-2.0
#include "host/animate/timeline.hpp"

#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using glm::dvec3;

Track track_of(Steps steps, std::vector<double> at, const std::function<dvec3(double)>& f) {
  Track track;
  track.steps = steps;
  for (const double t : at) track.values.push_back(f(t));
  track.at = std::move(at);
  return track;
}

double distance_between(const dvec3& a, const dvec3& b) {
  return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

TEST_CASE("linear steps are straight lines between uneven keys, and values stay beyond the ends") {
  const auto line = [](double t) { return dvec3(3 - 2 * t, 0.5 * t, 7); };
  const auto track = track_of(Steps::linear, {1, 2, 5, 11}, line);
  for (double t = 1; t <= 11; t += 0.1)
    CHECK(distance_between(value_at(track, t), line(t)) < 1e-13);
  CHECK(value_at(track, 0) == track.values.front());
  CHECK(value_at(track, 12) == track.values.back());
  const auto corner = track_of(Steps::linear, {0, 4, 6}, [](double t) { return dvec3(t * t); });
  CHECK(distance_between(value_at(corner, 1), dvec3(4)) < 1e-14);   // 16 / 4
  CHECK(distance_between(value_at(corner, 5), dvec3(26)) < 1e-13);  // (16 + 36) / 2
}

TEST_CASE("held values jump at their keys") {
  const auto track = track_of(Steps::hold, {0, 3, 4}, [](double t) { return dvec3(t); });
  for (const auto& [t, value] :
       {std::pair{0.0, 0.0}, {2.999, 0.0}, {3.0, 3.0}, {3.5, 3.0}, {4.0, 4.0}, {9.0, 4.0}})
    CHECK(value_at(track, t) == dvec3(value));
}

TEST_CASE("cubic steps follow parabolas between even keys, and lines everywhere") {
  // Slopes from both neighbours are those of a parabola where keys are even.
  const auto parabola = [](double t) { return dvec3(t * t - 3 * t, 2 - t * t, t); };
  const auto even = track_of(Steps::cubic, {0, 2, 4, 6, 8}, parabola);
  for (double t = 2; t <= 6; t += 0.1)
    CHECK(distance_between(value_at(even, t), parabola(t)) < 1e-12);
  const auto line = [](double t) { return dvec3(3 - 2 * t, 0.5 * t, 7); };
  const auto uneven = track_of(Steps::cubic, {0, 1, 5, 7, 20}, line);
  for (double t = 0; t <= 20; t += 0.1)
    CHECK(distance_between(value_at(uneven, t), line(t)) < 1e-12);
  // Two keys: a line
  const auto two = track_of(Steps::cubic, {0, 10}, [](double t) { return dvec3(t * t); });
  CHECK(distance_between(value_at(two, 3), dvec3(30)) < 1e-12);
}

TEST_CASE("cubic steps meet their keys with one slope from both sides") {
  const auto wave = [](double t) { return dvec3(std::sin(t), std::cos(1.7 * t), t * t * t); };
  auto track = track_of(Steps::cubic, {0, 1, 2.5, 3, 4.5, 6}, wave);
  constexpr double h = 1e-6;
  for (std::size_t k = 0; k < track.at.size(); ++k)
    CHECK(value_at(track, track.at[k]) == track.values[k]);
  for (std::size_t k = 1; k + 1 < track.at.size(); ++k) {
    const double t = track.at[k];
    const auto before = (value_at(track, t) - value_at(track, t - h)) / h,
               after = (value_at(track, t + h) - value_at(track, t)) / h,
               wanted = (track.values[k + 1] - track.values[k - 1]) /
                        (track.at[k + 1] - track.at[k - 1]);
    CHECK(distance_between(before, wanted) < 1e-3);
    CHECK(distance_between(after, wanted) < 1e-3);
  }
}

TEST_CASE("a closed cubic track leaves its last key as it has left its first") {
  const auto circle = [](double t) { return dvec3(std::cos(t), std::sin(t), 0); };
  const double turn = 2 * std::acos(-1.0);
  std::vector<double> at;
  for (int k = 0; k <= 12; ++k) at.push_back(turn * k / 12);
  auto track = track_of(Steps::cubic, at, circle);
  track.closed = true;
  constexpr double h = 1e-6;
  const auto out = (value_at(track, h) - value_at(track, 0)) / h,
             in = (value_at(track, turn) - value_at(track, turn - h)) / h;
  CHECK(distance_between(out, in) < 1e-4);
  // Catmull-Rom's slope on a circle is too small by sin(a) / a: 4.5 % at 30 degrees
  CHECK(distance_between(out, dvec3(0, std::sin(turn / 12) / (turn / 12), 0)) < 1e-4);
  for (double t = 0; t < turn; t += 0.01)
    CHECK(distance_between(value_at(track, t), circle(t)) < 0.01);
}

/// A scene that names files which need not be meshes: nothing reads them here.
class Stage {
public:
  Stage() { folder_.write("a.obj", ""); }

  Scene load(const std::string& animation) const {
    return load_scene(folder_.write("scene.toml", head + animation));
  }
  std::string refusal(const std::string& animation) const {
    return input_error_of([&] { load(animation); });
  }

private:
  static constexpr const char* head =
      "[[light]]\ndirection = [0, 0, 1]\n[[light]]\ntype = \"point\"\nposition = [0, 0, 0]\n"
      "[[object]]\nmesh = \"a.obj\"\nposition = [0, 0, \"10 mm\"]\n"
      "[[object]]\nmesh = \"a.obj\"\nposition = [0, 0, \"12 mm\"]\n";  // 11 lines
  Folder folder_;
};

TEST_CASE("every key of [animation] arrives, in metres and pictures") {
  const Stage stage;
  const auto scene = stage.load(
      "[animation]\nframes = 50\nrate = 25\nsubframes = 3\n"
      "[animation.camera]\ndepth = \"11 mm\"\nview = [0.5, 0]\naperture = [0.5, 1]\n"
      "window = [\"2 mm\", \"1 mm\"]\n"
      "[[animation.track]]\nof = \"object.1.position\"\nat = [0, \"1 s\", 50]\n"
      "values = [[0, 0, \"12 mm\"], [\"1 mm\", 0, \"12 mm\"], [0, 0, \"13 mm\"]]\n"
      "steps = \"cubic\"\nclosed = true\n"
      "[[animation.track]]\nof = \"object.1.scale\"\nat = [0, 50]\nvalues = [1, 3]\n"
      "[[animation.track]]\nof = \"light.0.direction\"\nat = [0, 50]\nvalues = [[0, 0, 1], [1, 0, "
      "1]]\n"
      "[[animation.track]]\nof = \"light.1.position\"\nat = [10]\nvalues = [[0, 0, \"1 mm\"]]\n"
      "[[animation.track]]\nof = \"light.1.intensity\"\nat = [0, 50]\nvalues = [0, 2]\n"
      "steps = \"hold\"\n"
      "[[animation.track]]\nof = \"camera.depth\"\nat = [0, 50]\nvalues = [\"11 mm\", \"13 "
      "mm\"]\n");
  const auto& animation = scene.animation.value();
  CHECK(animation.pictures == 50);
  CHECK(animation.rate_per_s == 25);
  CHECK(animation.subframes == 3);
  CHECK(animation.tracks[0].at == std::vector<double>{0, 25, 50});
  CHECK(animation.tracks[0].closed);
  CHECK(moving_objects(animation) == std::set<std::size_t>{1});
  CHECK(moving_lights(animation) == std::set<std::size_t>{0, 1});

  const auto middle = scene_at(scene, 25);
  CHECK(middle.objects[1].position_m == dvec3(1e-3, 0, 12e-3));
  CHECK(middle.objects[1].solid_scale == 2);
  CHECK_FALSE(middle.objects[0].solid_scale);
  CHECK(middle.lights[0].direction == dvec3(0.5, 0, 1));
  CHECK(middle.lights[1].position_m == dvec3(0, 0, 1e-3));
  CHECK(middle.lights[1].intensity == 0);
  const auto camera = camera_at(animation, 25);
  CHECK(std::abs(camera.depth_m.value() - 12e-3) < 1e-15);
  CHECK(camera.view == glm::dvec2(0.5, 0));
  CHECK(camera.aperture == glm::dvec2(0.5, 1));
  CHECK(camera.window_m == glm::dvec2(2e-3, 1e-3));
  CHECK_FALSE(stage.load("").animation);
}

TEST_CASE("what is wrong in [animation] is refused with file, line and what would be right") {
  const Stage stage;
  const auto track = [](const std::string& lines) {
    return "[animation]\nframes = 10\n[[animation.track]]\n" + lines;  // lines 12 to 14
  };
  const std::vector<std::pair<std::string, std::string>> cases{
      {"[animation]\nrate = 25\n", "scene.toml:12: animation: frames is missing"},
      {"[animation]\nframes = 0\n", "scene.toml:13: animation: frames must be 1 to 1000000, got 0"},
      {"[animation]\nframes = 9\nslm_rate = 20\n", "scene.toml:14: animation: slm_rate must be"},
      {"[animation]\nframes = 9\nsubframes = 2\nslm_rate = 60\n", "left out where `subframes`"},
      {"[animation]\nframes = 9\n[animation.camera]\nview = [2, 0]\n",
       "scene.toml:15: animation: camera: view[0] must be -1 to 1, got 2"},
      {track("of = \"object.2.position\"\nat = [0]\nvalues = [[0, 0, 1]]\n"),
       "scene.toml:15: track 0: of must be of one of the 2 objects, counted from 0"},
      {track("of = \"object.0.colour\"\nat = [0]\nvalues = [1]\n"), "object.N.position"},
      {track("of = \"camera.0.view\"\nat = [0]\nvalues = [1]\n"), "camera.depth"},
      {track("of = \"light.1.direction\"\nat = [0]\nvalues = [[0, 0, 1]]\n"),
       "of a light with a direction, which light 1 has not"},
      {track("of = \"light.0.position\"\nat = [0]\nvalues = [[0, 0, 1]]\n"),
       "of a light with a position, which light 0 has not"},
      {track("at = [0]\nvalues = [1]\n"), "scene.toml:14: track 0: of is missing"},
      {track("of = \"object.0.scale\"\nat = [0, 5, 5]\nvalues = [1, 1, 1]\n"),
       "scene.toml:16: track 0: at[2] must be later than the key before it"},
      {track("of = \"object.0.scale\"\nat = [0, 11]\nvalues = [1, 1]\n"),
       "scene.toml:16: track 0: at[1] must be at most 10, which is animation.frames; of fewer "
       "pictures, `at` must be shorter, too (animate --pictures 0..9 makes a part of the "
       "animation), "
       "got 11"},
      {track("of = \"object.0.scale\"\nat = [0, \"1 s\"]\nvalues = [1, 1]\n"),
       "at most 0.416667 s"},
      {track("of = \"object.0.scale\"\nat = [0, 5]\nvalues = [1]\n"),
       "scene.toml:17: track 0: values must be as many as there are in `at`, 2"},
      {track("of = \"object.0.scale\"\nat = [0, 5]\nvalues = [1, 0]\n"),
       "scene.toml:17: track 0: values[1] must be"},
      {track("of = \"object.0.position\"\nat = [0]\nvalues = [[0, \"1 parsec\", 0]]\n"),
       "scene.toml:17: track 0: values[0][1]"},
      {track("of = \"object.0.scale\"\nat = [0]\nvalues = [1]\nstep = \"cubic\"\n"),
       "unknown key \"step\"; did you mean \"steps\"?"},
      {track("of = \"object.0.scale\"\nat = [0]\nvalues = [1]\nclosed = true\n"), "two or more"},
      {track("of = \"object.0.scale\"\nat = [0]\nvalues = [1]\n[[animation.track]]\nof = "
             "\"object.0.scale\"\nat = [0]\nvalues = [1]\n"),
       "moves what track 0 moves"}};
  for (const auto& [text, message] : cases) {
    INFO(text);
    CHECK_SAYS(stage.refusal(text), message);
  }
  const auto dips = stage.load(
      "[animation]\nframes = 30\n[[animation.track]]\nof = \"object.0.scale\"\nsteps = \"cubic\"\n"
      "at = [0, 10, 20, 30]\nvalues = [5, 0.01, 0.01, 5]\n");
  CHECK_REFUSED(scene_at(dips, 15), "scene.toml:14: track 0: at picture 15: the cubic curve falls");
  const auto flips = stage.load(
      "[animation]\nframes = 30\n[[animation.track]]\nof = \"light.0.direction\"\n"
      "at = [0, 30]\nvalues = [[0, 0, 1], [0, 0, -1]]\n");
  CHECK_REFUSED(scene_at(flips, 15), "[0, 0, 0]");
}

TEST_CASE("holograms show the picture of their time, and none is left out or shown twice") {
  Animation animation;
  animation.pictures = 24;
  const auto counts = [&](int frames) {
    const Schedule schedule(animation, frames);
    std::vector<int> all;
    for (int i = 0; i < schedule.pictures(); ++i) all.push_back(schedule.count_of(i));
    return all;
  };
  CHECK(counts(1) == std::vector<int>(24, 1));
  CHECK(counts(4) == std::vector<int>(24, 4));
  animation.subframes = 8;
  CHECK(counts(4) == std::vector<int>(24, 8));
  CHECK(Schedule(animation, 1).slm_rate_per_s() == 8 * 24);

  animation.subframes.reset();
  animation.slm_rate_per_s = 60;
  const auto pulldown = counts(1);
  for (std::size_t i = 0; i < 24; ++i) CHECK(pulldown[i] == (i % 2 == 0 ? 3 : 2));
  const Schedule schedule(animation, 1);
  CHECK(schedule.holograms() == 60);
  CHECK(schedule.most_of_a_picture() == 3);
  for (int j = 0; j < 60; ++j) {  // hologram j, at j / 60 s, shows picture floor(24 j / 60)
    const int picture = 24 * j / 60;
    CHECK(schedule.first_of(picture) <= j);
    CHECK(j < schedule.first_of(picture + 1));
  }
  CHECK(schedule.spread(8) == std::vector<int>{0, 3, 6, 9, 12, 15, 18, 21});
  CHECK(schedule.spread(5) == std::vector<int>{0, 4, 9, 14, 19});
  CHECK(schedule.spread(100).size() == 24);
  CHECK(schedule.spread(24).back() == 23);
  // Rates of television, whose quotient is 2.5 but for rounding
  animation.pictures = 100000;
  animation.rate_per_s = 24000.0 / 1001;
  animation.slm_rate_per_s = 60000.0 / 1001;
  CHECK(Schedule(animation, 1).holograms() == 250000);
}

}  // namespace
}  // namespace raywave
