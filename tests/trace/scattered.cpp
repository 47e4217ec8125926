// SPDX-License-Identifier: Apache-2.0
// Light that one surface throws on another, on devices, against sums over the shining one.
#include <cmath>
#include <functional>
#include <numbers>

#include "host/planning/make_plan.hpp"
#include "host/view/lens.hpp"
#include "tests/support/samples.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec3;

namespace {

constexpr double floor_z = 20 * mm;

/// A rectangle that shines, or is lit, with this radiance towards the side of its normal.
struct GlowingPanel {
  dvec3 middle, across, up;  // from edge to edge
  double radiance;
};

/// Sum of f(direction, solid angle) over the parts of a panel, as seen from `from`.
double over(const GlowingPanel& panel, dvec3 from, const std::function<double(dvec3, double)>& f) {
  constexpr int steps = 300;
  const auto normal = glm::cross(panel.across, panel.up) / double{steps * steps};
  double sum = 0;
  for (int j = 0; j < steps; ++j) {
    for (int i = 0; i < steps; ++i) {
      const auto at = panel.middle + ((i + 0.5) / steps - 0.5) * panel.across +
                      ((j + 0.5) / steps - 0.5) * panel.up;
      const double distance = glm::length(at - from);
      const auto way = (at - from) / distance;
      sum += f(way, std::abs(glm::dot(way, normal)) / (distance * distance));
    }
  }
  return panel.radiance * sum;
}

Stage before_floor(const GlowingPanel& panel, const Material& of_floor, const Material& of_panel) {
  Stage stage;
  stage.scene.hologram = {{64, 64}, {8e-6, 8e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 25e-6;
  stage.scene.sampling.antialias = 4;
  stage.add(rectangle({0, 0, floor_z}, {-0.6 * mm, 0, 0}, {0, 0.4 * mm, 0}), of_floor);
  stage.add(rectangle(panel.middle, panel.across / 2.0, panel.up / 2.0), of_panel);
  return stage;
}

/// Largest difference of the floor's radiance from `expected`, at places and towards the hologram's
/// centre, over its largest: of what a lens sees, and of samples.
struct Worst {
  double seen = 0, samples = 0, most = 0;
  int pixels = 0, number = 0;
};

Worst compare(const raywave::cl::Device& device, const Stage& stage,
              const std::function<double(dvec3)>& expected) {
  Worst worst;
  const auto plan = make_plan(stage.scene, stage.world);
  const DeviceScene arrays(device, stage.world, plan);
  const auto image = lens_picture(device, plan, arrays,
                                  {.z_m = floor_z,
                                   .window_m = glm::dvec2(0.8 * mm, 0.1 * mm),
                                   .points = 4,
                                   .pixel_m = glm::dvec2(20e-6)});
  for (int i = 0; i < image.width; ++i) {
    const dvec3 at((i - (image.width - 1) / 2.0) * 20e-6, ((image.height - 1) / 2.0 - 2) * 20e-6,
                   floor_z);
    const double want = expected(at), got = image.pixels[2 * image.width + i];
    worst.most = std::max(worst.most, want);
    worst.seen = std::max(worst.seen, std::abs(got - want));
    ++worst.pixels;
  }
  const Rig rig(device, stage);
  for (std::size_t i = 0; i < rig.samples.size(); i += 11) {
    const auto& s = rig.samples[i];
    if (rig.object_of(s) != 0) continue;
    const auto at = place(s) + rig.plan.extent.origin_m;
    if (std::abs(at.x) > 0.5 * mm || std::abs(at.y) > 0.3 * mm) continue;
    worst.samples = std::max(worst.samples, std::abs(double{s.radiance} - expected(at)));
    ++worst.number;
  }
  worst.seen /= worst.most;
  worst.samples /= worst.most;
  return worst;
}

void check(const Worst& worst, double bound) {
  INFO("off by " << worst.seen << " and " << worst.samples << " of " << worst.most);
  CHECK(worst.pixels == 40);
  CHECK(worst.number > 30);
  CHECK(worst.most > 0.05);
  CHECK(worst.seen < bound);
  CHECK(worst.samples < bound);
}

Material matt(double diffuse) { return {.ambient = dvec3(0), .diffuse = dvec3(diffuse)}; }
Material glowing(double radiance) {
  return {.ambient = dvec3(0), .diffuse = dvec3(0), .emission = dvec3(radiance)};
}

// A panel beside the floor, upright on it.
constexpr double beside = 0.7 * mm;
const GlowingPanel upright{{beside, 0, 19.4 * mm}, {0, 1.6 * mm, 0}, {0, 0, 1.2 * mm}, 0.9};

}  // namespace

DEVICE_TEST("a floor beside a shining panel is lit as the sum over the panel says") {
  for (const bool is_lamp : {false, true}) {
    CAPTURE(is_lamp);  // one shines itself, the other has the light of a lamp
    auto stage = before_floor(upright, matt(0.8), is_lamp ? matt(0.6) : glowing(upright.radiance));
    // A lamp whose light goes along the floor
    stage.scene.lights = {Light{.direction = {1, 0, 0}, .intensity = is_lamp ? 1.5 : 0}};
    stage.scene.trace.diffuse_rays = 64;
    check(compare(device, stage,
                  [](dvec3 at) {
                    return 0.8 / std::numbers::pi * over(upright, at, [](dvec3 way, double solid) {
                             return std::max(-way.z, 0.0) * solid;
                           });
                  }),
          0.02);
    stage.scene.trace.diffuse_rays = 0;
    const auto none = compare(device, stage, [](dvec3) { return 1.0; });
    CHECK(none.seen == 1);
  }
}

DEVICE_TEST("what stands before a shining panel keeps its light from the floor") {
  auto stage = before_floor(upright, matt(0.8), glowing(upright.radiance));
  constexpr double card_x = 0.6 * mm;
  stage.add(rectangle({card_x, 1 * mm, 19.5 * mm}, {0, 1 * mm, 0}, {0, 0, 2 * mm}), dark());
  stage.scene.lights = {Light{.direction = {1, 0, 0}, .intensity = 0}};
  stage.scene.trace.diffuse_rays = 64;
  check(compare(device, stage,
                [](dvec3 at) {
                  return 0.8 / std::numbers::pi * over(upright, at, [&](dvec3 way, double solid) {
                           const bool hidden = at.y + way.y / way.x * (card_x - at.x) > 0;
                           return hidden ? 0 : std::max(-way.z, 0.0) * solid;
                         });
                }),
        0.03);
}

DEVICE_TEST("a rough mirror shows a panel as the sum over its lobe says") {
  // Between hologram and floor, beside the rays from one to the other
  const GlowingPanel panel{{1.2 * mm, 0, 18 * mm}, {1.4 * mm, 0, 0}, {0, 1.2 * mm, 0}, 0.9};
  for (const double roughness : {0.3, 0.6}) {
    CAPTURE(roughness);
    const double s = 0.5 / std::pow(roughness, 4) - 0.5;
    Material mirror = matt(0);
    mirror.specular = dvec3(0.7 * (s + 2) / 2);
    mirror.shininess = s;
    auto stage = before_floor(panel, mirror, glowing(panel.radiance));
    stage.scene.lights = {Light{.direction = {1, 0, 0}, .intensity = 0}};
    stage.scene.trace.gloss_rays = 64;
    check(compare(device, stage,
                  [&](dvec3 at) {
                    const auto mirrored = glm::normalize(dvec3(at.x, at.y, -at.z));
                    return 0.7 * (s + 1) / (2 * std::numbers::pi) *
                           over(panel, at, [&](dvec3 way, double solid) {
                             return std::pow(std::max(glm::dot(way, mirrored), 0.0), s) * solid;
                           });
                  }),
          0.035);
  }
}
