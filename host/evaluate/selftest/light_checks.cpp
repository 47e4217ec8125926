// SPDX-License-Identifier: Apache-2.0
// Checks from surfaces to grey levels against double precision: samples, shading, gathering, the
// lens and the encoder.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/evaluate/selftest/checks.hpp"
#include "host/plan/make_plan.hpp"
#include "host/propagate/compact_propagator.hpp"
#include "host/reference/compact.hpp"
#include "host/reference/gathering.hpp"
#include "host/reference/propagation.hpp"
#include "host/reference/shading.hpp"
#include "host/trace/compact_gatherer.hpp"
#include "host/trace/fan_tracer.hpp"
#include "host/trace/gatherer.hpp"
#include "host/view/lens.hpp"

namespace raywave::selftest {
namespace {

using glm::dvec2;
using glm::dvec3;
using reference::ball_before_wall;
using reference::normal;
using reference::place;
using reference::Rig;
using reference::Stage;

std::size_t pixels_of(const Plan& plan) {
  return static_cast<std::size_t>(plan.size.x) * static_cast<std::size_t>(plan.size.y);
}

/// The lattice ray through a cell, from the centre of the hologram, scene frame.
reference::Ray lattice_ray(const Rig& rig, std::size_t cell) {
  const auto& lattice = rig.plan.lattice;
  const auto nx = static_cast<std::size_t>(lattice.size.x);
  const auto tangent = (dvec2(lattice.first) + dvec2(cell % nx, cell / nx) + 0.5) * lattice.step;
  return {-rig.plan.origin_m, {tangent, 1}, 0, 2 * rig.plan.far_m};
}

/// Counts cells that do not hold exactly one sample for each surface that their ray hits: the
/// outside of the ball, and the wall.
Finding layers(const cl::Device& device) {
  const Rig rig(device, ball_before_wall(30e-3));
  int wrong = 0, unsure = 0;
  const auto cells = rig.first_of_cell.size() - 1;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const auto ray = lattice_ray(rig, cell);
    const auto meets = [&](int object, double sideways) {
      for (std::size_t i = 0; i < rig.corners.size(); ++i)
        if (rig.triangles[i].material == object &&
            reference::intersect(rig.corners[i], ray, sideways).triangle >= 0)
          return true;
      return false;
    };
    int expected = 0;
    bool at_edge = false;
    for (const int object : {0, 1}) {
      expected += meets(object, 0);
      at_edge |= meets(object, 1e-6) != meets(object, -1e-6);
    }
    unsure += at_edge;
    wrong += !at_edge && rig.first_of_cell[cell + 1] - rig.first_of_cell[cell] != expected;
  }
  if (10 * static_cast<std::size_t>(unsure) > cells)
    throw std::logic_error("samples: most cells lie on edges");
  return {static_cast<double>(wrong), std::to_string(rig.table.count) + " samples"};
}

/// Largest distance of a sample from its lattice ray or from the plane of its triangle, in metres.
Finding places(const cl::Device& device) {
  const Rig rig(device, ball_before_wall(30e-3));
  Finding finding;
  for (std::size_t cell = 0; cell + 1 < rig.first_of_cell.size(); ++cell) {
    const auto ray = lattice_ray(rig, cell);
    for (auto i = rig.first_of_cell[cell]; i < rig.first_of_cell[cell + 1]; ++i) {
      const auto& s = rig.samples[static_cast<std::size_t>(i)];
      const auto& t = rig.corners[static_cast<std::size_t>(s.triangle)];
      const dvec3 a(t.a[0], t.a[1], t.a[2]), b(t.b[0], t.b[1], t.b[2]), c(t.c[0], t.c[1], t.c[2]);
      const auto from_eye = place(s) - ray.origin;
      const double off_ray = length(dvec2(from_eye) - dvec2(ray.direction) * from_eye.z);
      const double off_plane = std::abs(dot(place(s) - a, normalize(cross(b - a, c - a))));
      for (const double off : {off_ray, off_plane})
        if (!(off <= finding.measured)) finding.measured = off;
    }
  }
  return finding;
}

/// Counts samples and lights whose visibility differs from brute force.
Finding lit(const cl::Device& device) {
  const Rig rig(device, ball_before_wall(30e-3));
  Finding finding;
  for (std::size_t i = 0; i < rig.samples.size(); ++i) {
    const auto& s = rig.samples[i];
    for (std::size_t number = 0; number < rig.scene.lights.size(); ++number) {
      const auto& light = rig.scene.lights[number];
      const auto way = light.type == LightType::point
                           ? light.position_m - rig.plan.origin_m - place(s)
                           : -normalize(light.direction) * 0.1;
      const double facing = dot(normal(s), normalize(way));
      const auto seen =
          reference::free_path(rig.corners, place(s), normal(s), rig.arrays.bias_m, place(s) + way);
      if (std::abs(facing) < 1e-5 || (facing > 0 && seen == reference::Seen::unsure)) continue;
      const bool said = rig.lit[i * rig.arrays.light_words() + number / 32] >> (number % 32) & 1u;
      finding.measured += said != (facing > 0 && seen == reference::Seen::yes);
    }
  }
  return finding;
}

/// Largest relative error of the samples' radiance that does not depend on direction.
Finding radiance(const cl::Device& device) {
  const Rig rig(device, ball_before_wall(30e-3));
  Finding finding;
  for (std::size_t i = 0; i < rig.samples.size(); ++i) {
    const auto& s = rig.samples[i];
    const auto& material = rig.scene.materials[static_cast<std::size_t>(rig.object_of(s))];
    double expected = material.ambient.x;
    for (std::size_t number = 0; number < rig.scene.lights.size(); ++number) {
      const auto& light = rig.scene.lights[number];
      if (!(rig.lit[i * rig.arrays.light_words() + number / 32] >> (number % 32) & 1u)) continue;
      const auto way = light.type == LightType::point
                           ? light.position_m - rig.plan.origin_m - place(s)
                           : -light.direction;
      expected +=
          light.intensity * material.diffuse.x * std::max(0.0, dot(normal(s), normalize(way)));
    }
    const double error = std::abs(s.radiance / expected - 1);
    if (!(error <= finding.measured)) finding.measured = error;
  }
  return finding;
}

/// Error of geometric gathering on a plane around `centre_m` against the direct sum of the samples.
Finding gathered(const cl::Device& device, dvec3 centre_m) {
  // A pixel of a plane far from the samples sees more samples, and the direct sum is slow: 40
  // pixels are enough there.
  const int pixels = centre_m.z > 25e-3 ? 600 : 40;
  const Rig rig(device, ball_before_wall(30e-3));
  Gatherer gatherer(device, rig.plan, rig.arrays, rig.table, 1, 0);
  gatherer.draw_phases(1);
  cl::ComplexBuffer field(device, pixels_of(rig.plan), "field");
  gatherer.gather(Wrp{centre_m}, field);
  const auto got = field.read();
  require_finite(got, "gathered field");
  const auto result = reference::against_direct_sum(rig, got, 1, 1, centre_m, pixels);
  if (4 * result.pixels < pixels) throw std::logic_error("gather: too few pixels are decided");
  return {result.dark_error > 0 ? INFINITY : result.error,
          result.dark_error > 0 ? "light where none should be" : ""};
}

/// Three times the measured error (docs/selftest.md).
constexpr double fan_bound = 1e-6;

/// Error of a WRP traced with a fan against the rays traced in double, over the pixels that single
/// precision can decide.
Finding traced(const cl::Device& device, Stage stage, double reach) {
  auto& scene = stage.scene;
  scene.hologram = {{17, 13}, {1e-6, 1e-6}, 638e-9};
  scene.sampling.mode = SamplingMode::fan;
  scene.wrp.distances_m = {stage.world.min_m.z - 0.5e-3};
  scene.wrp.grid = glm::ivec2(1, 1);
  const auto plan = make_plan(scene, stage.world);
  Wrp wrp;
  wrp.centre_m = {0.031e-3, -0.017e-3, plan.layers[0].distance_m};
  // Tangents rounded to floats, slightly off a regular grid: no ray runs along an edge.
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 5; ++i)
      wrp.fan.emplace_back(glm::vec2(((i + 0.5 + 0.137 * std::sin(7 * j)) / 2.5 - 1) * reach,
                                     ((j + 0.5 + 0.119 * std::cos(5 * i)) / 2.5 - 1) * reach));
  wrp.fan_step = dvec2(reach / 2.5);
  const DeviceScene arrays(device, stage.world, plan);
  cl::ComplexBuffer field(device, pixels_of(plan), "field");
  FanTracer(device, plan, arrays, HitSource::hit).trace(wrp, 5, field);
  const auto got = field.read();
  require_finite(got, "traced field");
  const auto oracle = reference::trace_fan(scene, stage.world, plan, wrp, 5);
  reference::Field decided, expected;
  for (std::size_t i = 0; i < got.size(); ++i) {
    if (oracle.undecided[i]) continue;
    decided.emplace_back(got[i]);
    expected.push_back(oracle.field[i]);
  }
  if (10 * expected.size() < 8 * got.size())
    throw std::logic_error("trace: too few pixels are decided");
  return {reference::relative_error(decided, expected), std::to_string(oracle.hits) + " hits"};
}

/// A wall with only a highlight, lit so that the middle ray of the fan hits its brightest place.
Stage highlight(double shininess) {
  Stage stage;
  Material m;
  m.ambient = m.diffuse = dvec3(0);
  m.specular = dvec3(1);
  m.shininess = shininess;
  stage.add(reference::rectangle({0, 0, 30e-3}, {1.5e-3, 0, 0.08e-3}, {0, 1.5e-3, 0.05e-3}), m);
  const dvec3 facing(stage.world.normals[0]);
  const auto to_viewer = -normalize(dvec3(0.3 * (2.5 + 0.137 * std::sin(14.0) - 2.5) / 2.5,
                                          0.3 * (2.5 + 0.119 * std::cos(10.0) - 2.5) / 2.5, 1));
  Light light;
  light.direction = -(2 * dot(facing, to_viewer) * facing - to_viewer) + dvec3(3e-4, -2e-4, 0);
  stage.scene.lights = {light};
  return stage;
}

/// Error of the lens picture of a matt wall in focus: every pixel must have the wall's radiance.
Finding lens(const cl::Device& device) {
  Stage stage;
  const double z = 30e-3, half = 1e-3;
  Material matt;
  matt.ambient = dvec3(0.1);
  matt.diffuse = dvec3(0.8);
  stage.add(reference::rectangle({0, 0, z}, {half, 0, 0}, {0, half, 0}), matt);
  Light light;
  light.direction = {0.3, 0.4, 1};
  light.intensity = 0.7;
  stage.scene.lights = {light};
  const auto plan = make_plan(stage.scene, stage.world);
  const DeviceScene arrays(device, stage.world, plan);
  LensSpec what;
  what.z_m = z;
  what.points = 4;
  const double expected = 0.1 + 0.7 * 0.8 / length(light.direction);
  Finding finding;
  for (const float pixel : lens_picture(device, plan, arrays, what).pixels) {
    const double error = std::abs(pixel / expected - 1);
    if (!(error <= finding.measured)) finding.measured = error;
  }
  return finding;
}

/// Counts levels that are not nearest to the phase; zero, NaN and infinity must give level 0.
Finding encoded(const cl::Device& device) {
  reference::Random random(1);
  std::vector<std::complex<float>> field;
  std::vector<int> expected;
  while (field.size() < 100'000) {
    const double turns = reference::uniform(random, 0, 1),
                 size = std::pow(10, reference::uniform(random, -30, 30));
    if (std::abs(turns * 256 - std::floor(turns * 256) - 0.5) < 1e-3) continue;  // a tie in float
    field.emplace_back(std::polar(size, 2 * std::numbers::pi * turns));
    expected.push_back(static_cast<int>(std::lround(turns * 256)) % 256);
  }
  for (const auto& special : {std::complex<float>(0, 0),
                              {-0.0f, 0},
                              {NAN, 1},
                              {1, NAN},
                              {INFINITY, 1},
                              {-1, -INFINITY}}) {
    field.push_back(special);
    expected.push_back(0);
  }
  SlmSpec slm;
  slm.encoding = Encoding::phase;
  const auto count = static_cast<int>(field.size());
  Encoder encoder(device, std::make_shared<Panel>(slm, glm::ivec2(count, 1), glm::dvec2(1), 1));
  const auto levels = encode(device, encoder, {count, 1, 1, field}).front();
  Finding finding;
  for (std::size_t i = 0; i < levels.size(); ++i) finding.measured += levels[i] != expected[i];
  return finding;
}

}  // namespace

Finding over_virtual_planes(const cl::Device& device, Stage stage, WrpPropagation propagation,
                            cl::FftBackend fft) {
  stage.scene.wrp.propagation = propagation;
  const Rig rig(device, stage);
  const auto& plan = rig.plan;
  if (!plan.compact) return {0, "over WRPs: " + plan.why_propagation};
  cl::ComplexBuffer plane(device, plan.gathered_pixels(), "virtual plane"),
      field(device,
            static_cast<std::size_t>(plan.tile_size.x) * static_cast<std::size_t>(plan.tile_size.y),
            "field");
  const auto columns = static_cast<std::size_t>(plan.tile_size.x);
  CompactGatherer gatherer(device, plan, rig.arrays, rig.table, 1);
  gatherer.draw_phases(1);
  CompactPropagator propagator(device, plan, fft);
  std::vector<glm::ivec2> pixels;
  for (int i = 0; i < 100; ++i)
    pixels.push_back({i * 37 % plan.tile_size.x, i * 61 % plan.tile_size.y});
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
  require_finite(all, "field over virtual planes");
  for (const auto& pixel : pixels)
    got.emplace_back(
        all[static_cast<std::size_t>(pixel.y) * columns + static_cast<std::size_t>(pixel.x)]);
  const auto is_dark = [](auto z) { return z == 0.0; };
  const std::string note = std::to_string(rig.table.count) + " samples, " +
                           std::to_string(rig.table.hidden) + " hidden, " +
                           std::to_string(end - first) + " planes";
  if (std::all_of(expected.begin(), expected.end(), is_dark))
    return {std::all_of(got.begin(), got.end(), is_dark) ? 0 : INFINITY, note};
  return {reference::relative_error(got, expected), note};
}

std::vector<SelfCheck> light_checks() {
  std::vector<SelfCheck> checks{
      {"samples", "one for each surface that a lattice ray meets", "wrong cells", 0, layers},
      {"samples", "places, off the ray or the surface", "m", 5e-9, places},
      {"samples", "shadows on them", "wrong lights", 0, lit},
      {"samples", "radiance", "relative", 1e-6, radiance},
  };
  for (const auto& [name, centre_m] : {std::pair("0.1 mm before the scene", dvec3(0, 0, 29.6e-3)),
                                       {"20 mm before it", {0.1e-3, 0, 9.7e-3}},
                                       {"off the axis", {0.43e-3, -0.35e-3, 27e-3}},
                                       {"behind it", {0, 0, 33e-3}},
                                       {"at the hologram", {0, 0, 0}}})
    checks.push_back(
        {"gather", std::string("plane ") + name + ", against the direct sum", "relative L2", 2e-5,
         [centre_m = centre_m](const cl::Device& device) { return gathered(device, centre_m); }});
  for (const double z_m : {10e-3, 100e-3})
    checks.push_back({"gather",
                      "virtual plane, hologram " + length_text(z_m) + " away, as in double",
                      "relative L2", 1e-5, [z_m](const cl::Device& device) {
                        return over_virtual_planes(device, ball_before_wall(z_m),
                                                   WrpPropagation::compact, cl::FftBackend::host);
                      }});
  checks.push_back({"gather", "virtual plane, the same by the device's FFT", "relative L2", 1e-5,
                    [](const cl::Device& device) {
                      return over_virtual_planes(device, ball_before_wall(10e-3),
                                                 WrpPropagation::compact, cl::FftBackend::vkfft);
                    }});
  checks.push_back(
      {"Phong", "fan of rays, ball and wall, sun and lamp, shadows", "relative L2", fan_bound,
       [](const cl::Device& device) { return traced(device, ball_before_wall(30e-3), 0.2); }});
  for (const double exponent : {0.0, 1.0, 1e3, 1e6}) {
    char claim[64];
    std::snprintf(claim, sizeof claim, "fan of rays, highlight of shininess %g", exponent);
    checks.push_back(
        {"Phong", claim, "relative L2", fan_bound, [exponent](const cl::Device& device) {
           return traced(device, highlight(exponent), 0.3);
         }});
  }
  checks.push_back({"lens", "a matt wall in focus", "relative", 4e-7, lens});
  checks.push_back(
      {"encode", "100,000 phases, zero, NaN and infinity", "wrong levels", 0, encoded});
  return checks;
}

}  // namespace raywave::selftest
