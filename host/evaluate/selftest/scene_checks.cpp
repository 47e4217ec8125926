// SPDX-License-Identifier: Apache-2.0
// Checks from surfaces to the light at the hologram, against the same computation in double: small
// scenes, ordinary ones and ones at the limits of wavelength, pitch, distance, size and light.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "host/carriers/planning/facts.hpp"
#include "host/carriers/virtual_planes/compact_gatherer.hpp"
#include "host/carriers/virtual_planes/compact_propagator.hpp"
#include "host/evaluate/selftest/selfcheck.hpp"
#include "host/evaluate/selftest/selftest.hpp"
#include "host/planning/make_plan.hpp"
#include "host/reference/gathering.hpp"
#include "host/reference/lens.hpp"
#include "host/reference/looks.hpp"
#include "host/reference/samples.hpp"
#include "host/render.hpp"
#include "host/trace/gatherer.hpp"
#include "host/view/lens.hpp"

namespace raywave::selftest {
namespace {

using glm::dvec3;
using glm::ivec2;
using reference::ball_before_wall;
using reference::Rig;
using reference::Stage;

/// Largest accepted relative L2 error of a hologram.
constexpr double field_bound = 1e-4;

void take_larger(Finding& finding, double error) {
  if (!(error <= finding.measured)) finding.measured = error;  // NaN, too
}

/// Largest error of a sample: of its radiance, and of its place, in pitches of the samples.
Finding samples(const cl::Device& device) {
  auto stage = ball_before_wall(30 * mm);
  stage.scene.sampling.antialias = 4;
  const Rig rig(device, stage);
  Finding finding{0, std::to_string(rig.table.count) + " samples"};
  for (std::size_t cell = 0; cell + 1 < rig.first_of_cell.size(); ++cell) {
    const auto wanted = reference::samples_of_cell(stage, rig, cell);
    const auto first = static_cast<std::size_t>(rig.first_of_cell[cell]),
               end = static_cast<std::size_t>(rig.first_of_cell[cell + 1]);
    if (wanted.unsure) continue;
    if (wanted.samples.size() != end - first) return {INFINITY, "a cell has other samples"};
    for (auto i = first; i < end; ++i) {
      const auto& want = wanted.samples[i - first];
      take_larger(finding, length(reference::place(rig.samples[i]) - want.place) /
                               stage.scene.sampling.pitch_m);
      take_larger(finding, std::abs(rig.samples[i].radiance - want.radiance));
    }
  }
  return finding;
}

/// Largest error of a pixel that a lens sees, relative to the brightest.
Finding seen(const cl::Device& device) {
  const auto stage = ball_before_wall(30 * mm);
  const auto plan = make_plan(stage.scene, stage.world);
  LensSpec spec;
  spec.z_m = 30 * mm;
  spec.pixel_m = glm::dvec2(40 * um);
  spec.window_m = glm::dvec2(1.2 * mm);
  spec.points = 2;
  const auto picture = lens_picture(device, plan, DeviceScene(device, stage.world, plan), spec);
  const auto exact =
      reference::seen_by_lens(stage.scene, stage.world, plan,
                              {spec.z_m, {picture.width, picture.height}, *spec.pixel_m, 2});
  const double brightest = *std::ranges::max_element(exact.radiance);
  Finding finding;
  for (std::size_t i = 0; i < exact.radiance.size(); ++i)
    if (!exact.unsure[i])
      take_larger(finding, std::abs(picture.pixels[i] - exact.radiance[i]) / brightest);
  return finding;
}

/// Error of a rendered hologram whose light travels over WRPs, or is gathered at the hologram
/// (Method::points), against the same samples or fans in double. Where floats cannot decide what
/// reaches a pixel of a WRP, the device's word is taken.
Finding rendered(const cl::Device& device, const Stage& stage, Method method) {
  RenderOptions how;
  how.method = method;
  how.fft = cl::default_backend(device.info());
  how.keep_wrps = true;
  const auto result = render(device, stage.scene, stage.world, how);
  const Rig rig(device, stage, method);
  const auto what = reference::gathering(rig, default_plane_wave_spots);
  const auto got = reference::to_double(result.field.samples);
  std::vector<reference::Field> planes;
  std::size_t unsure = 0;
  for (const auto& wrp : rig.plan.wrps) {
    reference::GatheredField want;
    if (stage.scene.sampling.mode == SamplingMode::fan) {
      auto traced =
          reference::trace_fan(stage.scene, stage.world, rig.plan, wrp, stage.scene.sampling.seed);
      want = {std::move(traced.field), std::move(traced.undecided)};
    } else {
      want = reference::gather(what, wrp, stage.scene.sampling.seed);
    }
    const auto word =
        method == Method::points ? got : reference::to_double(result.wrps[planes.size()].samples);
    for (std::size_t i = 0; i < want.field.size(); ++i) {
      want.field[i] *= amplitude_unit_m(rig.plan);
      if (!want.unsure[i]) continue;
      want.field[i] = word[i];
      ++unsure;
    }
    planes.push_back(std::move(want.field));
  }
  if (2 * unsure > planes.size() * planes.front().size())
    throw std::logic_error("most pixels cannot be decided");
  const auto want =
      method == Method::points ? planes.front() : reference::hologram(rig.plan, planes);
  return {reference::relative_error(got, want), std::to_string(result.samples) + " samples"};
}

/// Error of a hologram (its first tile) over virtual planes, at 100 pixels; 0 with a note where
/// virtual planes do not serve.
Finding over_virtual_planes(const cl::Device& device, Stage stage, cl::FftBackend fft) {
  stage.scene.wrp.propagation = WrpPropagation::automatic;
  const Rig rig(device, stage);
  const auto& plan = rig.plan;
  if (propagation_of(plan) != WrpPropagation::compact)
    return {0, std::string(not_over_planes) + plan.why_carrier};
  const auto columns = static_cast<std::size_t>(plan.tiling.tile_size.x);
  cl::ComplexBuffer plane(device, plan.gathered_pixels(), "virtual plane"),
      field(device, columns * static_cast<std::size_t>(plan.tiling.tile_size.y), "field");
  CompactGatherer gatherer(device, plan, rig.arrays, rig.table, 1);
  gatherer.draw_phases(1);
  CompactPropagator propagator(device, plan, fft);
  std::vector<ivec2> pixels;
  for (int i = 0; i < 100; ++i)
    pixels.push_back({i * 37 % plan.tiling.tile_size.x, i * 61 % plan.tiling.tile_size.y});
  reference::Field expected(pixels.size()), got;
  const auto [first, end] = plan.wrps_of(0);
  for (auto number = first; number < end; ++number) {
    const auto& wrp = plan.wrps[number];
    const auto lit = gatherer.gather(wrp, plane, fft != cl::FftBackend::host);
    propagator.add(plane, 0, lit, wrp.centre_m.z, number == first, field);
    const auto part =
        reference::compact_field(reference::gathering(rig), wrp, 1, gatherer.footprints(), pixels);
    for (std::size_t i = 0; i < part.size(); ++i) expected[i] += part[i];
  }
  const auto all = field.read();
  for (const auto& pixel : pixels)
    got.emplace_back(
        all[static_cast<std::size_t>(pixel.y) * columns + static_cast<std::size_t>(pixel.x)]);
  return {reference::relative_error(got, expected), std::to_string(rig.table.count) + " samples"};
}

/// A shiny plate of 20 x 20 samples under one light.
struct Plate {
  const char* name;
  ivec2 resolution;
  double pitch_m, wavelength_m;
  double width_m;  // side of the square, before it is tilted
  dvec3 centre_m;
  double intensity = 1, shininess = 20;
  std::optional<double> wrp_m = {};
  glm::dvec2 slope{0.1, 0.05};
  int samples = 20;  // along a side
};

Stage stage_of(const Plate& e) {
  Stage stage;
  Material material;
  material.specular = dvec3(0.5);
  material.shininess = e.shininess;
  const double half = e.width_m / 2;
  const dvec3 u(half, 0, e.slope.x * half), v(0, half, e.slope.y * half), to_viewer(0, 0, -1),
      normal = normalize(cross(u, v));
  stage.add(reference::rectangle(e.centre_m, u, v), material);
  Light light;  // its highlight points along the axis
  light.direction = to_viewer - 2 * dot(normal, to_viewer) * normal;
  light.intensity = e.intensity;
  stage.scene.lights = {light};
  stage.scene.hologram = {e.resolution, {e.pitch_m, e.pitch_m}, e.wavelength_m};
  stage.scene.sampling.pitch_m = e.width_m / e.samples;
  stage.scene.wrp.grid = ivec2(1, 1);
  if (e.wrp_m) stage.scene.wrp.distances_m = {*e.wrp_m};
  return stage;
}

Plate sloped(Plate plate, double along_x) {
  plate.slope = {along_x, 0};
  return plate;
}
Plate sampled(Plate plate, int along_a_side) {
  plate.samples = along_a_side;
  return plate;
}

const Plate plates[] = {
    {"wavelength 10 nm", {48, 40}, 0.5 * um, 10 * nm, 50 * um, {0, 0, 10 * mm}, 1, 20, 8 * mm},
    {"wavelength 1 mm", {48, 40}, 0.6 * mm, 1 * mm, 50 * mm, {0, 0, 0.3}},
    {"pitch a quarter wavelength", {48, 40}, red_m / 4, red_m, 10 * um, {0, 0, 50 * um}},
    {"pitch 100 um", {48, 40}, 100 * um, red_m, 3 * mm, {0, 0, 1}},
    {"scene of 1 um", {48, 40}, 0.5 * um, red_m, 1 * um, {0, 0, 100 * um}},
    {"scene of 1 um, 1 um away", {48, 40}, 0.2 * um, red_m, 1 * um, {0, 0, 1 * um}},
    {"scene 1 m off the axis", {48, 40}, 3 * um, red_m, 50 * mm, {1, 0, 10}, 1, 20, 0.2},
    {"scene 100 m away", {48, 40}, 100 * um, red_m, 0.2, {0, 0, 100}, 1, 20, 50},
    {"hologram of 1 x 1 samples", {1, 1}, slm_m, red_m, 20 * um, {0, 0, 10 * mm}, 1, 20, 1 * mm},
    {"hologram of 1 x 97 samples", {1, 97}, slm_m, red_m, 20 * um, {0, 0, 10 * mm}},
    {"60 degrees off the axis", {48, 40}, 0.3 * um, red_m, 20 * um, {1.7 * mm, 0, 1 * mm}},
    sloped({"surface nearly edge-on", {48, 40}, slm_m, red_m, 20 * um, {0, 0, 20 * mm}}, 50),
    sloped({"depth from 20 mm to 1 m", {48, 40}, slm_m, red_m, 10 * mm, {0, 0, 0.51}}, 98),
    sampled({"one sample", {48, 40}, slm_m, red_m, 20 * um, {0, 0, 10 * mm}}, 1),
    sampled({"14,400 samples", {48, 40}, slm_m, red_m, 1 * mm, {0, 0, 10 * mm}}, 120),
    {"shininess 0", {48, 40}, slm_m, red_m, 0.2 * mm, {0, 0, 10 * mm}, 1, 0},
    {"shininess 1e6", {48, 40}, slm_m, red_m, 0.2 * mm, {0, 0, 10 * mm}, 1, 1e6},
    {"intensity 1e12", {48, 40}, slm_m, red_m, 0.2 * mm, {0, 0, 10 * mm}, 1e12},
    // The plate extends from 19.925 to 20.075 mm.
    {"WRP cuts the surface", {96, 80}, slm_m, red_m, 1 * mm, {0, 0, 20 * mm}, 1, 20, 20 * mm},
    {"WRP behind the surface", {96, 80}, slm_m, red_m, 1 * mm, {0, 0, 20 * mm}, 1, 20, 21 * mm},
};

}  // namespace

std::vector<SelfCheck> scene_checks() {
  std::vector<SelfCheck> checks{
      {"samples", "places, shadows and radiance, ball before a wall", "pitches", 1e-5, samples},
      {"lens", "ball before a wall", "relative", 1e-6, seen}};
  const auto add = [&](const char* part, const std::string& claim, double bound, auto measure) {
    checks.push_back({part, claim, "relative L2", bound, measure});
  };
  add("WRPs", "ball before a wall, sun and lamp, shadows", 2e-5, [](const cl::Device& device) {
    return rendered(device, ball_before_wall(30 * mm), Method::wrp);
  });
  add("WRPs", "the same, by fans of rays", 2e-6, [](const cl::Device& device) {
    auto stage = ball_before_wall(30 * mm);
    stage.scene.hologram = {{17, 13}, {1 * um, 1 * um}, red_m};
    stage.scene.sampling.mode = SamplingMode::fan;
    stage.scene.wrp.grid = ivec2(1, 1);
    return rendered(device, stage, Method::wrp);
  });
  add("hologram", "the same, all samples at the hologram", 2e-5, [](const cl::Device& device) {
    return rendered(device, ball_before_wall(30 * mm), Method::points);
  });
  for (const auto fft : {cl::FftBackend::host, cl::FftBackend::vkfft})
    add("planes", "the same over virtual planes, by " + std::string(cl::name_of(fft)), 1e-5,
        [fft](const cl::Device& device) {
          return over_virtual_planes(device, ball_before_wall(10 * mm), fft);
        });
  for (const auto& plate : plates) {
    const std::string name = plate.name;
    add("WRPs", name, field_bound, [&](const cl::Device& device) {
      return exact_or_refused("no light arrives",
                              [&] { return rendered(device, stage_of(plate), Method::wrp); });
    });
    add("hologram", name, field_bound, [&](const cl::Device& device) {
      return rendered(device, stage_of(plate), Method::points);
    });
    add("planes", name + std::string(if_planned), field_bound, [&](const cl::Device& device) {
      return over_virtual_planes(device, stage_of(plate), cl::FftBackend::host);
    });
  }
  return checks;
}

}  // namespace raywave::selftest
