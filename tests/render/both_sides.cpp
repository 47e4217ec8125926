// SPDX-License-Identifier: Apache-2.0
// Scenes before the hologram (z < 0: real images), and on both sides of it.
#include "host/planning/make_plan.hpp"
#include "tests/support/seen.hpp"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec2;
using glm::dvec3;

namespace {

Stage with(WrpPropagation propagation, Stage stage) {
  stage.scene.wrp.propagation = propagation;
  return stage;
}

/// Two tilted cards that do not hide each other, 2 x_m apart, depth_m from front to back; `side`
/// -1: their mirror image through the hologram.
Stage two_cards(double side, double x_m = 0.3e-3, double depth_m = 2.2e-3) {
  const double z_m = side * 40e-3, tilt_m = side * 0.05 * depth_m;
  Stage stage;
  stage.scene.hologram = {{128, 96}, {8e-6, 8e-6}, 638e-9};
  stage.add(rectangle({-x_m, 0.05e-3, z_m + tilt_m}, {0.2e-3, 0, tilt_m}, {0, 0.25e-3, 0}));
  stage.add(rectangle({x_m + 0.05e-3, -0.1e-3, z_m + side * depth_m - tilt_m}, {0.15e-3, 0, 0},
                      {0, 0.2e-3, tilt_m}));
  return stage;
}

/// Two cards with stripes of different width, left before the hologram and right beyond it.
Stage striped_cards() {
  Stage stage;
  stage.scene.hologram = {{320, 240}, {8e-6, 8e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 20e-6;
  stage.scene.sampling.frames = 8;
  for (int i = 0; i < 4; ++i) {
    stage.add(rectangle({-0.9e-3 + 0.2e-3 * i, 0, -40e-3}, {0.05e-3, 0, 0}, {0, 0.5e-3, 0}));
    stage.add(rectangle({0.5e-3, -0.3e-3 + 0.2e-3 * i, 45e-3}, {0.4e-3, 0, 0}, {0, 0.06e-3, 0}));
  }
  return stage;
}

/// A message of make_plan.
std::string refusal_of(const Stage& stage, Method method = Method::wrp) {
  return input_error_of([&] { make_plan(stage.scene, stage.world, method); });
}

/// The sample of an object, which has one only.
std::size_t only_sample(const Rig& rig, int object) {
  std::size_t found = rig.samples.size(), count = 0;
  for (std::size_t i = 0; i < rig.samples.size(); ++i) {
    if (rig.object_of(rig.samples[i]) != object) continue;
    found = i;
    ++count;
  }
  REQUIRE(count == 1);
  return found;
}

}  // namespace

DEVICE_TEST("a scene and its mirror image give conjugate fields, to the rounding of places") {
  const double x_m = GENERATE(0.3e-3, 1.5e-3), depth_m = GENERATE(2.2e-3, 0.1e-3, 10e-6);
  // Places are floats about the middle of the scene: half their last bit, as a phase
  const double largest_sine = 638e-9 / 16e-6;
  const double rounding =
      2 * std::numbers::pi / 638e-9 * 0x1p-24 * (depth_m + largest_sine * 2 * (x_m + 0.2e-3));
  for (const auto propagation : {WrpPropagation::spectrum, WrpPropagation::compact}) {
    for (const auto method : {Method::wrp, Method::points}) {
      if (method == Method::points && propagation == WrpPropagation::compact) continue;
      const auto beyond = with(propagation, two_cards(1, x_m, depth_m)),
                 before = with(propagation, two_cards(-1, x_m, depth_m));
      RenderOptions options{.method = method};
      const auto a = render(device, beyond.scene, beyond.world, options);
      auto b = render(device, before.scene, before.world, options);
      REQUIRE(b.plan.extent.far_m < 0);
      for (auto& sample : b.field.samples) sample = std::conj(sample);
      const auto same = compare_fields(a.field, b.field);
      CAPTURE(static_cast<int>(method), x_m, depth_m, same.error, rounding);
      CHECK(same.error < rounding);
      // They are no real numbers, whose conjugates they would be anyhow.
      for (auto& sample : b.field.samples) sample = std::conj(sample);
      CHECK(compare_fields(a.field, b.field).correlation < 0.2);
    }
  }
}

DEVICE_TEST("what is nearer to the eye hides what is farther, before the hologram and beyond it") {
  struct Case {
    const char* name;
    double point_z_m, card_z_m;
    bool hides;  // for the parts of the window whose line through the point meets the card
  };
  const Case cases[] = {
      {"both before the hologram", -20e-3, -30e-3, true},
      {"the card nearer to the hologram than a real image", -20e-3, -10e-3, false},
      {"a card before the hologram, a point beyond", 20e-3, -10e-3, true},
      {"a card beyond the hologram, a point before", -20e-3, 10e-3, false},
      {"both beyond the hologram", 20e-3, 10e-3, true}};
  for (const auto& [name, point_z_m, card_z_m, hides] : cases) {
    Stage stage;
    stage.scene.hologram = {{61, 47}, {8e-6, 8e-6}, 638e-9};
    stage.add(rectangle({13e-6, 13e-6, point_z_m}, {18e-6, 0, 0}, {0, 18e-6, 0}));
    // Its left edge lies at x = 0.02 mm.
    stage.add(rectangle({5.02e-3, 0, card_z_m}, {5e-3, 0, 0}, {0, 5e-3, 0}));
    stage.scene.sampling.pitch_m = 36e-6;
    const Rig rig(device, stage);
    const auto point = only_sample(rig, 0);
    const auto p = reference::place(rig.samples[point]) + rig.plan.extent.origin_m;
    const auto window_m = dvec2(rig.plan.hologram.size) * rig.plan.hologram.pitch_m *
                          std::max(1.0, rig.plan.cone.half_width);
    const int parts = rig.table.visibility_parts;
    int wrong = 0, hidden = 0;
    for (int i = 0; i < parts; ++i) {
      const double from_x = ((i + 0.5) / parts - 0.5) * window_m.x;
      const double at_x = from_x + (p.x - from_x) * card_z_m / p.z;  // of the line, on the card
      for (int j = 0; j < parts; ++j) {
        const bool is_hidden = hides && at_x > 0.02e-3;
        wrong += rig.sees(point, i, j) == is_hidden;
        hidden += is_hidden;
      }
    }
    INFO(name << ": " << hidden << " hidden, " << wrong << " wrong");
    CHECK(wrong == 0);
    CHECK((hidden > 0 && hidden < parts * parts) == hides);
    // What the eye sees of a surface faces it.
    for (const auto& s : rig.samples) CHECK(s.nz < 0);
  }
}

DEVICE_TEST("a closed ball before the hologram has samples on all of the side that faces the eye") {
  // Normal cones cull what faces away from the eye, where rays go towards the hologram's centre.
  for (const double z_m : {-30e-3, 30e-3}) {
    Stage stage;
    stage.scene.hologram = {{61, 47}, {8e-6, 8e-6}, 638e-9};
    const double radius_m = 0.4e-3;
    stage.add(sphere({0, 0, z_m}, radius_m, 24));
    const Rig rig(device, stage, Method::points, false);
    const double step_m = rig.plan.lattice.step * std::abs(z_m);
    const double wanted = std::numbers::pi * radius_m * radius_m / (step_m * step_m);
    INFO(z_m << ": " << rig.samples.size() << " samples, " << wanted << " wanted");
    CHECK(std::abs(static_cast<double>(rig.samples.size()) / wanted - 1) < 0.03);
    int wrong = 0;
    for (const auto& s : rig.samples)
      wrong += reference::place(s).z > 0.02 * radius_m || s.nz > 0.1f || !(s.weight > 0);
    CHECK(wrong == 0);
  }
}

TEST_CASE("what does not know z < 0 says so") {
  const auto before = two_cards(-1);
  Stage through;
  through.scene.hologram = {{128, 96}, {8e-6, 8e-6}, 638e-9};
  through.scene.wrp.propagation = WrpPropagation::automatic;
  through.add(rectangle({0, 0, 0}, {0.2e-3, 0, 0.1e-3}, {0, 0.25e-3, 0}));
  auto mirror = through, refined = through, distance = before;
  mirror.scene.materials[0].reflectivity = Spectrum(0.5);
  refined.scene.refine.emplace();
  distance.scene.wrp.distances_m = {40e-3};
  CHECK(refusal_of(before).empty());
  CHECK(refusal_of(through).empty());
  CHECK(refusal_of(striped_cards(), Method::rays).empty());
  auto fans = striped_cards();
  fans.scene.sampling.mode = SamplingMode::fan;
  CHECK_SAYS(refusal_of(fans), "z = -40 mm", "aimed");
  CHECK_SAYS(refusal_of(mirror), "too near to the hologram", "mirrors and glass", "0.256 mm away");
  CHECK_SAYS(refusal_of(refined), "[refine]");
  CHECK_SAYS(refusal_of(distance), "wrp.distance");
}

DEVICE_TEST("fans show before the hologram what they show beyond it") {
  double in_focus[2], beside[2];
  for (const int i : {0, 1}) {
    const double z_m = i == 0 ? 40e-3 : -40e-3;
    Stage stage;
    stage.scene.hologram = {{320, 240}, {8e-6, 8e-6}, 638e-9};
    stage.scene.sampling.pitch_m = 20e-6;
    stage.scene.sampling.frames = 8;
    stage.scene.sampling.mode = SamplingMode::fan;
    stage.add(rectangle({-0.3e-3, 0, z_m}, {0.15e-3, 0, 0}, {0, 0.4e-3, 0}))
        .add(rectangle({0.25e-3, 0.1e-3, z_m + 0.5e-3}, {0.1e-3, 0, 0}, {0, 0.3e-3, 0}));
    const auto shown = render(device, stage.scene, stage.world);
    CHECK(shown.plan.layers[0].distance_m < z_m);
    in_focus[i] = psnr_db_of_shown(device, stage, shown, z_m, z_m, 8);
    beside[i] = psnr_db_of_shown(device, stage, shown, z_m, z_m + 10e-3, 8);
  }
  CAPTURE(in_focus[0], in_focus[1], beside[0], beside[1]);
  CHECK(in_focus[1] > in_focus[0] - 1);
  CHECK(in_focus[1] > beside[1] + 3);
}

DEVICE_TEST("reconstructions before and beyond the hologram show what a lens sees there") {
  for (const auto propagation : {WrpPropagation::spectrum, WrpPropagation::compact}) {
    const auto stage = with(propagation, striped_cards());
    const auto shown = render(device, stage.scene, stage.world);
    const auto similar = [&](double lens_z_m, double shown_z_m) {
      return psnr_db_of_shown(device, stage, shown, lens_z_m, shown_z_m, 8);
    };
    const double before = similar(-40e-3, -40e-3), beyond = similar(45e-3, 45e-3),
                 swapped = similar(-40e-3, 45e-3), unfocused = similar(-40e-3, -30e-3);
    CAPTURE(before, beyond, swapped, unfocused);
    CHECK(before > 24);
    CHECK(beyond > 24);
    CHECK(swapped < before - 6);
    CHECK(unfocused < before - 3);
  }
}
