// SPDX-License-Identifier: Apache-2.0
#include "host/plan.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <random>

#include "host/error.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using Catch::Approx;
using test::mm;
using test::um;

/// Square of this side that faces the hologram, centred at `centre_m`.
World square_world(double side_m, glm::dvec3 centre_m, double depth_m = 0) {
  World world;
  for (const glm::dvec3 corner : {glm::dvec3(-1, -1, -1), {1, -1, -1}, {1, 1, 1}, {-1, 1, 1}})
    world.positions.push_back(centre_m + glm::dvec3(corner.x * side_m, corner.y * side_m, corner.z * depth_m) / 2.0);
  world.triangles = {{0, 1, 2}, {0, 2, 3}};
  world.triangle_object = {0, 0};
  world.object_closed = {false};
  world.min_m = world.positions[0];
  world.max_m = world.positions[2];
  return world;
}

/// The paper's SLM: 1920 x 1080 pixels of 3.74 um, 638 nm.
Scene paper_scene(SamplingMode mode = SamplingMode::fan) {
  Scene scene;
  scene.file = "scene.toml";
  scene.sampling.mode = mode;
  scene.materials = {test::glowing()};
  scene.objects = {test::object_at("", 1, {})};
  return scene;
}

Plan plan_of(const Scene& scene, const World& world) { return make_plan(scene, world); }

TEST_CASE("a fan fills the hologram's angle, turned towards it, with rays a sampling pitch apart at the object") {
  // Paper, Eq. 4-7 with W = 7.2 mm, z = 90 mm: width 0.08; at 10 mm behind the plane and p = 0.1 mm the step may be 0.01: 8 rays.
  const auto straight = fan_tangents(7.2 * mm, 90 * mm, 0, 10 * mm, 0.1 * mm);
  REQUIRE(straight.size() == 8);
  CHECK(straight.front() == Approx(-0.035));
  CHECK(straight.back() == Approx(0.035));
  const auto turned = fan_tangents(7.2 * mm, 90 * mm, 3.6 * mm, 10 * mm, 0.1 * mm);
  REQUIRE(turned.size() == 8);
  for (std::size_t i = 0; i < 8; ++i) CHECK(turned[i] - straight[i] == Approx(0.04));

  std::mt19937 random(1);
  for (int n = 0; n < 200; ++n) {
    const auto draw = [&](double low, double high) { return low * std::pow(high / low, std::uniform_real_distribution<>(0, 1)(random)); };
    const double window = draw(0.1 * mm, 20 * mm), z = draw(1 * mm, 1), depth = draw(10 * um, 50 * mm), p = draw(20 * um, 1 * mm);
    const double shift = draw(0.1 * mm, 50 * mm);
    const auto fan = fan_tangents(window, z, shift, depth, p);
    const auto count = static_cast<double>(fan.size());
    const double width = window / z;
    CHECK((fan.front() + fan.back()) / 2 == Approx(shift / z));
    CHECK(width / count * depth <= p * (1 + 1e-6));                                                    // no wider than p at the object,
    CHECK((fan.size() == 1 || width / (count - 1) * depth > p * (1 - 1e-6)));                          // and one ray fewer would be
    for (std::size_t i = 1; i < fan.size(); ++i) CHECK(fan[i] - fan[i - 1] == Approx(width / count));  // evenly
  }
}

TEST_CASE("a fan that a hair's breadth of rounding would give one ray more has none more") {
  CHECK(fan_tangents(8 * mm, 80 * mm, 0, 3 * mm, 0.1 * mm).size() == 3);  // 0.1 * 3 mm / 0.1 mm is 3.0000000000000004 in double
  CHECK(fan_tangents(8 * mm, 80 * mm, 0, 1e-12, 0.1 * mm).size() == 1);
  CHECK(fan_tangents(8 * mm, 80 * mm, 0, -1 * mm, 0.1 * mm) == std::vector<double>{0});
}

TEST_CASE("every ray of a plan's fans reaches the hologram and is one that the SLM's pixels can show") {
  auto scene = paper_scene();
  scene.hologram.pitch_m = {8 * um, 8 * um};  // sine at most 638 nm / 16 um = 0.0399
  scene.hologram.resolution = {960, 540};
  scene.wrp.grid = glm::ivec2(3, 3);
  const auto plan = plan_of(scene, square_world(20 * mm, {0, 0, 200 * mm}));
  REQUIRE(plan.largest_sine.x == Approx(0.039875));
  const double half_width = 960 * 8 * um / plan.slabs[0].distance_m / 2;
  std::size_t fewest = SIZE_MAX, most = 0;
  for (const auto& wrp : plan.wrps) {
    REQUIRE_FALSE(wrp.fan.empty());
    fewest = std::min(fewest, wrp.fan.size());
    most = std::max(most, wrp.fan.size());
    for (const auto& t : wrp.fan) {
      const double length = std::sqrt(1 + t.x * t.x + t.y * t.y);
      CHECK(std::abs(t.x) / length <= plan.largest_sine.x);
      CHECK(std::abs(t.y) / length <= plan.largest_sine.y);
      CHECK(std::abs(t.x - wrp.centre_m.x / plan.slabs[0].distance_m) <= half_width);
    }
  }
  CHECK(fewest < most);  // the outer WRPs, turned by 0.04, lose steep rays
  const auto centre = plan.wrps[4].fan;
  CHECK(centre.size() == most);
}

TEST_CASE("a perspective fan's rays converge on the hologram, whichever pixel and WRP they start from") {
  auto scene = paper_scene();
  scene.sampling.shape = FanShape::perspective;
  scene.wrp.grid = glm::ivec2(2, 2);
  const auto plan = plan_of(scene, square_world(12.5 * mm, {0, 0, 100 * mm}, 2 * mm));
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  for (const auto& wrp : plan.wrps) {
    for (const auto& t : wrp.fan) {
      for (const glm::dvec2 pixel_m : {glm::dvec2(wrp.centre_m), glm::dvec2(wrp.centre_m) + window / 2.0}) {
        const auto at_hologram = pixel_m - (t + wrp.convergence_per_m * pixel_m) * plan.slabs[0].distance_m;
        CHECK(std::abs(at_hologram.x) <= window.x / 2);
        CHECK(std::abs(at_hologram.y) <= window.y / 2);
        CHECK(at_hologram.x == Approx(-t.x * plan.slabs[0].distance_m).margin(1e-12));  // the same point for every pixel
      }
    }
  }
}

TEST_CASE(
    "WRPs that gather fans stand in front of the nearest surface, those that gather samples amid the surfaces, both where they are told") {
  for (const auto mode : {SamplingMode::fan, SamplingMode::aimed}) {
    for (const double z : {3 * mm, 10 * mm, 100 * mm, 10.0}) {
      for (const double p : {z / 3e3, z / 300, z}) {
        auto scene = paper_scene(mode);
        scene.sampling.pitch_m = p;
        const auto plan = plan_of(scene, square_world(z / 100, {0, 0, z}, z / 10));
        CHECK(plan.near_m == Approx(0.95 * z));
        CHECK(plan.slabs[0].distance_m > 0);
        if (mode == SamplingMode::fan)
          CHECK(plan.slabs[0].distance_m < plan.near_m);
        else
          CHECK((plan.slabs[0].distance_m > plan.near_m && plan.slabs[0].distance_m < plan.far_m));
      }
    }
    auto scene = paper_scene(mode);
    scene.wrp.distances_m = {99 * mm};  // inside the scene
    CHECK(plan_of(scene, square_world(1 * mm, {0, 0, 100 * mm}, 4 * mm)).slabs[0].distance_m == 99 * mm);
  }
}

TEST_CASE("a sampling pitch that would take too many rays or samples is refused") {
  auto scene = paper_scene();
  scene.sampling.pitch_m = 1e-8;
  CHECK_THROWS_WITH(plan_of(scene, square_world(0.1 * mm, {0, 0, 2 * mm}, 1 * mm)), Catch::Matchers::ContainsSubstring("rays per pixel"));
  CHECK_THROWS_WITH(plan_of(scene, square_world(100 * mm, {0, 0, 100 * mm})), Catch::Matchers::ContainsSubstring("lattice cells"));
}

TEST_CASE("WRPs placed behind the whole scene are refused where rays form a fan, which goes forwards, and serve aimed rays") {
  auto scene = paper_scene();
  scene.wrp.distances_m = {102 * mm};
  scene.sampling.mode = SamplingMode::aimed;
  CHECK(plan_of(scene, square_world(1 * mm, {0, 0, 100 * mm})).slabs[0].distance_m == 102 * mm);
  scene.sampling.mode = SamplingMode::fan;
  for (const double z_m : {100 * mm, 102 * mm, 1.0}) {
    scene.wrp.distances_m = {z_m};
    CHECK_THROWS_AS(plan_of(scene, square_world(1 * mm, {0, 0, 100 * mm})), InputError);
  }
  CHECK_THROWS_WITH(plan_of(scene, square_world(1 * mm, {0, 0, 100 * mm})), Catch::Matchers::ContainsSubstring("100 mm"));
}

TEST_CASE("an automatic grid holds all light on its way from the scene into the hologram, and is no larger than that takes") {
  std::mt19937 random(1);
  for (const glm::dvec3 centre : {glm::dvec3(0, 0, 100 * mm), {3 * mm, -2 * mm, 100 * mm}, {0, 0, 300 * mm}}) {
    for (const double side : {2 * mm, 12.5 * mm, 20 * mm}) {
      const auto world = square_world(side, centre, 2 * mm);
      const auto plan = plan_of(paper_scene(), world);
      const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
      const glm::dvec2 low = glm::dvec2(plan.wrps[0].centre_m) + glm::dvec2(-1, 1) * window / 2.0,
                       high = glm::dvec2(plan.wrps.back().centre_m) + glm::dvec2(1, -1) * window / 2.0;
      glm::dvec2 least(INFINITY), most(-INFINITY);
      for (int i = 0; i < 20000; ++i) {
        // Corners first, then anywhere.
        const auto unit = [&] { return i < 4096 ? static_cast<double>(random() % 2) : std::uniform_real_distribution<>(0, 1)(random); };
        const double s = unit(), t = unit();
        const auto& a = world.positions;
        const glm::dvec3 from = a[0] + s * (a[1] - a[0]) + t * (a[3] - a[0]);
        const glm::dvec3 to((unit() - 0.5) * window.x, (unit() - 0.5) * window.y, 0);
        const auto way = to - from;
        if (glm::any(glm::greaterThan(glm::abs(glm::dvec2(way)), plan.largest_sine * glm::length(way)))) continue;  // cannot be shown
        const glm::dvec2 crossing(from + way * ((from.z - plan.slabs[0].distance_m) / from.z));
        least = glm::min(least, crossing);
        most = glm::max(most, crossing);
      }
      // A hundredth of a WRP may be left out.
      CHECK(least.x >= low.x - 0.01 * window.x);
      CHECK(most.x <= high.x + 0.01 * window.x);
      CHECK(least.y >= high.y - 0.01 * window.y);
      CHECK(most.y <= low.y + 0.01 * window.y);
      CHECK((plan.grid.x == 1 || (plan.grid.x - 1) * window.x < most.x - least.x));
      CHECK((plan.grid.y == 1 || (plan.grid.y - 1) * window.y < most.y - least.y));
    }
  }
}

TEST_CASE("a square of 20 mm at 100 mm needs 3 x 5 WRPs of 7.18 mm x 4.04 mm") {
  // At the WRPs' depth of 95.8 mm the light from its edge at 10 mm into the hologram's edge at 3.59 mm (2.02 mm) passes 9.73 mm (9.67 mm)
  // from the axis: 2.71 and 4.79 WRPs.
  const auto plan = plan_of(paper_scene(), square_world(20 * mm, {0, 0, 100 * mm}));
  CHECK(plan.slabs[0].distance_m == Approx(95.82 * mm).epsilon(1e-4));
  CHECK(plan.grid == glm::ivec2(3, 5));
}

TEST_CASE("WRPs of a given grid stand side by side from the top left without gap or overlap") {
  auto scene = paper_scene();
  scene.wrp.grid = glm::ivec2(3, 2);
  const auto plan = plan_of(scene, square_world(5 * mm, {2 * mm, 1 * mm, 100 * mm}));
  REQUIRE(plan.grid == glm::ivec2(3, 2));
  REQUIRE(plan.wrps.size() == 6);
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 3; ++column) {
      const auto centre = plan.wrps[static_cast<std::size_t>(row * 3 + column)].centre_m - plan.wrps[0].centre_m;
      CHECK(centre.x == Approx(column * window.x).margin(1e-15));
      CHECK(centre.y == Approx(-row * window.y).margin(1e-15));
      CHECK(centre.z == 0);
    }
  }
}

TEST_CASE("a grid of more than 1024 WRPs is refused") {
  auto scene = paper_scene();
  CHECK_THROWS_AS(plan_of(scene, square_world(500 * mm, {0, 0, 3})), InputError);
  scene.wrp.grid = glm::ivec2(1024, 2);
  CHECK_THROWS_AS(plan_of(scene, square_world(1 * mm, {0, 0, 100 * mm})), InputError);
}

TEST_CASE("bounces are followed only when an object's material asks for them") {
  auto scene = paper_scene();
  scene.trace.depth = 3;
  auto mirror = test::glowing(), glass = test::glowing();
  mirror.reflectivity = 0.5;
  glass.transparency = 0.5;
  scene.materials = {test::glowing(), mirror, glass};
  const auto world = square_world(1 * mm, {0, 0, 100 * mm});
  const auto bounces = [&](int material, int depth) {
    scene.objects[0].material = material;
    scene.trace.depth = depth;
    return plan_of(scene, world).bounces;
  };
  CHECK(bounces(0, 3) == 0);  // mirror and glass are there, but nothing is made of them
  CHECK(bounces(1, 3) == 3);
  CHECK(bounces(2, 16) == 16);
  CHECK(bounces(1, 0) == 0);
}

}  // namespace
}  // namespace raywave
