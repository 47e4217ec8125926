// SPDX-License-Identifier: Apache-2.0
/// Light from mirrors and through glass as samples (kernels/samples/paths.cl).
#include <algorithm>
#include <cmath>
#include <complex>
#include <glm/matrix.hpp>
#include <numbers>
#include <set>

#include "cl/buffer.hpp"
#include "host/plan/make_plan.hpp"
#include "host/reference/shading.hpp"
#include "host/reference/specular.hpp"
#include "host/trace/gatherer.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/samples.hpp"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec2;
using glm::dvec3;
using Complex = std::complex<double>;

namespace {

Material glowing() {
  Material m;
  m.ambient = dvec3(1);
  m.diffuse = dvec3(0);
  return m;
}

Material mirror(double reflectivity = 1) {
  Material m;
  m.reflectivity = reflectivity;
  return m;
}

Material glass(double ior) {
  Material m;
  m.transparency = 1.0;
  m.ior = ior;
  return m;
}

/// 160 x 160 pixels of 8 um; all pixels gather all samples.
Stage bench(Bounces bounces) {
  Stage stage;
  stage.scene.hologram = {{160, 160}, {8e-6, 8e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 25e-6;
  stage.scene.trace.bounces = bounces;
  return stage;
}

/// Keeps only what is seen in mirrors and through glass.
void darken_direct(Rig& rig) {
  auto samples = rig.table.samples.read();
  for (auto& s : samples) {
    if (s.path < 0) s.radiance = 0;
  }
  rig.table.samples.write(samples);
}

/// A dark sheet beside the scene, seen edge-on: scenes of the same depth have the same lattice.
Surface sheet_aside() { return rectangle({1.5e-3, 0, 20e-3}, {0, 0, 3e-3}, {0, 0.1e-3, 0}); }

Material dark() {
  Material m;
  m.ambient = m.diffuse = dvec3(0);
  return m;
}

/// The hologram of a rig of Method::points.
std::vector<std::complex<float>> all_points(const raywave::cl::Device& device, const Rig& rig) {
  raywave::cl::ComplexBuffer field(
      device, static_cast<std::size_t>(rig.plan.size.x * rig.plan.size.y), "field");
  Gatherer gatherer(device, rig.plan, rig.arrays, rig.table, 1);
  gatherer.draw_phases(1);
  gatherer.gather(rig.plan.wrps[0], field);
  return field.read();
}

double energy(const std::vector<std::complex<float>>& field) {
  double sum = 0;
  for (const auto& v : field) sum += std::norm(Complex(v));
  return sum;
}

/// |<a, b>| / (|a| |b|)
double correlation(const std::vector<std::complex<float>>& a,
                   const std::vector<std::complex<float>>& b) {
  Complex sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::conj(Complex(a[i])) * Complex(b[i]);
  return std::abs(sum) / std::sqrt(energy(a) * energy(b));
}

/// A cap of a sphere towards the hologram, `half` wide, of squares `step` wide.
Surface cap(dvec3 centre, double radius, dvec2 middle, double half, double step) {
  const int count = static_cast<int>(std::ceil(2 * half / step));
  const auto place = [&](double s, double t) {
    const auto off = middle + (dvec2(s, t) * 2.0 - 1.0) * half;
    return centre + dvec3(off, -std::sqrt(radius * radius - glm::dot(off, off)));
  };
  auto surface = grid(count, count, place);
  for (const auto& p : surface.positions)
    surface.normals.push_back(glm::vec3(glm::normalize(p - centre)));
  return surface;
}

/// Relative L2 error of a hologram of path samples at some pixels, against solved paths.
struct PathErrors {
  double field = 0, point_field = 0;  // of the fitted paths, and of virtual points alone
  int samples = 0, unsolved = 0;
};

PathErrors errors_of(const Rig& rig, const std::vector<std::complex<float>>& field,
                     const std::vector<reference::PerfectSurface>& surfaces) {
  PathErrors errors;
  const auto paths = rig.table.paths.read();
  const auto& plan = rig.plan;
  Random random(5);
  double wrong = 0, all = 0;
  std::vector<dvec2> places;
  std::vector<std::size_t> pixels;
  for (int i = 0; i < 40; ++i) {
    const int column = static_cast<int>(uniform(random, 0, plan.size.x - 0.01)),
              row = static_cast<int>(uniform(random, 0, plan.size.y - 0.01));
    pixels.push_back(static_cast<std::size_t>(row * plan.size.x + column));
    places.push_back(dvec2(column - (plan.size.x - 1) / 2.0, (plan.size.y - 1) / 2.0 - row) *
                     plan.pitch_m);
  }
  std::vector<Complex> truth(places.size());
  for (const auto& s : rig.samples) {
    if (s.path < 0) continue;
    ++errors.samples;
    const auto v = place(s) + plan.origin_m;
    const auto& path = paths[static_cast<std::size_t>(s.path)];
    const auto source = dvec3(path.source[0], path.source[1], path.source[2]) + plan.origin_m;
    const auto face = normal(s);
    const auto chief = reference::solve_path(surfaces, dvec2(0), source, dvec2(v) / v.z);
    if (!chief) {
      ++errors.unsolved;
      continue;
    }
    const auto light = [&](const reference::SolvedPath& p) {
      return p.share * std::pow(1 + glm::dot(p.tangents, p.tangents), -1.5) / p.spread_m2 *
             -glm::dot(face, p.arrival);
    };
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto solved =
          reference::solve_path(surfaces, places[i], source, (dvec2(v) - places[i]) / v.z);
      if (!solved) {
        ++errors.unsolved;
        continue;
      }
      const double amplitude =
          std::sqrt(s.radiance * light(*solved) / light(*chief)) * s.weight / glm::length(v);
      const double turns =
          (solved->optical_m - chief->optical_m + glm::length(v)) / plan.wavelength_m +
          reference::phase_turns_of_key(s.key, 1);
      truth[i] += std::polar(amplitude, 2 * std::numbers::pi * std::remainder(turns, 1));
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    wrong += std::norm(truth[i] - Complex(field[pixels[i]]));
    all += std::norm(truth[i]);
  }
  errors.field = std::sqrt(wrong / all);
  return errors;
}

}  // namespace

TEST_CASE("a plane mirror shows samples where the mirrored scene has them, in the same light") {
  // The mirror z = 20 mm + x / 2 sends rays of the hologram back to a card in front of it, which
  // faces it: its mirror image is a card behind the mirror.
  const dvec3 middle(0, 0, 20e-3), n = glm::normalize(dvec3(0.5, 0, -1));
  const auto mirrored = [&](dvec3 p) { return p - 2 * glm::dot(p - middle, n) * n; };
  const auto image = grid(1, 1, [&](double s, double t) {
    return dvec3(0.5e-3 * (s - 0.5), 0.5e-3 * (t - 0.5), 21e-3 + 0.1e-3 * s);
  });
  auto card = image;
  for (auto& p : card.positions) p = mirrored(p);
  auto with_mirror = bench(Bounces::points), direct = bench(Bounces::points);
  with_mirror.scene.sampling.antialias = direct.scene.sampling.antialias = 4;
  Light lamp;
  lamp.type = LightType::point;
  lamp.position_m = mirrored({0.2e-3, 0.1e-3, 20.2e-3});
  Material matt;
  matt.ambient = dvec3(0.2);
  with_mirror.scene.lights = {lamp};
  lamp.position_m = {0.2e-3, 0.1e-3, 20.2e-3};
  direct.scene.lights = {lamp};
  with_mirror
      .add(grid(2, 2,
                [&](double s, double t) {
                  return middle + dvec3(2e-3 * (s - 0.5), 1.6e-3 * (t - 0.5), 1e-3 * (s - 0.5));
                }),
           mirror())
      .add(card, matt)
      .add(sheet_aside(), dark());
  direct.add(image, matt).add(sheet_aside(), dark());
  for (const auto& device : all_devices()) {
    const Rig seen(device, with_mirror, Method::points), truth(device, direct, Method::points);
    std::vector<device::Sample> in_mirror, behind;
    for (const auto& s : seen.samples) {
      if (s.path >= 0) in_mirror.push_back(s);
    }
    for (const auto& s : truth.samples) {
      if (truth.object_of(s) == 0) behind.push_back(s);
    }
    REQUIRE(in_mirror.size() > 300);
    REQUIRE(in_mirror.size() == behind.size());
    double off = 0, light = 0, tilt = 0;
    int partly = 0;
    for (std::size_t i = 0; i < behind.size(); ++i) {
      const auto &a = in_mirror[i], &b = behind[i];
      off = std::max(off,
                     glm::length(place(a) + seen.plan.origin_m - place(b) - truth.plan.origin_m));
      light = std::max(light, std::abs(a.radiance / b.radiance - 1.0));
      tilt = std::max({tilt, std::abs(a.tilt_x - b.tilt_x + 0.0),
                       std::abs(a.tilt_y - b.tilt_y + 0.0), std::abs(a.tilt_z - b.tilt_z + 0.0)});
      partly += b.hidden;
    }
    CAPTURE(off, light, tilt, partly);
    CHECK(off < 100e-9);
    CHECK(light < 5e-3);
    CHECK(tilt < 1e-3);
  }
}

TEST_CASE("the wave of a plane mirror is that of the mirrored scene") {
  const dvec3 middle(0, 0, 20e-3), n = glm::normalize(dvec3(0.5, 0, -1));
  const auto image = rectangle({0, 0, 21e-3}, {0.25e-3, 0, 0.05e-3}, {0, 0.25e-3, 0});
  auto card = image;
  for (auto& p : card.positions) p -= 2 * glm::dot(p - middle, n) * n;
  auto with_mirror = bench(Bounces::points), direct = bench(Bounces::points);
  with_mirror.scene.sampling.antialias = direct.scene.sampling.antialias = 4;
  with_mirror.add(rectangle(middle, {1e-3, 0, 0.5e-3}, {0, 0.8e-3, 0}), mirror())
      .add(card, glowing())
      .add(sheet_aside(), dark());
  direct.add(image, glowing()).add(sheet_aside(), dark());
  for (const auto& device : all_devices()) {
    Rig seen(device, with_mirror, Method::points, false);
    const Rig truth(device, direct, Method::points, false);
    darken_direct(seen);
    const auto a = all_points(device, seen), b = all_points(device, truth);
    const double ratio = energy(a) / energy(b);
    CAPTURE(correlation(a, b), ratio);
    CHECK(correlation(a, b) > 0.99);
    CHECK(ratio == Catch::Approx(1).margin(0.02));
  }
}

TEST_CASE("fitted paths over a convex mirror, a slab and glass balls are those that are solved") {
  struct Case {
    const char* name;
    double most;
    Stage stage;
    std::vector<reference::PerfectSurface> surfaces;
  };
  std::vector<Case> cases;
  const double mm = 1e-3;
  const auto stage_of = [&] {
    auto stage = bench(Bounces::paths);
    stage.scene.hologram = {{384, 384}, {3.74e-6, 3.74e-6}, 638e-9};
    stage.scene.sampling.visibility = 0;
    return stage;
  };
  {
    // A mirror of radius 2 mm; what it shows lies in front of it, beside the hologram's axis
    Case c{"convex mirror", 0.01, stage_of(), {}};
    const dvec3 centre(0, 0, 22 * mm);
    c.stage.add(cap(centre, 2 * mm, {0.4 * mm, 0}, 0.5 * mm, 0.02 * mm), mirror())
        .add(rectangle({2.5 * mm, 0, 16 * mm}, {mm, 0, 0}, {0, mm, 0}), glowing());
    c.surfaces = {{.centre = centre, .radius = 2 * mm}};
    cases.push_back(std::move(c));
  }
  {
    Case c{"slab", 0.01, stage_of(), {}};
    const dvec3 tilted(0.36, 0, -1);
    auto slab = box({0, 0, 0}, {2 * mm, 1.5 * mm, 1 * mm / std::sqrt(1 + 0.36 * 0.36)});
    // Turned so that its faces have the normal `tilted`
    const auto z = -glm::normalize(tilted), y = dvec3(0, 1, 0), x = glm::cross(y, z);
    for (auto& p : slab.positions) p = dvec3(0, 0, 15 * mm) + p.x * x + p.y * y + p.z * z;
    slab.normals.clear();
    c.stage.add(slab, glass(1.5))
        .add(rectangle({0.2 * mm, 0, 19 * mm}, {0.115 * mm, 0, 0}, {0, 0.115 * mm, 0}), glowing());
    c.surfaces = {{.centre = dvec3(0, 0, 15 * mm) - z * mm / std::sqrt(1 + 0.36 * 0.36),
                   .normal = tilted,
                   .beyond = 1.5},
                  {.centre = dvec3(0, 0, 15 * mm) + z * mm / std::sqrt(1 + 0.36 * 0.36),
                   .normal = tilted,
                   .beyond = 1}};
    cases.push_back(std::move(c));
  }
  for (const double radius : {1 * mm, 2 * mm}) {
    Case c{radius < 1.5 * mm ? "ball of 1 mm" : "ball of 2 mm", 0.05, stage_of(), {}};
    const dvec3 centre(0, 0, 17 * mm);
    c.stage.add(sphere(centre, radius, 160), glass(1.5))
        .add(rectangle(centre + dvec3(0, 0, 3 * radius), {0.115 * mm, 0, 0}, {0, 0.115 * mm, 0}),
             glowing());
    c.surfaces = {{.centre = centre, .radius = radius, .beyond = 1.5},
                  {.centre = centre, .radius = -radius, .beyond = 1}};
    cases.push_back(std::move(c));
  }
  for (auto& c : cases) {
    CAPTURE(c.name);
    c.stage.scene.trace.depth = static_cast<int>(c.surfaces.size());
    for (const auto& device : all_devices()) {
      Rig rig(device, c.stage, Method::points, false);
      darken_direct(rig);
      const auto errors = errors_of(rig, all_points(device, rig), c.surfaces);
      CAPTURE(errors.field, errors.samples, errors.unsolved);
      CHECK(errors.samples > 50);
      CHECK(errors.unsolved == 0);
      CHECK(errors.field < c.most);
    }
  }
}
