// SPDX-License-Identifier: Apache-2.0
// Grey levels are copied to the host while the next frame is computed.
#include "host/encode/encode.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/opencl_spy.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;

constexpr glm::ivec2 size{120, 90};
constexpr std::size_t pixels = 120 * 90;

/// A tilted wall 10 mm from a hologram of 120 x 90 pixels of 4 um.
Scene wall_scene(const Folder& folder, glm::ivec2 tiles, int frames) {
  Scene scene;
  scene.hologram.resolution = size;
  scene.hologram.pitch_m = {4 * um, 4 * um};
  scene.hologram.tiles = tiles;
  scene.sampling.pitch_m = 20 * um;
  scene.sampling.frames = frames;
  scene.materials = {glowing()};
  scene.objects = {object_at(folder.write("wall.obj", square_obj()), 0.4 * mm, {0, 0, 10 * mm})};
  scene.objects[0].rotation_deg = {5, -8, 0};
  return scene;
}

constexpr glm::ivec2 tile_grids[] = {{1, 1}, {2, 2}};

DEVICE_TEST("the levels of every frame and tile match the returned field") {
  const Folder folder;
  for (const auto tiles : tile_grids) {
    Renderer renderer(device, wall_scene(folder, tiles, 5));
    for (int picture = 0; picture < 2; ++picture) {
      const auto result = renderer.render();
      REQUIRE(result.plan.tiling.tiles.size() == static_cast<std::size_t>(tiles.x * tiles.y));
      for (std::size_t frame = 0; frame < 5; ++frame) {
        const auto from =
            result.field.samples.begin() + static_cast<std::ptrdiff_t>(frame * pixels);
        const std::vector field(from, from + static_cast<std::ptrdiff_t>(pixels));
        REQUIRE(std::any_of(field.begin(), field.end(),
                            [](auto z) { return z != std::complex<float>(); }));
        Encoder encoder(device, result.panel);
        CHECK(result.levels[frame] == encode(device, encoder, {size.x, size.y, 1, field}).front());
        if (frame > 0) CHECK(result.levels[frame] != result.levels[frame - 1]);
      }
    }
  }
}

DEVICE_TEST(
    "levels made of a virtual plane's transform in one pass are those of the field, to a level "
    "where rounding decides") {
  const Folder folder;
  const auto scene_of = [&](Encoding encoding, int frames) {
    auto scene = wall_scene(folder, {1, 1}, frames);
    scene.slm.encoding = encoding;
    scene.wrp.propagation = WrpPropagation::compact;
    return scene;
  };
  std::vector<std::pair<std::string, Scene>> cases;
  for (const auto encoding : {Encoding::phase, Encoding::double_phase, Encoding::off_axis,
                              Encoding::burckhardt, Encoding::lee})
    cases.emplace_back(name_of(encoding), scene_of(encoding, 2));
  cases.emplace_back("a lens and few levels", scene_of(Encoding::double_phase, 1));
  cases.back().second.slm.lens_m = 0.2;
  cases.back().second.slm.levels = 16;
  cases.emplace_back("tiles", scene_of(Encoding::phase, 2));
  cases.back().second.hologram.tiles = glm::ivec2(2, 2);
  cases.emplace_back("two layers, whose fields add up", scene_of(Encoding::phase, 1));
  cases.back().second.wrp.distances_m = {9.9 * mm, 10.1 * mm};
  cases.emplace_back("nothing in sight", scene_of(Encoding::phase, 1));
  cases.back().second.objects[0].position_m.x = 1;
  // So near that the reference wave needs two floats
  cases.emplace_back("1 mm away", scene_of(Encoding::double_phase, 1));
  cases.back().second.hologram = {{590, 560}, {1 * um, 1 * um}, 638e-9};
  cases.back().second.objects[0].position_m.z = 1 * mm;
  cases.back().second.sampling.pitch_m = 8 * um;
  for (const auto fft : {cl::FftBackend::host, cl::default_backend(device.info())}) {
    for (const auto& [name, scene] : cases) {
      INFO(device.info().name << ", " << name);
      RenderOptions options{.fft = fft};
      const auto kept = rendered(device, scene, options);
      options.keep_field = false;
      const auto direct = rendered(device, scene, options);
      REQUIRE(kept.plan.virtual_planes());
      CHECK(encodes_transforms(direct.plan, false) == (direct.plan.layers.size() == 1));
      CHECK(direct.field.samples.empty());
      const int grey_levels = 256, most = scene.slm.encoding == Encoding::lee ? 255
                                          : scene.slm.levels == 16            ? 16
                                                                              : 1;
      for (std::size_t frame = 0; frame < kept.levels.size(); ++frame) {
        int differ = 0, farthest = 0;
        for (std::size_t i = 0; i < kept.levels[frame].size(); ++i) {
          const int apart = std::abs(kept.levels[frame][i] - direct.levels[frame][i]);
          differ += apart > 0;
          farthest = std::max(farthest, std::min(apart, grey_levels - apart));
        }
        // Measured: none differs
        CHECK(differ <= 20);
        CHECK(farthest <= most);
      }
    }
  }
}

TEST_CASE(
    "levels are copied without blocking, after the kernels of their frame, on a queue without "
    "launches") {
  const Folder folder;
  auto& spy = opencl_spy();
  for (const auto& info : cl::list_devices()) {
    const cl::Device device(info);
    RenderOptions options{.keep_field = false};
    spy.reads.clear();
    spy.launched_on.clear();
    auto scene = wall_scene(folder, {2, 1}, 3);
    scene.slm.encoding = Encoding::phase;  // double phase encodes when all tiles are there
    const auto result = render(device, scene, options);
    const auto bytes =
        static_cast<std::size_t>(result.plan.tiling.tile_size.x * result.plan.tiling.tile_size.y);
    int copies = 0;
    for (const auto& read : spy.reads) {
      if (read.bytes != bytes) continue;
      ++copies;
      CHECK_FALSE(read.blocking);
      CHECK(read.waits == 1);
      CHECK(spy.launched_on.count(read.queue) == 0);
    }
    CHECK(copies == 6);
  }
  CHECK(spy.overrun.empty());
}

TEST_CASE("a device that gives only one queue computes the same levels") {
  const Folder folder;
  auto& spy = opencl_spy();
  const auto scene = wall_scene(folder, {2, 2}, 3);
  for (const auto& info : cl::list_devices()) {
    const auto two = render(cl::Device(info), scene);
    spy.queues_left = 1;
    const cl::Device device(info);
    spy.queues_left = -1;
    REQUIRE(device.copy_queue()() == device.queue()());
    CHECK(render(device, scene).levels == two.levels);
  }
}

DEVICE_TEST("later launches do not change a copy, and an abandoned copy ends with its handle") {
  const std::vector<float> ones(1 << 20, 1.0f), twos(1 << 20, 2.0f);
  std::vector<float> first(ones.size()), second(ones.size());
  cl::Buffer<float> from(device, ones, "numbers"), other(device, twos, "other numbers");
  cl::Buffer<float> turn[2] = {{device, ones.size(), "turn"}, {device, ones.size(), "turn"}};
  turn[0].copy_from(from, 0);
  auto copy = turn[0].start_reading_rows(first.data(), first.size(), first.size());
  turn[1].copy_from(other, 0);
  { const auto left = turn[1].start_reading_rows(second.data(), 1024, 1024); }
  copy.wait();
  copy.wait();  // nothing is left to wait for
  CHECK(first == ones);
  CHECK(second == twos);
}

}  // namespace
}  // namespace raywave
