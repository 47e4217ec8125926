// SPDX-License-Identifier: Apache-2.0
// Compact propagation: samples on virtual planes, and these planes at the hologram.
#include "host/carriers/virtual_planes/compact_gatherer.hpp"
#include "host/carriers/virtual_planes/compact_propagator.hpp"
#include "host/carriers/virtual_planes/planning/planes.hpp"
#include "host/plan/precision.hpp"
#include "host/reference/gathering.hpp"
#include "host/reference/looks.hpp"
#include "host/render.hpp"
#include "host/view/compare.hpp"
#include "kernels/gather/compact_layout.h"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec2;
using glm::dvec3;
using glm::ivec2;

namespace {

using Complex = std::complex<double>;
using Fields = std::vector<std::complex<float>>;
using reference::ball_before_wall;

struct AtHologram {
  std::vector<Fields> tiles;                                      // frame after frame
  std::vector<std::vector<device::CompactFootprint>> footprints;  // by WRP
};

AtHologram at_hologram(const raywave::cl::Device& device, const Rig& rig, int frames = 1,
                       std::uint32_t seed = 1,
                       raywave::cl::FftBackend fft = raywave::cl::FftBackend::host,
                       std::optional<Counting> bins = {}) {
  const auto& plan = rig.plan;
  CompactGatherer gatherer(device, plan, rig.arrays, rig.table, frames, bins);
  gatherer.draw_phases(seed);
  CompactPropagator propagator(device, plan, fft);
  AtHologram result;
  raywave::cl::ComplexBuffer stack(device, Fields(frames * plan.gathered_pixels(), {7, 7}),
                                   "stack");
  std::vector<raywave::cl::ComplexBuffer> fields;
  for (std::size_t tile = 0; tile < plan.tiling.tiles.size(); ++tile) {
    fields.clear();
    for (int frame = 0; frame < frames; ++frame)
      fields.emplace_back(device, Fields(plan.tiling.tile_size.x * plan.tiling.tile_size.y, {7, 7}),
                          "field");
    const auto [first, end] = plan.wrps_of(tile);
    for (auto wrp = first; wrp < end; ++wrp) {
      const auto lit = gatherer.gather(plan.wrps[wrp], stack, fft != raywave::cl::FftBackend::host);
      result.footprints.push_back(gatherer.footprints());
      for (int frame = 0; frame < frames; ++frame)
        propagator.add(stack, frame, lit, plan.wrps[wrp].centre_m.z, wrp == first, fields[frame]);
    }
    Fields all;
    for (const auto& field : fields) {
      const auto samples = field.read();
      all.insert(all.end(), samples.begin(), samples.end());
    }
    result.tiles.push_back(std::move(all));
  }
  return result;
}

Complex got_at(const Plan& plan, const Fields& fields, int frame, ivec2 pixel) {
  const auto size = plan.tiling.tile_size;
  return Complex(fields[(frame * size.y + pixel.y) * size.x + pixel.x]);
}

struct Errors {
  double discrete = 0;  // against the same computation in double
  double direct = 0;    // against the sum of the samples' smooth waves
  double inner = 0;     // the same, in the inner 80 % of each axis
};

/// Pixels whose distance from the middle lies between two shares of the half tile, along the axis
/// where it is the larger share.
std::vector<ivec2> some_pixels(const Plan& plan, int count, double from = 0, double to = 2) {
  Random random(1);
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  std::vector<ivec2> pixels;
  while (static_cast<int>(pixels.size()) < count) {
    const int x = below(plan.tiling.tile_size.x), y = below(plan.tiling.tile_size.y);
    const auto share = glm::abs(dvec2(x, y) - dvec2(plan.tiling.tile_size - 1) / 2.0) /
                       (dvec2(plan.tiling.tile_size) / 2.0);
    const double greater = std::max(share.x, share.y);
    if (greater >= from && greater < to) pixels.emplace_back(x, y);
  }
  return pixels;
}

/// Relative L2 errors over pixels of all tiles.
Errors errors_at(const Rig& rig, const AtHologram& got, std::uint32_t seed,
                 const std::vector<ivec2>& pixels, int frame = 0) {
  const auto& plan = rig.plan;
  const auto what = reference::gathering(rig);
  double discrete = 0, direct = 0, energy = 0, inner = 0, inner_energy = 0;
  for (std::size_t tile = 0; tile < plan.tiling.tiles.size(); ++tile) {
    std::vector<Complex> same(pixels.size());
    const auto [first, end] = plan.wrps_of(tile);
    for (auto wrp = first; wrp < end; ++wrp) {
      const auto one =
          reference::compact_field(what, plan.wrps[wrp], seed, got.footprints[wrp], pixels);
      for (std::size_t n = 0; n < pixels.size(); ++n) same[n] += one[n];
    }
    for (std::size_t n = 0; n < pixels.size(); ++n) {
      const auto from_middle = dvec2(pixels[n]) - dvec2(plan.tiling.tile_size - 1) / 2.0;
      const auto place =
          plan.tiling.tiles[tile].centre_m + from_middle * plan.hologram.pitch_m * dvec2(1, -1);
      Complex sum = 0;
      for (std::size_t i = 0; i < rig.samples.size(); ++i)
        sum += reference::smooth_wave(what, i, plan.tiling.tiles[tile], place) *
               reference::phasor_of(what, i, seed);
      const auto value = got_at(plan, got.tiles[tile], frame, pixels[n]);
      discrete += std::norm(value - same[n]);
      direct += std::norm(value - sum);
      energy += std::norm(sum);
      const auto share = glm::abs(from_middle) / (dvec2(plan.tiling.tile_size) / 2.0);
      if (share.x > 0.8 || share.y > 0.8) continue;
      inner += std::norm(value - sum);
      inner_energy += std::norm(sum);
    }
  }
  return {std::sqrt(discrete / energy), std::sqrt(direct / energy),
          std::sqrt(inner / inner_energy)};
}

Errors errors_of(const Rig& rig, const AtHologram& got, std::uint32_t seed, int count,
                 int frame = 0) {
  return errors_at(rig, got, seed, some_pixels(rig.plan, count), frame);
}

Stage compact(Stage stage) {
  stage.scene.wrp.propagation = WrpPropagation::compact;
  return stage;
}

/// A tilted wall of the study's proportions: 192 x 160 pixels of 3.74 um, 10 mm away.
Stage wall(dvec3 centre = {0.05e-3, -0.03e-3, 10e-3}) {
  Stage stage;
  stage.scene.hologram = {{192, 160}, {3.74e-6, 3.74e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 40e-6;
  stage.add(rectangle(centre, {0.3e-3, 0, 0.2e-3}, {0, 0.25e-3, -0.1e-3}));
  return stage;
}

/// Relative L2 error of fields of render() against all points, and their correlation.
FieldComparison against_points(const raywave::cl::Device& device, const Stage& stage) {
  return compare_fields(render(device, stage.scene, stage.world, {.method = Method::points}).field,
                        render(device, stage.scene, stage.world).field);
}

}  // namespace

DEVICE_TEST(
    "compact propagation is what the same computation in double gives, and the sum of the "
    "samples' waves to within what the plan states") {
  struct Case {
    const char* name;
    Stage stage;
    double most_error;  // against all samples; 0: a factor of 1.6 around the stated one
  };
  auto tiles = wall();
  tiles.scene.hologram.tiles = ivec2(2, 3);
  auto layers = wall();
  layers.scene.wrp.layers = 2;
  auto odd = wall();
  odd.scene.hologram.resolution = {97, 61};
  auto wide = wall({0, 0, 2e-3});
  wide.scene.hologram = {{256, 192}, {1e-6, 1e-6}, 638e-9};
  Stage deep;
  deep.scene = wall().scene;
  deep.scene.objects.clear();
  deep.scene.materials.clear();
  deep.add(rectangle({0, 0, 10e-3}, {0.3e-3, 0, 1.5e-3}, {0, 0.25e-3, 0}));
  auto both = wall();
  both.add(rectangle({0.1e-3, 0.05e-3, -8e-3}, {0.2e-3, 0, 0.1e-3}, {0, 0.15e-3, 0}));
  both.scene.hologram.tiles = ivec2(2, 1);
  auto wide_band = wall();
  wide_band.scene.wrp.guard = 1.25;
  wide_band.scene.wrp.bell = 7;
  auto tight = wall();
  tight.scene.wrp.margin_px = 2;
  auto wide_margin = wall();
  wide_margin.scene.wrp.margin_px = 6;
  wide_margin.scene.wrp.bell = 12;
  wide_margin.scene.wrp.lines = 5;
  auto few_lines = wall();
  few_lines.scene.wrp.lines = 1;
  // Stated errors are of samples that nothing hides or cuts.
  Case cases[] = {
      {"a wall", wall(), 0},
      {"light too steep for the pixels", wall({0.8e-3, 0.6e-3, 10e-3}), 0.03},
      {"a shiny ball before a wall", ball_before_wall(10e-3), 0.03},
      {"tiles", tiles, 0},
      {"two layers", layers, 0},
      {"prime sizes", odd, 0},
      {"a wider guard band, and a weaker window function", wide_band, 0},
      {"a margin of 2 pixels", tight, 0},
      {"a margin of 6 pixels, a stronger window function and 5 scan lines", wide_margin, 0},
      {"one scan line", few_lines, 0},
      {"pixels of 1 um", wide, 0},
      {"a deep wall", deep, 0},
      {"a wall before the hologram", wall({0.05e-3, -0.03e-3, -10e-3}), 0},
      {"a shiny ball before it", ball_before_wall(-10e-3), 0.03},
      {"both sides, and tiles", both, 0.03}};
  for (auto& [name, stage, most_error] : cases) {
    for (const auto precision : {Precision::floats, Precision::doubles}) {
      if (precision == Precision::doubles && !device.info().fp64) continue;
      auto exact = compact(stage);
      exact.scene.accuracy.precision = precision;
      const Rig rig(device, exact);
      REQUIRE(rig.samples.size() > 100);
      const auto got = at_hologram(device, rig);
      const auto result = errors_of(rig, got, 1, 200);
      const auto& planned = *rig.plan.virtual_planes();
      const double stated = std::hypot(planned.window_error, planned.lines_error);
      CAPTURE(name, name_of(precision), rig.samples.size(), rig.table.hidden, planned.lines,
              result.discrete, result.direct, result.inner, stated);
      CHECK(result.discrete < 1e-5);
      CHECK(result.direct < (most_error > 0 ? most_error : 1.6 * stated));
      CHECK((most_error > 0 || result.direct > stated / 1.6));
      CHECK(result.inner < 0.02);
      // The window function is a ten-thousandth in the corners, where it is divided out.
      const auto last = rig.plan.tiling.tile_size - 1;
      const auto corners = errors_at(rig, got, 1, {{0, 0}, {last.x, 0}, {0, last.y}, last});
      INFO("corners " << corners.discrete << ", against all samples " << corners.direct);
      CHECK(corners.discrete < 2e-4);
    }
  }
}

DEVICE_TEST("sharp highlights get the scan lines that they need, or their error is stated",
            "[slow]") {
  struct Case {
    double shininess;
    int least_lines;
    double most_error;
  };
  for (const auto& [shininess, least_lines, most_error] :
       {Case{2e3, 2, 0.02}, Case{2e4, 4, 0.02}, Case{2e5, 8, 0.9}}) {
    Stage stage;
    stage.scene = wall().scene;
    stage.scene.objects.clear();
    stage.scene.materials.clear();
    // The highlight of each sample is brightest straight before it.
    stage.add(rectangle({0, 0, 10e-3}, {0.3e-3, 0, 0}, {0, 0.25e-3, 0}), shiny(shininess));
    stage.scene.lights = {Light{.direction = {0, 0, 1}}};
    const Rig rig(device, compact(stage));
    const auto result = errors_of(rig, at_hologram(device, rig), 1, 200);
    const auto& planned = *rig.plan.virtual_planes();
    CAPTURE(shininess, result.direct, planned.error(), planned.highlights_error,
            planned.highlight_lines, result.discrete);
    CHECK(planned.highlight_lines >= least_lines);
    CHECK(result.discrete < 2e-5);
    CHECK(result.direct < most_error);
    CHECK(result.direct < 1.6 * std::hypot(planned.error(), planned.highlights_error));
  }
}

DEVICE_TEST("the error of virtual planes lies at the edge, and floats suffice there") {
  struct Ring {
    double from, to;
    double most_discrete, most_direct;
  };
  const Ring rings[] = {{0, 0.5, 1e-5, 0.003},   {0.5, 0.8, 1e-5, 0.005},  {0.8, 0.9, 1e-5, 0.01},
                        {0.9, 0.95, 1e-5, 0.03}, {0.95, 0.98, 1e-4, 0.05}, {0.98, 1, 1e-4, 0.1}};
  auto stage = compact(wall({0.05e-3, -0.03e-3, 30e-3}));
  stage.scene.hologram.resolution = {640, 480};
  const Rig rig(device, stage);
  const auto got = at_hologram(device, rig);
  for (const auto& [from, to, most_discrete, most_direct] : rings) {
    const auto errors = errors_at(rig, got, 1, some_pixels(rig.plan, 200, from, to));
    CAPTURE(from, to, errors.discrete, errors.direct);
    CHECK(errors.discrete < most_discrete);
    CHECK(errors.direct < most_direct);
  }
}

DEVICE_TEST("frames of a virtual plane differ only in their phases") {
  const Rig rig(device, compact(wall()));
  const auto got = at_hologram(device, rig, 5, 40);
  for (const int frame : {0, 3, 4}) {
    const auto result = errors_of(rig, got, 40 + static_cast<std::uint32_t>(frame), 20, frame);
    INFO("frame " << frame << ": " << result.discrete);
    CHECK(result.discrete < 1e-5);
  }
}

DEVICE_TEST("all transforms carry a virtual plane alike, and every time to the bit") {
  for (const bool has_gaps : {false, true}) {
    auto stage = compact(wall());
    if (has_gaps) stage.scene.hologram.resolution = {480, 40};
    const Rig rig(device, stage);
    const auto& plane = *rig.plan.virtual_planes();
    REQUIRE(plane.row_stride() == plane.size.x + (has_gaps ? 8 : 0));
    const auto host = at_hologram(device, rig, 2).tiles;
    CHECK(at_hologram(device, rig, 2).tiles == host);
    for (const auto backend : backends_of(device)) {
      INFO(name_of(backend));
      CHECK(relative_l2(at_hologram(device, rig, 2, 1, backend).tiles[0], host[0]) < 4e-6);
    }
  }
}

DEVICE_TEST("the virtual plane that is kept has the hologram's amplitude as its transform") {
  for (const auto resolution : {ivec2(60, 40), ivec2(480, 40)}) {
    const auto result =
        render(device,
               load_scene(std::filesystem::path(RAYWAVE_DATA_DIR) / "study.toml",
                          {"wrp.propagation=compact", "sampling.pitch='60 um'",
                           "hologram.resolution=[" + std::to_string(resolution.x) + ", 40]"}),
               RenderOptions{.keep_wrps = true});
    const auto& plan = result.plan;
    const auto& plane = result.wrps.at(0);
    const auto size = plan.virtual_planes()->size;
    REQUIRE(plan.wrps.size() == 1);
    REQUIRE(ivec2(plane.nx, plane.ny) == size);
    std::vector<double> expected, got;
    for (const auto pixel : some_pixels(plan, 20)) {
      const auto at = pixel - resolution / 2, frequency = at + size / 2;
      std::complex<double> sum = 0;
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x)
          sum += std::complex<double>(plane.samples[y * size.x + x]) *
                 std::polar(1.0,
                            -2 * std::numbers::pi *
                                (1.0 * frequency.x * x / size.x + 1.0 * frequency.y * y / size.y));
      }
      const auto window = [&](int axis) {
        return window_function(plan, axis)(2.0 * at[axis] / resolution[axis]) * size[axis];
      };
      expected.push_back(std::abs(sum) / (window(0) * window(1)));
      got.push_back(std::abs(result.field.samples[pixel.y * resolution.x + pixel.x]));
    }
    for (std::size_t i = 0; i < got.size(); ++i) {
      INFO(resolution.x << " columns, pixel " << i);
      CHECK(got[i] == Catch::Approx(expected[i]).epsilon(1e-3));
    }
  }
}

DEVICE_TEST(
    "holograms over virtual planes are those of all points, with the brightness of theirs") {
  for (const auto& stage : {wall(), ball_before_wall(40e-3)}) {
    const auto spectrum = against_points(device, stage),
               compacted = against_points(device, compact(stage));
    CAPTURE(spectrum.correlation, compacted.correlation, spectrum.energy_ratio,
            compacted.energy_ratio);
    CHECK(compacted.correlation > spectrum.correlation);
    CHECK(compacted.correlation > 0.99);
    CHECK(compacted.energy_ratio == Catch::Approx(1).margin(0.02));
  }
}

DEVICE_TEST(
    "a scene that moves to where its virtual planes do not serve gets more layers, or goes on "
    "over WRPs",
    "[slow]") {
  const std::filesystem::path data = RAYWAVE_DATA_DIR;
  struct Case {
    Scene scene;
    dvec3 to;
    std::size_t layers;  // over virtual planes then; 0: over WRPs
    double most_error;   // against the scene there; an object nearly touches the second hologram
  };
  const Case cases[] = {
      {load_scene(data / "apart.toml",
                  {"sampling.pitch='0.2 mm'", "object.0.position=[0, 0, '120 mm']"}),
       {0, 0, 75e-3},
       2,
       1e-2},
      {load_scene(data / "study.toml", {"hologram.resolution=[160, 128]", "sampling.frames=1",
                                        "sampling.pitch='0.1 mm'", "hologram.tiles=[1, 1]"}),
       {0, 0, 0.6e-3},
       0,
       3e-2}};
  for (auto [scene, to, layers, most_error] : cases) {
    INFO(scene.file.filename());
    Renderer renderer(device, scene);
    const auto before = renderer.render();
    REQUIRE(before.plan.virtual_planes());
    REQUIRE(before.plan.layers.size() == 1);
    renderer.set_pose(0, to, scene.objects[0].rotation_deg);
    const auto moved = renderer.render();
    CHECK((moved.plan.virtual_planes() != nullptr) == (layers > 0));
    CHECK(moved.plan.layers.size() == std::max<std::size_t>(layers, 1));
    CHECK_FALSE(moved.plan.why_carrier.empty());
    scene.objects[0].position_m = to;
    CHECK(compare_fields(render(device, scene).field, moved.field).error < most_error);
  }
}

DEVICE_TEST("virtual planes stay finite at the extremes") {
  struct Case {
    const char* name;
    ivec2 size;
    double pitch_m, z_m, side_m;
  };
  const Case cases[] = {{"one pixel", {1, 1}, 8e-6, 10e-3, 50e-6},
                        {"one row", {211, 1}, 8e-6, 10e-3, 0.2e-3},
                        {"as wide as the pixels show", {320, 320}, 8e-6, 32e-3, 1e-3},
                        {"much wider", {320, 320}, 8e-6, 5e-3, 1e-3},
                        {"half a wavelength", {128, 96}, 0.319e-6, 0.2e-3, 50e-6},
                        {"10 km", {64, 64}, 8e-6, 1e4, 100},
                        {"a micrometre away", {64, 64}, 1e-6, 1e-6, 20e-6}};
  for (const auto& [name, size, pitch_m, z_m, side_m] : cases) {
    Stage stage;
    stage.scene.hologram = {size, dvec2(pitch_m), 638e-9};
    stage.scene.sampling.pitch_m = side_m / 5;
    stage.scene.wrp.grid = ivec2(1);
    stage.add(rectangle({0, 0, z_m}, {side_m, 0, 0}, {0, side_m, 0}));
    INFO(name);
    const auto result = render(device, compact(stage).scene, stage.world);
    CHECK(all_finite(result.field.samples));
  }
}

TEST_CASE("virtual planes that leave much wrong are noted", "[slow]") {
  const auto device = all_devices().front();
  const auto notes_with = [&](const char* margin) {
    return render(device, load_scene(std::filesystem::path(RAYWAVE_DATA_DIR) / "study.toml",
                                     {"wrp.propagation=compact", "hologram.resolution=[96, 80]",
                                      "sampling.pitch='60 um'", "sampling.frames=1", margin}))
        .notes;
  };
  CHECK(notes_with("wrp.margin=4").empty());
  const auto notes = notes_with("wrp.margin=0");
  REQUIRE(notes.size() == 1);
  CHECK_THAT(notes[0], Catch::Matchers::StartsWith("virtual planes bring an error of "));
}

DEVICE_TEST("the device bins footprints as the host does, and fields are the same bit for bit") {
  const auto elements = [](const auto& buffer, std::size_t count) {
    auto all = buffer.read();
    all.resize(count);
    return all;
  };
  INFO(device.info().name);
  // Footprints of all kinds: dark, wrapped around, as wide as the plane, beyond it
  for (const ivec2 size : {ivec2(64, 48), ivec2(320, 16), ivec2(16, 512)}) {
    for (const int count : {0, 1, 70, 5000}) {
      for (const bool is_whole : {false, true}) {
        Random random(static_cast<unsigned>(count + size.x));
        const auto pick = [&](int low, int high) {
          return low + static_cast<int>(random() % static_cast<unsigned>(high - low + 1));
        };
        std::vector<raywave::device::CompactFootprint> footprints;
        for (int i = 0; i < count; ++i)
          footprints.push_back({pick(-2 * size.x, 2 * size.x), 2 * pick(0, size.x / 2),
                                pick(-2 * size.y, size.y), 2 * pick(0, size.y / 2), pick(0, 4), 0});
        const auto given = footprints;
        footprints.resize(footprints.size() + 1);
        const raywave::cl::Buffer<raywave::device::CompactFootprint> buffer(
            device, std::span<const raywave::device::CompactFootprint>(footprints), "footprints");
        FootprintBins host(device, "", Counting::on_host, 100'000),
            there(device, "", Counting::on_device, 100'000);
        for (int round = 0; round < 2; ++round) {
          host.find(buffer, count, size, is_whole);
          there.find(buffer, count, size, is_whole);
        }
        REQUIRE(there.batches == host.batches);
        CHECK((count < 5000 || host.batches.size() > 10));
        CHECK(there.longest == host.longest);
        CHECK(there.lit.x.first == host.lit.x.first);
        CHECK(there.lit.x.count == host.lit.x.count);
        CHECK(there.lit.y.first == host.lit.y.first);
        CHECK(there.lit.y.count == host.lit.y.count);
        std::size_t samples = 0, entries = 0, bins = 0, rows = 0;
        for (const auto& batch : host.batches) {
          samples += static_cast<std::size_t>(batch.samples);
          entries += static_cast<std::size_t>(batch.entries);
          rows += static_cast<std::size_t>(batch.rows);
        }
        bins = rows * static_cast<std::size_t>(size.x / COMPACT_BIN);
        const auto lit = elements(host.lit_samples, samples);
        CHECK(elements(there.lit_samples, samples) == lit);
        CHECK(elements(there.bin_samples, entries) == elements(host.bin_samples, entries));
        CHECK(elements(there.is_fresh, rows) == elements(host.is_fresh, rows));
        if (bins > 0)
          CHECK(elements(there.first_of_bin, bins + 1) == elements(host.first_of_bin, bins + 1));
        if (samples == 0) continue;
        const auto offsets = elements(host.offsets, given.size()),
                   got = elements(there.offsets, given.size());
        for (const int i : lit) CHECK(got[i] == offsets[i]);
      }
    }
  }
  for (const auto& stage : {compact(wall()), compact(ball_before_wall(10e-3))}) {
    const Rig rig(device, stage);
    REQUIRE(rig.plan.virtual_planes());
    const auto fields = [&](Counting where) {
      return at_hologram(device, rig, 2, 1, raywave::cl::FftBackend::host, where).tiles;
    };
    CHECK(fields(Counting::on_device) == fields(Counting::on_host));
  }
}
