// SPDX-License-Identifier: Apache-2.0
// Soft shadows, spots and highlights on devices, against sums over the lights and their formulas.
#include "host/planning/make_plan.hpp"
#include "host/view/lens.hpp"
#include "tests/support/samples.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec3;

namespace {

// A floor that faces the hologram, and a card before it whose edge is at x = edge and which goes on
// to the right. Light comes from the right: the edge's shadow lies to the left of it.
constexpr double floor_z = 20 * mm, card_z = 19.4 * mm, card_edge = 0.35 * mm, light_z = 18 * mm;
const dvec3 light_middle(1.2 * mm, 0, light_z);

Stage card_over_floor() {
  Stage stage;
  stage.scene.hologram = {{64, 64}, {8e-6, 8e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 25e-6;
  stage.scene.sampling.antialias = 4;
  stage.scene.trace.shadows = true;
  Material matt{.ambient = dvec3(0), .diffuse = dvec3(0.8)};
  stage.add(rectangle({0, 0, floor_z}, {-0.8 * mm, 0, 0}, {0, 0.4 * mm, 0}), matt);
  stage.add(rectangle({card_edge + 2 * mm, 0, card_z}, {-2 * mm, 0, 0}, {0, 3 * mm, 0}), dark());
  return stage;
}

Light area_light(bool is_disc, int samples) {
  Light light{
      .type = LightType::area, .position_m = light_middle, .intensity = 1.5, .samples = samples};
  if (is_disc) {
    light.radius_m = 0.5 * mm;
    light.direction = {0, 0, 1};
  } else {
    light.edges_m = {dvec3(0.8 * mm, 0, 0), dvec3(0.1 * mm, 0.7 * mm, 0)};
  }
  return light;
}

/// Radiance of the floor at (x, y): the mean over the light's surface of what is not hidden.
double floor_radiance(const Light& light, double x, double y) {
  constexpr int steps = 400;
  double sum = 0;
  int number = 0;
  for (int j = 0; j < steps; ++j) {
    for (int i = 0; i < steps; ++i) {
      const double s = (i + 0.5) / steps - 0.5, t = (j + 0.5) / steps - 0.5;
      dvec3 at = light.position_m;
      if (light.radius_m > 0) {
        if (s * s + t * t > 0.25) continue;
        at += 2 * light.radius_m * dvec3(s, t, 0);
      } else {
        at += s * light.edges_m[0] + t * light.edges_m[1];
      }
      ++number;
      const auto way = at - dvec3(x, y, floor_z);
      const double over_card = x + way.x * (floor_z - card_z) / (floor_z - light_z);
      if (over_card > card_edge) continue;
      sum += -way.z / glm::length(way);
    }
  }
  return 0.8 * light.intensity * sum / number;
}

/// A picture of the floor through the lens, 0.1 mm high, in pixels of 10 um.
Image floor_picture(const raywave::cl::Device& device, const Stage& stage, double width_m,
                    int points) {
  const auto plan = make_plan(stage.scene, stage.world);
  const DeviceScene arrays(device, stage.world, plan);
  LensSpec spec{.z_m = floor_z,
                .window_m = glm::dvec2(width_m, 0.1 * mm),
                .points = points,
                .pixel_m = glm::dvec2(10e-6)};
  return lens_picture(device, plan, arrays, spec);
}

}  // namespace

DEVICE_TEST("the shadow of a straight edge under an area light is the sum over it, smooth to 1.5 %",
            "[slow]") {
  for (const bool is_disc : {false, true}) {
    auto stage = card_over_floor();
    const auto light = area_light(is_disc, 16);
    stage.scene.lights = {light};
    // The lens: all places of the light at each pixel
    const auto image = floor_picture(device, stage, 0.6 * mm, 4);
    double worst = 0, most = 0, darkest = 1e9;
    for (int i = 0; i < image.width; ++i) {
      const double x = (i - (image.width - 1) / 2.0) * 10e-6;
      if (x > card_edge - 0.05 * mm) continue;  // behind the card, for part of the lens
      const double y = ((image.height - 1) / 2.0 - 2) * 10e-6;
      const double expected = floor_radiance(light, x, y), got = image.pixels[2 * image.width + i];
      worst = std::max(worst, std::abs(got - expected));
      most = std::max(most, expected);
      darkest = std::min(darkest, expected);
    }
    INFO((is_disc ? "disc" : "rectangle") << ": worst " << worst << " of " << most);
    CHECK(darkest < 0.2 * most);
    CHECK(worst < 0.015 * most);  // 256 places: measured 0.011

    // Samples: radiance of each cell, within the penumbra and on both sides
    // Bounds of rms and largest error, over the light that falls where nothing is in its way. Rays
    // ask in lanes: of 8, 4 rays miss by 0.061 at most, of 16 by less
    for (const auto& [rays, rms, largest] :
         {std::tuple{16, 0.01, 0.03}, {4, 0.017, 0.065}, {2, 0.03, 0.08}}) {
      stage.scene.trace.shadow_rays = rays;
      const Rig rig(device, stage);
      double squares = 0, off = 0, rough = 0;
      int number = 0;
      double last = -1, last_x = 0;
      for (const auto& s : rig.samples) {
        if (rig.object_of(s) != 0) continue;
        const auto at = place(s) + rig.plan.extent.origin_m;
        if (std::abs(at.x) > 0.25 * mm || std::abs(at.y) > 0.2 * mm) continue;
        const double expected = floor_radiance(light, at.x, at.y);
        off = std::max(off, std::abs(double{s.radiance} - expected));
        squares += std::pow(double{s.radiance} - expected, 2);
        ++number;
        if (last >= 0 && at.x > last_x)
          rough = std::max(rough, std::abs((double{s.radiance} - expected) - last));
        last = double{s.radiance} - expected;
        last_x = at.x;
        if (number == 250) break;
      }
      REQUIRE(number > 100);
      CAPTURE(rays, off, std::sqrt(squares / number), rough, most);
      CHECK(std::sqrt(squares / number) < rms * most);
      CHECK(off < largest * most);
      CHECK(rough < largest * most);
    }
  }
}

DEVICE_TEST("a spot's cone and the square of the distance are on the surface as its formula says") {
  Stage stage;
  stage.scene.hologram = {{64, 64}, {8e-6, 8e-6}, 638e-9};
  Material matt{.ambient = dvec3(0), .diffuse = dvec3(1)};
  stage.add(rectangle({0, 0, floor_z}, {-0.8 * mm, 0, 0}, {0, 0.4 * mm, 0}), matt);
  Light spot;
  spot.type = LightType::spot;
  spot.position_m = {-0.4 * mm, 0.2 * mm, 17 * mm};
  spot.direction = dvec3(0.1 * mm, 0, floor_z) - spot.position_m;
  spot.inner_deg = 2;
  spot.outer_deg = 8;
  spot.falls_off = true;
  spot.intensity = 1e-5;
  stage.scene.lights = {spot};
  const auto image = floor_picture(device, stage, 1.4 * mm, 1);
  int full = 0, between = 0, dark = 0;
  double worst = 0;
  for (int i = 0; i < image.width; ++i) {
    const dvec3 at((i - (image.width - 1) / 2.0) * 10e-6, ((image.height - 1) / 2.0 - 3) * 10e-6,
                   floor_z);
    const auto way = at - spot.position_m;
    const double cosine = glm::dot(normalize(way), normalize(spot.direction)),
                 inner = std::cos(2 * std::numbers::pi / 180),
                 outer = std::cos(8 * std::numbers::pi / 180),
                 t = std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0);
    const double expected = 1e-5 * t * t / glm::dot(way, way) * way.z / glm::length(way);
    (t == 1 ? full : t == 0 ? dark : between) += 1;
    worst = std::max(worst, std::abs(image.pixels[3 * image.width + i] - expected));
  }
  CHECK(full > 10);
  CHECK(between > 10);
  CHECK(dark > 10);
  CHECK(worst < 1e-4);  // of about 1.1; the cosines' difference is 0.009
}

DEVICE_TEST("the highlights of lights with a size and of spots add up to the direct sum") {
  auto stage = reference::ball_before_wall(20 * mm);
  stage.scene.sampling.antialias = 4;
  auto panel = area_light(false, 6);
  panel.position_m = {0.6 * mm, 0.4 * mm, 18.5 * mm};
  const Light spot{.type = LightType::spot,
                   .direction = {0.2, -0.1, 1},
                   .position_m = {-0.5 * mm, 0.3 * mm, 18 * mm},
                   .outer_deg = 40};
  Light unseen = area_light(true, 40);  // without highlights; more than one word of the mask
  unseen.highlights = false;
  unseen.intensity = 0.3;
  stage.scene.lights = {unseen, panel, spot};
  const Rig rig(device, stage);
  CHECK(rig.arrays.light_words() == 2);
  Gatherer gatherer(device, rig.plan, rig.arrays, rig.table, 1, 0);
  gatherer.draw_phases(1);
  const auto pixels = static_cast<std::size_t>(rig.plan.hologram.size.x) *
                      static_cast<std::size_t>(rig.plan.hologram.size.y);
  raywave::cl::ComplexBuffer field(device, std::vector<std::complex<float>>(pixels), "field");
  const dvec3 centre(0, 0, 18.8 * mm);
  gatherer.gather(Wrp{.centre_m = centre, .layer = 0}, field);
  const auto agreement = reference::against_direct_sum(rig, field.read(), 1, 1, centre, 400);
  CAPTURE(agreement.error, agreement.pixels, agreement.unsure);
  CHECK(agreement.pixels > 200);
  CHECK(agreement.error < 1e-3);
}
