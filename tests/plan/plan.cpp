// SPDX-License-Identifier: Apache-2.0
#include "host/plan/plan.hpp"

#include <glm/vector_relational.hpp>

#include "host/carriers/wrps/planning/fans.hpp"
#include "host/planning/make_plan.hpp"
#include "tests/support/plans.hpp"
#include "tests/support/worlds.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Approx;

/// Square of this side that faces the hologram, centred at `centre_m`.
World square_world(double side_m, glm::dvec3 centre_m, double depth_m = 0) {
  return world_of_squares({{side_m, centre_m, depth_m}});
}

/// The paper's SLM: 1920 x 1080 pixels of 3.74 um, 638 nm.
Scene paper_scene(SamplingMode mode = SamplingMode::fan) {
  Scene scene;
  scene.file = "scene.toml";
  scene.sampling.mode = mode;
  scene.materials = {glowing()};
  scene.objects = {object_at("", 1, {})};
  return scene;
}

TEST_CASE(
    "a fan fills the hologram's angle, turned towards it, with rays a sampling pitch apart at the "
    "object") {
  // Paper, Eq. 4-7 with W = 7.2 mm, z = 90 mm: width 0.08; at 10 mm behind the plane and p = 0.1 mm
  // the step may be 0.01: 8 rays.
  const auto straight = fan_tangents(7.2 * mm, 90 * mm, 0, 10 * mm, 0.1 * mm);
  REQUIRE(straight.size() == 8);
  CHECK(straight.front() == Approx(-0.035));
  CHECK(straight.back() == Approx(0.035));
  const auto turned = fan_tangents(7.2 * mm, 90 * mm, 3.6 * mm, 10 * mm, 0.1 * mm);
  REQUIRE(turned.size() == 8);
  for (std::size_t i = 0; i < 8; ++i) CHECK(turned[i] - straight[i] == Approx(0.04));

  std::mt19937 random(1);
  for (int n = 0; n < 200; ++n) {
    const auto draw = [&](double low, double high) {
      return low * std::pow(high / low, std::uniform_real_distribution<>(0, 1)(random));
    };
    const double window = draw(0.1 * mm, 20 * mm), z = draw(1 * mm, 1),
                 depth = draw(10 * um, 50 * mm), p = draw(20 * um, 1 * mm);
    const double shift = draw(0.1 * mm, 50 * mm);
    const auto fan = fan_tangents(window, z, shift, depth, p);
    const auto count = static_cast<double>(fan.size());
    const double width = window / z;
    CHECK((fan.front() + fan.back()) / 2 == Approx(shift / z));
    // No wider than p at the object,
    CHECK(width / count * depth <= p * (1 + 1e-6));
    // And one ray fewer would be
    CHECK((fan.size() == 1 || width / (count - 1) * depth > p * (1 - 1e-6)));
    // Evenly
    for (std::size_t i = 1; i < fan.size(); ++i)
      CHECK(fan[i] - fan[i - 1] == Approx(width / count));
  }
}

TEST_CASE("rounding errors do not add a ray to a fan") {
  // 0.1 * 3 mm / 0.1 mm is 3.0000000000000004 in double
  CHECK(fan_tangents(8 * mm, 80 * mm, 0, 3 * mm, 0.1 * mm).size() == 3);
  CHECK(fan_tangents(8 * mm, 80 * mm, 0, 1e-12, 0.1 * mm).size() == 1);
  CHECK(fan_tangents(8 * mm, 80 * mm, 0, -1 * mm, 0.1 * mm) == std::vector<double>{0});
}

TEST_CASE(
    "every ray of a plan's fans reaches the hologram and is one that the SLM's pixels can show") {
  auto scene = paper_scene();
  scene.hologram.pitch_m = {8 * um, 8 * um};  // sine at most 638 nm / 16 um = 0.0399
  scene.hologram.resolution = {960, 540};
  scene.wrp.grid = glm::ivec2(3, 3);
  const auto plan = make_plan(scene, square_world(20 * mm, {0, 0, 200 * mm}));
  REQUIRE(plan.hologram.largest_sine.x == Approx(0.039875));
  const double half_width = 960 * 8 * um / plan.layers[0].distance_m / 2;
  std::size_t fewest = SIZE_MAX, most = 0;
  for (const auto& wrp : plan.wrps) {
    REQUIRE_FALSE(wrp.fan.empty());
    fewest = std::min(fewest, wrp.fan.size());
    most = std::max(most, wrp.fan.size());
    for (const auto& t : wrp.fan) {
      const double length = std::sqrt(1 + t.x * t.x + t.y * t.y);
      CHECK(std::abs(t.x) / length <= plan.hologram.largest_sine.x);
      CHECK(std::abs(t.y) / length <= plan.hologram.largest_sine.y);
      CHECK(std::abs(t.x - wrp.centre_m.x / plan.layers[0].distance_m) <= half_width);
    }
  }
  CHECK(fewest < most);  // the outer WRPs, turned by 0.04, lose steep rays
  const auto centre = plan.wrps[4].fan;
  CHECK(centre.size() == most);
}

TEST_CASE(
    "WRPs that gather fans stand in front of the nearest surface, WRPs that gather samples amid "
    "the surfaces, and both at a given distance") {
  for (const auto mode : {SamplingMode::fan, SamplingMode::aimed}) {
    for (const double z : {3 * mm, 10 * mm, 100 * mm, 10.0}) {
      for (const double p : {z / 3e3, z / 300, z}) {
        auto scene = paper_scene(mode);
        scene.sampling.pitch_m = p;
        scene.wrp.propagation = WrpPropagation::spectrum;
        const auto plan = make_plan(scene, square_world(z / 100, {0, 0, z}, z / 10));
        CHECK(plan.extent.near_m == Approx(0.95 * z));
        CHECK(plan.layers[0].distance_m > 0);
        if (mode == SamplingMode::fan)
          CHECK(plan.layers[0].distance_m < plan.extent.near_m);
        else
          CHECK((plan.layers[0].distance_m > plan.extent.near_m &&
                 plan.layers[0].distance_m < plan.extent.far_m));
      }
    }
    auto scene = paper_scene(mode);
    scene.wrp.distances_m = {99 * mm};  // inside the scene
    CHECK(make_plan(scene, square_world(1 * mm, {0, 0, 100 * mm}, 4 * mm)).layers[0].distance_m ==
          99 * mm);
  }
}

TEST_CASE(
    "WRPs behind the whole scene are refused for fans, whose rays go forwards, and accepted for "
    "aimed rays") {
  auto scene = paper_scene();
  scene.wrp.distances_m = {102 * mm};
  scene.sampling.mode = SamplingMode::aimed;
  CHECK(make_plan(scene, square_world(1 * mm, {0, 0, 100 * mm})).layers[0].distance_m == 102 * mm);
  scene.sampling.mode = SamplingMode::fan;
  for (const double z_m : {100 * mm, 102 * mm, 1.0}) {
    scene.wrp.distances_m = {z_m};
    CHECK_THROWS_AS(make_plan(scene, square_world(1 * mm, {0, 0, 100 * mm})), InputError);
  }
  CHECK_REFUSED(make_plan(scene, square_world(1 * mm, {0, 0, 100 * mm})), "100 mm");
}

TEST_CASE(
    "an automatic grid of WRPs covers all light from the scene to the hologram and is no larger "
    "than necessary") {
  std::mt19937 random(1);
  for (const glm::dvec3 centre :
       {glm::dvec3(0, 0, 100 * mm), {3 * mm, -2 * mm, 100 * mm}, {0, 0, 300 * mm}}) {
    for (const double side : {2 * mm, 12.5 * mm, 20 * mm}) {
      const auto world = square_world(side, centre, 2 * mm);
      const auto plan = make_plan(paper_scene(), world);
      const glm::dvec2 window = glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m;
      const glm::dvec2 low = glm::dvec2(plan.wrps[0].centre_m) + glm::dvec2(-1, 1) * window / 2.0,
                       high =
                           glm::dvec2(plan.wrps.back().centre_m) + glm::dvec2(1, -1) * window / 2.0;
      glm::dvec2 least(INFINITY), most(-INFINITY);
      for (int i = 0; i < 20000; ++i) {
        // Corners first, then anywhere.
        const auto unit = [&] {
          return i < 4096 ? static_cast<double>(random() % 2)
                          : std::uniform_real_distribution<>(0, 1)(random);
        };
        const double s = unit(), t = unit();
        const auto& a = world.positions;
        const glm::dvec3 from = a[0] + s * (a[1] - a[0]) + t * (a[3] - a[0]);
        const glm::dvec3 to((unit() - 0.5) * window.x, (unit() - 0.5) * window.y, 0);
        const auto way = to - from;
        // Cannot be shown
        if (glm::any(glm::greaterThan(glm::abs(glm::dvec2(way)),
                                      plan.hologram.largest_sine * glm::length(way))))
          continue;
        const glm::dvec2 crossing(from + way * ((from.z - plan.layers[0].distance_m) / from.z));
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
  // At the WRPs' depth of 95.8 mm the light from its edge at 10 mm into the hologram's edge at 3.59
  // mm (2.02 mm) passes 9.73 mm (9.67 mm) from the axis: 2.71 and 4.79 WRPs.
  const auto plan = make_plan(paper_scene(), square_world(20 * mm, {0, 0, 100 * mm}));
  CHECK(plan.layers[0].distance_m == Approx(95.82 * mm).epsilon(1e-4));
  CHECK(plan.grid == glm::ivec2(3, 5));
}

TEST_CASE("WRPs of a given grid stand side by side from the top left without gap or overlap") {
  auto scene = paper_scene();
  scene.wrp.grid = glm::ivec2(3, 2);
  const auto plan = make_plan(scene, square_world(5 * mm, {2 * mm, 1 * mm, 100 * mm}));
  REQUIRE(plan.grid == glm::ivec2(3, 2));
  REQUIRE(plan.wrps.size() == 6);
  const glm::dvec2 window = glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m;
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 3; ++column) {
      const auto centre = plan.wrps[row * 3 + column].centre_m - plan.wrps[0].centre_m;
      CHECK(centre.x == Approx(column * window.x).margin(1e-15));
      CHECK(centre.y == Approx(-row * window.y).margin(1e-15));
      CHECK(centre.z == 0);
    }
  }
}

TEST_CASE("a grid of more than 1024 WRPs is refused") {
  auto scene = paper_scene();
  CHECK_REFUSED(make_plan(scene, square_world(500 * mm, {0, 0, 3})), "the scene needs",
                "give wrp.grid");
  scene.wrp.grid = glm::ivec2(1024, 2);
  CHECK_REFUSED(make_plan(scene, square_world(1 * mm, {0, 0, 100 * mm})),
                "wrp.grid asks for 1024 x 2 WRPs, 1024 are allowed; give a smaller "
                "one, or \"auto\"");
}

/// Squares of these sides that face the hologram, on its axis.
World squares_at_depths(const std::vector<std::pair<double, double>>& sides_and_depths_m) {
  std::vector<Square> squares;
  for (const auto& [side_m, z_m] : sides_and_depths_m) squares.push_back({side_m, {0, 0, z_m}});
  return world_of_squares(squares);
}

Scene aimed_scene(std::vector<double> distances_m, int layers = 1) {
  auto scene = paper_scene(SamplingMode::aimed);
  scene.wrp.distances_m = std::move(distances_m);
  scene.wrp.layers = layers;
  return scene;
}

TEST_CASE(
    "every depth belongs to one layer, the one on whose WRPs the footprint of its light is "
    "smallest") {
  const auto world = square_world(4 * mm, {0, 0, 100 * mm}, 60 * mm);
  const auto plan = make_plan(aimed_scene({80 * mm, 95 * mm, 99 * mm, 120 * mm}), world);
  REQUIRE(plan.layers.size() == 4);
  CHECK(plan.layers.front().begin_m == -INFINITY);
  CHECK(plan.layers.back().end_m == INFINITY);
  for (std::size_t i = 1; i < 4; ++i) CHECK(plan.layers[i].begin_m == plan.layers[i - 1].end_m);
  std::mt19937 random(1);
  for (int n = 0; n < 1000; ++n) {
    const double z = std::uniform_real_distribution<>(60 * mm, 140 * mm)(random);
    const auto cone = [&](const DepthLayer& layer) { return std::abs(1 - layer.distance_m / z); };
    const auto& own = plan.layer_at(z);
    CHECK((own.begin_m <= z && z < own.end_m));
    for (const auto& layer : plan.layers) CHECK(cone(own) <= cone(layer) * (1 + 1e-12));
  }
  for (const auto& layer : plan.layers) {  // as floats too
    const auto [begin, end] = layer_bounds(plan, layer);
    CHECK(begin < end);
    if (&layer != &plan.layers.back()) CHECK(end == layer_bounds(plan, *(&layer + 1)).first);
  }
}

TEST_CASE("light of a layer's surfaces crosses that layer's WRPs on its way to the hologram") {
  auto scene = aimed_scene({}, 3);
  scene.wrp.propagation = WrpPropagation::spectrum;
  const auto world = square_world(16 * mm, {2 * mm, -1 * mm, 100 * mm}, 30 * mm);
  const auto plan = make_plan(scene, world);
  REQUIRE(plan.layers.size() == 3);
  const glm::dvec2 window = glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m;
  std::mt19937 random(1);
  const auto unit = [&] { return std::uniform_real_distribution<>(0, 1)(random); };
  int wanted = 0, caught = 0;
  for (int n = 0; n < 20000; ++n) {
    const double s = unit(), t = unit();
    const auto& a = world.positions;
    const glm::dvec3 from = a[0] + s * (a[1] - a[0]) + t * (a[3] - a[0]);
    const auto way = glm::dvec3((unit() - 0.5) * window.x, (unit() - 0.5) * window.y, 0) - from;
    // Cannot be shown
    if (glm::any(glm::greaterThan(glm::abs(glm::dvec2(way)),
                                  plan.hologram.largest_sine * glm::length(way))))
      continue;
    const auto& layer = plan.layer_at(from.z);
    CHECK((layer.min_m.z <= from.z && from.z <= layer.max_m.z));
    const glm::dvec2 crossing(from + way * ((from.z - layer.distance_m) / from.z));
    ++wanted;
    caught += std::any_of(plan.wrps.begin(), plan.wrps.end(), [&](const Wrp& wrp) {
      const auto off = glm::abs(crossing - glm::dvec2(wrp.centre_m)) - window / 2.0;
      // A hundredth of a WRP may be left out.
      return &plan.layer_of(wrp) == &layer && std::max(off.x / window.x, off.y / window.y) <= 0.01;
    });
  }
  CHECK(caught == wanted);
  CHECK(wanted > 1000);
}

TEST_CASE("planned distances are the means of the layers that spread their surfaces' area least") {
  std::mt19937 random(1);
  for (int n = 0; n < 20; ++n) {
    std::vector<std::pair<double, double>> squares;
    for (int i = 0; i < 7; ++i) {
      squares.emplace_back(std::uniform_real_distribution<>(0.1 * mm, 1 * mm)(random),
                           std::uniform_real_distribution<>(80 * mm, 120 * mm)(random));
    }
    std::sort(squares.begin(), squares.end(), [](auto a, auto b) { return a.second < b.second; });
    // All ways to cut seven squares into three layers.
    const auto layer = [&](int first, int last) {
      double area = 0, depth = 0, squared = 0;
      for (int i = first; i < last; ++i) {
        const auto& [side_m, z_m] = squares[i];
        const double seen = side_m * side_m / (z_m * z_m) * z_m;  // as the hologram sees it
        area += seen;
        depth += seen * z_m;
        squared += seen * z_m * z_m;
      }
      return std::pair{depth / area, squared - depth * depth / area};
    };
    double least = INFINITY;
    std::vector<double> wanted;
    for (int i = 1; i < 6; ++i) {
      for (int j = i + 1; j < 7; ++j) {
        const auto a = layer(0, i), b = layer(i, j), c = layer(j, 7);
        if (const double sum = a.second + b.second + c.second; sum < least) {
          least = sum;
          wanted = {a.first, b.first, c.first};
        }
      }
    }
    const auto plan = make_plan(aimed_scene({}, 3), squares_at_depths(squares));
    REQUIRE(plan.layers.size() == 3);
    for (std::size_t i = 0; i < 3; ++i)
      CHECK(plan.layers[i].distance_m == Approx(wanted[i]).margin(40 * mm / 256));
  }
}

TEST_CASE(
    "WRPs amid a mesh of more triangles than planning looks at stand where all of them together "
    "ask for") {
  const auto ball = mesh_of(sphere({}, 1, 256));  // triangles are small at its poles
  auto scene = paper_scene(SamplingMode::aimed);
  for (const glm::dvec3 rotation : {glm::dvec3(0), {50, 20, 0}}) {
    scene.objects = {object_at("", 8 * mm, {3 * mm, 0, 60 * mm})};
    scene.objects[0].rotation_deg = rotation;
    const auto world = place_objects(scene, {{ball}, {true}, {0}});
    REQUIRE(world.area_samples[0].size() < world.triangles.size() / 2);
    double area[2] = {0, 0}, depth_m[2] = {0, 0};  // solid angles from the hologram, by side
    for (const auto& t : world.triangles) {
      const auto &a = world.positions[t.x], &b = world.positions[t.y], &c = world.positions[t.z];
      const auto middle = (a + b + c) / 3.0;
      const double seen = glm::dot(glm::cross(b - a, c - a), middle) / (middle.z * middle.z);
      area[seen < 0] += std::abs(seen);
      depth_m[seen < 0] += std::abs(seen) * middle.z;
    }
    const double near_m = std::min(depth_m[0] / area[0], depth_m[1] / area[1]);
    const auto plan = make_plan(scene, world);
    INFO("stands at " << plan.layers[0].distance_m << ", all triangles say " << near_m);
    CHECK(std::abs(plan.layers[0].distance_m - near_m) < 0.1 * um);  // measured 8 nm
  }
}

TEST_CASE("a tilted square's layers divide it evenly") {
  const auto plan =
      make_plan(aimed_scene({}, 4), square_world(0.1 * mm, {0, 0, 100 * mm}, 0.8 * mm));
  REQUIRE(plan.layers.size() == 4);
  for (int i = 0; i < 4; ++i)
    CHECK(plan.layers[i].distance_m == Approx((99.7 + 0.2 * i) * mm).margin(0.01 * mm));
  const auto one = make_plan(aimed_scene({}), square_world(0.1 * mm, {0, 0, 100 * mm}, 0.8 * mm));
  CHECK(one.layers[0].distance_m == Approx(100 * mm).margin(0.01 * mm));
}

TEST_CASE("layers without a surface are left out, and surfaces at one depth make one layer") {
  const auto two = squares_at_depths({{1 * mm, 75 * mm}, {1 * mm, 125 * mm}});
  const auto plan = make_plan(aimed_scene({76 * mm, 100 * mm, 124 * mm, 200 * mm}), two);
  REQUIRE(plan.layers.size() == 2);
  CHECK(plan.layers[0].distance_m == 76 * mm);
  CHECK(plan.layers[1].distance_m == 124 * mm);
  CHECK(plan.layers[0].max_m.z == 75 * mm);
  CHECK(plan.layers[1].min_m.z == 125 * mm);
  CHECK(make_plan(aimed_scene({}, 5), two).layers.size() == 2);
  CHECK(make_plan(aimed_scene({}, 5), square_world(1 * mm, {0, 0, 100 * mm})).layers.size() == 1);
  CHECK(make_plan(aimed_scene({1 * mm, 2 * mm, 3 * mm}), two).layers.size() == 1);
}

TEST_CASE(
    "several layers are refused for fans, whose rays go from layer to layer; mirrors whose light "
    "comes from samples have them") {
  const auto world = square_world(1 * mm, {0, 0, 100 * mm}, 4 * mm);
  auto scene = paper_scene();
  scene.wrp.layers = 2;
  CHECK_REFUSED(make_plan(scene, world), "scene.toml: wrp.layers 2: ", "give wrp.layers 1");
  scene.wrp.layers = 1;
  scene.wrp.distances_m = {97 * mm, 99 * mm};
  CHECK_REFUSED(make_plan(scene, world), "give wrp.layers 1 and one wrp.distance");
  scene = aimed_scene({}, 2);
  scene.trace.depth = 1;
  scene.materials[0].reflectivity = 0.5;
  CHECK(make_plan(scene, world).layers.size() == 2);
  scene.materials[0].reflectivity = 0;
  CHECK(make_plan(scene, world).layers.size() == 2);
}

TEST_CASE("bounces are computed only when an object is a mirror or glass") {
  auto scene = paper_scene();
  scene.trace.depth = 3;
  auto mirror = glowing(), glass = glowing();
  mirror.reflectivity = 0.5;
  glass.transparency = 0.5;
  scene.materials = {glowing(), mirror, glass};
  const auto world = square_world(1 * mm, {0, 0, 100 * mm});
  const auto bounces = [&](int material, int depth) {
    scene.objects[0].material = material;
    scene.trace.depth = depth;
    return make_plan(scene, world).specular.bounces;
  };
  CHECK(bounces(0, 3) == 0);  // no object is a mirror or glass, though materials are
  CHECK(bounces(1, 3) == 3);
  CHECK(bounces(2, 16) == 16);
  CHECK(bounces(1, 0) == 0);
}

}  // namespace
}  // namespace raywave
