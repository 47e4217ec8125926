// SPDX-License-Identifier: Apache-2.0
// Checks of whole holograms at the limits of wavelength, pitch, distance, size and light.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "host/evaluate/selftest/checks.hpp"
#include "host/reference/gathering.hpp"
#include "host/render.hpp"
#include "host/view/compare.hpp"

namespace raywave::selftest {
namespace {

using glm::dvec3;
using reference::Rig;
using reference::Stage;

constexpr double nm = 1e-9, um = 1e-6, mm = 1e-3, red_m = 638e-9;

/// Largest accepted relative L2 error (docs/robustness.md).
constexpr double field_bound = 1e-4;

struct Extreme {
  const char* name;
  glm::ivec2 resolution;
  double pitch_m, wavelength_m;
  double width_m;  // of a square plate, tilted by slopes of 1/10 and 1/20
  dvec3 centre_m;
  double intensity = 1, shininess = 20;
  std::optional<double> wrp_m = {};
};

/// A shiny plate of 20 x 20 samples under one light.
Stage plate(const Extreme& e) {
  Stage stage;
  Material material;
  material.specular = dvec3(0.5);
  material.shininess = e.shininess;
  const double half = e.width_m / 2;
  stage.add(reference::rectangle(e.centre_m, {half, 0, 0.1 * half}, {0, half, 0.05 * half}),
            material);
  Light light;  // its highlight points along the axis
  const auto u = stage.world.positions[1] - stage.world.positions[0],
             v = stage.world.positions[2] - stage.world.positions[0];
  const auto normal = normalize(cross(u, v));
  const dvec3 to_viewer(0, 0, -1);
  light.direction = to_viewer - 2 * dot(normal, to_viewer) * normal;
  light.intensity = e.intensity;
  stage.scene.lights = {light};
  stage.scene.hologram = {e.resolution, {e.pitch_m, e.pitch_m}, e.wavelength_m};
  stage.scene.sampling.pitch_m = e.width_m / 20;
  stage.scene.wrp.grid = glm::ivec2(1, 1);
  if (e.wrp_m) stage.scene.wrp.distances_m = {*e.wrp_m};
  return stage;
}

RenderResult rendered(const cl::Device& device, const Stage& stage, Method method) {
  RenderOptions how;
  how.method = method;
  how.fft = cl::default_backend(device.info());
  how.keep_wrps = true;
  auto result = render(device, stage.scene, stage.world, how);
  require_finite(result.field.samples, "hologram");
  for (const auto& wrp : result.wrps) require_finite(wrp.samples, "WRP");
  return result;
}

bool dark(const FieldStack& field) {
  return std::all_of(field.samples.begin(), field.samples.end(), [](auto z) { return z == 0.0f; });
}

/// Error of the sum of all samples at the hologram against that sum in double. The field by way of
/// WRPs must be finite and not dark.
Finding whole(const cl::Device& device, const Extreme& e) {
  const auto stage = plate(e);
  if (dark(rendered(device, stage, Method::wrp).field))
    throw std::runtime_error("no light arrives by way of the WRP");
  const auto points = rendered(device, stage, Method::points);
  const Rig rig(device, stage, Method::points);
  const auto result =
      reference::against_direct_sum(rig, points.field.samples, 1, stage.scene.sampling.seed,
                                    {0, 0, 0}, 100, amplitude_unit_m(rig.plan));
  if (result.pixels < 50)
    throw std::runtime_error("only " + std::to_string(result.pixels) +
                             " of 100 pixels can be decided");
  return {result.error, std::to_string(points.samples) + " samples"};
}

/// 1 - correlation between the field by way of an unfavourably placed WRP and the sum of all
/// samples.
Finding by_wrp(const cl::Device& device, const Extreme& e) {
  auto stage = plate(e);
  const auto points = rendered(device, stage, Method::points),
             wrp = rendered(device, stage, Method::wrp);
  return {1 - compare_fields(points.field, wrp.field).correlation, ""};
}

}  // namespace

std::vector<SelfCheck> scene_extremes(SelfTestSize) {
  std::vector<SelfCheck> checks;
  const glm::ivec2 small(96, 80);
  const double slm = 3.74 * um;
  const Extreme extremes[] = {
      {"wavelength 10 nm", small, 0.5 * um, 10 * nm, 50 * um, {0, 0, 10 * mm}},
      {"wavelength 1 mm", small, 0.6 * mm, 1 * mm, 50 * mm, {0, 0, 0.3}},
      {"pitch a quarter wavelength", small, red_m / 4, red_m, 10 * um, {0, 0, 50 * um}},
      {"pitch 100 um", small, 100 * um, red_m, 2 * mm, {0, 0, 2}},
      {"scene of 1 um", small, 0.5 * um, red_m, 1 * um, {0, 0, 100 * um}},
      {"scene of 1 um, 1 um away", small, 0.2 * um, red_m, 1 * um, {0, 0, 1 * um}},
      {"scene of 1 m", {384, 320}, slm, red_m, 1, {0, 0, 2}, 1, 20, 10 * mm},
      {"scene 1 m off the axis", {1920, 48}, 0.5 * um, red_m, 20 * mm, {1, 0, 2}},
      {"scene 10 m away", small, slm, red_m, 0.2, {0, 0, 10}},
      {"scene 100 m away", small, 100 * um, red_m, 0.2, {0, 0, 100}},
      {"hologram of 1 x 1 samples", {1, 1}, slm, red_m, 20 * um, {0, 0, 10 * mm}},
      {"hologram of 1 x 97 samples", {1, 97}, slm, red_m, 20 * um, {0, 0, 10 * mm}},
      {"hologram of 97 x 89 samples", {97, 89}, slm, red_m, 0.2 * mm, {0, 0, 10 * mm}},
      {"shininess 0", small, slm, red_m, 0.2 * mm, {0, 0, 10 * mm}, 1, 0},
      {"shininess 1e-3", small, slm, red_m, 0.2 * mm, {0, 0, 10 * mm}, 1, 1e-3},
      {"shininess 1e6", small, slm, red_m, 0.2 * mm, {0, 0, 10 * mm}, 1, 1e6},
      {"intensity 0", small, slm, red_m, 0.2 * mm, {0, 0, 10 * mm}, 0},
      {"intensity 1e12", small, slm, red_m, 0.2 * mm, {0, 0, 10 * mm}, 1e12},
  };
  for (const auto& e : extremes)
    checks.push_back({"extremes", std::string(e.name) + ": all samples at the hologram",
                      "relative L2", field_bound,
                      [=](const cl::Device& device) { return whole(device, e); }});
  for (const auto& e : extremes)
    checks.push_back({"extremes", std::string(e.name) + ": virtual planes, if planned",
                      "relative L2", field_bound, [=](const cl::Device& device) {
                        return over_virtual_planes(device, plate(e), WrpPropagation::automatic,
                                                   cl::FftBackend::host);
                      }});

  // The plate extends from 19.925 to 20.075 mm.
  const auto wrp_at = [&](const char* name, double wrp_m) {
    const Extreme e{name, {384, 320}, slm, red_m, 1 * mm, {0, 0, 20 * mm}, 1, 20, wrp_m};
    checks.push_back({"extremes", std::string("WRP that ") + name + ": against all samples",
                      "1 - corr.", 0.03,
                      [=](const cl::Device& device) { return by_wrp(device, e); }});
  };
  wrp_at("touches the surface", 19.925 * mm);
  wrp_at("cuts the surface", 20 * mm);
  wrp_at("stands behind the surface", 21 * mm);
  checks.push_back(
      {"extremes", "WRP that coincides with the surface: against all samples", "1 - corr.", 0.03,
       [=](const cl::Device& device) {
         const Extreme e{"", {384, 320}, slm, red_m, 1 * mm, {0, 0, 20 * mm}, 1, 20, 20 * mm};
         auto stage = plate(e);
         for (auto& p : stage.world.positions) p.z = 20 * mm;
         stage.world.min_m.z = stage.world.max_m.z = 20 * mm;
         for (auto& n : stage.world.normals) n = {0, 0, -1};
         const auto points = rendered(device, stage, Method::points),
                    wrp = rendered(device, stage, Method::wrp);
         return Finding{1 - compare_fields(points.field, wrp.field).correlation, ""};
       }});
  return checks;
}

}  // namespace raywave::selftest
