// SPDX-License-Identifier: Apache-2.0
// Scenes under the hand, against renders of scenes that stand so, and reconstruct.
#include "host/encode/shown.hpp"
#include "host/live/live_scene.hpp"
#include "host/live/saved_scene.hpp"
#include "host/live/steps.hpp"
#include "host/view/colour_picture.hpp"
#include "host/view/compare.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;

const std::filesystem::path study_file = std::filesystem::path(RAYWAVE_DATA_DIR) / "study.toml";

std::vector<Scene> scenes_of(std::vector<std::string> set = {}) {
  set.insert(set.begin(), {"sampling.frames=1", "sampling.pitch=20 um"});
  return load_scenes(study_file, set);
}

/// Drafts are coarser, and there are no references.
LiveScene live(const cl::Device& device, const std::vector<Scene>& scenes) {
  const auto scenes_for = [scenes](const Viewing::Plans& plans, const World&) {
    if (plans.preset == Preset::reference) throw InputError("no reference");
    auto chosen = scenes;
    for (auto& scene : chosen) {
      if (plans.preset) scene.sampling.pitch_m = 40e-6;
      if (plans.are_refined) scene.refine.emplace().iterations = 4;
    }
    return chosen;
  };
  return {device,
          cl::default_backend(device.info()),
          build_world(scenes[0]),
          {scenes_for,
           [](const Scene&, const World&, const Plan&) { return std::vector<std::string>(); },
           // Slow where it lies before the hologram
           [](const Scene& scene, const World&, const Plan&) {
             return scene.objects[0].position_m.z < 0 ? 11 : 0;
           }},
          48};
}

/// A picture with larger pixels around its middle: means of what lies within them.
Image coarser(const Image& from, glm::dvec2 from_m, glm::ivec2 size, glm::dvec2 sides_m) {
  Image to{size.x, size.y, std::vector<float>(static_cast<std::size_t>(size.x) * size.y)};
  std::vector<int> count(to.pixels.size());
  for (int y = 0; y < from.height; ++y)
    for (int x = 0; x < from.width; ++x) {
      const glm::dvec2 at =
          (glm::dvec2(x, y) + 0.5 - glm::dvec2(from.width, from.height) / 2.0) * from_m / sides_m +
          0.5;
      const glm::ivec2 pixel(glm::floor(at * glm::dvec2(size)));
      if (pixel.x < 0 || pixel.y < 0 || pixel.x >= size.x || pixel.y >= size.y) continue;
      const auto i = static_cast<std::size_t>(pixel.y) * size.x + pixel.x;
      to.pixels[i] += from.pixels[static_cast<std::size_t>(y) * from.width + x];
      ++count[i];
    }
  for (std::size_t i = 0; i < count.size(); ++i)
    to.pixels[i] /= static_cast<float>(std::max(count[i], 1));
  return to;
}

double mean_difference(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  REQUIRE(a.size() == b.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

}  // namespace

DEVICE_TEST("a live picture is that of reconstruct, in focus and out of it, by any eye") {
  const auto near_eye = load_scenes(study_file.parent_path() / "near_eye.toml",
                                    {"hologram.resolution=[240, 136]", "sampling.frames=1"});
  for (const auto& scenes :
       {scenes_of(), scenes_of({"hologram.wavelength=[\"638 nm\", \"520 nm\", \"450 nm\"]"}),
        near_eye}) {
    const auto& viewer = scenes[0].viewer;
    auto scene = live(device, scenes);
    const auto rendered = render(device, scenes, build_world(scenes[0]));
    const double side_m = scenes[0].hologram.resolution.x * scenes[0].hologram.pitch_m.x;
    for (const auto& [focus_m, eye, part, is_pupil] :
         {std::tuple(18.55 * mm, glm::dvec2(0), 1.0, false),
          {22 * mm, {0.5, -0.4}, 0.5, false},
          {19 * mm, {-0.3, 0}, 0.6, true}}) {
      auto viewing = scene.start();
      if (!viewer.eyepiece_m) viewing.focus_m = focus_m;
      viewing.eye = eye;
      if (is_pupil)
        viewing.pupil_m = part * side_m;
      else
        viewing.part = part;
      const auto picture = scene.look(viewing);
      const auto sides_m = scene.window_m();
      std::vector<Image> light;
      for (std::size_t i = 0; i < scenes.size(); ++i) {
        const auto& laser = rendered.lasers[i];
        const auto& hologram = scenes[i].hologram;
        ReconstructSpec what{.z_m = viewing.focus_m,
                             .window_m = sides_m + 4.0 * hologram.pitch_m,
                             .view = eye,
                             .aperture = glm::dvec2(part)};
        if (viewer.eyepiece_m) {  // a part is for bare holograms
          what.view = {0, 0};
          what.aperture = {1, 1};
          what.pupil = pupils_of(viewer).front();
          if (is_pupil) what.pupil->diameter_m = part * side_m;
        }
        const auto seen = reconstruct(device, cl::default_backend(device.info()),
                                      shown_field(*laser.panel, laser.levels), hologram, what);
        light.push_back(
            blurred(coarser(seen, hologram.pitch_m, picture.size_px, sides_m),
                    eye_blur_m(viewer, viewing.focus_m) * picture.size_px.x / sides_m.x));
        if (scenes.size() > 1)
          for (auto& pixel : light[i].pixels)
            pixel *=
                static_cast<float>(rendered.powers[i] / scenes[0].colour->lasers.white_powers[i]);
      }
      std::vector<Image> channels = light;
      if (scenes.size() > 1) {
        const auto colours = picture_of_lasers(scenes[0].colour->lasers, light).channels;
        channels = {colours.begin(), colours.end()};
      }
      for (auto& one : channels) one = in_frame(one, Frame::eye);
      const auto bytes = expose_to(channels, white_of(channels, 99.5));
      std::vector<std::uint8_t> expected;
      for (std::size_t i = 0; i < bytes.size(); ++i)
        expected.insert(expected.end(), channels.size() == 1 ? 3 : 1, bytes[i]);
      CAPTURE(viewing.focus_m, part, scenes.size());
      // Behind an eyepiece, reconstruct lacks light that the pupil's edge spreads far; discs are
      // held to direct sums in tests/refine/light.cpp
      CHECK(mean_difference(picture.rgb, expected) < (viewer.eyepiece_m ? 2.8 : 1.6));
      CHECK(*std::max_element(picture.rgb.begin(), picture.rgb.end()) == 255);
    }
  }
}

DEVICE_TEST("a scene that was turned and turned back looks as at first, and in between otherwise") {
  const auto scenes = scenes_of();
  auto scene = live(device, scenes);
  auto viewing = scene.start();
  viewing.hologram = true;
  const auto first = scene.look(viewing);
  CHECK(first.hologram_s == 0);
  viewing.poses[0].rotation_deg.y += 30;
  viewing.poses[0].position_m.x += 0.1 * mm;
  const auto turned = scene.look(viewing);
  CHECK(turned.hologram_s > 0);
  CHECK(turned.size_px == first.size_px);
  CHECK(mean_difference(turned.rgb, first.rgb) > 10);
  // A place that cannot be is refused, and leaves all as it was
  auto wrong = viewing;
  wrong.poses[0].position_m.z = 1e9;
  CHECK_THROWS_AS(scene.look(wrong), InputError);
  wrong.poses[0].position_m.z *= -1e-10;
  CHECK_THROWS_WITH(scene.look(wrong), Catch::Matchers::ContainsSubstring("about 11 s"));
  CHECK(scene.look(viewing).rgb == turned.rgb);
  const auto back = scene.start().poses == viewing.poses;
  CHECK(back);  // it starts from where it is
  viewing.poses[0].rotation_deg.y -= 30;
  viewing.poses[0].position_m.x -= 0.1 * mm;
  CHECK(mean_difference(scene.look(viewing).rgb, first.rgb) < 1);
}

DEVICE_TEST("a light that is changed lights as one that a scene has so, and none where refused") {
  const auto scenes = scenes_of();
  auto scene = live(device, scenes);
  const auto first = scene.look(scene.start());
  auto viewing = scene.start();
  viewing.lights[0].direction = direction_from({-60, 20});
  viewing.lights[0].intensity = 3;
  const auto lit = scene.look(viewing);
  CHECK(lit.hologram_s > 0);
  CHECK(lit.stages_s.contains("trace"));
  CHECK(mean_difference(lit.rgb, first.rgb) > 3);
  auto bright = scenes;
  bright[0].lights = viewing.lights;
  auto other = live(device, bright);
  CHECK(mean_difference(other.look(other.start()).rgb, lit.rgb) < 0.5);

  for (const bool is_place : {true, false}) {
    auto wrong = viewing;
    wrong.poses[0].position_m.x += 0.1 * mm;
    wrong.lights[0].intensity = 1;
    if (is_place)
      wrong.poses[1].position_m.z = 1e9;
    else
      wrong.lights[0].falls_off = true;  // has other kernels
    CHECK_THROWS_AS(scene.look(wrong), InputError);
    const auto after = scene.look(viewing);
    CHECK(after.hologram_s == 0);
    CHECK(after.rgb == lit.rgb);
  }
  viewing.lights.clear();  // who knows none leaves them
  CHECK(scene.look(viewing).hologram_s == 0);
}

TEST_CASE("lights come from where a viewer sees them: from him, his right, above") {
  const auto near = [](const auto& a, const auto& b) { return glm::length(a - b) < 1e-9; };
  using Way = glm::dvec3;
  for (const auto& [from_deg, way] :
       {std::pair(glm::dvec2(0, 0), Way(0, 0, 1)), {{90, 0}, {1, 0, 0}}, {{0, 90}, {0, -1, 0}}})
    CHECK(near(direction_from(from_deg), way));  // his right is -x
  for (const glm::dvec2 from_deg : {glm::dvec2(0), {-30, 70}, {179, -89}, {100, 12}})
    CHECK(near(origin_deg(5.0 * direction_from(from_deg)), from_deg));
}

DEVICE_TEST("a saved scene stands, is lit and planned as it was seen, sizes of turned meshes too") {
  const Folder folder;
  const auto file = std::filesystem::path(RAYWAVE_DATA_DIR) / "teapot.toml";
  const std::vector<std::string> set{"hologram.resolution=[240, 136]", "sampling.pitch=0.4 mm"};
  for (const auto* anchor : {"centre", "origin"}) {
    auto given = set;
    given.emplace_back(std::string("object.0.anchor=") + anchor);
    const auto scenes = load_scenes(file, given);
    auto scene = live(device, scenes);
    auto viewing = scene.start();
    viewing.poses[0].turn({20, 70, -40});
    viewing.poses[0].position_m += glm::dvec3(2, -1, 5) * mm;
    viewing.lights[0].direction = {0.1, 0.2, 0.7};
    viewing.lights[0].intensity = 0.4;
    viewing.plans = {Preset::draft, true};
    scene.look(viewing);
    const auto changes = overrides_between(scenes[0], scene.scene());
    given.insert(given.end(), changes.begin(), changes.end());
    save_scene(folder / "saved.toml", read_scene_text(file), given);

    const auto saved = load_scenes(folder / "saved.toml");
    CHECK(saved[0].sampling.pitch_m == 40e-6);
    CHECK(saved[0].refine.value().iterations == 4);
    CHECK(saved[0].lights[0].direction == viewing.lights[0].direction);
    CHECK(saved[0].lights[0].intensity == 0.4);
    // A solid that turns about its anchor
    const auto was = build_world(scenes[0]), is = build_world(saved[0]);
    const auto& before = scenes[0].objects[0];
    const auto turn = rotation_xyz(viewing.poses[0].rotation_deg) *
                      glm::transpose(rotation_xyz(before.rotation_deg));
    double worst_m = 0;
    for (std::size_t i = 0; i < was.positions.size(); ++i)
      worst_m = std::max(
          worst_m, glm::length(viewing.poses[0].position_m +
                               turn * (was.positions[i] - before.position_m) - is.positions[i]));
    CHECK(worst_m < 1e-14);
  }
  CHECK(overrides_between(load_scenes(file)[0], load_scenes(file)[0]).empty());
}

TEST_CASE(
    "a saved scene finds its files from its own folder, and one that is damaged is not saved") {
  const Folder folder;
  save_scene(folder / "deep" / "study.toml", read_scene_text(study_file), {"light.0.intensity=2"});
  const auto saved = load_scenes(folder / "deep" / "study.toml");
  CHECK(saved[0].lights[0].intensity == 2);
  for (std::size_t i = 0; i < 2; ++i)
    CHECK(std::filesystem::equivalent(saved[0].objects[i].mesh,
                                      load_scenes(study_file)[0].objects[i].mesh));
  for (const auto* wrong : {"light.0.intensity=-1", "light.7.intensity=1"}) {
    CHECK_THROWS_AS(save_scene(folder / "wrong.toml", read_scene_text(study_file), {wrong}),
                    InputError);
    CHECK_FALSE(std::filesystem::exists(folder / "wrong.toml"));
  }
}

DEVICE_TEST("plans chosen while a turned scene is seen show what they show from the start") {
  const auto scenes = scenes_of();
  auto scene = live(device, scenes);
  const auto first = scene.look(scene.start());
  auto viewing = scene.start();
  viewing.poses[0].turn({0, 30, 0});
  const auto turned = scene.look(viewing);
  viewing.plans = {Preset::draft, true};
  const auto seen = scene.look(viewing);

  auto coarse = scenes;
  coarse[0].sampling.pitch_m = 40e-6;
  coarse[0].refine.emplace().iterations = 4;
  auto other = live(device, coarse);
  viewing.plans = {};
  CHECK(mean_difference(other.look(viewing).rgb, seen.rgb) < 0.5);
  CHECK(mean_difference(turned.rgb, seen.rgb) > 2);
  // A plan that cannot be leaves everything as it was
  viewing.plans = {Preset::reference, false};
  CHECK_THROWS_AS(scene.look(viewing), InputError);
  viewing.plans = {Preset::draft, true};
  CHECK(mean_difference(scene.look(viewing).rgb, seen.rgb) < 0.5);
  CHECK(mean_difference(scene.look(scene.start()).rgb, first.rgb) < 0.5);
}

DEVICE_TEST("a scene around the hologram begins in focus at its end, and is shown near it, too") {
  const auto file = std::filesystem::path(RAYWAVE_DATA_DIR) / "teapot.toml";
  auto scene = live(
      device, load_scenes(file, {"hologram.resolution=[240, 136]", "object.0.position=[0, 0, 0]",
                                 "object.0.width=0.8 mm", "sampling.pitch=20 um"}));
  auto viewing = scene.start();
  CHECK(viewing.focus_m > 0.1 * mm);
  for (const double focus_m : {viewing.focus_m, 0.02 * mm, 0.5 * mm, 5 * mm}) {
    viewing.focus_m = focus_m;
    const auto picture = scene.look(viewing);
    CHECK(*std::max_element(picture.rgb.begin(), picture.rgb.end()) == 255);
    // An arc minute from 250 mm away over the steepest light's slope: 0.85 mm
    CHECK(picture.note.empty() == (focus_m > 0.85 * mm));
  }
}

TEST_CASE("poses turn as seen: about the hologram's axes, whatever they were turned by before") {
  for (const glm::dvec3 before : {glm::dvec3(0), {-17, 29, -8.5}, {10, 90, 40}, {200, -60, 170}}) {
    for (const glm::dvec3 by : {glm::dvec3(0, 30, 0), {25, 0, 0}, {10, -20, 300}}) {
      Viewing::Pose pose{.rotation_deg = before};
      pose.turn(by);
      const auto wanted = rotation_xyz(by) * rotation_xyz(before),
                 got = rotation_xyz(pose.rotation_deg);
      double worst = 0;
      for (int column = 0; column < 3; ++column)
        worst = std::max(worst, glm::length(wanted[column] - got[column]));
      CHECK(worst < 1e-7);
    }
  }
}

TEST_CASE("a script's steps follow each other, and what is wrong in one has its line") {
  const Folder folder;
  const auto read = [&](const std::string& text, bool has_eyepiece = false) {
    Viewing start;
    start.poses.resize(2);
    start.lights = {{}, {.type = LightType::point}};
    return read_steps(folder.write("steps.toml", text), start, has_eyepiece);
  };
  const auto steps = read(
      "[[step]]\nfocus = \"95 mm\"\n[[step]]\nobject = 1\nturn = [0, 10, 0]\nrepeat = 3\n"
      "[[step]]\nmove = [\"1 mm\", 0, 0]\neye = [-0.5, 0]\nlens = true\npupil = \"2 mm\"\n"
      "[[step]]\nlight = 1\nposition = [0, \"30 mm\", 0]\npart = 0.5\nsave = true\nrepeat = 2\n"
      "[[step]]\ndirection = [1, 0, 1]\nintensity = 0.5\n");
  REQUIRE(steps.size() == 8);
  CHECK(steps[4].pupil_m == 2 * mm);
  CHECK_FALSE(steps[5].pupil_m);  // `part` takes its place
  CHECK_FALSE(steps[5].saves);
  CHECK(steps[6].saves);
  CHECK(steps[7].lights[1].position_m.y == 0.03);
  CHECK(steps[7].lights[0].direction == glm::dvec3(1, 0, 1));
  CHECK(steps[7].lights[0].intensity == 0.5);
  CHECK(steps[6].lights[0].intensity == 1);
  CHECK(steps[0].focus_m == 0.095);
  CHECK(steps[3].poses[1].rotation_deg.y == Catch::Approx(30));
  CHECK(steps[4].poses[1].rotation_deg.y == Catch::Approx(30));
  CHECK(steps[4].eye == glm::dvec2(0.5, 0));  // to the viewer's left
  CHECK(steps[4].poses[0].position_m.x == 1 * mm);
  CHECK(steps[4].lens);
  CHECK_FALSE(steps[3].lens);
  CHECK_SAYS(input_error_of([&] { read("[[step]]\nobject = 2\n"); }),
             "steps.toml:2: step 0: object", "0 to 1");
  CHECK_SAYS(input_error_of([&] { read("[[step]]\n[[step]]\ntrun = [0, 1, 0]\n"); }),
             "steps.toml:3", "did you mean \"turn\"");
  CHECK_SAYS(input_error_of([&] { read("[[step]]\nlight = 1\ndirection = [0, 0, 1]\n"); }),
             "steps.toml:3", "unknown key \"direction\"");  // of a point
  CHECK_SAYS(input_error_of([&] { read("[[step]]\npart = 0.5\npupil = \"2 mm\"\n"); }),
             "steps.toml:3: step 0: pupil", "takes the place of part");
  for (const char* key : {"eye = [0.5, 0]", "part = 0.5"})
    CHECK_SAYS(input_error_of([&] { read(std::string("[[step]]\n") + key, true); }), "steps.toml:2",
               "behind an eyepiece");
  CHECK_SAYS(input_error_of([&] { read(""); }), "has no [[step]]");
}

}  // namespace raywave
