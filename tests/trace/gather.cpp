// SPDX-License-Identifier: Apache-2.0
#include "host/plan/memory.hpp"
#include "host/propagate/propagator.hpp"
#include "host/reference/looks.hpp"
#include "host/render.hpp"
#include "host/view/compare.hpp"
#include "tests/support/samples.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec2;
using glm::dvec3;

namespace {

using Complex = std::complex<double>;
using Fields = std::vector<std::complex<float>>;
const std::filesystem::path data = RAYWAVE_DATA_DIR;

using reference::against_direct_sum;
using reference::ball_before_wall;
using reference::phase_turns_of_key;

/// The gathered field of one layer on a plane.
///
/// plane_wave_spots  see Gatherer; 0: all samples are gathered geometrically
Fields gathered(const raywave::cl::Device& device, const Rig& rig, dvec3 centre,
                double plane_wave_spots = 0, int frames = 1, std::uint32_t seed = 1,
                std::size_t layer = 0) {
  Gatherer gatherer(device, rig.plan, rig.arrays, rig.table, frames, plane_wave_spots);
  gatherer.draw_phases(seed);
  const auto pixels = static_cast<std::size_t>(rig.plan.hologram.size.x) *
                      static_cast<std::size_t>(rig.plan.hologram.size.y);
  raywave::cl::ComplexBuffer field(
      device, Fields(static_cast<std::size_t>(frames) * pixels, {7, 7}), "field");
  gatherer.gather(Wrp{.centre_m = centre, .layer = layer}, field);
  return field.read();
}

/// One emissive point: a patch that only one lattice ray hits.
Stage one_point(dvec3 at) {
  Stage stage;
  stage.scene.hologram = {{61, 47}, {8e-6, 8e-6}, 638e-9};
  stage.add(rectangle(at, {18e-6, 0, 0}, {0, 18e-6, 0}));
  return stage;
}

Scene study(std::vector<std::string> settings) {
  settings.insert(settings.end(), {"sampling.frames=1", "wrp.propagation=spectrum"});
  return load_scene(data / "study.toml", settings);
}

}  // namespace

DEVICE_TEST(
    "geometric gathering matches the direct sum in front of, inside and behind the scene, on and "
    "off the axis") {
  struct Case {
    const char* name;
    double scene_z_m;
    dvec3 centre;
    double fan, edge;
  };
  const Case cases[] = {{"0.1 mm before the scene", 30e-3, {0, 0, 29.6e-3}, 1.2, 0.2},
                        {"1 mm before it, hard fan", 30e-3, {0, 0, 28.7e-3}, 1.0, 0.0},
                        {"20 mm before it", 30e-3, {0.1e-3, 0, 9.7e-3}, 1.2, 0.2},
                        {"inside", 6e-3, {0, 0, 6.05e-3}, 1.2, 0.2},
                        {"behind it", 30e-3, {0, 0, 33e-3}, 1.2, 0.2},
                        {"off the axis", 30e-3, {0.43e-3, -0.35e-3, 27e-3}, 1.1, 0.1},
                        {"at the hologram", 30e-3, {0, 0, 0}, 1.2, 0.2},
                        {"at the hologram, 1 m away", 1, {0, 0, 0}, 1.2, 0.2},
                        {"z < 0, nearer to the hologram", -30e-3, {0, 0, -27.6e-3}, 1.2, 0.2},
                        {"z < 0, inside", -6e-3, {0, 0, -5.95e-3}, 1.2, 0.2},
                        {"z < 0, nearer to the eye", -30e-3, {0, 0, -33e-3}, 1.0, 0.0},
                        {"z < 0, off the axis", -30e-3, {0.43e-3, -0.35e-3, -27e-3}, 1.1, 0.1},
                        {"z < 0, at the hologram", -30e-3, {0, 0, 0}, 1.2, 0.2}};
  for (const auto& [name, scene_z_m, centre, fan, edge] : cases) {
    auto stage = ball_before_wall(scene_z_m);
    CAPTURE(name);
    stage.scene.sampling.cone = fan;
    stage.scene.sampling.apodization = edge;
    const Rig rig(device, stage);
    REQUIRE(rig.samples.size() > 400);
    REQUIRE(rig.table.hidden > 20);
    const auto result = against_direct_sum(rig, gathered(device, rig, centre), 1, 1, centre, 250);
    CAPTURE(name, result.error, result.pixels, result.unsure);
    CHECK(result.pixels > 60);
    CHECK(result.error < 2e-5);
    CHECK(result.dark_error == 0);
  }
}

DEVICE_TEST("frames gathered together differ only in their phases") {
  const auto stage = ball_before_wall(30e-3);
  const dvec3 centre(0, 0, 28.5e-3);
  const Rig rig(device, stage);
  for (const int frames : {3, most_frames_together}) {
    const auto result = against_direct_sum(rig, gathered(device, rig, centre, 0, frames, 40),
                                           frames, 40, centre, 100);
    CAPTURE(frames, result.error);
    CHECK(result.pixels > 60);
    CHECK(result.error < 2e-5);
  }
}

TEST_CASE("frames beyond one group continue with the next seeds", "[slow]") {
  const auto device = all_devices().front();
  auto scene =
      load_scene(data / "study.toml",
                 {"sampling.frames=17", "hologram.resolution=[33, 31]", "sampling.pitch='0.1 mm'"});
  const auto many = render(device, scene).field;
  scene.sampling.frames = 1;
  for (const int frame : {0, 15, 16}) {
    scene.sampling.seed = 1 + static_cast<std::uint32_t>(frame);
    const auto one = render(device, scene).field;
    const FieldStack same{
        33,
        31,
        1,
        {many.samples.begin() + frame * 33 * 31, many.samples.begin() + (frame + 1) * 33 * 31}};
    CHECK(compare_fields(one, same).error < 1e-5);
  }
}

DEVICE_TEST("a cone without apodization lights exactly the pixels whose rays reach the hologram") {
  for (const double z_wrp : {19e-3, 15e-3, 23e-3}) {
    auto stage = one_point({13e-6, 13e-6, 20e-3});
    stage.scene.sampling.cone = 1;
    stage.scene.sampling.apodization = 0;
    const Rig rig(device, stage);
    REQUIRE(rig.samples.size() == 1);
    const auto p = place(rig.samples[0]) + rig.plan.extent.origin_m;
    const dvec3 centre(5e-6, 0, z_wrp);
    const auto field = gathered(device, rig, centre);
    int lit = 0, wrong = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      const auto pixel = reference::pixel_m(rig.plan, centre, i);
      const auto at = abs(dvec2(pixel) - dvec2(p - pixel) * pixel.z / (p.z - pixel.z)) /
                      (dvec2(rig.plan.hologram.size) * rig.plan.hologram.pitch_m / 2.0);
      const double most = std::max(at.x, at.y);
      if (std::abs(most - 1) < 1e-5) continue;
      wrong += (field[i] != 0.0f) != (most < 1);
      lit += most < 1;
    }
    CHECK(wrong == 0);
    CHECK(lit > 3);
  }
}

DEVICE_TEST("light too steep for the pixels of the SLM is left out") {
  // 4 um pixels show sines up to 0.0798: a sample 1.2 mm off the axis at 15 mm sends steeper light
  // to one side of the hologram.
  Stage stage;
  stage.scene.hologram = {{121, 5}, {4e-6, 4e-6}, 638e-9};
  stage.add(rectangle({1.2e-3, 0, 15e-3}, {30e-6, 0, 0}, {0, 30e-6, 0}));
  const Rig rig(device, stage, Method::points, false);
  REQUIRE(rig.plan.beyond_diffraction);
  REQUIRE(!rig.samples.empty());
  const auto field = gathered(device, rig, {0, 0, 0});
  int wrong = 0, steep = 0;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const auto pixel = reference::pixel_m(rig.plan, {0, 0, 0}, i);
    int shown = 0, unsure = 0;
    for (const auto& s : rig.samples) {
      const auto way = normalize(place(s) + rig.plan.extent.origin_m - pixel);
      shown += way.x < 638e-9 / 8e-6;
      unsure += std::abs(way.x - 638e-9 / 8e-6) < 1e-6;
    }
    wrong += !unsure && (field[i] != 0.0f) != (shown > 0);
    steep += shown == 0;
  }
  CHECK(wrong == 0);
  CHECK(steep > 50);
  CHECK(steep < 121 * 5 - 50);
}

DEVICE_TEST("rendering by points matches the direct sum at the hologram") {
  // The test needs no mesh file and no texture; render() and the oracle's world read one file.
  const auto scene =
      load_scene(data / "study.toml",
                 {"sampling.frames=2", "hologram.resolution=[63, 65]", "sampling.pitch='80 um'",
                  "object.0.mesh=plane.ply", "object.0.rotation=[20, 30, 0]"});
  const auto result = render(device, scene, RenderOptions{.method = Method::points});
  Stage stage;
  stage.scene = scene;
  stage.world = build_world(scene);
  const Rig rig(device, stage, Method::points, false);
  CHECK(result.samples == rig.table.count);
  CHECK(result.hidden_samples == rig.table.hidden);
  const auto agreement = against_direct_sum(rig, result.field.samples, 2, 1, {0, 0, 0}, 300,
                                            amplitude_unit_m(rig.plan));
  CAPTURE(agreement.error, agreement.unsure, rig.table.hidden, rig.table.count);
  CHECK(agreement.pixels > 100);
  CHECK(agreement.error < 2e-5);
}

DEVICE_TEST(
    "smooth parts of the window are nearer than hard ones to a ray from every sample to every "
    "pixel",
    "[slow]") {
  auto stage = ball_before_wall(10e-3);
  stage.scene.hologram = {{192, 160}, {3.74e-6, 3.74e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 20e-6;
  const Rig rig(device, stage, Method::points, false);
  const auto what = reference::gathering(rig);
  const auto half_m = rig.plan.window_m() / 2.0;
  const int parts = rig.table.visibility_parts;
  Random random(3);
  double smooth = 0, hard = 0, energy = 0;
  for (int n = 0; n < 200; ++n) {
    const dvec2 at(uniform(random, -1, 1), uniform(random, -1, 1));
    const dvec3 pixel_m(at * half_m, 0);
    const auto part = glm::ivec2((at + 1.0) * (parts / 2.0));
    const auto bit = static_cast<std::size_t>(part.y * parts + part.x);
    Complex exact = 0, by_smooth = 0, by_hard = 0;
    for (std::size_t i = 0; i < rig.samples.size(); ++i) {
      const auto& s = rig.samples[i];
      const auto path = pixel_m - (place(s) + rig.plan.extent.origin_m);
      const double r = length(path);
      const auto wave =
          reference::amplitude_towards(what, i, path / -path.z) / r *
          std::polar(1.0, 2 * std::numbers::pi *
                              (std::remainder(r / 638e-9, 1.0) + phase_turns_of_key(s.key, 1)));
      const bool is_free = free_path(rig.corners, place(s), normal(s), rig.arrays.bias_m,
                                     pixel_m - rig.plan.extent.origin_m) != reference::Seen::no;
      exact += is_free ? wave : 0.0;
      by_smooth += (s.hidden ? reference::smooth_share(what, i, dvec2(pixel_m)) : 1.0) * wave;
      const auto words = rig.table.visibility_words();
      const bool is_seen = rig.visibility_masks[i * words + bit / 32] >> (bit % 32) & 1u;
      by_hard += !s.hidden || is_seen ? wave : 0.0;
    }
    smooth += std::norm(by_smooth - exact);
    hard += std::norm(by_hard - exact);
    energy += std::norm(exact);
  }
  CAPTURE(rig.table.hidden, rig.table.count, std::sqrt(smooth / energy), std::sqrt(hard / energy));
  REQUIRE(rig.table.hidden > 20);
  CHECK(smooth < hard);
  CHECK(std::sqrt(smooth / energy) < 0.1);
}

DEVICE_TEST(
    "gathered and fan-traced holograms of the study scene correlate with the sum of all points",
    "[slow]") {
  const RenderOptions points{.method = Method::points};
  const auto gold = render(device, study({}), points);
  const auto correlation = [&](std::vector<std::string> settings) {
    return compare_fields(gold.field, render(device, study(std::move(settings))).field).correlation;
  };
  const double hard = correlation({"sampling.cone=1.0", "sampling.apodization=0"});
  const double soft = correlation({"sampling.cone=1.2", "sampling.apodization=0.2"});
  const double literal = correlation({"sampling.mode=fan"});
  CAPTURE(hard, soft, literal);
  CHECK(hard >= 0.94);
  CHECK(soft >= 0.965);
  CHECK(literal < 0.2);
}

DEVICE_TEST(
    "the hologram does not depend on the place of the WRP: in front of, inside, on a surface of "
    "or behind the scene",
    "[slow]") {
  Stage stage;
  stage.scene = study({});
  stage.world = build_world(stage.scene);
  const RenderOptions points{.method = Method::points};
  const auto gold = render(device, stage.scene, points);
  const Rig rig(device, stage);
  Propagator propagator(device, {rig.plan.hologram.size, rig.plan.hologram.pitch_m,
                                 rig.plan.hologram.wavelength_m, 2});
  // The sphere extends from 18.55 to 19.45 mm; the plane behind it stands at 19.5 mm.
  for (const double z :
       {16.5e-3, 17.55e-3, 18.2e-3, 18.6e-3, 19e-3, 19.2e-3, 19.47e-3, 19.5e-3, 19.7e-3, 21e-3}) {
    const auto on_plane = gathered(device, rig, {0, 0, z}, default_plane_wave_spots);
    raywave::cl::ComplexBuffer field(device, std::span(on_plane), "field");
    propagator.load(field);
    propagator.add({{0, 0}, z});
    propagator.collect(field);
    auto samples = field.read();
    for (auto& u : samples) u *= static_cast<float>(amplitude_unit_m(rig.plan));
    const auto result = compare_fields(gold.field, {384, 384, 1, std::move(samples)});
    CAPTURE(z, result.correlation, result.energy_ratio);
    CHECK(result.correlation >= 0.97);
    CHECK(result.energy_ratio == Catch::Approx(1).margin(0.05));
  }
}

namespace {

/// The wave of an unoccluded sample at a pixel: the sum of 500 plane waves per axis towards the
/// window of the cone.
Complex plane_waves(const Plan& plan, dvec3 p, dvec3 pixel) {
  const double wave_number = 2 * std::numbers::pi / plan.hologram.wavelength_m,
               depth = p.z - pixel.z;
  Complex product =
      Complex(0, 1) / plan.hologram.wavelength_m * std::polar(1.0, wave_number * depth);
  for (int axis = 0; axis < 2; ++axis) {
    const double half = plan.hologram.size[axis] * plan.hologram.pitch_m[axis] / 2;
    const int count = 500;
    Complex sum = 0;
    for (int n = 0; n < count; ++n) {
      const double at = ((n + 0.5) / count * 2 - 1) * plan.cone.half_width,
                   tangent = (at * half - p[axis]) / p.z;
      const double e =
          plan.cone.apodization > 0
              ? std::clamp((plan.cone.half_width - std::abs(at)) / plan.cone.apodization, 0.0, 1.0)
              : 1.0;
      const double sine = tangent / std::hypot(1, tangent), cosine = 1 / std::hypot(1, tangent);
      // ds = cosine^3 d tangent
      const double weight =
          e * e * (3 - 2 * e) * cosine * cosine * (2 * plan.cone.half_width * half / p.z / count);
      sum += weight *
             std::polar(1.0, wave_number * (sine * (pixel[axis] - p[axis]) - depth * (1 - cosine)));
    }
    product *= sum;
  }
  return product;
}

/// A point off the axis in front of a hologram 1.4 mm wide.
Stage near_point() {
  Stage stage;
  stage.add(rectangle({312.5e-6, -187.5e-6, 20e-3}, {10e-6, 0, 0}, {0, 10e-6, 0}));
  stage.scene.hologram = {{383, 347}, {3.74e-6, 3.74e-6}, 638e-9};
  stage.scene.sampling.cone = 1.2;
  stage.scene.sampling.apodization = 0.2;
  return stage;
}

}  // namespace

DEVICE_TEST(
    "a sample on or near the plane gives the sum of the plane waves that reach the hologram") {
  const Rig rig(device, near_point());
  REQUIRE(rig.samples.size() == 1);
  for (const double depth : {0.0, 1e-9, -1e-9, 3e-6, -20e-6, 0.2e-3, -0.7e-3}) {
    // The plane is centred on the sample, so that all of its light falls on the plane.
    const auto first = place(rig.samples[0]) + rig.plan.extent.origin_m;
    const dvec3 centre(first.x, first.y, first.z - depth);
    const auto field = gathered(device, rig, centre, 12);
    double difference = 0, lit = 0, all = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      const auto pixel = reference::pixel_m(rig.plan, centre, i);
      if (std::abs(pixel.x - first.x) > 120e-6 || std::abs(pixel.y - first.y) > 120e-6) continue;
      REQUIRE(std::isfinite(std::abs(field[i])));
      Complex wanted = 0;
      for (const auto& s : rig.samples)
        wanted += double(s.weight) * std::sqrt(double(s.radiance)) *
                  std::polar(1.0, 2 * std::numbers::pi * phase_turns_of_key(s.key, 1)) *
                  plane_waves(rig.plan, place(s) + rig.plan.extent.origin_m, pixel);
      all += std::norm(wanted);
      if (field[i] == 0.0f) continue;  // outside the sample's footprint
      difference += std::norm(Complex(field[i]) - wanted);
      lit += std::norm(wanted);
    }
    CAPTURE(depth, std::sqrt(difference / lit), lit / all);
    CHECK(std::sqrt(difference / lit) < 2e-3);
    CHECK(lit / all > 0.97);
  }
}

DEVICE_TEST("geometric footprints and plane waves agree at the switch between them") {
  const Rig rig(device, near_point());
  const auto first = place(rig.samples.at(0)) + rig.plan.extent.origin_m;
  const double half = rig.plan.hologram.size.x * rig.plan.hologram.pitch_m.x / 2,
               spot =
                   rig.plan.hologram.wavelength_m * first.z / (2 * rig.plan.cone.half_width * half);
  for (const double side : {1.0, -1.0}) {
    const double depth = side * 12 * spot * first.z / (rig.plan.cone.half_width * half);
    const dvec3 centre(first.x, first.y, first.z - depth);
    const auto geometric = gathered(device, rig, centre, 0),
               waves = gathered(device, rig, centre, 20);
    Fields difference(geometric);
    for (std::size_t i = 0; i < difference.size(); ++i) difference[i] -= waves[i];
    const double error = std::sqrt(energy(difference) / energy(waves));
    CAPTURE(depth, error, energy(geometric) / energy(waves));
    CHECK(error > 0);
    // The geometric footprint has no Fresnel fringes; here they cover a third of the footprint.
    CHECK(error < 0.4);
    CHECK(energy(geometric) / energy(waves) == Catch::Approx(1).margin(0.03));
  }
}

DEVICE_TEST(
    "every sample is gathered in exactly one layer, also at boundaries, before the first and "
    "behind the last") {
  Stage stage;
  stage.scene.hologram = {{61, 47}, {8e-6, 8e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 30e-6;
  for (int i = 0; i < 5; ++i)  // 18.8 to 20 mm
    stage.add(
        rectangle({(i - 2) * 40e-6, 0, 18.8e-3 + i * 0.3e-3}, {18e-6, 0, 2e-6 * i}, {0, 18e-6, 0}));
  Rig rig(device, stage);
  std::vector<float> depths;
  for (const auto& s : rig.samples) depths.push_back(s.z);
  std::sort(depths.begin(), depths.end());
  depths.erase(std::unique(depths.begin(), depths.end()), depths.end());
  REQUIRE(depths.size() >= 5);
  auto& layers = rig.plan.layers;
  REQUIRE(layers.size() == 1);
  const auto whole = layers[0];
  const dvec3 centre(10e-6, -5e-6, 19.3e-3);
  const auto all = gathered(device, rig, centre), all_near = gathered(device, rig, centre, 12);
  // Layer bounds at a sample's own depth, one float behind another sample, and behind all
  // samples
  const double z0 = rig.plan.extent.origin_m.z, first = z0 + double{depths[1]},
               second = z0 + double{std::nextafter(depths[3], 1.0f)};
  layers.assign(4, whole);
  layers[0].end_m = layers[1].begin_m = first;
  layers[1].end_m = layers[2].begin_m = second;
  layers[2].end_m = layers[3].begin_m = 1;
  REQUIRE(layer_bounds(rig.plan, layers[1]) ==
          std::pair(depths[1], std::nextafter(depths[3], 1.0f)));
  const auto sum_of_layers = [&](double plane_wave_spots) {
    std::vector<Complex> sum(all.size());
    for (std::size_t layer = 0; layer < 4; ++layer) {
      const auto part = gathered(device, rig, centre, plane_wave_spots, 1, 1, layer);
      if (layer == 3) CHECK(energy(part) == 0);
      if (layer < 3) CHECK(energy(part) > 0);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += Complex(part[i]);
    }
    return sum;
  };
  // Only the order of the sums differs.
  CHECK(reference::relative_error(sum_of_layers(0), reference::to_double(all)) < 1e-6);
  CHECK(reference::relative_error(sum_of_layers(12), reference::to_double(all_near)) < 1e-6);
}

DEVICE_TEST(
    "a pixel of the study scene gathers at most 30 rays, and most of the light reaches the "
    "hologram",
    "[slow]") {
  const auto scene = study({"sampling.cone=1.0", "sampling.apodization=0"});
  Stage stage;
  stage.scene = scene;
  stage.world = build_world(scene);
  const Rig rig(device, stage);
  const auto& plan = rig.plan;
  const double z_wrp = plan.layers[0].distance_m;
  double pairs = 0, asked = 0;
  for (const auto& s : rig.samples) {
    const auto p = place(s) + plan.extent.origin_m;
    double pixels = 1;
    for (int axis = 0; axis < 2; ++axis) {
      const double middle = p[axis] * z_wrp / p.z, half = plan.hologram.size[axis] *
                                                          plan.hologram.pitch_m[axis] / 2 *
                                                          (p.z - z_wrp) / p.z;
      int inside = 0;
      for (int i = 0; i < plan.hologram.size[axis]; ++i)
        inside +=
            std::abs((i - (plan.hologram.size[axis] - 1) / 2.0) * plan.hologram.pitch_m[axis] -
                     middle) <= half;
      pixels *= inside;
    }
    pairs += pixels;
    asked += s.hidden ? pixels : 0;
  }
  const double per_pixel = pairs / (plan.hologram.size.x * plan.hologram.size.y),
               asked_per_pixel = asked / (plan.hologram.size.x * plan.hologram.size.y);

  const auto share_in_window = [&](const Scene& wanted) {
    const auto wrp = render(device, wanted, RenderOptions{.keep_wrps = true}).wrps.at(0);
    const int wide = 3 * wrp.nx, margin = wrp.nx;
    Fields padded(static_cast<std::size_t>(wide) * static_cast<std::size_t>(wide));
    for (int y = 0; y < wrp.ny; ++y)
      std::copy_n(wrp.samples.begin() + y * wrp.nx, wrp.nx,
                  padded.begin() + (y + margin) * wide + margin);
    raywave::cl::ComplexBuffer field(device, std::span<const std::complex<float>>(padded),
                                     "wide field");
    Propagator propagator(device,
                          {{wide, wide}, plan.hologram.pitch_m, plan.hologram.wavelength_m, 1.25});
    propagator.load(field);
    propagator.add({{0, 0}, z_wrp});
    propagator.collect(field);
    const auto arrived = field.read();
    double within = 0, all = 0;
    for (const auto& v : padded) all += std::norm(Complex(v));
    for (int y = margin; y < margin + wrp.ny; ++y)
      for (int x = margin; x < margin + wrp.nx; ++x)
        within += std::norm(Complex(arrived[y * wide + x]));
    return within / all;
  };
  const double hard = share_in_window(scene), soft = share_in_window(study({}));
  CAPTURE(per_pixel, asked_per_pixel, rig.table.count, rig.table.hidden, hard, soft);
  CHECK(per_pixel <= 30);
  CHECK(per_pixel > 20);
  CHECK(asked_per_pixel < 0.6 * per_pixel);
  CHECK(hard >= 0.85);
  CHECK(soft >= 0.85);
}
