// SPDX-License-Identifier: Apache-2.0
// Surfaces that are not there everywhere: the lattice's rays, visibility, shadows and the lens
// agree on where they are, and on the mean they are there as often as their alpha says.
#include <glm/common.hpp>

#include "host/geometry/kernel_options.hpp"
#include "host/planning/make_plan.hpp"
#include "host/reference/lens.hpp"
#include "host/reference/looks.hpp"
#include "host/reference/surfaces.hpp"
#include "host/view/lens.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
using glm::dvec3;
using Json = nlohmann::json;

// A veil 1 mm wide before a wall that shines: units of the file are half the veil's width.
constexpr double veil_z = 20 * mm, wall_z = 20.6 * mm, veil_half = 0.5 * mm;
constexpr double veil_radiance = 0.25, wall_radiance = 1;

struct Veiled {
  Scene scene;
  World world;
};

/// A veil of a material that the file describes more closely, and the wall behind it. Both have
/// emission alone, but for light on the wall where `lamp` asks for it.
Veiled veiled(const Folder& folder, Json material, const std::string& picture, bool lamp) {
  Gltf file;
  auto& pbr = material["pbrMetallicRoughness"];
  if (!picture.empty()) pbr["baseColorTexture"] = texture_info(file.texture(picture));
  material["emissiveFactor"] = {veil_radiance, veil_radiance, veil_radiance};
  pbr["metallicFactor"] = 1;
  if (!pbr.contains("baseColorFactor")) pbr["baseColorFactor"] = {0, 0, 0, 1};
  const double glow = lamp ? 0 : wall_radiance;
  const int wall =
      file.material({{"emissiveFactor", {glow, glow, glow}},
                     {"pbrMetallicRoughness",
                      {{"metallicFactor", 0}, {"baseColorFactor", {lamp ? 1 : 0, 0, 0, 1}}}}});
  file.add(Gltf::square(1, {0, 0, 0}, file.material(material)))
      .add(Gltf::square(0.9f, {0, 0, -static_cast<float>((wall_z - veil_z) / veil_half)}, wall));
  Veiled made;
  auto& scene = made.scene;
  scene.hologram = {{64, 64}, {8e-6, 8e-6}, 638e-9};
  scene.sampling.pitch_m = 25e-6;
  scene.wrp.propagation = WrpPropagation::spectrum;
  scene.materials.emplace_back();
  scene.lights.push_back({LightType::ambient, {0, 0, 1}, {}, 0});
  if (lamp) {
    scene.lights.push_back(Light{.direction = {0.05, 0.02, 1}});
    scene.trace.shadows = true;
  }
  scene.objects.emplace_back();
  auto& object = scene.objects[0];
  object.mesh = folder.write("veil.glb", file.glb());
  object.unit_m = veil_half;
  object.anchor = Anchor::origin;
  object.position_m = {0, 0, veil_z};
  object.rotation_deg = {0, 180, 0};
  made.world = build_world(scene);
  return made;
}

Image in_focus(const cl::Device& device, const Veiled& what, double width_m, int pixels,
               int points) {
  const auto plan = make_plan(what.scene, what.world);
  const DeviceScene arrays(device, what.world, plan);
  LensSpec spec{.z_m = veil_z,
                .window_m = glm::dvec2(width_m),
                .points = points,
                .pixel_m = glm::dvec2(width_m / pixels)};
  return lens_picture(device, plan, arrays, spec);
}

/// Left of the middle, as the hologram's picture has it, alpha is 1; it falls to 0 at the right.
std::string ramp() {
  return tga_picture(64, 2, [](int i, int) {
    return glm::u8vec4(0, 0, 0, static_cast<int>(std::lround(255 * (i + 0.5) / 64)));
  });
}

/// Ways from the wall's samples to the middles of the window's parts: those that the oracle finds
/// free, and hidden by the veil, and those of both that the device finds otherwise.
struct Ways {
  int free = 0, hidden = 0, wrong = 0, unsure = 0;
};

Ways ways_to_window(const Veiled& what, const reference::Rig& rig) {
  Ways ways;
  const auto half = glm::dvec2(rig.plan.hologram.size) * rig.plan.hologram.pitch_m / 2.0 *
                    std::max(1.0, rig.plan.cone.half_width);
  const int parts = rig.table.visibility_parts;
  for (std::size_t i = 0; i < rig.samples.size(); ++i) {
    const auto p = reference::place(rig.samples[i]) + rig.plan.extent.origin_m;
    if (std::abs(p.z - wall_z) > 1e-6) continue;
    // Samples that have moved to the centroid of their light have looked around before
    const auto cell = glm::dvec2(p) / (p.z * rig.plan.lattice.step);
    if (glm::length(glm::fract(cell) - 0.5) > 1e-3) continue;
    for (int b = 0; b < parts; ++b) {
      for (int a = 0; a < parts; ++a) {
        const dvec3 to(half.x * ((2 * a + 1.0) / parts - 1), half.y * ((2 * b + 1.0) / parts - 1),
                       0);
        // Where the way crosses the veil: x turns with the file's half turn about y
        const auto at = p + (to - p) * ((p.z - veil_z) / p.z);
        bool doubt = false, there = false;
        for (std::size_t t = 0; t < what.world.triangles.size(); ++t) {
          const auto corners = what.world.corners_m(t);
          if (std::abs(corners[0].z - veil_z) > 1e-6) continue;
          Corners c{};
          float* const out[] = {c.a, c.b, c.c};
          for (std::size_t k = 0; k < 3; ++k)
            for (int axis = 0; axis < 3; ++axis)
              out[k][axis] = static_cast<float>(corners[k][axis]);
          const auto hit = reference::intersect(c, {p, to - p, 0, 1});
          if (hit.triangle < 0) continue;
          there |= reference::is_there(reference::look_at(what.scene, what.world, t, hit.u, hit.v),
                                       at - rig.plan.extent.origin_m, rig.plan, &doubt);
        }
        if (std::abs(std::abs(at.x) - veil_half) < 1e-8 ||
            std::abs(std::abs(at.y) - veil_half) < 1e-8)
          doubt = true;
        if (doubt) {
          ++ways.unsure;
          continue;
        }
        ++(there ? ways.hidden : ways.free);
        ways.wrong += there == rig.sees(i, a, b);
      }
    }
  }
  return ways;
}

DEVICE_TEST("a cut-out surface is there where its alpha passes, for the lens as for the samples") {
  const Folder folder;
  const auto what = veiled(folder, {{"alphaMode", "MASK"}, {"alphaCutoff", 0.5}}, ramp(), false);
  // The lens, as the oracle and as the ramp says: there where alpha is 0.5 and more
  const auto image = in_focus(device, what, 0.8 * mm, 80, 2);
  int wrong = 0;
  double covered = 0;
  for (int j = 0; j < image.height; ++j) {
    for (int i = 0; i < image.width; ++i) {
      const double x = (i - (image.width - 1) / 2.0) * 0.8 * mm / 80,
                   got = double{image.pixels[j * image.width + i]};
      const bool there = x < 0;  // alpha grows to the file's right, which the half turn makes left
      covered += std::abs(got - veil_radiance) < 1e-5;
      wrong += std::abs(got - (there ? veil_radiance : wall_radiance)) > 1e-5;
    }
  }
  CHECK(wrong == 0);
  CHECK(covered / (image.width * image.height) == 0.5);
  // The samples: light of the veil to the left, of the wall to the right, and its ways
  reference::Stage stage;
  stage.scene = what.scene;
  stage.world = what.world;
  const reference::Rig rig(device, stage);
  int left = 0, right = 0;
  double light = 0;
  for (const auto& s : rig.samples) {
    const auto p = reference::place(s) + rig.plan.extent.origin_m;
    if (std::abs(p.z - veil_z) > 1e-6) continue;
    ++(p.x < 0 ? left : right);
    light += double{s.radiance} / veil_radiance;
  }
  const double cells = std::pow(2 * veil_half / 25e-6, 2) * std::pow(wall_z / veil_z + 1, 2) / 4;
  CHECK(right == 0);
  CHECK(left > 700);
  CHECK(light / cells == Catch::Approx(0.5).epsilon(0.03));
  const auto ways = ways_to_window(what, rig);
  INFO(ways.free << " free, " << ways.hidden << " hidden, " << ways.unsure << " unsure");
  CHECK(ways.free > 10000);
  CHECK(ways.hidden > 10000);
  // A sample that sixteen ways agree on asks no more: edges of the veil alone
  CHECK(ways.wrong < 0.01 * (ways.free + ways.hidden));
}

DEVICE_TEST("a cut-out surface whose cutoff is 0 is there where its alpha is 0, too") {
  const Folder folder;
  const auto dark = tga_picture(2, 2, [](int i, int) { return glm::u8vec4(0, 0, 0, 255 * i); });
  const auto what = veiled(folder, {{"alphaMode", "MASK"}, {"alphaCutoff", 0}}, dark, false);
  REQUIRE(what.world.materials.at(0).alpha_mode == AlphaMode::mask);
  const auto plan = make_plan(what.scene, what.world);
  const auto exact = reference::seen_by_lens(what.scene, what.world, plan,
                                             {veil_z, {8, 8}, glm::dvec2(0.1 * mm), 1});
  for (const double radiance : exact.radiance) CHECK(radiance == Catch::Approx(veil_radiance));
  const auto image = in_focus(device, what, 0.8 * mm, 8, 1);
  for (const float radiance : image.pixels) CHECK(double{radiance} == Catch::Approx(veil_radiance));
}

DEVICE_TEST(
    "a blended surface is there as often as its alpha says, at the same places for all rays") {
  const Folder folder;
  for (const bool lamp : {false, true}) {
    const double alpha = 0.35;
    const auto what = veiled(
        folder,
        {{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, alpha}}}}},
        "", lamp);
    // The lens: each pixel's rays meet the veil at one place
    constexpr int pixels = 90;
    const auto image = in_focus(device, what, 0.8 * mm, pixels, 2);
    const auto plan = make_plan(what.scene, what.world);
    CHECK(kernel_options(plan).at(option::alpha) == "2");
    double sum = 0;
    for (const float radiance : image.pixels) sum += radiance;
    const double mean = sum / (pixels * pixels),
                 lit = lamp ? plan.lighting.lights[1].direction.z / std::sqrt(1 + 0.0029) : 1;
    // With a lamp, the wall is lit through the veil as well
    const double wall = lamp ? (1 - alpha) * 1.04 * lit : wall_radiance;
    const double deviation =
        std::abs(wall_radiance - veil_radiance) * std::sqrt(alpha * (1 - alpha)) / pixels;
    INFO("lamp " << lamp << ": lens " << mean);
    CHECK(mean == Catch::Approx(alpha * veil_radiance + (1 - alpha) * wall).margin(4 * deviation));
    if (!lamp) {
      const auto exact =
          reference::seen_by_lens(what.scene, what.world, plan,
                                  {veil_z, {pixels, pixels}, glm::dvec2(0.8 * mm / pixels), 2});
      int differ = 0, sure = 0;
      for (std::size_t i = 0; i < exact.radiance.size(); ++i) {
        sure += !exact.unsure[i];
        differ += !exact.unsure[i] && std::abs(double{image.pixels[i]} - exact.radiance[i]) > 1e-5;
      }
      CHECK(sure > pixels * pixels / 2);
      CHECK(differ == 0);
    }

    // Samples of the veil, the ways from the wall through it, and the lamp's
    reference::Stage stage;
    stage.scene = what.scene;
    stage.world = what.world;
    const reference::Rig rig(device, stage);
    double veil_light = 0, wall_light = 0, seen = 0, veils = 0;
    int walls = 0;
    for (std::size_t i = 0; i < rig.samples.size(); ++i) {
      const auto p = reference::place(rig.samples[i]) + rig.plan.extent.origin_m;
      if (std::max(std::abs(p.x), std::abs(p.y)) > 0.4 * mm) continue;
      if (std::abs(p.z - veil_z) < 1e-6) {
        veil_light += double{rig.samples[i].radiance} / veil_radiance;
        ++veils;
        continue;
      }
      ++walls;
      wall_light += double{rig.samples[i].radiance};
      for (int b = 0; b < 8; ++b)
        for (int a = 0; a < 8; ++a) seen += rig.sees(i, a, b) / 64.0;
    }
    REQUIRE(walls > 800);
    // A cell without a ray that meets the veil is rare: 0.65^17
    CHECK(veils > 0.95 * walls);
    const double error = 4 * std::sqrt(alpha * (1 - alpha) / (16 * walls)) + 0.005;
    CAPTURE(lamp, veil_light / veils, wall_light / walls, seen / walls);
    CHECK(veil_light / veils == Catch::Approx(alpha).margin(error));
    CHECK(seen / walls == Catch::Approx(1 - alpha).margin(error));
    CHECK(wall_light / walls == Catch::Approx(wall).margin(error));
    const auto ways = ways_to_window(what, rig);
    CAPTURE(ways.free, ways.hidden, ways.unsure, ways.wrong);
    CHECK(ways.free + ways.hidden > (lamp ? 500 : 10000));  // with a lamp most samples have moved
    CHECK(ways.wrong < 0.01 * (ways.free + ways.hidden));
  }
}

}  // namespace
}  // namespace raywave
