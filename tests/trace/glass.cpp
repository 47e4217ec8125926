// SPDX-License-Identifier: Apache-2.0
/// Light through glass as samples (kernels/samples/paths.cl).
#include "host/reference/specular.hpp"
#include "tests/trace/bench.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec2;
using glm::dvec3;

namespace {

/// A slab of glass across the axis, 2 mm thick, from z = 14 mm on, and a card behind it.
Stage slab_and_card(const Material& material) {
  auto stage = bench(Bounces::points);
  stage.scene.sampling.visibility = 0;
  stage.add(box({0, 0, 15e-3}, {2e-3, 1.5e-3, 1e-3}), material)
      .add(rectangle({0, 0, 19e-3}, {0.3e-3, 0, 0}, {0, 0.3e-3, 0}), glowing());
  return stage;
}

/// Share of light that a surface between air and glass lets through, after Fresnel.
double let_through(double cosine, double ior) {
  const double in = std::acos(cosine), out = std::asin(std::sin(in) / ior);
  const double s = (std::cos(in) - ior * std::cos(out)) / (std::cos(in) + ior * std::cos(out)),
               p = (ior * std::cos(in) - std::cos(out)) / (ior * std::cos(in) + std::cos(out));
  return 1 - (s * s + p * p) / 2;
}

/// Two panes, a wedge of 0.3 rad between them, before a card.
struct Prism {
  Stage stage;
  std::vector<reference::PerfectSurface> surfaces;
};

Prism prism(double ior) {
  Prism p;
  p.stage = bench(Bounces::points);
  p.stage.scene.sampling.visibility = 0;
  Material m = glass(1);
  // Between 450 and 650 nm
  m.ior.table = {{450e-9, 1.53}, {650e-9, 1.51}};
  const auto front = [&](double x) { return 15 * mm - 0.15 * x; };
  const auto back = [&](double x) { return 16 * mm + 0.15 * x; };
  auto wedge = box({0, 0, 15.5 * mm}, {2 * mm, 2 * mm, 0.5 * mm});
  for (auto& place : wedge.positions)
    place.z = place.z < 15.5 * mm ? front(place.x) : back(place.x);
  wedge.normals.clear();
  p.stage.add(wedge, m).add(rectangle({-0.2 * mm, 0, 20 * mm}, {1.5 * mm, 0, 0}, {0, 0.3 * mm, 0}),
                            glowing());
  p.surfaces = {{.centre = {0, 0, front(0)}, .normal = {-0.15, 0, -1}, .beyond = ior},
                {.centre = {0, 0, back(0)}, .normal = {0.15, 0, -1}, .beyond = 1}};
  return p;
}

/// Radiance of what a rig's samples show, on the mean over a raster of the hologram's places, in
/// rings of a plane: 1 for a card of radiance 1 that is seen directly. A sample's light leaves a
/// place along the gradient of its wave's phase.
std::vector<double> rings(const Rig& rig, double plane_m, const std::vector<double>& edges_m) {
  const auto paths = rig.table.paths.read();
  const auto& plan = rig.plan;
  const int parts = rig.table.visibility_parts;
  const auto half_m = plan.window_m() / 2.0 * std::max(1.0, plan.cone.half_width);
  std::vector<double> light(edges_m.size() - 1);
  for (std::size_t i = 0; i < rig.samples.size(); ++i) {
    const auto& s = rig.samples[i];
    if (s.path < 0) continue;
    const auto v = place(s) + plan.extent.origin_m;
    const auto& r = paths[s.path].rest;
    const auto& a = paths[s.path].amplitude;
    for (int part = 0; part < parts * parts; ++part) {
      if (!rig.sees(i, part % parts, part / parts)) continue;
      const auto w = (dvec2(part % parts, part / parts) + 0.5) / (parts / 2.0) - 1.0;
      const auto way = v - dvec3(w * half_m, 0);
      const double length = glm::length(way);
      // Terms x^i y^j by total degree from 2 on, and by falling i
      dvec2 slope(0);
      for (int degree = 2, term = 0; degree <= 5; ++degree)
        for (int j = 0; j <= degree; ++j, ++term)
          slope +=
              double{r[term]} *
              dvec2(
                  degree > j ? (degree - j) * std::pow(w.x, degree - j - 1) * std::pow(w.y, j) : 0,
                  j > 0 ? j * std::pow(w.x, degree - j) * std::pow(w.y, j - 1) : 0);
      const auto sines = dvec2(way) / length - slope / half_m;
      const auto at = w * half_m + plane_m * sines / std::sqrt(1 - glm::dot(sines, sines));
      const auto amplitude = (a[0] + a[1] * w.x + a[2] * w.y + a[3] * w.x * w.x + a[4] * w.x * w.y +
                              a[5] * w.y * w.y) *
                             s.weight / length;
      const double turned = -(s.tilt_x * way.x + s.tilt_y * way.y) / way.z - s.tilt_z;
      const auto ring =
          std::upper_bound(edges_m.begin(), edges_m.end(), glm::length(at)) - edges_m.begin();
      if (ring > 0 && ring < std::ssize(edges_m))
        light[static_cast<std::size_t>(ring - 1)] += s.radiance * amplitude * amplitude * turned;
    }
  }
  const double per_area =
      std::pow(plan.lattice.full_z_m * plan.lattice.step * plane_m / parts, 2) / std::numbers::pi;
  for (std::size_t i = 0; i < light.size(); ++i)
    light[i] *= per_area / (edges_m[i + 1] * edges_m[i + 1] - edges_m[i] * edges_m[i]);
  return light;
}

}  // namespace

DEVICE_TEST("a card behind a glass ball looks as bright as Fresnel says, near its focus too") {
  // Each of two surfaces lets 1 - ((n - 1) / (n + 1))^2 through; the focus is 0.565 mm behind
  const double through = std::pow(1 - std::pow(0.515 / 2.515, 2), 2);
  struct Case {
    double behind_m;
    int pixels;
    double most;              // relative error of a ring
    Bounces as;               // what "auto" takes
    bool folds, is_strained;  // what plans say of it
  };
  for (const auto& c : {Case{0.25 * mm, 192, 0.08, Bounces::paths, true, false},
                        Case{0.565 * mm, 192, 0.08, Bounces::paths, true, false},
                        Case{0.8 * mm, 192, 0.3, Bounces::paths, false, true},
                        Case{1.8 * mm, 384, 0.03, Bounces::paths, false, false},
                        Case{4 * mm, 192, 0.03, Bounces::points, false, false}}) {
    auto stage = bench(Bounces::automatic);
    stage.scene.hologram = {{c.pixels, c.pixels}, {3.74 * um, 3.74 * um}, 638e-9};
    stage.add(sphere({0, 0, 24 * mm}, 1.2 * mm, 120), glass(1.515))
        .add(rectangle({0, 0, 25.2 * mm + c.behind_m}, {2 * mm, 0, 0}, {0, 2 * mm, 0}), glowing());
    const auto worst = [&](const Rig& rig) {
      double error = 0;
      for (const double seen : rings(rig, 24 * mm, {0, 0.2 * mm, 0.4 * mm, 0.6 * mm}))
        error = std::max(error, std::abs(seen / through - 1));
      return error;
    };
    const Rig rig(device, stage, Method::points, false);
    stage.scene.trace.bounces = Bounces::points;
    const double wrong = worst(rig), of_points = worst(Rig(device, stage, Method::points, false));
    const auto& images = rig.plan.specular.images;
    CAPTURE(c.behind_m, c.pixels, wrong, of_points, images.points_error, images.paths_error,
            images.folded, images.folded_m);
    CHECK(rig.plan.specular.as == c.as);
    CHECK(wrong < c.most);
    CHECK((images.folded > 0.05) == c.folds);
    if (c.is_strained) CHECK(images.paths_error > 0.03);
    // Virtual points are farther off, and plans say by how much
    if (c.as == Bounces::paths) CHECK(of_points > std::max(1.3 * wrong, 0.03));
    CHECK(of_points < 3 * images.points_error);
  }
}

DEVICE_TEST("glass passes what Fresnel's formulas and its attenuation leave") {
  auto clear = glass(1.5), grey = glass(1.5);
  grey.attenuation = 0.5;
  grey.attenuation_distance_m = 2e-3;
  for (const auto& material : {clear, grey}) {
    const Rig rig(device, slab_and_card(material), Method::points, false);
    const double left = material.attenuation.at(638e-9);
    double off = 0, off_twice = 0;
    int once = 0, twice = 0;
    for (std::size_t cell = 0; cell < cells(rig); ++cell) {
      const auto t = tangents(rig, cell);
      // Rays that are as steep as those of the hologram's pixels or less
      const double cosine = 1 / std::sqrt(1 + glm::dot(t, t)),
                   inside = std::sqrt(1 - (1 - cosine * cosine) / (1.5 * 1.5)),
                   passes = let_through(cosine, 1.5), on_the_way = std::pow(left, 1 / inside);
      std::vector<double> seen;
      for (const auto& s : samples_of(rig, cell)) {
        if (s.path >= 0) seen.push_back(s.radiance);
      }
      if (seen.empty()) continue;
      std::sort(seen.rbegin(), seen.rend());
      off = std::max(off, std::abs(seen[0] / (passes * passes * on_the_way) - 1));
      ++once;
      const double reflected = std::pow((1 - passes) * on_the_way, 2) * seen[0];
      if (seen.size() < 2) continue;
      off_twice = std::max(off_twice, std::abs(seen[1] / reflected - 1));
      ++twice;
    }
    CAPTURE(left, once, twice, off, off_twice);
    CHECK(once > 300);
    CHECK(off < 1e-5);
    // A path that carries less than a thousandth of the light ends
    CHECK((left < 1 ? twice == 0 : twice > 200));
    CHECK(off_twice < 1e-4);
  }
}

DEVICE_TEST("a slab brings what lies behind it nearer by its thickness times 1 - 1/n") {
  const Rig rig(device, slab_and_card(glass(1.5)), Method::points, false);
  int count = 0;
  double off = 0;
  for (const auto& s : rig.samples) {
    const auto v = place(s) + rig.plan.extent.origin_m;
    const auto t = dvec2(v) / v.z;
    if (s.path < 0 || s.radiance < 0.5 || glm::length(t) > 4e-3) continue;
    ++count;
    off = std::max(off, std::abs(v.z - (19e-3 - 2e-3 * (1 - 1 / 1.5))));
  }
  CAPTURE(count, off);
  CHECK(count > 10);
  CHECK(off < 0.2e-6);  // the square of the angle times the thickness is left
}

DEVICE_TEST("a glass ball focuses as a thick lens does") {
  // f = n R / (2 (n - 1)) from the centre; a card at 4 R comes to 1 / (1 / f - 1 / 4 R) before it
  const double radius = 1e-3, ior = 1.5, f = ior * radius / (2 * (ior - 1)),
               image = 1 / (1 / f - 1 / (4 * radius));
  auto stage = bench(Bounces::points);
  stage.scene.sampling.visibility = 0;
  const dvec3 centre(0, 0, 17e-3);
  stage.add(sphere(centre, radius, 160), glass(ior))
      .add(rectangle(centre + dvec3(0, 0, 4 * radius), {0.1e-3, 0, 0}, {0, 0.1e-3, 0}), glowing());
  const Rig rig(device, stage, Method::points, false);
  int count = 0;
  double sum = 0;
  for (const auto& s : rig.samples) {
    const auto v = place(s) + rig.plan.extent.origin_m;
    if (s.path < 0 || s.radiance < 0.5 || glm::length(dvec2(v)) > 60e-6) continue;
    ++count;
    sum += v.z;
  }
  CAPTURE(count, sum / count, centre.z - image);
  CHECK(count > 8);
  // A depth of focus: wavelength over the square of the hologram's angle
  const double angle = 160 * 8e-6 / (centre.z - image);
  CHECK(std::abs(sum / count - (centre.z - image)) < 638e-9 / (angle * angle));
}

DEVICE_TEST("a prism turns light by the index of refraction that it has at the wavelength") {
  const double low = 1 / (450e-9 * 450e-9), high = 1 / (650e-9 * 650e-9);
  std::vector<double> turned;
  for (const double wavelength : {450e-9, 520e-9, 650e-9}) {
    // Cauchy's formula through both entries of the table
    const double b = (1.53 - 1.51) / (low - high),
                 ior = 1.51 + b * (1 / (wavelength * wavelength) - high);
    auto [stage, surfaces] = prism(ior);
    stage.scene.hologram.wavelength_m = wavelength;
    const Rig rig(device, stage, Method::points, false);
    const auto paths = rig.table.paths.read();
    double off = 0;
    int count = 0;
    for (const auto& s : rig.samples) {
      if (s.path < 0 || s.radiance < 0.5) continue;
      const auto v = place(s) + rig.plan.extent.origin_m;
      const auto& path = paths[s.path];
      const auto source = dvec3(path.source[0], path.source[1], path.source[2]);
      const auto solved = reference::solve_path(surfaces, dvec2(0),
                                                source + rig.plan.extent.origin_m, dvec2(v) / v.z);
      REQUIRE(solved);
      off = std::max(off, glm::length(solved->tangents - dvec2(v) / v.z));
      ++count;
    }
    CAPTURE(wavelength, off, count);
    CHECK(count > 200);
    CHECK(off < 1e-7);
  }
}
