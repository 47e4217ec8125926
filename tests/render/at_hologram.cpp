// SPDX-License-Identifier: Apache-2.0
// Surfaces near the hologram and in its plane: z = 0 is no special place.
#include "host/carriers/at_hologram/carrier.hpp"
#include "host/plan/lattice.hpp"
#include "host/planning/make_plan.hpp"
#include "host/view/lens.hpp"
#include "tests/support/render.hpp"
#include "tests/support/seen.hpp"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec2;
using glm::dvec3;
using Complex = std::complex<double>;

namespace {

constexpr double pitch_m = 4e-6, wavelength_m = 638e-9, largest_sine = wavelength_m / (2 * pitch_m);

/// A hologram of 160 x 128 pixels, without surfaces.
Stage empty_stage() {
  Stage stage;
  stage.scene.hologram = {{160, 128}, dvec2(pitch_m), wavelength_m};
  stage.scene.sampling.pitch_m = 16e-6;
  stage.scene.wrp.propagation = WrpPropagation::automatic;
  return stage;
}

/// The field of a rig's samples at the hologram.
std::vector<std::complex<float>> gathered(const raywave::cl::Device& device, const Rig& rig) {
  Gatherer gatherer(device, rig.plan, rig.arrays, rig.table, 1);
  gatherer.draw_phases(1);
  raywave::cl::ComplexBuffer buffer(
      device, std::vector<std::complex<float>>(std::size_t{160} * 128, {7, 7}), "field");
  gatherer.gather(rig.plan.wrps.at(0), buffer);
  return buffer.read();
}

/// Gathers small squares at depths in a row at the hologram, and compares with the direct sum of
/// their samples' waves.
void check_sum(const raywave::cl::Device& device, const Illumination& light, Method method,
               const std::vector<double>& depths_m) {
  auto stage = empty_stage();
  stage.scene.slm.illumination = light;
  for (int i = 0; i < static_cast<int>(depths_m.size()); ++i)
    stage.add(rectangle(
        {(i - 2) * 0.1e-3, i % 2 * 0.1e-3 - 0.05e-3, depths_m[static_cast<std::size_t>(i)]},
        {14e-6, 0, 0}, {0, 14e-6, 0}));
  const Rig rig(device, stage, method, false);
  REQUIRE(rig.plan.is_at_hologram());
  REQUIRE(is_near_hologram(rig.plan) == (method == Method::wrp));
  std::vector<int> found(depths_m.size());
  for (const auto& s : rig.samples) ++found[rig.object_of(s)];
  for (const int count : found) REQUIRE(count > 0);

  const auto field = gathered(device, rig);
  const auto what = reference::gathering(rig);
  double difference = 0, energy = 0;
  int pixels = 0, finite = 0, dark = 0;
  for (const auto& value : field)
    finite += std::isfinite(value.real()) && std::isfinite(value.imag());
  for (std::size_t i = 0; i < field.size(); i += 3) {  // each column has its turn
    const auto at = reference::pixel_m(rig.plan, {0, 0, 0}, i);
    const auto lit_sine = light.sine_at(dvec2(at));
    Complex sum = 0;
    bool unsure = false;
    for (std::size_t n = 0; n < rig.samples.size(); ++n) {
      const auto p = place(rig.samples[n]) + rig.plan.extent.origin_m;
      const auto path = at - p;
      const double r = glm::length(path), side = p.z < 0 ? -1 : 1;
      if (std::abs(p.z) < 1e-6) {  // has no spherical wave
        unsure = unsure || (std::abs(path.x) < 24 * pitch_m && std::abs(path.y) < 24 * pitch_m);
        continue;
      }
      const auto beyond = side * dvec2(path) / r - lit_sine;
      const double most = std::max(std::abs(beyond.x), std::abs(beyond.y));
      unsure = unsure || std::abs(most - largest_sine) < 1e-5;
      dark += most > largest_sine;
      if (most > largest_sine) continue;
      const auto wave =
          std::polar(1.0, side * 2 * std::numbers::pi * std::remainder(r / wavelength_m, 1.0));
      double share = rig.samples[n].hidden ? reference::smooth_share(what, n, dvec2(at)) : 1;
      sum += share * reference::amplitude_towards(what, n, path / -path.z) / r * wave *
             reference::phasor_of(what, n, 1);
    }
    if (unsure) continue;
    ++pixels;
    difference += std::norm(Complex(field[i]) - sum);
    energy += std::norm(sum);
  }
  const double error = std::sqrt(difference / energy);
  INFO("sine " << light.sine.x << ": error " << error << " of " << pixels << " pixels");
  CHECK(finite == 160 * 128);
  CHECK(pixels > 3333);
  CHECK(dark > 333);
  CHECK(error < 1e-5);
}

const Illumination lights[] = {{}, {0.2, {0, 0}}, {{}, {0.03, -0.02}}};

}  // namespace

DEVICE_TEST(
    "points from -95 to +95 mm, also beside one in the hologram's plane, are the direct sum of "
    "their waves under plane, converging and tilted light") {
  for (const auto& light : lights)
    check_sum(device, light, Method::wrp, {-95e-3, -1e-3, 0, 1e-3, 95e-3});
}

DEVICE_TEST(
    "points from 1 to 95 mm whose light is too steep for most pixels are the direct sum of their "
    "waves under plane, converging and tilted light",
    "[slow]") {
  for (const auto& light : lights)
    check_sum(device, light, Method::points, {1e-3, 1.2e-3, 1.5e-3, 2e-3, 95e-3});
}

DEVICE_TEST("what reaches a small pupil behind an eyepiece is the sum of its plane waves") {
  // Spots are 8 pixels wide
  auto stage = empty_stage();
  stage.scene.viewer.eyepiece_m = stage.scene.viewer.eyepiece_distance_m = 50e-3;
  stage.scene.viewer.eye_relief_m = 50e-3;
  stage.scene.viewer.pupil_m = 1e-3;
  stage.add(rectangle({20e-6, -30e-6, 0.15e-3}, {30e-6, 0, 0}, {0, 30e-6, 0}));
  const Rig rig(device, stage, Method::wrp, false);
  REQUIRE(is_near_hologram(rig.plan));
  const auto sine = rig.plan.hologram.largest_sine;
  REQUIRE(sine.x == Catch::Approx(0.01));
  const auto field = gathered(device, rig);
  const auto what = reference::gathering(rig);
  REQUIRE(!rig.samples.empty());
  std::vector<Complex> sums(field.size());
  for (std::size_t n = 0; n < rig.samples.size(); ++n) {
    const auto p = place(rig.samples[n]) + rig.plan.extent.origin_m;
    const double amplitude = reference::amplitude_towards(what, n, {0, 0, -1});
    // Integrals over the sines of an axis, by the midpoint rule
    const auto waves = [&](double away_m, double most) {
      constexpr int steps = 400;
      Complex sum = 0;
      for (int i = 0; i < steps; ++i) {
        const double s = most * ((2 * i + 1.0) / steps - 1);
        sum += std::polar(
            2 * most / steps / std::sqrt(1 - s * s),
            2 * std::numbers::pi / wavelength_m * (s * away_m - p.z * (1 - std::sqrt(1 - s * s))));
      }
      return sum;
    };
    std::vector<Complex> across, down;
    for (std::size_t x = 0; x < 160; ++x)
      across.push_back(waves(reference::pixel_m(rig.plan, {0, 0, 0}, x).x - p.x, sine.x));
    for (std::size_t y = 0; y < 128; ++y)
      down.push_back(waves(reference::pixel_m(rig.plan, {0, 0, 0}, 160 * y).y - p.y, sine.y));
    const auto wave = Complex(0, 1) / wavelength_m *
                      std::polar(amplitude, 2 * std::numbers::pi * p.z / wavelength_m) *
                      reference::phasor_of(what, n, 1);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += wave * across[i % 160] * down[i / 160];
  }
  double difference = 0, energy = 0;
  for (std::size_t i = 0; i < field.size(); ++i) {
    difference += std::norm(Complex(field[i]) - sums[i]);
    energy += std::norm(sums[i]);
  }
  INFO("relative L2 " << std::sqrt(difference / energy));
  CHECK(std::sqrt(difference / energy) < 0.02);
}

TEST_CASE(
    "scenes on one side are gathered at the hologram near it, and as far as nothing else serves, "
    "but for mirrors and planes") {
  for (const double z_m : {-1.6e-3, -0.2e-3, -0.1e-3, 0.1e-3, 0.2e-3, 1.6e-3, 12e-3}) {
    INFO("z " << z_m);
    auto stage = empty_stage();
    stage.add(rectangle({0, 0, z_m}, {0.1e-3, 0, 0}, {0, 0.1e-3, 0}));
    const double away_m = std::abs(z_m);
    const bool is_near = away_m < 160 * pitch_m / 4;
    const bool serves_far = away_m > 5e-3;
    const auto plan = make_plan(stage.scene, stage.world);
    CHECK(is_near_hologram(plan) == !serves_far);
    CHECK(plan.is_at_hologram() == !serves_far);
    CHECK((plan.why_carrier.find("WRPs one of") != plan.why_carrier.npos) ==
          (!is_near && !serves_far));
    auto planes = stage.scene;
    planes.wrp.distances_m = {0.8 * z_m};
    CHECK(!make_plan(planes, stage.world).is_at_hologram());
    planes.wrp.distances_m.clear();
    planes.wrp.grid = glm::ivec2(1, 1);
    CHECK(!make_plan(planes, stage.world).is_at_hologram());
    if (z_m < 0) continue;
    auto mirror = empty_stage();
    mirror.add(rectangle({0, 0, z_m}, {0.1e-3, 0, 0}, {0, 0.1e-3, 0}), {.reflectivity = 1});
    CHECK(!make_plan(mirror.scene, mirror.world).is_at_hologram());
    mirror.scene.trace.depth = 0;
    CHECK(make_plan(mirror.scene, mirror.world).is_at_hologram() == !serves_far);
  }
}

DEVICE_TEST("a card through the hologram's plane is as bright there as on both sides of it") {
  for (const double tilt : {0.0, 0.5, 2.0}) {  // half depth over half width
    auto stage = empty_stage();
    stage.scene.sampling.frames = 8;
    stage.scene.sampling.pitch_m = 8e-6;
    const double half_m = 0.6e-3;
    stage.add(rectangle({0, 0, 0}, {half_m, 0, tilt * half_m}, {0, half_m, 0}), glowing());
    const auto result = render(device, stage.scene, stage.world);
    REQUIRE(is_near_hologram(result.plan));
    // All that pixels show of a surface: radiance times the square of the band's sines
    const double wanted = std::pow(2 * largest_sine, 2);
    const std::size_t nx = 160, ny = 128;
    for (std::size_t band = 0; band < 5; ++band) {
      double sum = 0, brightest = 0;
      int count = 0;
      for (std::size_t frame = 0; frame < 8; ++frame) {
        for (std::size_t y = 32; y < 96; ++y) {
          for (std::size_t x = 16 + band * 25; x < 16 + (band + 1) * 25; ++x) {
            const double here = std::norm(result.field.samples[(frame * ny + y) * nx + x]);
            sum += here;
            brightest = std::max(brightest, here);
            ++count;
          }
        }
      }
      CAPTURE(tilt, 16 + band * 25, sum / count / wanted, brightest / wanted);
      CHECK(std::abs(sum / count / wanted - 1) < 0.05);
      CHECK(brightest < 25 * wanted);
    }
  }
}

TEST_CASE("lasers of one scene are gathered alike, wherever it stands") {
  for (const char* z : {"3 mm", "10 mm", "14 mm", "17 mm", "20 mm", "30 mm"}) {
    const auto scenes =
        load_scenes(std::filesystem::path(RAYWAVE_DATA_DIR) / "teapot.toml",
                    {"hologram.wavelength=['638 nm', '520 nm', '450 nm']", "wrp.grid=auto",
                     "object.0.width=2 mm", std::string("object.0.position=[0, 0, '") + z + "']"});
    const auto world = build_world(scenes[0]);
    const auto first = make_plan(scenes[0], world);
    for (const auto& scene : scenes) {
      const auto plan = make_plan(scene, world);
      INFO(z << ", " << scene.hologram.wavelength_m << ": " << plan.why_carrier);
      CHECK(is_near_hologram(plan) == is_near_hologram(first));
      CHECK(plan.is_at_hologram() == is_near_hologram(plan));
    }
  }
}

DEVICE_TEST("a wall seen edge-on near the hologram is no brighter than a card that faces it") {
  for (const double z_m : {0.0, 0.3e-3, -0.3e-3}) {
    const auto brightest = [&](bool has_wall) {
      auto stage = empty_stage();
      stage.scene.sampling.frames = 4;
      stage.scene.viewer.distance_m = 1e-3;  // near, so that rays of the lattice meet the wall
      stage.add(rectangle({-0.2e-3, 0, z_m}, {0.15e-3, 0, 0}, {0, 0.3e-3, 0}), glowing());
      if (has_wall)
        stage.add(rectangle({0.3e-3, 0.3e-3, z_m}, {-1e-12, -1e-12, 0.1e-3}, {0.2e-3, -0.2e-3, 0}),
                  glowing());
      double most = 0;
      for (const auto& u : render(device, stage.scene, stage.world).field.samples)
        most = std::max(most, double{std::norm(u)});
      return most;
    };
    const double card = brightest(false), both = brightest(true);
    CAPTURE(z_m, both / card);
    CHECK(both < 3 * card);
  }
}

TEST_CASE("scenes in the hologram's plane refuse what cannot show them") {
  auto stage = empty_stage();
  stage.add(rectangle({0, 0, 0}, {0.1e-3, 0, 0}, {0, 0.1e-3, 0}));
  CHECK(make_plan(stage.scene, stage.world).is_at_hologram());
  stage.scene.wrp.propagation = WrpPropagation::compact;
  CHECK_REFUSED(make_plan(stage.scene, stage.world), "wrp.propagation");
  stage.scene.wrp.propagation = WrpPropagation::automatic;
  stage.scene.sampling.mode = SamplingMode::fan;
  CHECK_REFUSED(make_plan(stage.scene, stage.world), "aimed");
}

DEVICE_TEST(
    "mirrors beside the hologram's plane show a lens what lies there; they have no hologram, and "
    "rays from its pixels none of that plane") {
  const Material glowing{.ambient = dvec3(0), .diffuse = dvec3(0), .emission = dvec3(1)},
      dim{.ambient = dvec3(0), .diffuse = dvec3(0), .emission = dvec3(0.5)},
      mirror{.ambient = dvec3(0), .diffuse = dvec3(0), .reflectivity = 0.5};
  // A card through the plane, and a mirror at z = 1 mm that is turned by 0.04
  const dvec3 middle(-0.05e-3, 0, 0), across(0.02e-3, 0, 0.02e-3), up(0, 0.04e-3, 0),
      at(0, 0, 1e-3);
  const auto normal = glm::normalize(dvec3(0.04, 0, -1));
  const auto turned = [&](dvec3 v) { return v - 2 * glm::dot(v, normal) * normal; };
  auto stage = empty_stage();
  stage.add(rectangle(middle, across, up), glowing);
  stage.add(rectangle(at, {0.4e-3, 0, 0.4e-3 * 0.04}, {0, 0.4e-3, 0}), mirror);
  CHECK_REFUSED(make_plan(stage.scene, stage.world),
                "mirrors and glass are not followed there; move it");
  auto image = empty_stage();
  image.add(rectangle(middle, across, up), glowing);
  image.add(rectangle(at + turned(middle - at), turned(across), turned(up)), dim);
  auto alone = empty_stage();
  alone.add(rectangle(middle, across, up), glowing);

  const auto seen = [&](const Stage& of) {
    const auto plan = lens_plan(of.scene, of.world);
    return lens_picture(
        device, plan, DeviceScene(device, of.world, plan),
        {.z_m = 2e-3, .window_m = dvec2(0.6e-3, 0.3e-3), .points = 12, .pixel_m = dvec2(10e-6)});
  };
  const auto by_mirror = seen(stage), expected = seen(image), without = seen(alone);
  double difference = 0, all = 0, mirrored = 0;
  for (std::size_t i = 0; i < expected.pixels.size(); ++i) {
    difference += std::abs(by_mirror.pixels[i] - expected.pixels[i]);
    mirrored += std::abs(expected.pixels[i] - without.pixels[i]);
    all += expected.pixels[i];
  }
  CAPTURE(difference / all, mirrored / all);
  CHECK(mirrored > 0.1 * all);
  CHECK(difference < 0.01 * all);
  const auto plan = make_plan(image.scene, image.world, Method::rays);
  StageTimes times;
  HologramCarrier by_rays(device, device, {}, times);
  CHECK_REFUSED(by_rays.fit(plan), "leave out --method rays");
}

TEST_CASE("a scene that moves through the hologram's plane gives what scenes there give") {
  const auto device = all_devices().front();
  auto stage = empty_stage();
  stage.add(rectangle({0, 0, 0}, {0.1e-3, 0, 0.02e-3}, {0, 0.08e-3, 0}));
  auto& scene = stage.scene;
  // The world of place_objects knows how to move
  const auto placed_at = [&](double z_m) {
    const Folder folder;
    auto there = scene;
    there.objects = {object_at(folder.write("square.obj", square_obj()), 0.2e-3, {0, 0, z_m})};
    there.objects[0].rotation_deg = {5, 10, 0};
    return std::pair(there, world_of(there));
  };
  const auto [first, world] = placed_at(12e-3);
  Renderer renderer(device, first, world);
  renderer.render();
  for (const double z_m : {0.0, -0.01e-3, -12e-3, 0.005e-3, 12e-3}) {
    renderer.set_pose(0, {0, 0, z_m}, {5, 10, 0});
    const auto moved = renderer.render();
    const auto [there, its_world] = placed_at(z_m);
    const auto placed = render(device, there, its_world);
    INFO("z " << z_m << ": off by " << relative_l2(moved.field.samples, placed.field.samples));
    CHECK(is_near_hologram(moved.plan) == (std::abs(z_m) < 1e-3));
    CHECK(relative_l2(moved.field.samples, placed.field.samples) < 0.02);
  }
}

DEVICE_TEST("near the hologram, reconstructions show what a lens sees within the pixels' angles") {
  auto stage = empty_stage();
  stage.scene.hologram.resolution = {320, 240};
  stage.scene.sampling.frames = 8;
  stage.scene.sampling.pitch_m = 10e-6;
  for (int i = 0; i < 4; ++i) {
    stage.add(rectangle({-0.5e-3 + 0.12e-3 * i, 0, -0.25e-3}, {0.03e-3, 0, 0}, {0, 0.3e-3, 0}),
              glowing());
    stage.add(rectangle({0.33e-3, -0.2e-3 + 0.12e-3 * i, 1e-3}, {0.2e-3, 0, 0}, {0, 0.03e-3, 0}),
              glowing());
  }
  const auto shown = render(device, stage.scene, stage.world);
  REQUIRE(is_near_hologram(shown.plan));
  const auto similar = [&](double lens_z_m, double shown_z_m) {
    return psnr_db_of_shown(device, stage, shown, lens_z_m, shown_z_m, 20);
  };
  const double before = similar(-0.25e-3, -0.25e-3), beyond = similar(1e-3, 1e-3),
               swapped = similar(-0.25e-3, 1e-3);
  INFO("before " << before << " dB, beyond " << beyond << ", swapped " << swapped);
  CHECK(before > 22);
  CHECK(beyond > 22);
  CHECK(swapped < before - 4);
}
