// SPDX-License-Identifier: Apache-2.0
/// Parts of the window that see samples, and the light of samples.
#include "tests/support/samples.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec2;
using glm::dvec3;

DEVICE_TEST("small objects far from the hologram keep their samples and do not hide themselves") {
  for (const double z : {0.1, 1.0, 10.0}) {
    CAPTURE(z);
    Stage stage;
    stage.scene.sampling.pitch_m = 20e-6;
    stage.add(rectangle({0, 0, z}, {0.2e-3, 0, 0.05e-3}, {0, 0.2e-3, 0}))
        .add(sphere({0.5e-3, 0, z}, 0.2e-3, 60));
    stage.scene.lights = {Light{.direction = {0.1, 0.2, 1}}};
    stage.scene.trace.shadows = true;
    const Rig rig(device, stage);
    int plane = 0, plane_lit = 0, plane_hidden = 0;
    double off = 0;
    for (std::size_t i = 0; i < rig.samples.size(); ++i) {
      const auto& s = rig.samples[i];
      if (rig.object_of(s) != 0) continue;
      const auto p = place(s) + rig.plan.extent.origin_m;
      off = std::max(off, std::abs(p.z - z - p.x / 4));
      ++plane;
      plane_lit += rig.lit[i] & 1u;
      plane_hidden += s.hidden;
    }
    CAPTURE(off);
    CHECK(plane == Catch::Approx(400).margin(45));
    CHECK(plane_lit == plane);
    CHECK(plane_hidden == 0);
    CHECK(off < 2e-10);
  }
}

DEVICE_TEST(
    "a sample is hidden from a part of the hologram exactly when an object lies between, and "
    "samples hidden from all parts are left out") {
  Random random(11);
  std::vector<Stage> stages(3);
  stages[0]
      .add(sphere({0, 0, 19e-3}, 0.3e-3, 10))
      .add(rectangle({0, 0, 19.6e-3}, {0.6e-3, 0, 0}, {0, 0.6e-3, 0}));
  for (std::size_t i = 1; i < stages.size(); ++i) {
    Surface soup;
    const auto corner = [&](double size) {
      const double x = uniform(random, -size, size), y = uniform(random, -size, size),
                   z = uniform(random, -size, size);
      return dvec3(x, y, z);
    };
    for (int t = 0; t < 40; ++t) {
      const auto a = dvec3(0, 0, 20e-3) + corner(0.6e-3);
      soup.triangle(a, a + corner(0.4e-3), a + corner(0.4e-3));
    }
    stages[i].add(soup);
  }
  for (auto& stage : stages) stage.scene.sampling.pitch_m = 50e-6;
  // The mask of every sample is compared with rays of the oracle to the centres of all parts.
  for (const auto& stage : stages) {
    const Rig rig(device, stage);
    const auto half = dvec2(rig.plan.hologram.size) * rig.plan.hologram.pitch_m / 2.0 *
                      std::max(1.0, rig.plan.cone.half_width);
    const int parts = rig.table.visibility_parts;
    int seen = 0, blind = 0, wrong = 0, hidden = 0, unseen = 0;
    for (std::size_t i = 0; i < rig.samples.size(); ++i) {
      const auto& s = rig.samples[i];
      const auto truth = [&](int part_x, int part_y) {
        const dvec2 at = (dvec2(part_x, part_y) + 0.5) / (parts / 2.0) - 1.0;
        return free_path(rig.corners, place(s), normal(s), rig.arrays.bias_m,
                         hologram_centre(rig) + dvec3(at * half, 0));
      };
      // Kernels test sixteen parts first; when these agree, they decide for all parts. Parts of a
      // group of four lie in different rows and columns.
      int free = 0, unsure = 0;
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) {
          const auto seen_there =
              truth(parts / 4 * a + b % (parts / 4), parts / 4 * b + a % (parts / 4));
          free += seen_there == Seen::yes;
          unsure += seen_there == Seen::unsure;
        }
      }
      int seen_parts = 0;
      for (int part = 0; part < parts * parts; ++part) {
        const auto seen_there = free == 0 || free == 16 ? (free == 0 ? Seen::no : Seen::yes)
                                                        : truth(part % parts, part / parts);
        const bool said = rig.sees(i, part % parts, part / parts);
        wrong += unsure == 0 && seen_there != Seen::unsure && said != (seen_there == Seen::yes);
        seen_parts += said;
      }
      seen += seen_parts;
      blind += parts * parts - seen_parts;
      wrong += s.hidden != (seen_parts < parts * parts);
      hidden += s.hidden != 0;
      unseen += seen_parts == 0;
    }
    CAPTURE(rig.samples.size(), hidden, unseen);
    CHECK(wrong == 0);
    CHECK(rig.table.hidden == hidden);
    CHECK(seen > 3000);
    CHECK(blind > 1000);
    CHECK(hidden > unseen);
    CHECK(unseen > 0);
    CHECK(SampleTable(device, rig.plan, rig.arrays).count == rig.table.count - unseen);
  }
}

DEVICE_TEST(
    "radiance and lights of samples match Phong's model in double precision, with shadows and 40 "
    "lights",
    "[slow]") {
  Random random(3);
  Stage stage;
  Material matt, glass;
  matt.ambient = dvec3(0.2);
  matt.diffuse = dvec3(0.6);
  glass = matt;
  glass.reflectivity = 0.25;
  glass.transparency = 0.35;
  glass.specular = dvec3(0.5);
  stage.add(sphere({0, 0, 19e-3}, 0.3e-3, 12), matt)
      .add(rectangle({0, 0, 19.5e-3}, {0.6e-3, 0, 0.1e-3}, {0, 0.6e-3, 0}), glass);
  Light ambient;
  ambient.type = LightType::ambient;
  ambient.intensity = 0.7;
  stage.scene.lights = {ambient};
  for (int i = 0; i < 40; ++i) {
    Light l{.intensity = uniform(random, 0.01, 0.1)};
    const double x = uniform(random, -1, 1), y = uniform(random, -1, 1);
    if (i % 2) {
      l.type = LightType::point;
      l.position_m = {2e-3 * x, 2e-3 * y, i % 4 == 1 ? 18e-3 : 20.5e-3};
    } else {
      l.direction = {x, y, i % 4 ? -0.5 : 1.0};
    }
    stage.scene.lights.push_back(l);
  }
  stage.scene.trace.depth = 0;  // what is seen directly
  for (const bool shadows : {false, true}) {
    CAPTURE(shadows);
    stage.scene.trace.shadows = shadows;
    const Rig rig(device, stage);
    REQUIRE(rig.arrays.light_words() == 2);
    int unsure = 0, wrong_bits = 0, lit_low = 0, lit_high = 0, shadowed = 0;
    double error = 0;
    for (std::size_t i = 0; i < rig.samples.size(); ++i) {
      const auto& s = rig.samples[i];
      const bool on_plane = rig.object_of(s) == 1;
      const double own = on_plane ? 1 - 0.25 - 0.35 : 1;
      double radiance = 0.2 * 0.7;
      for (int l = 0; l < 40; ++l) {
        const auto& light = stage.scene.lights[l + 1];
        const auto way = light.type == LightType::point
                             ? light.position_m - rig.plan.extent.origin_m - place(s)
                             : -normalize(light.direction) * 0.1;
        const double facing = dot(normalize(way), normal(s));
        bool lit = facing > 0;
        bool undecided = std::abs(facing) < 1e-5;
        if (shadows && lit) {
          const auto way_is =
              free_path(rig.corners, place(s), normal(s), rig.arrays.bias_m, place(s) + way);
          undecided |= way_is == Seen::unsure;
          shadowed += way_is == Seen::no;
          lit = way_is == Seen::yes;
        }
        const bool bit = rig.lit[2 * i + static_cast<std::size_t>(l / 32)] >> (l % 32) & 1u;
        wrong_bits += bit != lit && !undecided;
        unsure += undecided;
        if (undecided) lit = bit;
        (l < 32 ? lit_low : lit_high) += lit;
        if (lit) radiance += 0.6 * facing * light.intensity;
      }
      error = std::max(error, std::abs(s.radiance - radiance * own));
      if (on_plane) CHECK(s.specular == Catch::Approx(0.5 * own));
    }
    CAPTURE(unsure, rig.samples.size(), shadowed, error);
    CHECK(unsure < 0.1 * 40 * static_cast<double>(rig.samples.size()));
    CHECK(wrong_bits == 0);
    CHECK(lit_low > 1000);
    CHECK(lit_high > 300);
    CHECK((shadowed > 1000) == shadows);
    CHECK(error < 2e-6);
  }
}
