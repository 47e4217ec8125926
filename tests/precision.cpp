// SPDX-License-Identifier: Apache-2.0
// The whole pipeline against the same discrete computation in double precision (host/reference/pipeline.hpp), at the paper's setting and at
// the extremes.
#include <cstdio>
#include <functional>

#include "host/gatherer.hpp"
#include "host/propagator.hpp"
#include "host/reference/pipeline.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec3;

namespace {

constexpr double nm = 1e-9;

/// A scene as wide as it is deep, or as wide and deep as told: a shiny sphere before a tilted square, lit by the sun and a lamp.
struct Extreme {
  std::string name;
  HologramSpec hologram;
  dvec3 centre_m;           // of the scene
  double width_m, depth_m;  // of the scene
  double sampling_pitch_m;
  std::optional<double> wrp_m = {};
  Method method = Method::wrp;
};

Stage stage_of(const Extreme& e) {
  Stage stage;
  stage.scene.file = "extreme.toml";
  stage.scene.hologram = e.hologram;
  stage.scene.sampling.pitch_m = e.sampling_pitch_m;
  stage.scene.wrp.distance_m = e.wrp_m;
  Material shiny;
  shiny.specular = dvec3(2.0);
  shiny.shininess = 20;
  const double w = e.width_m, d = e.depth_m;
  stage.add(sphere(e.centre_m - dvec3(0.1 * w, 0, 0.5 * d - std::min(0.2 * w, 0.4 * d)), std::min(0.2 * w, 0.4 * d), 6), shiny);
  stage.add(rectangle(e.centre_m + dvec3(0, 0, 0.3 * d), {0.5 * w, 0, 0.2 * d}, {0, 0.4 * w, 0}));
  Light sun, lamp;
  sun.direction = {0.1, -0.2, 1};
  lamp.type = LightType::point;
  lamp.position_m = e.centre_m + dvec3(0.5 * w, 0.5 * w, -0.5 * d);
  lamp.intensity = 0.5;
  stage.scene.lights = {sun, lamp};
  return stage;
}

HologramSpec hologram(glm::ivec2 size, double pitch_m, double wavelength_m = 638 * nm) { return {size, {pitch_m, pitch_m}, wavelength_m}; }

std::vector<Extreme> extremes() {
  const glm::ivec2 small(96, 80);
  return {
      // An eighth of the paper's hologram, at an eighth of its distance: the same angles.
      {"the paper's setting", hologram({240, 136}, 3.74 * um), {0, 0, 12.5 * mm}, 1.56 * mm, 0.7 * mm, 25 * um},
      {"wavelength 10 nm", hologram(small, 1 * um, 10 * nm), {0, 0, 10 * mm}, 0.08 * mm, 1 * mm, 3 * um},
      {"wavelength 1 mm", hologram(small, 0.5 * mm, 1 * mm), {0, 0, 200 * mm}, 60 * mm, 60 * mm, 2 * mm},
      {"pitch lambda/4", hologram(small, 638 * nm / 4), {0, 0, 20 * um}, 20 * um, 8 * um, 0.5 * um},
      {"pitch 100 um", hologram(small, 100 * um), {0, 0, 1}, 6 * mm, 6 * mm, 0.2 * mm},
      {"WRPs at 1 um", hologram(small, 3.74 * um), {0, 0, 20 * mm}, 1 * mm, 1 * mm, 40 * um, 1 * um},
      {"WRPs at 5 m", hologram(small, 50 * um), {0, 0, 5.3}, 20 * mm, 0.2, 0.6 * mm, 5.0},
      {"scene of 1 um", hologram(small, 0.32 * um), {0, 0, 20 * um}, 1 * um, 1 * um, 40 * nm},
      {"scene 1 m wide, 10 m away", hologram(small, 3.74 * um), {0, 0, 10}, 1, 0.1, 30 * mm, 20 * mm},
      {"scene 1 m deep", hologram(small, 3.74 * um), {0, 0, 0.9}, 30 * mm, 1, 1 * mm, 0.3},
      {"1 m off the axis, 10 m away", hologram(small, 3 * um), {1, 0, 10}, 50 * mm, 50 * mm, 2 * mm, 1.0},
      {"10 m away", hologram(small, 20 * um), {0, 0, 10}, 0.1, 0.1, 4 * mm},
      {"WRP cuts a surface", hologram(small, 3.74 * um), {0, 0, 6 * mm}, 0.5 * mm, 0.4 * mm, 15 * um, 6.1 * mm},
      {"points, 1 m away", hologram(small, 3.74 * um), {0, 0, 1}, 50 * mm, 50 * mm, 2 * mm, {}, Method::points},
      {"points, wavelength 10 nm", hologram(small, 1 * um, 10 * nm), {0, 0, 1}, 1 * mm, 10 * mm, 40 * um, {}, Method::points},
  };
}

struct Outcome {
  double error = 0;         // relative L2, of the hologram
  double unsure_share = 0;  // of the light on the WRPs, where floats cannot decide
  int samples = 0, planes = 0;
};

Outcome outcome_of(const raywave::cl::Device& device, const Rig& rig) {
  const auto& plan = rig.plan;
  Gatherer gatherer(device, plan, rig.arrays, rig.table, 1);
  gatherer.draw_phases(1);
  const auto pixels = static_cast<std::size_t>(plan.size.x) * static_cast<std::size_t>(plan.size.y);
  raywave::cl::ComplexBuffer field(device, pixels, "field");
  Propagator propagator(device, {plan.size, plan.pitch_m, plan.wavelength_m, rig.scene.wrp.padding});
  const reference::Gathering gathering{rig.plan,
                                       rig.scene.lights,
                                       rig.samples,
                                       rig.lit,
                                       rig.arrays.light_words(),
                                       rig.triangles,
                                       rig.arrays.bias_m,
                                       Gatherer::default_near_spots};
  const bool at_hologram = plan.wrps[0].centre_m.z <= 0;
  Outcome outcome{.samples = rig.table.count, .planes = static_cast<int>(plan.wrps.size())};
  double unsure = 0, all = 0;
  std::vector<reference::Field> wanted;
  for (const auto& wrp : plan.wrps) {
    gatherer.gather(wrp.centre_m, field);
    const auto got = reference::to_double(field.read());
    auto oracle = reference::gather(gathering, wrp.centre_m, 1);
    for (std::size_t i = 0; i < pixels; ++i) {
      if (oracle.unsure[i]) oracle.field[i] = got[i];
      all += std::norm(got[i]);
      unsure += oracle.unsure[i] ? std::norm(got[i]) : 0;
    }
    if (std::getenv("DEBUG_PREC")) std::printf("   plane error %.2e\n", reference::relative_error(got, oracle.field));
    wanted.push_back(std::move(oracle.field));
    if (at_hologram) continue;
    propagator.load(field);
    propagator.add({-wrp.centre_m.x, -wrp.centre_m.y}, wrp.centre_m.z);
  }
  if (!at_hologram) propagator.collect(field);
  const auto got = reference::to_double(field.read());
  outcome.error = reference::relative_error(got, at_hologram ? wanted[0] : reference::hologram(plan, wanted));
  outcome.unsure_share = unsure / all;
  return outcome;
}

}  // namespace

TEST_CASE("table", "[.table]") {
  for (const auto& device : all_devices()) {
    for (const auto& extreme : extremes()) {
      auto stage = stage_of(extreme);
      for (const auto precision : {Precision::floats, Precision::extended, Precision::doubles}) {
        stage.scene.accuracy.precision = precision;
        try {
          const Rig rig(device, stage, extreme.method);
          const auto outcome = outcome_of(device, rig);
          std::printf("%-30s %-9s error %.2e predicted %.2e unsure %.3f, %d samples %d planes\n", extreme.name.c_str(), name_of(precision),
                      outcome.error, 2 * 3.14159 * rig.plan.phase_errors[size_t(precision)].total_turns(), outcome.unsure_share,
                      outcome.samples, outcome.planes);
          std::fflush(stdout);
        } catch (std::exception& e) {
          std::printf("%s: %s\n", extreme.name.c_str(), e.what());
        }
      }
    }
  }
}
