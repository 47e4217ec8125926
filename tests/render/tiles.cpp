// SPDX-License-Identifier: Apache-2.0
// Holograms computed in tiles, compared with holograms computed in one piece.
#include "host/planning/tiles.hpp"

#include "host/carriers/planning/facts.hpp"
#include "host/plan/padded_plane.hpp"
#include "host/planning/make_plan.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;

/// A ball of 1 mm in front of a wall of 3 mm, 20 mm from a hologram of 603 x 401 pixels of 4 um:
/// both numbers of pixels are odd, 401 is prime.
Scene ball_scene(const Folder& folder) {
  return ball_and_wall(folder, {603, 401}, 40 * um, 12, 1 * mm, {0.2 * mm, 0.1 * mm, 19 * mm},
                       2.4 * mm, 21 * mm);
}

RenderResult rendered(const cl::Device& device, Scene scene, glm::ivec2 tiles,
                      Method method = Method::wrp) {
  scene.hologram.tiles = tiles;
  return test::rendered(device, scene, {.method = method});
}

constexpr glm::ivec2 divisions[] = {{2, 2}, {3, 1}};

TEST_CASE(
    "tiles of one size cover every pixel of holograms of any size, and stand where their pixels "
    "do") {
  std::mt19937 random(1);
  for (int n = 0; n < 2000; ++n) {
    Plan plan;
    plan.hologram.size = {1 + random() % 97, 1 + random() % 97};
    plan.hologram.pitch_m = {3 * um, 5 * um};
    divide(plan, {1 + random() % 12, 1 + random() % 12}, 1.5);
    REQUIRE(plan.tiling.tiles.size() ==
            static_cast<std::size_t>(plan.tiling.grid.x * plan.tiling.grid.y));
    for (int axis = 0; axis < 2; ++axis) {
      CHECK(plan.tiling.tile_size[axis] ==
            (plan.hologram.size[axis] + plan.tiling.grid[axis] - 1) / plan.tiling.grid[axis]);
      std::vector<bool> covered(static_cast<std::size_t>(plan.hologram.size[axis]), false);
      for (const auto& tile : plan.tiling.tiles) {
        REQUIRE((tile.first[axis] >= 0 &&
                 tile.first[axis] + plan.tiling.tile_size[axis] <= plan.hologram.size[axis]));
        for (int i = 0; i < plan.tiling.tile_size[axis]; ++i) covered[tile.first[axis] + i] = true;
        // Pixel i of n lies at (i - (n - 1) / 2) pitch; y decreases with i.
        const double place =
            tile.centre_m[axis] / plan.hologram.pitch_m[axis] * (axis == 0 ? 1 : -1) -
            (plan.tiling.tile_size[axis] - 1) / 2.0;
        CHECK(std::abs(place - (tile.first[axis] - (plan.hologram.size[axis] - 1) / 2.0)) < 1e-9);
      }
      CHECK(std::all_of(covered.begin(), covered.end(), [](bool c) { return c; }));
    }
  }
}

DEVICE_TEST("the points' own hologram in tiles is the one in one piece") {
  const Folder folder;
  const auto scene = ball_scene(folder);
  const auto whole = rendered(device, scene, {1, 1}, Method::points);
  REQUIRE(whole.hidden_samples > 50);
  for (const auto tiles : divisions) {
    const auto divided = rendered(device, scene, tiles, Method::points);
    CHECK(divided.samples == whole.samples);
    const double error = relative_l2(divided.field.samples, whole.field.samples);
    INFO(tiles.x << " x " << tiles.y << ": " << error);
    CHECK(error <= 2e-4);  // measured 4e-5: pixels on the edge between parts of the window
  }
}

/// Relative L2 differences: the field of one piece and that of all points, the field of the tiles
/// and that of all points, the fields of the tiles and of one piece.
struct Apart {
  double whole_points, tiles_points, tiles_whole;
};

/// points, whole  fields of the scene in one piece
/// divided        receives the hologram in tiles
Apart apart(const cl::Device& device, const Scene& scene,
            const std::vector<std::complex<float>>& points, const RenderResult& whole,
            glm::ivec2 tiles, RenderResult& divided) {
  divided = rendered(device, scene, tiles);
  REQUIRE(divided.plan.tiling.tiles.size() == static_cast<std::size_t>(tiles.x * tiles.y));
  REQUIRE(divided.plan.layers.size() == whole.plan.layers.size());
  REQUIRE(divided.samples == whole.samples);
  return {relative_l2(whole.field.samples, points), relative_l2(divided.field.samples, points),
          relative_l2(divided.field.samples, whole.field.samples)};
}

// The scene has no occlusion and no light too steep for the pixels, and the cone is wide: the field
// of the WRPs is nearly that of the points.
DEVICE_TEST(
    "tiles give the field of one piece within the predicted error of the padding and what the "
    "piece itself lacks") {
  const Folder folder;
  auto scene = ball_scene(folder);
  scene.objects.erase(scene.objects.begin());
  scene.objects[0].width_m = 1.6 * mm;
  scene.objects[0].position_m.z = 40 * mm;
  scene.sampling.cone = 1.6;
  scene.sampling.apodization = 0.6;
  struct Case {
    glm::ivec2 tiles;
    double padding;
    std::vector<double> distances_m{38 * mm};
  };
  // The sum of all points does not depend on WRPs; one piece depends on all settings of a case
  // but the tiles.
  const auto points = rendered(device, scene, {1, 1}, Method::points).field.samples;
  std::map<std::pair<double, std::vector<double>>, RenderResult> wholes;
  // Measured, tiles against one piece (one piece against points): 0.046 (0.016), 0.017 (0.015),
  // 0.042 (0.016)
  for (const auto& c :
       {Case{{2, 2}, 2}, {{2, 2}, 4}, {{3, 1}, 2}, {{2, 2}, 2, {38 * mm, 40 * mm}}, {{3, 2}, 2}}) {
    scene.wrp.padding = c.padding;
    scene.wrp.distances_m = c.distances_m;
    const auto key = std::pair(c.padding, c.distances_m);
    if (!wholes.contains(key)) wholes.emplace(key, rendered(device, scene, {1, 1}));
    RenderResult divided;
    const auto off = apart(device, scene, points, wholes.at(key), c.tiles, divided);
    const double predicted = propagation_error_of(divided.plan);
    CAPTURE(c.tiles.x, c.tiles.y, c.padding, c.distances_m.size(), off.tiles_points,
            off.whole_points, off.tiles_whole, predicted);
    CHECK(off.tiles_whole <= std::hypot(1.6 * predicted, 1.2 * off.whole_points));
    CHECK(off.tiles_points <= std::hypot(1.6 * predicted, off.whole_points));
  }
}

DEVICE_TEST(
    "with highlights, occluders and layers, tiles are no farther from the points' field than one "
    "piece and the padding") {
  const Folder folder;
  auto scene = ball_scene(folder);
  const auto points = rendered(device, scene, {1, 1}, Method::points).field.samples;
  for (const int layers : {1, 2}) {
    scene.wrp.layers = layers;
    const auto whole = rendered(device, scene, {1, 1});
    for (const auto tiles : divisions) {
      RenderResult divided;
      const auto off = apart(device, scene, points, whole, tiles, divided);
      const double predicted = propagation_error_of(divided.plan);
      CAPTURE(tiles.x, tiles.y, divided.plan.layers.size(), off.tiles_points, off.whole_points,
              predicted);
      CHECK(divided.hidden_samples > 50);
      // Measured 0.12 for 0.14
      CHECK(off.tiles_points <= std::hypot(off.whole_points, predicted));
    }
  }
}

DEVICE_TEST(
    "frames in tiles are frames of the seeds that follow, and a renderer that moves keeps its "
    "tiles") {
  const Folder folder;
  auto scene = ball_scene(folder);
  scene.hologram.resolution = {211, 150};
  scene.hologram.tiles = glm::ivec2(2, 2);
  scene.sampling.frames = 3;
  Renderer renderer(device, scene);
  const auto stack = renderer.render();
  REQUIRE(stack.levels.size() == 3);
  scene.sampling.frames = 1;
  scene.sampling.seed = 3;
  const auto alone = test::rendered(device, scene);
  const std::vector last(stack.field.samples.begin() + 2 * 211 * 150, stack.field.samples.end());
  // Measured 4e-6: the sums have another order, and the window function lets rounding grow.
  CHECK(relative_l2(last, alone.field.samples) <= 2e-5);
  const auto equal =
      std::inner_product(alone.levels[0].begin(), alone.levels[0].end(), stack.levels[2].begin(), 0,
                         std::plus<>(), [](auto a, auto b) { return a == b; });
  CHECK(equal >= 211 * 150 - 100);  // some levels differ by rounding

  scene.sampling.frames = 3;
  scene.sampling.seed = 1;
  scene.objects[0].position_m.x += 0.1 * mm;
  renderer.set_pose(0, scene.objects[0].position_m, scene.objects[0].rotation_deg);
  const auto moved = renderer.render();
  CHECK(moved.plan.tiling.grid == glm::ivec2(2, 2));
  // Rays that meet an edge within rounding errors may have other hits.
  CHECK(relative_l2(moved.field.samples, test::rendered(device, scene).field.samples) <= 0.02);
}

DEVICE_TEST("tiles that no light reaches are dark, and do not stop the others") {
  const Folder folder;
  auto scene = ball_scene(folder);
  scene.objects.erase(scene.objects.begin());
  // The light of a small object near the left edge is too steep for the right tiles, whose pixels
  // show at most 4.6 degrees.
  scene.hologram.resolution = {1500, 100};
  scene.objects[0].width_m = 0.2 * mm;
  scene.objects[0].position_m = {-2.8 * mm, 0, 15 * mm};
  scene.sampling.pitch_m = 20 * um;
  const auto divided = rendered(device, scene, {6, 1});
  double brightest = 0;
  for (const auto& z : divided.field.samples)
    brightest = std::max(brightest, static_cast<double>(std::abs(z)));
  REQUIRE(brightest > 0);
  for (int row = 0; row < 100; ++row) {
    const auto* line = &divided.field.samples[static_cast<std::size_t>(row) * 1500];
    for (int column = 1250; column < 1500; ++column)
      CHECK(std::abs(line[column]) <= 1e-3 * brightest);
  }
}

DEVICE_TEST(
    "a hologram that does not fit a small device is computed there in tiles, on no more than it "
    "has, to the same field") {
  const Folder folder;
  auto info = device.info();
  auto scene = ball_scene(folder);
  scene.wrp.propagation = WrpPropagation::spectrum;
  scene.hologram.resolution = {1024, 700};
  const auto whole = test::rendered(device, scene);
  REQUIRE(whole.plan.tiling.grid == glm::ivec2(1, 1));
  info.largest_buffer_bytes = 4 << 20;  // a field takes 5.5 MiB
  const cl::Device small(info);
  const auto divided = test::rendered(small, scene);
  INFO(divided.plan.tiling.why);
  CHECK(divided.plan.tiling.grid == glm::ivec2(2, 1));
  CHECK_SAYS(divided.plan.tiling.why,
             "fields of a WRP 5.5 MiB in one buffer, the device allows 4.0 MiB");
  CHECK(correlation(divided.field.samples, whole.field.samples) >= 0.98);

  scene.hologram.tiles = glm::ivec2(1, 1);
  CHECK_SAYS(device_error_of([&] { test::rendered(small, scene); }), "5.5 MiB asked in one buffer",
             "more hologram.tiles");
  scene.hologram.tiles = {};
  info.largest_buffer_bytes = 64 << 10;
  CHECK_SAYS(device_error_of([&] { test::rendered(cl::Device(info), scene); }),
             " asked in one buffer");
}

DEVICE_TEST("the device holds at most 64 bytes per padded pixel of a tile, of one frame") {
  const Folder folder;
  for (const auto backend : backends_of(device)) {
    for (const double padding : {1.0, 2.0}) {
      const cl::Device fresh(device.info());
      auto scene = ball_scene(folder);
      scene.hologram.resolution = {1024, 1024};  // few kernels, and small ones
      scene.objects.erase(scene.objects.begin());
      scene.objects[0].position_m.z = 150 * mm;
      scene.sampling.pitch_m = 100 * um;
      scene.wrp.padding = padding;
      scene.hologram.tiles = glm::ivec2(1, 1);
      const auto plan = test::rendered(fresh, scene, {.fft = backend}).plan;
      const auto padded = padded_size(plan.tiling.tile_size, padding);
      const double bytes =
          static_cast<double>(fresh.peak_bytes()) / (static_cast<double>(padded.x) * padded.y);
      INFO(device.info().name << ", padding " << padding << ": " << bytes << " bytes");
      CHECK(bytes <= 64);
    }
  }
}

TEST_CASE("tiles that would not add up to the hologram are refused") {
  const Folder folder;
  auto scene = ball_scene(folder);
  scene.hologram.tiles = glm::ivec2(2, 2);
  const auto world = world_of(scene);
  scene.sampling.mode = SamplingMode::fan;
  CHECK_REFUSED(make_plan(scene, world), "hologram.tiles 2 x 2: ", "rays of fans");
  CHECK_NOTHROW(make_plan(scene, world, Method::rays));
  scene.sampling.mode = SamplingMode::aimed;
  scene.sampling.cone = 1;
  CHECK_REFUSED(make_plan(scene, world), "sampling.cone less sampling.apodization", "tiles [1, 1]");
  scene.sampling.apodization = 0;
  CHECK_NOTHROW(make_plan(scene, world));
  scene.materials[0].reflectivity = 0.5;
  scene.trace.depth = 1;
  CHECK_NOTHROW(make_plan(scene, world));
}

}  // namespace
}  // namespace raywave
