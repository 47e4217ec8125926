// SPDX-License-Identifier: Apache-2.0
// Light that falls onto the SLM otherwise than straight: [illumination].
#include <glm/trigonometric.hpp>

#include "host/encode/shown.hpp"
#include "host/render.hpp"
#include "host/scene/read_slm.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec2;
using glm::dvec3;

namespace {

constexpr double wavelength_m = 638e-9;

/// SLM of a file with this section.
SlmSpec slm_with(const std::string& keys) {
  return parse_slm({"[illumination]\n" + keys, "slm.toml", "."}, wavelength_m, {});
}

Illumination light_of(std::optional<double> focus_m, dvec2 degrees) {
  return {focus_m, glm::sin(degrees * (std::numbers::pi / 180))};
}

/// Turns at a place of the SLM, less those at its middle, from distances to the focus.
long double turns_of(const Illumination& light, dvec2 at_m) {
  const long double sx = light.sine.x, sy = light.sine.y, down = -std::sqrt(1 - sx * sx - sy * sy);
  if (!light.focus_m) return (sx * at_m.x + sy * at_m.y) / static_cast<long double>(wavelength_m);
  const long double f = *light.focus_m;
  const auto length = [](long double x, long double y, long double z) {
    return std::sqrt(x * x + y * y + z * z);
  };
  const long double longer =
      length(at_m.x - f * sx, at_m.y - f * sy, -f * down) - length(f * sx, f * sy, -f * down);
  return (f > 0 ? -longer : longer) / static_cast<long double>(wavelength_m);
}

const Illumination lights[] = {light_of(0.2, {0, 0}), light_of(-0.15, {0, 0}),
                               light_of({}, {3, -2}), light_of(0.2, {-2, 1.5})};

/// One small square that shines.
Stage one_dot(dvec3 at, const Illumination& light) {
  Stage stage;
  stage.scene.hologram = {{384, 320}, {4e-6, 4e-6}, wavelength_m};
  stage.scene.sampling.pitch_m = 20e-6;
  stage.scene.slm.encoding = Encoding::phase;
  stage.scene.slm.illumination = light;
  stage.scene.wrp.propagation = WrpPropagation::compact;
  stage.add(rectangle(at, {10.5e-6, 0, 0}, {0, 10.5e-6, 0}));
  return stage;
}

}  // namespace

TEST_CASE("the phase of the light on the SLM is that of its focus, and the SLM takes it off") {
  const glm::ivec2 size(61, 47);
  const double pitch_m = 40e-6;
  for (const auto& light : lights) {
    const Panel panel(SlmSpec{.illumination = light}, size, dvec2(pitch_m), wavelength_m);
    REQUIRE(panel.added().size() == static_cast<std::size_t>(size.x * size.y));
    double worst = 0, worst_added = 0, worst_sine = 0;
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        const dvec2 at_m = dvec2(x - (size.x - 1) / 2.0, (size.y - 1) / 2.0 - y) * pitch_m;
        const auto wanted = turns_of(light, at_m);
        worst = std::max(worst,
                         std::abs(static_cast<double>(light.turns(at_m, wavelength_m) - wanted)));
        const auto added = panel.added()[y * size.x + x] / 65536.0;
        worst_added = std::max(worst_added,
                               std::abs(std::remainder(static_cast<double>(added + wanted), 1.0)));
        // Its direction is the phase's slope.
        const double step_m = 1e-6;
        const auto slope = [&](dvec2 step) {
          return static_cast<double>(turns_of(light, at_m + step) - turns_of(light, at_m - step)) *
                 wavelength_m / (2 * step_m);
        };
        const auto sine = light.sine_at(at_m);
        worst_sine = std::max({worst_sine, std::abs(sine.x - slope({step_m, 0})),
                               std::abs(sine.y - slope({0, step_m}))});
      }
    }
    INFO("turns " << worst << ", added " << worst_added << ", sine " << worst_sine);
    CHECK(worst < 1e-9);
    CHECK(worst_added < 0.51 / 65536);
    CHECK(worst_sine < 1e-5);
  }
}

DEVICE_TEST(
    "the field does not depend on the light, and what the levels show focuses where it lies") {
  for (const double z_m : {60e-3, -60e-3}) {
    const dvec2 at(0.1e-3, -0.06e-3);
    const auto straight = one_dot({at, z_m}, {});
    const auto plain = render(device, straight.scene, straight.world);
    for (const auto& light : lights) {
      const auto stage = one_dot({at, z_m}, light);
      const auto result = render(device, stage.scene, stage.world);
      CHECK(relative_l2(result.field.samples, plain.field.samples) < 1e-5);
      CHECK(result.levels != plain.levels);
      const auto shown = shown_field(*result.panel, result.levels);
      const auto image = reconstruct(device, raywave::cl::FftBackend::host, shown,
                                     stage.scene.hologram, ReconstructSpec{.z_m = z_m});
      const auto brightest =
          std::max_element(image.pixels.begin(), image.pixels.end()) - image.pixels.begin();
      const dvec2 found =
          dvec2(static_cast<double>(brightest % image.width) - (image.width - 1) / 2.0,
                (image.height - 1) / 2.0 - static_cast<double>(brightest / image.width)) *
          4e-6;
      CAPTURE(z_m, light.sine.x, found.x, found.y);
      CHECK(glm::distance(found, at) < 20e-6);
      double sum = 0;
      for (const float intensity : image.pixels) sum += intensity;
      CHECK(image.pixels[brightest] > 1e-3 * sum);
    }
  }
}

DEVICE_TEST("a stop stands where undiffracted light of any tilt or focus has frequency zero") {
  // Of the light on the SLM, 3 and -2 degrees are 0.33 and -0.22 cycles per pixel; the field has at
  // most 0.09. The field is thus at -0.33 and 0.22, the zero order at (-0.1, 0), its twin beyond.
  for (const double focus_m : {0.0, 5.0}) {
    auto stage = one_dot({0.1e-3, -0.06e-3, 60e-3},
                         light_of(focus_m > 0 ? std::optional(focus_m) : std::nullopt, {3, -2}));
    stage.scene.slm.encoding = Encoding::off_axis;
    stage.scene.slm.carrier = {0.1, 0};
    stage.scene.slm.stop = StopSpec{{0.25, 0.25}, {-0.33, 0.22}};
    const auto result = render(device, stage.scene, stage.world);
    const auto shown = shown_field(*result.panel, result.levels);
    std::complex<double> both = 0;
    double of_shown = 0, of_field = 0;
    for (std::size_t i = 0; i < shown.samples.size(); ++i) {
      const std::complex<double> a(shown.samples[i]), b(result.field.samples[i]);
      both += a * std::conj(b);
      of_shown += std::norm(a);
      of_field += std::norm(b);
    }
    CAPTURE(focus_m, of_shown);
    CHECK(std::abs(both) > 0.98 * std::sqrt(of_shown * of_field));
  }
}

DEVICE_TEST("the steepest light is so many degrees off the light on the SLM, place by place") {
  // 4 um pixels turn light by sines up to 0.0798 to either side.
  for (const double z_m : {15e-3, -15e-3}) {
    for (const auto& light : {light_of({}, {2, 0}), light_of(0.1, {-2, 0})}) {
      Stage stage;
      stage.scene.hologram = {{241, 5}, {4e-6, 4e-6}, wavelength_m};
      stage.scene.slm.illumination = light;
      for (const double x_m : {-1.6e-3, -0.8e-3, 0.0, 0.8e-3, 1.6e-3})
        stage.add(rectangle({x_m, 0, z_m}, {30e-6, 0, 0}, {0, 30e-6, 0}));
      const Rig rig(device, stage, Method::points, false);
      REQUIRE(rig.samples.size() > 4);
      Gatherer gatherer(device, rig.plan, rig.arrays, rig.table, 1, 0);
      gatherer.draw_phases(1);
      raywave::cl::ComplexBuffer buffer(
          device, std::vector<std::complex<float>>(std::size_t{241} * 5, {7, 7}), "field");
      gatherer.gather(rig.plan.wrps[0], buffer);
      const auto field = buffer.read();
      int wrong = 0, dark = 0;
      for (std::size_t i = 0; i < field.size(); ++i) {
        const auto pixel = reference::pixel_m(rig.plan, {0, 0, 0}, i);
        int shown = 0, unsure = 0;
        for (const auto& s : rig.samples) {
          const auto way = glm::normalize(pixel - (place(s) + rig.plan.extent.origin_m)) *
                           (z_m > 0 ? 1.0 : -1.0);
          const double beyond =
              std::abs(way.x - light.sine_at(dvec2(pixel)).x) - wavelength_m / 8e-6;
          shown += beyond < 0;
          unsure += std::abs(beyond) < 1e-6;
        }
        wrong += !unsure && (field[i] != 0.0f) != (shown > 0);
        dark += shown == 0;
      }
      INFO("z " << z_m << ", sine " << light.sine.x << ": " << dark << " dark");
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("WRPs refuse light that does not fall straight onto the SLM") {
  auto stage = one_dot({0, 0, 60e-3}, lights[0]);
  stage.scene.wrp.propagation = WrpPropagation::spectrum;
  CHECK_REFUSED(Rig(all_devices().front(), stage), "[illumination]", "compact");
}

TEST_CASE("[illumination] is read from scenes and from files of an SLM") {
  CHECK(slm_with("focus = \"200 mm\"\nangle = [3, -2]").illumination == light_of(0.2, {3, -2}));
  CHECK(slm_with("focus = \"parallel\"").illumination.is_plane());
  const auto beam =
      slm_with("profile = [\"6 mm\", 4e-3]\nsource_size = 0.5\nbandwidth = \"2 nm\"").illumination;
  CHECK(beam.profile.diameter_m == dvec2(6e-3, 4e-3));
  CHECK(beam.source_size_rad == 0.5e-3);
  CHECK(beam.bandwidth_m == 2e-9);
  CHECK(slm_with("profile = \"even\"").illumination == Illumination{});
  CHECK(slm_with("profile = \"6 mm\"").illumination.profile.diameter_m == dvec2(6e-3));
  for (const char* wrong :
       {"focus = 0", "angle = [85, 0]", "angle = [75, 75]", "tilt = 1", "profile = \"beam.png\"",
        "profile = 0", "profile = [1e-3]", "profile = true", "source_size = -1",
        "source_size = \"1 mm\"", "bandwidth = 1", "bandwidth = \"1 ps\""})
    CHECK_THROWS_AS(slm_with(wrong), InputError);
}
