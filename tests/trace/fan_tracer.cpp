// SPDX-License-Identifier: Apache-2.0
// trace_fan against host/reference/shading.hpp, pixel by pixel.
#include "host/plan/precision.hpp"
#include "host/planning/make_plan.hpp"
#include "host/reference/looks.hpp"
#include "host/trace/gatherer.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
using Field = std::vector<std::complex<float>>;

constexpr double distance_m = 98 * mm;  // WRPs to hologram

/// Relative L2 error of a field: measured 1.1e-7 to 3.4e-7.
constexpr double hit_error = 1e-6;

/// 33 x 17 pixels of 1 um: the plane is small, and the sines of its rays reach 0.319.
Scene small_scene() {
  Scene scene;
  scene.hologram.resolution = {33, 17};
  scene.hologram.pitch_m = {1 * um, 1 * um};
  scene.wrp.distances_m = {distance_m};
  scene.wrp.grid = glm::ivec2(1, 1);
  scene.sampling.mode = SamplingMode::fan;
  scene.materials = {glowing()};
  return scene;
}

/// n x n rays with tangents from -reach to reach, slightly off a regular grid: no ray runs along an
/// edge of a mesh.
Wrp wrp_with_fan(int n, double reach, glm::dvec2 centre_m = {0.031 * mm, -0.017 * mm}) {
  Wrp wrp{.centre_m = {centre_m, distance_m}};
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      wrp.fan.emplace_back(
          static_cast<float>(((i + 0.5 + 0.137 * std::sin(7 * j)) / n * 2 - 1) * reach),
          static_cast<float>(((j + 0.5 + 0.119 * std::cos(5 * i)) / n * 2 - 1) * reach));
  return wrp;
}

Field traced(const cl::Device& device, const World& world, const Plan& plan, const Wrp& wrp,
             std::uint32_t seed, cl::Options* options = nullptr) {
  const DeviceScene arrays(device, world, plan);
  if (options) *options = arrays.options;
  FanTracer tracer(device, plan, arrays);
  Field field(static_cast<std::size_t>(plan.hologram.size.x) * plan.hologram.size.y, {NAN, NAN});
  cl::ComplexBuffer buffer(device, std::span<const std::complex<float>>(field), "field");
  tracer.trace(wrp, seed, buffer);
  return buffer.read();
}

/// Relative L2 error over the pixels that the oracle can decide, at least 9 in 10.
double error_of(const Field& field, const reference::TracedField& oracle) {
  std::vector<std::complex<double>> got, want;
  for (std::size_t i = 0; i < field.size(); ++i) {
    if (oracle.undecided[i]) continue;
    got.emplace_back(field[i]);
    want.push_back(oracle.field[i]);
  }
  CHECK(10 * want.size() >= 9 * field.size());
  return relative_l2(got, want);
}

/// Traces on every device in every precision, compares with the oracle and returns the oracle's
/// result.
reference::TracedField check_trace(const Scene& scene, const Wrp& wrp, std::uint32_t seed = 5) {
  const auto world = build_world(scene);
  auto plan = make_plan(scene, world);
  const auto oracle = reference::trace_fan(scene, world, plan, wrp, seed);
  for (const auto& device : all_devices()) {
    for (const auto precision : {Precision::floats, Precision::doubles}) {
      if (precision == Precision::doubles && !device.info().fp64) continue;
      plan.precision = precision;
      const auto field = traced(device, world, plan, wrp, seed);
      INFO(name_of(precision) << " on " << device.info().name);
      CHECK(all_finite(field));
      const double error = error_of(field, oracle);
      CHECK(error <= hit_error);
      CHECK(error <= 2 * std::numbers::pi *
                         phase_errors_of(plan)[static_cast<std::size_t>(precision)].total_turns());
    }
  }
  return oracle;
}

/// A texture of 5 x 3 random values in linear light.
std::filesystem::path texture_in(const Folder& folder) {
  const auto file = folder / "texture.exr";
  const std::vector<float> texels{0.9f, 0.1f,  0.5f, 0.3f,  0.7f,  0.2f,  0.8f, 0.4f,
                                  1.0f, 0.05f, 0.6f, 0.35f, 0.15f, 0.75f, 0.45f};
  save_picture(file, 5, 3, texels);
  return file;
}

Light directional(glm::dvec3 direction, double intensity) {
  return Light{.direction = direction, .intensity = intensity};
}

Light point(glm::dvec3 position_m, double intensity) {
  return Light{.type = LightType::point, .position_m = position_m, .intensity = intensity};
}

Light ambient(double intensity) {
  return Light{.type = LightType::ambient, .intensity = intensity};
}

/// A ball of 0.8 mm in front of a tilted wall, lit by all kinds of light.
Scene ball_before_wall(const Folder& folder) {
  auto scene = small_scene();
  Material ball, wall;
  ball.ambient = glm::dvec3(0.05, 0.2, 0.3);
  ball.diffuse = glm::dvec3(0.6, 0.2, 0.1);
  ball.specular = glm::dvec3(0.5, 0.1, 0.1);
  ball.shininess = 30;
  wall.ambient = glm::dvec3(0.1);
  wall.diffuse = glm::dvec3(0.8);
  scene.materials = {ball, wall};
  scene.objects = {object_at(folder.write("ball.obj", ball_obj(14, 7)), 0.8 * mm,
                             {0.05 * mm, 0.02 * mm, 99.6 * mm}, 0),
                   object_at(folder.write("wall.obj", square_obj({-0.3, -0.7}, {2.4, 1.9})), 3 * mm,
                             {0, 0, 100.6 * mm}, 1)};
  scene.objects[1].rotation_deg = {10, -15, 5};
  scene.lights = {ambient(0.7), directional({0.5, -0.6, 0.62}, 0.8),
                  directional({-1, 0.3, 1.5}, 0.5), point({0.8 * mm, 1.1 * mm, 98.3 * mm}, 0.6),
                  ambient(0.2)};
  return scene;
}

/// A glass prism, a glass ball and a mirror between two walls, 2 mm long times `scale`.
Scene mirrors_and_glass(const Folder& folder, double scale) {
  auto scene = small_scene();
  Material wall, mirror, glass;
  wall.diffuse = glm::dvec3(0.7);
  mirror.diffuse = glm::dvec3(0.2);
  mirror.reflectivity = 0.6;
  glass.diffuse = glm::dvec3(0.1);
  glass.specular = glm::dvec3(0.3);
  glass.reflectivity = 0.2;
  glass.transparency = 0.7;
  glass.ior = 1.52;
  scene.materials = {wall, mirror, glass};
  scene.lights = {ambient(0.3), directional({0.4, -0.5, 0.8}, 0.7)};
  scene.trace.shadows = false;
  scene.sampling.pitch_m *= scale;
  const auto square = folder.write("square.obj", square_obj());
  const auto add = [&](const std::filesystem::path& mesh, double width_m, glm::dvec3 from_wrp_m,
                       int material, glm::dvec3 rotation_deg) {
    scene.objects.push_back(object_at(mesh, scale * width_m,
                                      scale * from_wrp_m + glm::dvec3(0, 0, distance_m), material));
    scene.objects.back().rotation_deg = rotation_deg;
  };
  add(folder.write("prism.obj", prism_obj()), 0.6 * mm, {-0.25 * mm, 0.02 * mm, 1 * mm}, 2,
      {2, 7, 3});
  add(folder.write("ball.obj", ball_obj(12, 6)), 0.4 * mm, {0.35 * mm, 0.25 * mm, 1 * mm}, 2,
      {11, 5, 0});
  scene.objects.back().normals = Normals::smooth;
  add(square, 0.5 * mm, {0.35 * mm, -0.35 * mm, 1.3 * mm}, 1, {20, -35, 0});
  add(square, 4 * mm, {0, 0, 2.2 * mm}, 0, {1, 2, 0});
  add(square, 4 * mm, {0, 0, -1 * mm}, 0, {178, 3, 0});
  return scene;
}

TEST_CASE("nearest hits, Phong light of every kind and phases match the oracle") {
  const Folder folder;
  const auto oracle = check_trace(ball_before_wall(folder), wrp_with_fan(7, 0.3));
  CHECK(oracle.hits == 33 * 17 * 49);
  CHECK(oracle.shadowed == 0);
}

/// Rays of planes before, amid and behind a scene that is made for z > 0.
void check_before_hologram(Scene scene) {
  for (auto& object : scene.objects) object.position_m.z -= 200 * mm;
  for (auto& light : scene.lights) light.position_m.z -= 200 * mm;
  scene.wrp.distances_m = {-102 * mm};
  auto wrp = wrp_with_fan(7, 0.3);
  for (const double z_m : {-102 * mm, -100 * mm, -distance_m}) {
    INFO("plane at " << z_m);
    wrp.centre_m.z = z_m;
    CHECK(check_trace(scene, wrp).hits > 10000);
  }
}

TEST_CASE("before the hologram, rays of planes before, amid and behind a scene match the oracle") {
  const Folder folder;
  check_before_hologram(ball_before_wall(folder));
}

TEST_CASE("before the hologram, paths over mirrors and through glass match the oracle", "[slow]") {
  const Folder folder;
  check_before_hologram(mirrors_and_glass(folder, 1));
}

TEST_CASE("smooth normals match the oracle", "[slow]") {
  const Folder folder;
  auto scene = ball_before_wall(folder);
  const auto flat = check_trace(scene, wrp_with_fan(7, 0.3));
  scene.objects[0].normals = Normals::smooth;
  const auto smooth = check_trace(scene, wrp_with_fan(7, 0.3));
  CHECK(relative_l2(flat.field, smooth.field) > 0.01);
}

TEST_CASE("shadows match the oracle", "[slow]") {
  const Folder folder;
  auto scene = ball_before_wall(folder);
  scene.trace.shadows = true;
  CHECK(check_trace(scene, wrp_with_fan(7, 0.3)).shadowed > 1000);
}

TEST_CASE("textures are bilinear, repeat and match the oracle", "[slow]") {
  const Folder folder;
  auto scene = ball_before_wall(folder);
  const auto plain = check_trace(scene, wrp_with_fan(7, 0.3));
  scene.materials[1].texture = texture_in(folder);
  const auto textured = check_trace(scene, wrp_with_fan(7, 0.3));
  CHECK(relative_l2(plain.field, textured.field) > 0.1);
}

TEST_CASE("highlights of any sharpness match the oracle", "[slow]") {
  const Folder folder;
  auto scene = small_scene();
  Material m{.ambient = glm::dvec3(0), .diffuse = glm::dvec3(0), .specular = glm::dvec3(1)};
  scene.objects = {object_at(folder.write("wall.obj", square_obj()), 3 * mm, {0, 0, 100.03 * mm})};
  scene.objects[0].rotation_deg = {3, 2, 0};
  const auto wrp = wrp_with_fan(7, 0.3);
  // The wall reflects the light almost exactly back along one ray of the fan.
  const auto ray = glm::normalize(glm::dvec3(wrp.fan[24], 1));
  for (const double shininess : {0.0, 1.0, 120.0, 130.0, 1e6}) {
    m.shininess = shininess;
    scene.materials = {m};
    const auto world = build_world(scene);
    const glm::dvec3 normal(world.normals[0]);
    const auto to_viewer = -ray, mirrored = 2 * dot(normal, to_viewer) * normal - to_viewer;
    scene.lights = {directional(-mirrored + glm::dvec3(3e-4, -2e-4, 0), 1)};
    INFO("shininess " << shininess);
    const auto oracle = check_trace(scene, wrp);
    double energy = 0;
    for (const auto& z : oracle.field) energy += std::norm(z);
    CHECK(energy > 0);
  }
}

TEST_CASE("paths over mirrors and through glass match the oracle to depth 3, with total reflection",
          "[slow]") {
  const Folder folder;
  auto scene = mirrors_and_glass(folder, 1);
  std::complex<double> last = 0;
  for (const int depth : {0, 1, 2, 3}) {
    scene.trace.depth = depth;
    INFO("depth " << depth);
    const auto oracle = check_trace(scene, wrp_with_fan(7, 0.3));
    if (depth == 3) {
      CHECK(oracle.mirrored > 1000);
      CHECK(oracle.refracted > 1000);
      CHECK(oracle.totally_reflected > 1000);
    }
    CHECK(oracle.field[200] != last);
    last = oracle.field[200];
  }
}

TEST_CASE("paths of 100 mm over mirrors and through glass match the oracle", "[slow]") {
  const Folder folder;
  auto scene = mirrors_and_glass(folder, 40);
  scene.trace.depth = 2;
  CHECK(check_trace(scene, wrp_with_fan(6, 0.3)).refracted > 1000);
}

TEST_CASE("rays too steep for the pixels of the SLM add nothing") {
  const Folder folder;
  auto scene = small_scene();
  scene.hologram.pitch_m = {2 * um, 3 * um};  // sines up to 0.1595 and 0.106
  scene.objects = {object_at(folder.write("wall.obj", square_obj()), 3 * mm, {0, 0, 100.03 * mm})};
  auto wrp = wrp_with_fan(9, 0.3);
  const auto oracle = check_trace(scene, wrp);
  CHECK(oracle.hits < 33 * 17 * 25);
  CHECK(oracle.hits > 33 * 17 * 9);
}

DEVICE_TEST("a WRP whose rays hit no surface is exactly zero", "[slow]") {
  const Folder folder;
  auto scene = small_scene();
  scene.objects = {
      object_at(folder.write("wall.obj", square_obj()), 0.1 * mm, {5 * mm, 0, 100 * mm})};
  scene.trace.depth = 2;
  scene.materials[0].reflectivity = 0.5;
  const auto world = build_world(scene);
  const auto plan = make_plan(scene, world);
  CHECK(traced(device, world, plan, wrp_with_fan(5, 0.3), 1) == Field(33 * 17));
}

DEVICE_TEST("unused materials and lights do not change the field", "[slow]") {
  const Folder folder;
  const auto lean = ball_before_wall(folder);
  auto rich = lean;
  auto unused = glowing();
  unused.texture = texture_in(folder);
  rich.materials.push_back(unused);
  auto no_light = directional({1, 1, 1}, 0);
  rich.lights.push_back(no_light);
  rich.trace.depth = 3;  // no material reflects or transmits
  const auto world = build_world(lean), rich_world = build_world(rich);
  const auto plan = make_plan(lean, world), rich_plan = make_plan(rich, rich_world);
  cl::Options lean_options, rich_options;
  const auto a = traced(device, world, plan, wrp_with_fan(5, 0.3), 1, &lean_options);
  const auto b = traced(device, rich_world, rich_plan, wrp_with_fan(5, 0.3), 1, &rich_options);
  CHECK(lean_options != rich_options);  // other code was compiled
  CHECK(relative_l2(a, b) <= 1e-6);
}

TEST_CASE("planes of odd sizes and single pixels are traced completely", "[slow]") {
  const Folder folder;
  for (const glm::ivec2 size : {glm::ivec2(1, 1), {1, 5}, {16, 2}, {17, 3}, {31, 1}}) {
    auto scene = ball_before_wall(folder);
    scene.hologram.resolution = size;
    INFO(size.x << " x " << size.y);
    check_trace(scene, wrp_with_fan(3, 0.3));
  }
}

TEST_CASE("seeds draw different phases, distributed uniformly over the turn") {
  std::vector<int> histogram(16);
  int same = 0;
  for (int i = -20; i < 20; ++i)
    for (int j = -20; j < 20; ++j)
      for (int k = -5; k < 5; ++k) {
        const double turns = reference::phase_turns(i, j, k, 1);
        ++histogram[static_cast<std::size_t>(turns * 16)];
        same += turns == reference::phase_turns(i, j, k, 2);
      }
  CHECK(same < 3);
  for (const int count : histogram) CHECK(std::abs(count - 1000) < 5 * std::sqrt(1000 * 15 / 16.0));
}

}  // namespace
}  // namespace raywave
