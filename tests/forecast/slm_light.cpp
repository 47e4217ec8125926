// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/slm_light.hpp"

#include "host/forecast/presets.hpp"
#include "host/planning/make_plan.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/files.hpp"
#include "tests/support/plans.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Approx;

constexpr double z_m = 100 * mm, side_m = 2 * mm;

/// A square of 2 mm that faces the eye.
World square_at(glm::dvec2 centre_m, double side = 1) {
  return world_of_squares({{side_m, {centre_m, side * z_m}}});
}

/// 1000 x 500 pixels of 4 um at 500 nm: 4 mm x 2 mm, sines up to 1 / 16.
Scene scene_for(const SlmSpec& slm) {
  Scene scene;
  scene.file = "scene.toml";
  scene.hologram.resolution = {1000, 500};
  scene.hologram.pitch_m = glm::dvec2(4 * um);
  scene.hologram.wavelength_m = 500e-9;
  scene.lights.emplace_back();
  scene.materials = {glowing()};
  scene.objects = {object_at("", 1, {})};
  scene.slm = slm;
  return scene;
}

/// side  1: the square lies beyond the hologram; -1: before it
Planned planned(const SlmSpec& slm, glm::dvec2 centre_m = {0, 0}, double side = 1) {
  return plan_scene(scene_for(slm), square_at(centre_m, side), {}, {});
}

SlmLight light_of(const SlmSpec& slm, glm::dvec2 centre_m = {0, 0}) {
  return planned(slm, centre_m).prediction.slm_light;
}

std::string warning_with(const Planned& p, const std::string& text) {
  for (const auto& warning : p.warnings)
    if (warning.find(text) != std::string::npos) return warning;
  return "";
}

SlmSpec with_stop(glm::dvec2 size, glm::dvec2 centre = {0, 0}) {
  return SlmSpec{.stop = StopSpec{size, centre}};
}

/// Share of the light that pixels show and the stop passes, point by point, along one axis.
double share_by_points(double from_m, double to_m, double half_m, double size, double centre) {
  constexpr int steps = 400;
  double shown = 0, passed = 0;
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const double x = from_m + (to_m - from_m) * (i + 0.5) / steps,
                   on_slm = half_m * ((2 * j + 1.0) / steps - 1);
      const double cycles = (on_slm - x) / std::hypot(on_slm - x, z_m) * 8;  // pitch / wavelength
      if (std::abs(cycles) > 0.5) continue;
      shown += 1;
      const double away = cycles - centre;
      passed += std::abs(away - std::round(away)) <= size / 2 ? 1 : 0;
    }
  }
  return passed / shown;
}

TEST_CASE("the share of light that a stop passes is that of a sum over points") {
  CHECK(light_of({}).through_stop == 1);
  struct Case {
    glm::dvec2 place_m, size, centre;
  };
  for (const auto& [place_m, size, centre] :
       {Case{{0, 0}, {1, 1}, {0, 0}},
        {{0, 0}, {0.3, 1}, {0, 0}},
        {{0, 0}, {0.3, 0.2}, {0, 0}},
        {{0, 0}, {0.2, 0.2}, {0.1, -0.05}},
        {{3 * mm, -1 * mm}, {0.4, 0.2}, {-0.2, 0.1}},
        {{5 * mm, 0}, {0.3, 1}, {0.45, 0}}}) {  // reaches over the band's edge
    const auto light = light_of(with_stop(size, centre), place_m);
    const double x = share_by_points(place_m.x - side_m / 2, place_m.x + side_m / 2, 2 * mm, size.x,
                                     centre.x),
                 y = share_by_points(place_m.y - side_m / 2, place_m.y + side_m / 2, 1 * mm, size.y,
                                     centre.y);
    INFO(size.x << " " << size.y << " around " << centre.x << " " << centre.y);
    CHECK(light.through_stop == Approx(x * y).margin(0.01));
  }
}

TEST_CASE("the stop that a plan asks for passes all light, and a narrower one does not") {
  for (const glm::dvec2 place_m : {glm::dvec2(0), {2 * mm, -1 * mm}}) {
    const auto open = light_of(with_stop({0.1, 0.1}), place_m).open_stop;
    CHECK(light_of(with_stop(open * 1.01), place_m).through_stop == Approx(1).margin(1e-6));
    CHECK(light_of(with_stop(open * 0.9), place_m).through_stop < 0.999);
  }
  const auto p = planned(with_stop({0.1, 0.1}));
  CHECK_SAYS(warning_with(p, "cut off by slm.stop"), "slm.stop [0.", "passes all of it");
  CHECK(warning_with(planned(with_stop({1, 1})), "cut off by slm.stop").empty());
}

TEST_CASE("a stop that passes none of the light is refused with a centre that passes some") {
  const auto refusal = [](const SlmSpec& slm, glm::dvec2 centre_m) {
    return input_error_of([&] { make_plan(scene_for(slm), square_at(centre_m)); });
  };
  // From -3 to 3 mm over 100 mm, times 8: cycles from -0.24 to 0.24
  const auto missed = with_stop({0.1, 0.5}, {0.4, 0});
  CHECK(refusal(missed, {0, 0}) ==
        "scene.toml: slm.stop passes none of the scene's light: of x it passes 0.35 to 0.45 cycles "
        "per pixel, and the light has -0.24 to 0.24; give slm.stop_centre = [0, 0]");
  CHECK_SAYS(refusal(with_stop({0.5, 0.02}, {0, -0.3}), {0, 0}), "of y it passes");
  CHECK(refusal(with_stop({0.1, 0.5}, {0.28, 0}), {0, 0}).empty());
  // The scene at +x lights the SLM with light towards -x.
  CHECK(refusal(with_stop({0.1, 0.5}, {-0.4, 0}), {5 * mm, 0}).empty());
  CHECK_FALSE(refusal(missed, {5 * mm, 0}).empty());
}

TEST_CASE("without a carrier, undiffracted light falls around the axis, on the part it covers") {
  const auto on_axis = light_of({});
  CHECK(on_axis.zero_order_m == glm::dvec2(0));
  CHECK(on_axis.zero_order_size_m.x == Approx(4 * mm));
  CHECK(on_axis.zero_order_size_m.y == Approx(2 * mm));
  CHECK(on_axis.z_m == Approx(z_m));
  CHECK(on_axis.on_picture == Approx(1).margin(0.01));
  CHECK(light_of({}, {2 * mm, 0}).on_picture == Approx(0.5).margin(0.01));
  CHECK(light_of({}, {3.2 * mm, 0}).on_picture == 0);
  CHECK_SAYS(warning_with(planned({}), "undiffracted"),
             "100 % of the picture: 4 mm x 2 mm around the axis");
}

TEST_CASE("a carrier or a shift moves the picture off the zero order, by as much as it says") {
  const auto half = light_of(SlmSpec{.shift_m = {0, 1 * mm}, .shift_distance_m = z_m});
  CHECK(half.zero_order_m.x == Approx(0).margin(1e-12));
  CHECK(half.zero_order_m.y == Approx(-1 * mm));
  CHECK(half.on_picture == Approx(0.5).margin(0.01));
  // The sine is 0.1 / 8.
  CHECK(light_of(SlmSpec{.carrier = {-0.1, 0}}).zero_order_m.x ==
        Approx(-z_m * std::tan(std::asin(0.1 / 8))).epsilon(1e-9));
  // Burckhardt's encoding brings a carrier of a third of the band.
  SlmSpec burckhardt;
  burckhardt.encoding = Encoding::burckhardt;
  const auto beside = light_of(burckhardt);
  CHECK(beside.zero_order_m.x == Approx(-z_m * std::tan(std::asin(1.0 / 3 / 8))));
  CHECK(beside.on_picture == 0);
}

TEST_CASE("the shift that a warning gives moves the picture beside the zero order") {
  for (const double side : {1.0, -1.0}) {
    const auto before = planned({}, {0, 0.3 * mm}, side);
    const auto shift_m = before.prediction.slm_light.beside_m;
    CHECK(shift_m.x == 0);
    CHECK(std::abs(shift_m.y) ==
          Approx(1.05 * 1.7 * mm).epsilon(0.01));  // half of both less 0.3 mm, and a margin
    CHECK_SAYS(warning_with(before, "undiffracted"), "slm.shift = [0, \"",
               "slm.shift_distance = \"100 mm\"");
    SlmSpec slm{.shift_m = shift_m, .shift_distance_m = std::abs(before.prediction.slm_light.z_m)};
    const auto after = planned(slm, {0, 0.3 * mm}, side);
    CHECK(after.prediction.slm_light.on_picture == 0);
    CHECK(warning_with(after, "undiffracted").empty());
  }
}

TEST_CASE("which side a shift is advised to does not hang on a thousandth of the picture") {
  const auto side = [](double y_m) {
    const auto shift_m = planned({}, {0, y_m}, 1).prediction.slm_light.beside_m;
    CHECK(shift_m.y != 0);
    return std::signbit(shift_m.y);
  };
  CHECK(side(2e-3 * mm) == side(-2e-3 * mm));
}

/// Share of the light that pixels show that a shift along the axis makes too steep, by points.
double lost_by_points(double half_side_m, double half_m, double shift_m, double wavelength_m) {
  constexpr int steps = 400;
  double shown = 0, lost = 0;
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const double place = half_side_m * ((2 * i + 1.0) / steps - 1),
                   on_slm = half_m * ((2 * j + 1.0) / steps - 1);
      const double per_sine = 4 * um / wavelength_m;
      const double cycles = per_sine * (on_slm - place) / std::hypot(on_slm - place, z_m);
      if (std::abs(cycles) > 0.5) continue;
      shown += 1;
      lost += std::abs(cycles - per_sine * shift_m / std::hypot(shift_m, z_m)) > 0.5 ? 1 : 0;
    }
  }
  return lost / shown;
}

TEST_CASE("one shift serves all lasers, and says what a sum over points finds that each loses") {
  const auto scene = scene_for({});
  const auto world = square_at({0, 0});
  const auto plan = make_plan(scene, world);
  const auto view = front_view(scene, world, plan);
  const std::vector<double> wavelengths_m{500e-9, 250e-9, 220e-9};
  const auto light = slm_light(plan, view, wavelengths_m);
  CHECK(light.beside_m.x == 0);
  CHECK(std::abs(light.beside_m.y) == Approx(1.05 * 2 * mm).epsilon(0.01));
  REQUIRE(light.beside_lost.size() == 3);
  CHECK(light.beside_lost[0] == 0);
  for (std::size_t i = 1; i < 3; ++i)
    CHECK(light.beside_lost[i] ==
          Approx(lost_by_points(1 * mm, 1 * mm, light.beside_m.y, wavelengths_m[i])).margin(0.01));
  // More than a quarter is no advice
  CHECK(slm_light(plan, view, {500e-9, 200e-9}).beside_m == glm::dvec2(0));
}

TEST_CASE("a given shift says what it moves beyond the band, as a sum over points finds") {
  for (const double shift_m : {4 * mm, 5 * mm, -5.5 * mm}) {
    const auto p = planned(SlmSpec{.shift_m = {0, shift_m}, .shift_distance_m = z_m});
    const double lost = lost_by_points(1 * mm, 1 * mm, shift_m, 500e-9);
    CAPTURE(shift_m, lost);
    CHECK(p.prediction.slm_light.beyond_band == Approx(lost).margin(0.01));
    CHECK(warning_with(p, "beyond the pixels' band").empty() == (lost == 0));
  }
  const auto scene = scene_for({.shift_m = {0, 2.1 * mm}, .shift_distance_m = z_m});
  const auto world = square_at({0, 0});
  const auto plan = make_plan(scene, world);
  const auto light = slm_light(plan, front_view(scene, world, plan), {500e-9, 220e-9});
  CHECK(light.beyond_band == Approx(lost_by_points(1 * mm, 1 * mm, 2.1 * mm, 220e-9)).margin(0.01));
}

TEST_CASE("a stop that keeps the zero order away ends the warning") {
  auto slm = with_stop({0.3, 1});
  slm.carrier = {0.2, 0};
  const auto p = planned(slm, {2 * mm, 0});
  CHECK(p.prediction.slm_light.zero_order_stopped);
  CHECK(warning_with(p, "undiffracted").empty());
  slm.stop->size.x = 0.5;
  CHECK_FALSE(light_of(slm, {2 * mm, 0}).zero_order_stopped);
}

TEST_CASE("a shift beyond the band and a flatness picture that does not fit are refused by plans") {
  SlmSpec slm{.shift_m = {20 * mm, 0}};
  CHECK_REFUSED(planned(slm), "give a smaller shift");
  SlmSpec uneven;
  uneven.flatness.where = "scene.toml:3: slm: flatness";
  uneven.flatness.picture = {2, 1, {0, 0}};
  CHECK_REFUSED(planned(uneven),
                "scene.toml:3: slm: flatness: the picture is 2 x 1, the SLM 1000 x "
                "500");
}

TEST_CASE("a plan says what beam, fill and source do to a scene, by closed forms") {
  SlmSpec slm;
  // The hologram is 4 mm x 2 mm, light 500 nm, the square 2 mm wide and 100 mm away, 5 mm off
  slm.illumination.profile.diameter_m = {4 * mm, 4 * mm};
  slm.fill = glm::dvec2(0.9, 0.8);
  slm.illumination.source_size_rad = 0.5e-3;
  slm.illumination.bandwidth_m = 2e-9;
  const auto p = planned(slm, {4 * mm, 0});
  const auto& light = p.prediction.slm_light;
  // erf(sqrt(2) W / d): 95.45 % and 68.27 %
  CHECK(light.on_hologram == Approx(0.9545 * 0.6827).epsilon(1e-3));
  CHECK(light.darkest < 0.5);
  CHECK(light.in_order == Approx(0.72 * 0.72));
  // The farthest corner, 5 mm and 1 mm off: 0.4 and 0.08 cycles per pixel
  const auto sinc = [](double t) {
    return std::sin(std::numbers::pi * t) / (std::numbers::pi * t);
  };
  CHECK(light.at_edge == Approx(std::pow(sinc(0.9 * 0.4) * sinc(0.8 * 0.08), 2)).epsilon(0.02));
  CHECK(light.source.disc_m == Approx(50 * um).epsilon(1e-3));
  CHECK(light.source.smear_m == Approx(2.0 / 500 * 2 * mm).epsilon(1e-3));
  const auto ideal = planned({}, {4 * mm, 0}).prediction.slm_light;
  CHECK(ideal.at_edge == 1);
  CHECK(ideal.source.speckle == 1);
  SlmSpec blurred;
  blurred.crosstalk.sigma_m = 20 * um;
  CHECK_REFUSED(planned(blurred), "slm.crosstalk: 20 um is more than 3 pixels of 4 um");
}

DEVICE_TEST(
    "the contrast of speckle that a source leaves is that of pictures, within 4 % near the axis",
    "[slow]") {
  const HologramSpec hologram{{320, 256}, glm::dvec2(4 * um), 500e-9};
  constexpr double away_m = 20 * mm;
  const auto contrast = [&](const SourceSpread& source) {
    double sum = 0, squares = 0;
    constexpr int holograms = 12;
    for (int i = 0; i < holograms; ++i) {
      auto one = random_phases({320, 256}, 1, 10 + i);
      one.source = source;
      const auto image = reconstruct(device, cl::FftBackend::host, one, hologram,
                                     {.z_m = away_m, .window_m = glm::dvec2(0.16 * mm)});
      for (const float v : image.pixels) sum += v, squares += double{v} * v;
    }
    const double n = holograms * 40.0 * 40;
    return std::sqrt(squares / n - sum / n * sum / n) / (sum / n);
  };
  const auto window_m = glm::dvec2(320, 256) * 4.0 * um;
  const double laser = contrast({});
  for (const auto& source : {SourceSpread{.size_rad = 1e-3}, SourceSpread{.size_rad = 3e-3},
                             SourceSpread{.bandwidth_m = 20e-9},
                             SourceSpread{.bandwidth_m = 5e-9, .per_m = {0.1 / (4 * um), 0}}}) {
    const double stated = source_blur(source, window_m, 500e-9, away_m).speckle;
    INFO(stated);
    CHECK(contrast(source) / laser == Approx(stated).epsilon(0.04));
    CHECK(stated < 0.95);
  }
}

}  // namespace
}  // namespace raywave
