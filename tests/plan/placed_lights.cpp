// SPDX-License-Identifier: Apache-2.0
// Lights with a size as sets of places and directions, and spots, against closed forms.
#include "host/plan/placed_lights.hpp"

#include <numbers>

#include "host/reference/looks.hpp"
#include "tests/support/catch.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

Light light_of(LightType type, int samples) {
  return Light{.type = type, .intensity = 3, .samples = samples};
}

/// Radiance of a matt surface of diffuse 1 by lights, from all places of those that have a size.
double shown(const std::vector<PlacedLight>& lights, glm::dvec3 place_m, glm::dvec3 normal) {
  double sum = 0;
  for (const auto& light : lights)
    for (int which = 0; which < places_of_light; ++which) {
      const auto seen = reference::seen_light(light, place_m, which);
      sum += seen.intensity * std::max(0.0, glm::dot(normal, seen.direction)) / places_of_light;
    }
  return sum;
}

/// A picture whose texels are f(direction).
template <class F>
Image sky_of(int width, int height, F f) {
  Image image{width, height, {}};
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i)
      image.pixels.push_back(static_cast<float>(
          f(direction_of_environment({(i + 0.5) / width, (j + 0.5) / height}, 0))));
  return image;
}

TEST_CASE("places in the parts of a square fill it evenly, each in a row and a column of its own") {
  for (const int count : {1, 2, 6, 7, 16, 60}) {
    std::set<double> columns, rows;
    glm::dvec2 sum(0), squares(0);
    for (int part = 0; part < count; ++part) {
      for (int place = 0; place < places_of_light; ++place) {
        const auto at = place_in_square(part, count, place);
        CHECK((at.x > 0 && at.x < 1 && at.y > 0 && at.y < 1));
        columns.insert(at.x);
        rows.insert(at.y);
        sum += at;
        squares += at * at;
      }
    }
    const double all = count * places_of_light;
    CHECK(columns.size() == static_cast<std::size_t>(all));
    CHECK(rows.size() == static_cast<std::size_t>(all));
    CHECK(glm::distance(sum / all, glm::dvec2(0.5)) < 1e-9);
    CHECK(glm::distance(squares / all, glm::dvec2(1.0 / 3)) < 1 / all);
  }
}

TEST_CASE("an area light is as bright as a point light, evenly over its rectangle or disc") {
  auto panel = light_of(LightType::area, 12);
  panel.position_m = {0.1, 0.2, 0.3};
  panel.edges_m = {glm::dvec3(0.2, 0, 0.1), glm::dvec3(0, 0.3, 0)};
  auto disc = light_of(LightType::area, 16);
  disc.position_m = {0.1, 0.2, 0.3};
  disc.direction = {1, 2, -2};
  disc.radius_m = 0.25;
  for (const auto& light : {panel, disc}) {
    const auto placed = placed_light(light, nullptr);
    REQUIRE(placed.size() == static_cast<std::size_t>(light.samples));
    double intensity = 0;
    glm::dvec3 middle(0);
    double squares = 0, number = 0;
    for (const auto& one : placed) {
      intensity += one.intensity;
      REQUIRE(one.places.size() == std::size_t{places_of_light});
      for (const auto& at : one.places) {
        const auto off = at - light.position_m;
        middle += off;
        ++number;
        if (light.radius_m > 0) {
          CHECK(glm::length(off) <= light.radius_m);
          CHECK(std::abs(glm::dot(off, light.direction)) < 1e-12);
          squares += glm::dot(off, off);
        } else {
          const double u =
              glm::dot(off, light.edges_m[0]) / glm::dot(light.edges_m[0], light.edges_m[0]);
          CHECK(std::abs(u) < 0.5);
          squares += u * u;
        }
      }
    }
    CHECK(intensity == Catch::Approx(3));
    CHECK(glm::length(middle / number) < 2e-3);
    CHECK(squares / number ==
          Catch::Approx(light.radius_m > 0 ? light.radius_m * light.radius_m / 2 : 1.0 / 12)
              .epsilon(0.01));
  }
}

TEST_CASE("an even environment of radiance L lights a matt surface to its diffuse share of L") {
  const auto sky = sky_of(32, 16, [](glm::dvec3) { return 0.7; });
  CHECK(mean_radiance(sky) == Catch::Approx(0.7));
  for (const int samples : {16, 64, 256}) {
    const auto lights = placed_light(light_of(LightType::environment, samples), &sky);
    for (const auto& normal : {glm::dvec3(0, 1, 0), glm::dvec3(0, 0, -1), glm::dvec3(0.6, 0, 0.8),
                               glm::normalize(glm::dvec3(1, -2, 3))})
      CHECK(shown(lights, glm::dvec3(0), normal) == Catch::Approx(3 * 0.7).epsilon(0.3 / samples));
  }
}

TEST_CASE("a sky that brightens upwards lights surfaces as its integral says") {
  // L = 1 + y: a surface with the normal n shows 1 + 2/3 n.y
  const auto sky = sky_of(256, 128, [](glm::dvec3 d) { return 1 + d.y; });
  const auto lights = placed_light(light_of(LightType::environment, 64), &sky);
  for (const auto& normal : {glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0), glm::dvec3(1, 0, 0),
                             glm::normalize(glm::dvec3(0.3, 0.5, -0.8))})
    CHECK(shown(lights, glm::dvec3(0), normal) ==
          Catch::Approx(3 * (1 + 2.0 / 3 * normal.y)).epsilon(0.01));
}

TEST_CASE("an environment in colour lights in the colours of its directions") {
  // Red L = 1 + y, green 0.5, blue 1 - y: a surface with the normal n shows 1 + 2/3 n.y of red
  const int width = 256, height = 128;
  auto sky = sky_of(width, height, [](glm::dvec3 d) { return 1 + d.y; });
  const auto green = sky_of(width, height, [](glm::dvec3) { return 0.5; }),
             blue = sky_of(width, height, [](glm::dvec3 d) { return 1 - d.y; });
  sky.channels = 3;
  for (const auto* more : {&green, &blue})
    sky.pixels.insert(sky.pixels.end(), more->pixels.begin(), more->pixels.end());
  CHECK(mean_radiance(sky) == Catch::Approx(0.2126 + 0.7152 * 0.5 + 0.0722).epsilon(1e-3));
  for (const int samples : {1, 7, 64, 256}) {
    const auto lights = placed_light(light_of(LightType::environment, samples), &sky);
    glm::dvec3 all(0);
    for (const auto& light : lights) all += light.intensity * light.colour;
    // Radiance over all directions, over pi
    CHECK(all.x == Catch::Approx(3 * 4.0).epsilon(1e-4));
    CHECK(all.y == Catch::Approx(3 * 2.0).epsilon(1e-4));
    CHECK(all.z == Catch::Approx(3 * 4.0).epsilon(1e-4));
    if (samples < 64) continue;
    for (const auto& normal : {glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0), glm::dvec3(1, 0, 0),
                               glm::normalize(glm::dvec3(0.3, 0.5, -0.8))}) {
      for (int k = 0; k < 3; ++k) {
        auto of_colour = lights;
        for (auto& light : of_colour) light.intensity *= light.colour[k];
        const double slope = k == 0 ? 2.0 / 3 : k == 1 ? 0 : -2.0 / 3;
        CHECK(shown(of_colour, glm::dvec3(0), normal) ==
              Catch::Approx(3 * (k == 1 ? 0.5 : 1 + slope * normal.y)).epsilon(0.05));
      }
    }
  }
}

TEST_CASE("a hot pixel of an environment is a directional light, and turns with the picture") {
  Image sky{16, 8, std::vector<float>(128, 0.0f)};
  sky.pixels[std::size_t{2} * 16 + 11] = 1000;
  // Solid angle of a pixel in row 2
  const double angle = 2 * pi / 16 * (std::cos(pi * 2 / 8) - std::cos(pi * 3 / 8));
  for (const double rotation_deg : {0.0, 30.0, -120.0}) {
    auto light = light_of(LightType::environment, 9);
    light.rotation_deg = rotation_deg;
    const auto lights = placed_light(light, &sky);
    const auto towards = direction_of_environment({11.5 / 16, 2.5 / 8}, rotation_deg);
    // The picture's middle is +z, its right side the viewer's right, -x; it turns about y as
    // objects do
    const double azimuth = 2 * pi * (11.5 / 16 - 0.5) - rotation_deg * pi / 180,
                 height = pi / 2 - pi * 2.5 / 8;
    CHECK(glm::distance(towards, glm::dvec3(-std::sin(azimuth) * std::cos(height), std::sin(height),
                                            std::cos(azimuth) * std::cos(height))) < 1e-12);
    for (const auto& one : lights)
      for (const auto& at : one.places) CHECK(glm::dot(at, towards) > 0.95);  // within the pixel
    CHECK(shown(lights, glm::dvec3(0), towards) ==
          Catch::Approx(3 * 1000 * angle / pi).epsilon(0.03));
  }
}

TEST_CASE("a spot is full within its inner angle, dark beyond the outer one, smooth between") {
  auto spot = light_of(LightType::spot, 1);
  spot.position_m = {0, 0, 1};
  spot.direction = {0, 0, 2};
  spot.inner_deg = 10;
  spot.outer_deg = 30;
  spot.falls_off = true;
  const auto placed = placed_light(spot, nullptr);
  REQUIRE(placed.size() == 1);
  const auto intensity_at = [&](double angle_deg, double distance_m) {
    const double a = angle_deg * pi / 180;
    const auto seen = reference::seen_light(
        placed[0], glm::dvec3(0, 0, 1) + distance_m * glm::dvec3(std::sin(a), 0, std::cos(a)), 0);
    return seen.intensity;
  };
  CHECK(intensity_at(0, 1) == Catch::Approx(3));
  CHECK(intensity_at(9.9, 1) == Catch::Approx(3));
  CHECK(intensity_at(30.1, 1) == 0);
  CHECK(intensity_at(150, 1) == 0);
  CHECK(intensity_at(0, 2) == Catch::Approx(0.75));
  const double part = (std::cos(20 * pi / 180) - std::cos(30 * pi / 180)) /
                      (std::cos(10 * pi / 180) - std::cos(30 * pi / 180));
  CHECK(intensity_at(20, 1) == Catch::Approx(3 * part * part));
}

TEST_CASE("lights with highlights come first, else lights keep their order") {
  std::vector<Light> lights(4);
  for (std::size_t i = 0; i < 4; ++i) lights[i].intensity = static_cast<double>(i) + 1;
  lights[1].type = LightType::ambient;
  lights[0].highlights = false;
  const auto placed = placed_lights(lights, {});
  REQUIRE(placed.size() == 3);
  CHECK(placed[0].intensity == 3);
  CHECK(placed[1].intensity == 4);
  CHECK(placed[2].intensity == 1);
}

}  // namespace
}  // namespace raywave
