// SPDX-License-Identifier: Apache-2.0
// Launches every kernel on grids of a few pixels, with each number of lanes, as on a CPU and as on
// a GPU: no kernel writes behind its buffers. scripts/check_kernels runs this test under oclgrind,
// which also finds races, uninitialised values and reads out of bounds.
#include <regex>

#include "host/carriers/virtual_planes/compact_gatherer.hpp"
#include "host/evaluate/selftest/selfcheck.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/planning/make_plan.hpp"
#include "host/propagate/propagation.hpp"
#include "host/refine/panel_light.hpp"
#include "host/render.hpp"
#include "host/view/lens.hpp"
#include "host/view/reconstruct.hpp"
#include "kernels/common/shared_layout.h"
#include "tests/support/devices.hpp"
#include "tests/support/opencl_spy.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
using Names = std::set<std::string>;

constexpr auto host = cl::FftBackend::host;
bool under_oclgrind(const cl::DeviceInfo& device) { return device.platform == "Oclgrind"; }

/// The device itself and other kinds of device that it can stand for: a CPU runs as a GPU too, the
/// simulator as CPUs with each number of lanes, which two runs of scripts/check_kernels share.
std::vector<cl::DeviceInfo> shapes_of(const cl::DeviceInfo& device) {
  std::vector<cl::DeviceInfo> shapes;
  const auto add = [&](cl::DeviceKind kind, int lanes) {
    auto shape = device;
    shape.kind = kind;
    shape.float_lanes = lanes;
    shapes.push_back(shape);
  };
  if (!under_oclgrind(device)) {
    shapes.push_back(device);
    if (device.kind == cl::DeviceKind::cpu) add(cl::DeviceKind::gpu, 1);
    return shapes;
  }
  // oclgrind 21.10 crashes on vectors of 16 floats when it tracks uninitialised values
  const bool tracks = std::getenv("OCLGRIND_UNINITIALIZED"),
             races = std::getenv("OCLGRIND_DATA_RACES");
  if (tracks || !races) {
    shapes.push_back(device);
    add(cl::DeviceKind::cpu, 4);
  }
  if (!tracks) {
    add(cl::DeviceKind::accelerator, cl::fpga_lanes);
    add(cl::DeviceKind::cpu, 16);
  }
  return shapes;
}

Names declared_kernels() {
  Names names;
  // Kernels of kernels/common/scan.cl are there for two types
  const std::regex declaration(R"((?:__kernel|SINGLE_ITEM_KERNEL)\s+void\s+(\w+)(##T)?\s*\()");
  for (const auto& [file, text] : cl::kernel_files()) {
    for (std::sregex_iterator it(text.begin(), text.end(), declaration), end; it != end; ++it) {
      names.insert((*it)[1].str() + ((*it)[2].matched ? "int" : ""));
      if ((*it)[2].matched) names.insert((*it)[1].str() + "int2");
    }
  }
  return names;
}

/// A size that is no multiple of the lanes or of a tile's rows.
glm::ivec2 size_on(const cl::Device& device) {
  return {device.info().float_lanes + 3, under_oclgrind(device.info()) ? 3 : 19};
}

/// A shiny ball in front of a textured wall.
Scene tiny_scene(const cl::Device& device, const Folder& folder) {
  Scene scene{.hologram = {size_on(device), {8 * um, 8 * um}, 638e-9}};
  scene.sampling.pitch_m = 80 * um;
  scene.sampling.frames = 2;
  scene.wrp.grid = {1, 1};  // planes this small receive nothing beside the axis
  scene.trace.shadows = true;
  save_picture(folder / "grey.png", 4, 2,
               std::vector<std::uint8_t>{10, 60, 110, 160, 200, 220, 240, 250});
  Material ball{.specular = glm::dvec3(0.4)};
  Material wall = glowing();
  wall.texture = folder / "grey.png";
  scene.materials = {ball, wall};
  scene.objects = {
      object_at(folder.write("ball.obj", ball_obj(3, 2)), 0.08 * mm, {10 * um, 0, 9.8 * mm}, 0),
      object_at(folder.write("wall.obj", square_obj()), 0.14 * mm, {0, 0, 10 * mm}, 1)};
  scene.objects[1].rotation_deg = {5, -8, 0};
  scene.lights = {Light{.direction = {0.4, -0.5, 0.8}}, lamp_at({-1 * mm, 2 * mm, 8 * mm})};
  return scene;
}

void check_render(const cl::Device& device, const Scene& scene, Method method = Method::wrp) {
  RenderOptions options{.method = method, .rays_per_axis = 3};
  const auto result = render(device, scene, options);
  CHECK(all_finite(result.field.samples));
  CHECK(std::any_of(result.field.samples.begin(), result.field.samples.end(),
                    [](auto z) { return z != std::complex<float>(); }));
  options.keep_field = false;  // levels are then made of transforms, where there are any
  const auto levels = render(device, scene, options).levels[0];
  CHECK(std::any_of(levels.begin(), levels.end(), [&](auto v) { return v != levels[0]; }));
}

void render_all_methods(const cl::Device& device, const Folder& folder) {
  auto scene = tiny_scene(device, folder);
  check_render(device, scene);
  check_render(device, scene, Method::points);
  auto compact = scene;
  compact.wrp.propagation = WrpPropagation::compact;
  compact.trace.diffuse_rays = compact.trace.gloss_rays = 1;
  check_render(device, compact);

  // Plane-wave samples, and samples in front of the planes
  scene.wrp.distances_m = {9.9 * mm, 10.2 * mm};
  scene.sampling.antialias = false;
  scene.lights.resize(1);
  scene.lights.resize(40, scene.lights[0]);  // more than one word of the mask
  scene.materials[0].shininess = 1e3;        // sharp highlights from here on
  check_render(device, scene);
  scene.lights.resize(1);

  scene.sampling.frames = 1;
  scene.wrp.distances_m.clear();
  scene.sampling.mode = SamplingMode::fan;
  check_render(device, scene);
  check_render(device, scene, Method::rays);

  scene.sampling.mode = SamplingMode::aimed;
  scene.trace.depth = 2;
  scene.materials[0].transparency = 0.5;
  scene.materials[1].reflectivity = 0.5;
  check_render(device, scene);
}

/// Counts samples and footprints on the device, as GPUs do.
void count_on_device(const cl::Device& device, const Folder& folder) {
  auto scene = tiny_scene(device, folder);
  scene.wrp.propagation = WrpPropagation::compact;
  const auto world = build_world(scene);
  const auto plan = make_plan(scene, world);
  const DeviceScene arrays(device, world, plan);
  const SampleTable table(device, plan, arrays, false, Counting::on_device);
  CompactGatherer gatherer(device, plan, arrays, table, 2, Counting::on_device);
  gatherer.draw_phases(1);
  cl::ComplexBuffer stack(device, 2 * plan.gathered_pixels(), "stack");
  gatherer.gather(plan.wrps[0], stack);
  CHECK(all_finite(stack.read()));
}

void look(const cl::Device& device, const Folder& folder) {
  const auto scene = tiny_scene(device, folder);
  const auto world = build_world(scene);
  const auto plan = make_plan(scene, world);
  LensSpec lens{.z_m = 10 * mm, .points = 2};
  const auto seen = lens_picture(device, plan, DeviceScene(device, world, plan), lens);
  CHECK(std::all_of(seen.pixels.begin(), seen.pixels.end(),
                    [](float v) { return std::isfinite(v) && v >= 0; }));

  const auto size = size_on(device);
  FieldStack hologram{size.x, size.y, 1, std::vector<std::complex<float>>(size.x * size.y, {1, 0})};
  ReconstructSpec what{.z_m = 10 * mm, .window_m = glm::dvec2(size + 2) * 8.0 * um};
  const auto shown = reconstruct(device, host, hologram, scene.hologram, what);
  CHECK(std::all_of(shown.pixels.begin(), shown.pixels.end(),
                    [](float v) { return std::isfinite(v) && v >= 0; }));
}

/// Launches the kernels around the device's FFT. The render above propagates on the host, without
/// kernels.
void propagate(const cl::Device& device) {
  constexpr int nx = 21, ny = 3, padded_nx = 48, padded_ny = 6, frames = 2;
  const auto floats = [&](int size, float value) {
    return cl::Buffer<float>(device, std::vector<float>(static_cast<std::size_t>(size), value),
                             "transfer function");
  };
  const auto band = [&](int size, int reach) {  // firsts, then lasts
    std::vector<std::int32_t> limits(static_cast<std::size_t>(2 * size), -reach);
    std::fill(limits.begin() + size, limits.end(), reach);
    return cl::Buffer<std::int32_t>(device, limits, "band");
  };
  const auto phase_x = floats(padded_nx, 0.25f), phase_y = floats(padded_ny, 0.5f);
  const auto power_x = floats(2 * padded_nx, 0), power_y = floats(2 * padded_ny, 0);
  const auto band_x = band(padded_nx, 2), band_y = band(padded_ny, 17);
  const cl::ComplexBuffer field(device, std::vector<std::complex<float>>(frames * nx * ny, {1, 0}),
                                "field");
  cl::ComplexBuffer padded(device, padded_nx * padded_ny, "padded plane"),
      sum(device, padded_nx * padded_ny, "sum of spectra"), shown(device, nx * ny, "field");
  for (const char* two_floats : {"0", "1"}) {
    const cl::Program program(device, "kernels/propagate/propagate.cl",
                              {{option::lanes, std::to_string(device.info().float_lanes)},
                               {option::two_floats, two_floats}});
    program.kernel("pad").run({1, padded_ny}, {1, 1}, field, padded, std::int32_t{1}, nx, ny,
                              padded_nx, padded_ny);
    for (const std::int32_t accumulate : {0, 1}) {
      program.kernel("multiply_add")
          .run({1, padded_ny}, {1, 1}, padded, sum, phase_x, phase_y, power_x, power_y, band_x,
               band_y, 1e3f, 0.0f, 2.0f, 2.0f, 2.0f, 2.0f, 0.5f, padded_nx, padded_ny, accumulate);
    }
    program.kernel("crop").run({1, ny}, {1, 1}, sum, shown, nx, ny, padded_nx);
    // The phases X and Y are a quarter and a half of a turn; columns 18 to 20 and the padding rows
    // lie outside the band.
    const auto field_shown = shown.read();
    for (int row = 0; row < ny; ++row) {
      for (int column = 0; column < nx; ++column) {
        const auto value = field_shown[row * nx + column];
        CHECK(std::abs(value - std::complex<float>(0, column <= 17 ? -1.0f : 0.0f)) <= 1e-6f);
      }
    }
  }
}

/// Refines a hologram of a few pixels towards a whole and a half picture, by both propagations, and
/// towards pictures made of samples.
void refine_all(const cl::Device& device, const Folder& folder) {
  const auto size = size_on(device);
  const FieldStack start{
      size.x, size.y, 2,
      std::vector<std::complex<float>>(static_cast<std::size_t>(2 * size.x * size.y), {0, 1})};
  RefineSpec spec{
      .pitch_m = {8 * um, 8 * um}, .wavelength_m = 638e-9, .blur_m = 10 * um, .iterations = 2};
  const Image picture{7, 2, std::vector<float>(14, 0.5f)};
  const RefineKey keys[] = {{0.6 * mm, {0, 0}, {1, 1}, picture, {8 * um, 8 * um}},
                            {0.6 * mm, {0.5, 0}, {0.5, 1}, picture, {8 * um, 8 * um}}};
  for (const auto propagation :
       {KeyPropagation::fresnel, KeyPropagation::corrected, KeyPropagation::exact}) {
    spec.propagation = propagation;
    CHECK(all_finite(refine(device, host, start, keys, spec).field.samples));
  }
  auto before = keys[0];
  before.z_m = -before.z_m;
  CHECK(all_finite(refine(device, host, start, {&before, 1}, spec).field.samples));
  const Pupil pupil{1 * mm, {0, 0}, 0, 50 * mm};
  const RefineKey through_pupil[] = {
      {-0.6 * mm, {0, 0}, {0.5, 0.5}, picture, {8 * um, 8 * um}, 1, false, 0, {}, {}, pupil}};
  CHECK(all_finite(refine(device, host, start, through_pupil, spec).field.samples));
  SlmSpec slm;
  slm.undiffracted = 0.1;
  slm.lens_m = 1;
  slm.crosstalk.sigma_m = 8 * um;
  for (int level = 0; level < 256; ++level) {
    slm.lut.values.push_back(level / 256.0);
    slm.lut.amplitudes.push_back(1 - level / 512.0);
  }
  spec.panel = refinement::panel_to_know(slm, size, spec.pitch_m, spec.wavelength_m);
  CHECK(all_finite(refine(device, host, start, keys, spec).field.samples));
  auto scene = tiny_scene(device, folder);
  auto& settings = scene.refine.emplace();
  settings.iterations = 2;
  settings.window_m = {1, 1};  // a few pixels resolve little
  CHECK(all_finite(render(device, scene).refined.value().phases.samples));
}

/// Launches the kernels around FFTs on the device, which take minutes in oclgrind, on buffers as
/// large as they may read and write.
void launch_around_ffts(const cl::Device& device) {
  const std::string lanes = std::to_string(device.info().float_lanes);
  constexpr int packet = 16, nx = 2 * packet, ny = 5, open_nx = packet + 3, open_ny = 3,
                pitch = 3 * packet;
  const auto plane = [&](int samples) {
    cl::ComplexBuffer light(device, static_cast<std::size_t>(samples), "light");
    light.write(std::vector<std::complex<float>>(light.size(), {0.6f, 0.8f}));
    return light;
  };
  for (const char* has_beam : {"0", "1"}) {
    const cl::Program program(device, "kernels/refine/refine.cl",
                              {{option::lanes, lanes}, {option::beam, has_beam}});
    auto hologram = plane(pitch * open_ny), spectrum = plane(nx * ny), turned = plane(nx * ny);
    const auto columns = plane(nx), rows = plane(ny);
    cl::Buffer<float> beam(device, hologram.size(), "beam");
    beam.write(std::vector<float>(beam.size(), 0.5f));
    const auto launch = [&](const char* name, const auto&... arguments) {
      auto kernel = program.kernel(name);
      run_rows(device, kernel, nx, ny, arguments...);
    };
    const std::uint32_t first = 1;
    launch("spread", hologram, first, pitch, -1.0f, beam, first, columns, rows, open_nx, open_ny,
           spectrum, nx, ny);
    for (const std::int32_t back : {0, 1})
      launch("turn_spectrum", spectrum, nx, columns, rows, nx - 3, ny, 0.1f, 0.1f, 1e3f, 1.0f, back,
             turned, nx, ny);
    launch("put_back", spectrum, first, nx, columns, rows, open_nx, open_ny, turned, nx, 0.5f);
    launch("step_phase", hologram, first, pitch, -1.0f, beam, first, columns, rows, open_nx,
           open_ny, turned, nx, 0.5f);
    for (const auto& light : {&hologram, &spectrum, &turned}) CHECK(all_finite(light->read()));
  }
}

/// Launches the kernels of the self-test and of the benchmark.
void launch_tools(const cl::Device& device) {
  const int lanes = device.info().float_lanes;
  const cl::Options options{{option::lanes, std::to_string(lanes)}};
  const cl::Program selfcheck(device, "kernels/instruments/selfcheck.cl", options);
  std::size_t members = 0;
#define COUNT(T, member) members += 3;
  RAYWAVE_LAYOUT(COUNT)
#undef COUNT
  cl::Buffer<std::int32_t> layout(device, members, "layout");
  selfcheck.kernel("struct_layout").run({1}, {1}, layout);
  const std::int32_t blocks = 3;
  const std::vector<float> numbers(static_cast<std::size_t>(blocks * lanes), 0.3f);
  const cl::Buffer<float> in(device, std::span<const float>(numbers), "in");
  cl::Buffer<float> out_a(device, numbers.size(), "out"), out_b(device, numbers.size(), "out");
  selfcheck.kernel("cos_sin").run({3}, {64}, in, out_a, out_b, blocks);
  for (const float v : out_a.read()) CHECK(std::abs(v) <= 1);

  // Rays along z at a square; the last packet has one ray.
  const std::vector<glm::dvec3> corners{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  const auto bvh = build_bvh(corners, std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}}, {0, 0, 0}, 1);
  const std::int32_t rays = lanes + 1;
  std::vector<float> planes;
  for (const float value : {0.25f, 0.5f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 9.0f})
    planes.insert(planes.end(), static_cast<std::size_t>(rays), value);
  const cl::Program intersect(device, "kernels/instruments/intersect.cl", options);
  const auto tree = selftest::upload(device, bvh);
  const cl::Buffer<float> ray_planes(device, std::span<const float>(planes), "rays");
  cl::Buffer<std::int32_t> hit(device, static_cast<std::size_t>(rays), "hits"),
      occluded(device, static_cast<std::size_t>(rays), "occluded");
  cl::Buffer<float> t_u_v(device, static_cast<std::size_t>(3 * rays), "t, u, v");
  intersect.kernel("intersect_nearest")
      .run({2}, {8}, tree.arguments(), ray_planes, rays, hit, t_u_v);
  intersect.kernel("intersect_any").run({2}, {8}, tree.arguments(), ray_planes, rays, occluded);
  CHECK(occluded.read() == std::vector<std::int32_t>(static_cast<std::size_t>(rays), 1));
  const auto distances = t_u_v.read();
  for (int i = 0; i < rays; ++i) CHECK(distances[i] == Catch::Approx(1));
}

void in_colour(const cl::Device& device, const Folder& folder) {
  std::vector<Scene> scenes(3, tiny_scene(device, folder));
  ColourSpec colour{.lasers = laser_set({638e-9, 520e-9, 450e-9})};
  for (auto& scene : scenes) {
    scene.colour = colour;
    scene.hologram.wavelength_m = colour.lasers.wavelengths_m[colour.laser++];
  }
  for (const auto& laser : render(device, scenes, build_world(scenes[0])).lasers)
    CHECK(all_finite(laser.field.samples));
}

TEST_CASE("every kernel is launched, and none writes behind its buffers") {
  const Folder folder;
  auto& spy = opencl_spy();
  const auto infos = cl::list_devices();
  REQUIRE_FALSE(infos.empty());
  for (const auto& info : infos) {
    for (const auto& shape : shapes_of(info)) {
      INFO(shape.name << (shape.kind == cl::DeviceKind::gpu ? " as a GPU, " : ", ")
                      << shape.float_lanes << " lanes");
      spy.canaries = !under_oclgrind(info);
      spy.launched.clear();
      {
        const cl::Device device(shape);
        render_all_methods(device, folder);
        count_on_device(device, folder);
        look(device, folder);
        propagate(device);
        refine_all(device, folder);
        in_colour(device, folder);
        launch_around_ffts(device);
        launch_tools(device);
        device.finish();
      }
      auto wanted = declared_kernels();
      // Where a work-item takes a packet of cells, it asks for what samples see itself
      if (shape.float_lanes > 1)
        for (const char* name : {"trace_parts", "ask_parts", "settle_samples"}) wanted.erase(name);
      CHECK(spy.launched == wanted);
      CHECK(spy.overrun.empty());
      CHECK(spy.live.empty());
      CHECK((spy.watched > 100 || !spy.canaries));
    }
  }
}

DEVICE_TEST("one pixel per work-item, as on GPUs, gives the hologram that packets of pixels give") {
  if (under_oclgrind(device.info())) return;  // too slow
  opencl_spy().canaries = true;
  auto gpu = device.info(), cpu = gpu;
  gpu.kind = cl::DeviceKind::gpu;
  gpu.float_lanes = 1;
  cpu.kind = cl::DeviceKind::cpu;
  cpu.float_lanes = std::max(cpu.float_lanes, 4);
  // Over WRPs, and over virtual planes: there without samples that are hidden by a hair, which
  // the order of rounding decides
  for (const auto* set : {"wrp.propagation=spectrum", "sampling.visibility=0"}) {
    const auto scene = load_scene(RAYWAVE_DATA_DIR "/study.toml",
                                  {"hologram.resolution=[64,48]", "sampling.frames=1", set});
    const auto packets = render(cl::Device(cpu), scene).field.samples,
               pixels = render(cl::Device(gpu), scene).field.samples;
    INFO(set);
    CHECK(relative_l2(pixels, packets) <= 1e-4);
  }
}

DEVICE_TEST("a kernel file refuses an option that it does not have") {
  CHECK(device_error_of([&] {
          cl::Program(device, "kernels/encode/encode.cl", {{option::shadows, "1"}});
        }) == "kernel file kernels/encode/encode.cl has no option RAYWAVE_SHADOWS");
}

TEST_CASE("a kernel that writes behind its buffer is noticed") {
  auto& spy = opencl_spy();
  for (const auto& info : cl::list_devices()) {
    if (under_oclgrind(info)) continue;  // it would notice itself
    spy.canaries = true;
    {
      const cl::Device device(info);
      const cl::Buffer<float> in(device, std::vector<float>(8, 0.25f), "in");
      cl::Buffer<float> cosines(device, 8, "cosines"), sines(device, 7, "sines");
      cl::Program(device, "kernels/instruments/selfcheck.cl", {{option::lanes, "1"}})
          .kernel("cos_sin")
          .run({8}, {8}, in, cosines, sines, std::int32_t{8});
    }
    CHECK(spy.overrun == std::vector<std::size_t>{7 * sizeof(float)});
    spy.overrun.clear();
  }
}

}  // namespace
}  // namespace raywave
