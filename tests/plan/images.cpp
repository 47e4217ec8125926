// SPDX-License-Identifier: Apache-2.0
/// Where the planner expects what mirrors and glass show (host/planning/images.cpp).
#include "host/planning/images.hpp"

#include "host/planning/make_plan.hpp"
#include "host/reference/surfaces.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/scenes.hpp"

using namespace raywave;
using namespace raywave::reference;
using glm::dvec3;
using test::glowing;

namespace {

Material mirror(double reflectivity) {
  auto m = test::dark();
  m.reflectivity = reflectivity;
  return m;
}

/// 160 x 160 pixels of 8 um at z = 0.
Stage bench() {
  Stage stage;
  stage.scene.hologram = {{160, 160}, {8e-6, 8e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 25e-6;
  return stage;
}

/// A slanted mirror that shows a card before it 10 mm behind it, at 30 mm.
Stage mirror_and_card(double reflectivity, double z_m = 20e-3) {
  const dvec3 middle(0, 0, z_m), n = glm::normalize(dvec3(0.5, 0, -1));
  auto card = rectangle({0, 0, z_m + 10e-3}, {0.25e-3, 0, 0}, {0, 0.25e-3, 0});
  for (auto& p : card.positions) p -= 2 * glm::dot(p - middle, n) * n;
  auto stage = bench();
  stage.add(rectangle(middle, {1e-3, 0, 0.5e-3}, {0, 0.8e-3, 0}), mirror(reflectivity))
      .add(card, glowing());
  return stage;
}

}  // namespace

TEST_CASE("a plane mirror's images lie where the mirrored scene does, before the hologram too") {
  for (const double z_m : {20e-3, -40e-3}) {
    CAPTURE(z_m);
    const auto stage = mirror_and_card(0.9, z_m);
    const auto plan = make_plan(stage.scene, stage.world);
    REQUIRE(plan.specular.images.all.size() > 8);
    for (const auto& image : plan.specular.images.all) {
      CHECK(std::abs(image.at_m.z - (z_m + 10e-3)) < 0.5e-6);
      CHECK(std::abs(image.at_m.x) < 0.26e-3);
      CHECK(image.surfaces == 1);
      CHECK(image.share == Catch::Approx(0.9));
    }
    CHECK(plan.specular.images.beyond < 0.01);
    CHECK(plan.specular.images.far_m == Catch::Approx(z_m + 10e-3));
  }
}

TEST_CASE("images on the hologram's other side count as light that lies elsewhere") {
  const auto stage = mirror_and_card(0.9, -7e-3);
  const auto plan = make_plan(stage.scene, stage.world);
  CHECK(plan.specular.images.all.empty());
  CHECK(plan.specular.images.beyond > 0.5);
}

TEST_CASE("a convex mirror's images lie half its radius behind it") {
  // 1 / v = 2 / R + 1 / s behind the mirror, for a card s before it
  const double radius = 2e-3, before = 6e-3;
  auto stage = bench();
  stage.add(sphere({0, 0, 20e-3 + radius}, radius, 200), mirror(1))
      .add(rectangle({1.9e-3, 0, 20e-3 - before}, {1.1e-3, 0, 0}, {0, -1.5e-3, 0}), glowing());
  const auto plan = make_plan(stage.scene, stage.world);
  REQUIRE_FALSE(plan.specular.images.all.empty());
  const double image_m = 20e-3 + 1 / (2 / radius + 1 / before);
  for (const auto& image : plan.specular.images.all)
    CHECK(std::abs(image.at_m.z - image_m) < 0.07 * (image_m - 20e-3));
}

TEST_CASE("images far away get planes where more than a hundredth of the light comes from there") {
  // A mirror at 45 degrees shows a wall 100 mm aside, before a bright card that fills the view
  struct Case {
    double half_m;
    bool is_kept;
  };
  for (const auto& [half_m, is_kept] : {Case{0.05e-3, false}, Case{0.25e-3, true}}) {
    auto stage = bench();
    const double slant = half_m / std::sqrt(2.0);
    stage.add(rectangle({0, 0, 20e-3}, {slant, 0, slant}, {0, half_m, 0}), mirror(1))
        .add(rectangle({100e-3, 0, 20e-3}, {0, 0, -10e-3}, {0, 10e-3, 0}), glowing())
        .add(rectangle({0, 0, 21e-3}, {0.8e-3, 0, 0}, {0, 0.8e-3, 0}), glowing());
    const auto plan = make_plan(stage.scene, stage.world);
    const double card = std::pow(1.6e-3 / 21e-3, 2),
                 shown = 2 * slant * 2 * half_m / (20e-3 * 20e-3), share = shown / card;
    INFO("share " << share << ", beyond " << plan.specular.images.beyond);
    REQUIRE_FALSE(plan.specular.images.all.empty());
    if (is_kept) {
      CHECK(plan.specular.images.far_m == Catch::Approx(120e-3).epsilon(0.01));
      CHECK(plan.specular.images.beyond < 0.01);
    } else {
      // The wall itself is 30 mm away at most
      CHECK(plan.specular.images.far_m == plan.extent.far_m);
      CHECK(plan.specular.images.beyond == Catch::Approx(share).epsilon(0.3));
    }
  }
}

TEST_CASE("without mirrors or with depth 0 there are no images") {
  auto stage = mirror_and_card(0.9);
  stage.scene.trace.depth = 0;
  CHECK(make_plan(stage.scene, stage.world).specular.images.all.empty());
  const auto matt = mirror_and_card(0);
  CHECK(make_plan(matt.scene, matt.world).specular.images.all.empty());
}

TEST_CASE("images get a depth layer where they lie far from the scene") {
  auto stage = mirror_and_card(0.9);
  // A card that the hologram sees directly, 8 mm before the images
  stage.add(rectangle({-0.6e-3, 0, 21e-3}, {0.3e-3, 0, 0}, {0, 0.3e-3, 0}), glowing());
  stage.scene.wrp.layers = 2;
  const auto plan = make_plan(stage.scene, stage.world);
  REQUIRE(plan.layers.size() == 2);
  CHECK(std::abs(plan.layers[1].distance_m - 30e-3) < 0.5e-3);
  CHECK(plan.layers[0].distance_m < 23e-3);
}
