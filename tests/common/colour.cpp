// SPDX-License-Identifier: Apache-2.0
#include "host/common/colour.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <stdexcept>

#include "tests/support/catch.hpp"

using namespace raywave;

namespace {

const std::vector<double> usual{638e-9, 520e-9, 450e-9};

/// What the lasers mix for a colour has its XYZ, and is the sum of their own colours.
void check_mixes(const LaserSet& set, double tolerance) {
  for (const glm::dvec3 rgb : {glm::dvec3(1), glm::dvec3(0.2, 0.5, 0.1), glm::dvec3(0.9, 0, 0.3)}) {
    glm::dvec3 mixed(0), white(0), shown(0);
    for (std::size_t i = 0; i < set.count(); ++i) {
      const double light = glm::dot(set.from_rgb[i], rgb);
      const auto of_one = xyz_of_wavelength(set.wavelengths_m[i]) * set.white_powers[i];
      mixed += light * of_one;
      white += of_one;
      shown += light * set.rgb[i];
    }
    CHECK(glm::length(mixed / white.y - xyz_from_srgb() * rgb) < tolerance);
    CHECK(glm::length(shown - rgb) < tolerance);
  }
}

double apart(glm::dvec2 a, glm::dvec2 b) { return glm::length(a - b); }

}  // namespace

TEST_CASE("colours of single wavelengths are those of the table in steps of 1 nm") {
  // CIE 018:2019, the 1 nm table, at laser lines between its multiples of 5
  struct Row {
    double wavelength_nm;
    glm::dvec3 xyz;
  };
  const Row rows[] = {
      {452, {0.3300411, 0.041768, 1.764039}},  {463, {0.2689178, 0.06804208, 1.5960223}},
      {532, {0.18914, 0.8849624, 0.03693564}}, {561, {0.6112209, 0.9926005, 0.0036232}},
      {633, {0.5811052, 0.2353344, 3.572e-5}}, {638, {0.4847436, 0.1911552, 2.364e-5}},
      {642, {0.412098, 0.1596464, 1.62e-5}}};
  for (const auto& row : rows) {
    CAPTURE(row.wavelength_nm);
    const auto xyz = xyz_of_wavelength(row.wavelength_nm * 1e-9);
    CHECK(apart(chromaticity_of(xyz), chromaticity_of(row.xyz)) < 1e-4);
    CHECK(std::abs(xyz.y / row.xyz.y - 1) < 5e-4);
  }
  CHECK(glm::length(xyz_of_wavelength(555e-9) - glm::dvec3(0.5120501, 1, 0.005749999)) < 1e-9);
  CHECK(xyz_of_wavelength(380e-9).x == Catch::Approx(0.001368));
  CHECK(xyz_of_wavelength(780e-9).y == Catch::Approx(1.499e-5));
}

TEST_CASE("linear sRGB to XYZ is the matrix of IEC 61966-2-1") {
  const auto m = xyz_from_srgb();
  const double published[3][3] = {
      {0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      CHECK(std::abs(m[column][row] - published[row][column]) < 6e-5);
}

TEST_CASE("lasers mix D65 for white, and what they mix for a colour has its XYZ") {
  const auto set = laser_set(usual);
  // Cramer's rule on the 1 nm table
  CHECK(set.white_powers[0] == Catch::Approx(0.47887).margin(2e-4));
  CHECK(set.white_powers[1] == Catch::Approx(0.33073).margin(2e-4));
  CHECK(set.white_powers[2] == Catch::Approx(0.19040).margin(1e-4));
  CHECK(set.from_rgb[0].y == Catch::Approx(0.42).margin(0.005));  // green lights the red laser
  CHECK(glm::length(set.white() - glm::dvec3(1)) < 1e-12);
  check_mixes(set, 1e-12);
}

TEST_CASE("four and more lasers mix D65, and every colour, with no negative light within gamut") {
  for (const std::vector<double>& wavelengths_m :
       {std::vector{638e-9, 589e-9, 520e-9, 450e-9}, std::vector{638e-9, 532e-9, 520e-9, 450e-9},
        std::vector{660e-9, 635e-9, 561e-9, 520e-9, 488e-9, 445e-9},
        std::vector{660e-9, 638e-9, 589e-9, 561e-9, 532e-9, 520e-9, 488e-9, 450e-9}}) {
    CAPTURE(wavelengths_m);
    const auto set = laser_set(wavelengths_m);
    check_mixes(set, 1e-10);
    CHECK(*std::min_element(set.white_powers.begin(), set.white_powers.end()) > 0);
    for (const auto& row : set.from_rgb) {
      CHECK(row.x >= 0);
      CHECK(row.y >= 0);
      CHECK(row.z > -0.02);  // blue of sRGB is a little beyond what lasers at 445 to 450 nm mix
    }
    auto turned = wavelengths_m;
    std::rotate(turned.begin(), turned.begin() + 1, turned.end());
    const auto other = laser_set(turned);
    for (std::size_t i = 1; i < wavelengths_m.size(); ++i)
      CHECK(glm::length(other.from_rgb[i - 1] - set.from_rgb[i]) < 1e-10);
  }
}

TEST_CASE("two lasers show the nearest white and the nearest colours, as a search finds them") {
  for (const std::vector<double>& pair :
       {std::vector{638e-9, 520e-9}, std::vector{520e-9, 450e-9}, std::vector{589e-9, 473e-9}}) {
    CAPTURE(pair);
    const auto set = laser_set(pair);
    // The published matrix from XYZ to linear sRGB
    const glm::dmat3 from_xyz = glm::transpose(
        glm::dmat3(3.2406, -1.5372, -0.4986, -0.9689, 1.8758, 0.0415, 0.0557, -0.2040, 1.0570));
    const auto a = from_xyz * xyz_of_wavelength(pair[0]), b = from_xyz * xyz_of_wavelength(pair[1]);
    const auto searched = [&](glm::dvec3 wanted) {  // powers >= 0, by a grid that narrows
      glm::dvec2 best(2), half(2);
      for (int round = 0; round < 60; ++round, half *= 0.8) {
        const auto middle = best;
        double least = INFINITY;
        for (int y = -10; y <= 10; ++y)
          for (int x = -10; x <= 10; ++x) {
            const auto p = glm::max(middle + half * (glm::dvec2(x, y) / 10.0), 0.0);
            const double apart = glm::length(p.x * a + p.y * b - wanted);
            if (apart < least) least = apart, best = p;
          }
      }
      return best;
    };
    const auto white = searched(glm::dvec3(1));
    CHECK(set.white_powers[0] == Catch::Approx(white.x / (white.x + white.y)).margin(1e-3));
    CHECK(glm::length(set.white() - (white.x * a + white.y * b)) < 2e-3);
    for (const glm::dvec3 rgb :
         {glm::dvec3(1), {0.6, 0.7, 0.5}, {0.5, 0.4, 0.4}, {0.3, 0.4, 0.35}}) {
      const glm::dvec2 light(glm::dot(set.from_rgb[0], rgb), glm::dot(set.from_rgb[1], rgb));
      CAPTURE(rgb.x, rgb.y, rgb.z, light.x, light.y);
      REQUIRE(std::min(light.x, light.y) > 0);
      CHECK(glm::length(light * white - searched(rgb)) < 2e-3);
    }
  }
}

TEST_CASE("lasers of given powers, efficiencies and duties show D65 at the drive that is told") {
  const auto set = laser_set({638e-9, 520e-9, 450e-9});
  const LaserBench bench{{30, 12, 80}, {0.7, 0.6, 0.4}, {0.5, 0.25, 0.2}};
  const auto drive = drive_of(set, bench, set.white_powers);
  REQUIRE(drive.shares.size() == 3);
  CHECK(*std::max_element(drive.shares.begin(), drive.shares.end()) == Catch::Approx(1));
  glm::dvec3 white(0), full(0);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto xyz = bench.powers[i] * bench.efficiencies[i] * bench.duties[i] *
                     xyz_of_wavelength(set.wavelengths_m[i]);
    white += drive.shares[i] * xyz;
    full += xyz;
    CHECK(drive.powers[i] / drive.powers[0] ==
          Catch::Approx(drive.shares[i] * bench.powers[i] / (drive.shares[0] * bench.powers[0])));
  }
  CHECK(glm::length(chromaticity_of(white) - glm::dvec2(0.3127, 0.3290)) < 1e-4);
  CHECK(glm::length(chromaticity_of(xyz_from_srgb() * drive.full) - chromaticity_of(full)) < 1e-9);
  CHECK((xyz_from_srgb() * drive.full).y == Catch::Approx(1));
  CHECK(drive_of(set, {}, set.white_powers).shares.empty());
}

TEST_CASE("CIEDE2000 gives the differences of its authors' pairs") {
  // Sharma, Wu, Dalal, Color Res. Appl. 30, 21 (2005), Table 1
  struct Pair {
    glm::dvec3 a, b;
    double difference;
  };
  const Pair pairs[] = {{{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
                        {{50, 3.1571, -77.2803}, {50, 0, -82.7485}, 2.8615},
                        {{50, 2.8361, -74.0200}, {50, 0, -82.7485}, 3.4412},
                        {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
                        {{50, -1.1848, -84.8006}, {50, 0, -82.7485}, 1.0000},
                        {{50, -0.9009, -85.5211}, {50, 0, -82.7485}, 1.0000},
                        {{50, 0, 0}, {50, -1, 2}, 2.3669},
                        {{50, -1, 2}, {50, 0, 0}, 2.3669},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0009}, 7.1792},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0010}, 7.1792},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0011}, 7.2195},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0012}, 7.2195},
                        {{50, -0.0010, 2.4900}, {50, 0.0009, -2.4900}, 4.8045},
                        {{50, -0.0010, 2.4900}, {50, 0.0010, -2.4900}, 4.8045},
                        {{50, -0.0010, 2.4900}, {50, 0.0011, -2.4900}, 4.7461},
                        {{50, 2.5, 0}, {50, 0, -2.5}, 4.3065},
                        {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
                        {{50, 2.5, 0}, {61, -5, 29}, 22.8977},
                        {{50, 2.5, 0}, {56, -27, -3}, 31.9030},
                        {{50, 2.5, 0}, {58, 24, 15}, 19.4535},
                        {{50, 2.5, 0}, {50, 3.1736, 0.5854}, 1.0000},
                        {{50, 2.5, 0}, {50, 3.2972, 0}, 1.0000},
                        {{50, 2.5, 0}, {50, 1.8634, 0.5757}, 1.0000},
                        {{50, 2.5, 0}, {50, 3.2592, 0.3350}, 1.0000},
                        {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
                        {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
                        {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
                        {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
                        {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
                        {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
                        {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
                        {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
                        {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
                        {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082}};
  for (const auto& pair : pairs) {
    CAPTURE(pair.a.x, pair.a.y, pair.a.z, pair.b.y, pair.b.z);
    CHECK(std::abs(delta_e_2000(pair.a, pair.b) - pair.difference) < 5.1e-5);
    CHECK(std::abs(delta_e_2000(pair.b, pair.a) - pair.difference) < 5.1e-5);
  }
}

TEST_CASE("L*, a*, b* of white, of grey and of sRGB's red are those of the CIE's formulas") {
  const auto white = xyz_from_srgb() * glm::dvec3(1);
  CHECK(glm::length(lab_of(white, white) - glm::dvec3(100, 0, 0)) < 1e-12);
  CHECK(lab_of(0.18 * white, white).x == Catch::Approx(49.496).margin(1e-3));
  CHECK(lab_of(0.005 * white, white).x == Catch::Approx(0.005 * 903.296).margin(1e-3));
  const auto red = lab_of(xyz_from_srgb() * glm::dvec3(1, 0, 0), white);
  CHECK(glm::length(red - glm::dvec3(53.24, 80.09, 67.20)) < 0.02);
}

TEST_CASE("lasers that mix no white are refused") {
  CHECK_THROWS_AS(laser_set({638e-9, 650e-9, 690e-9}), std::invalid_argument);
  CHECK_THROWS_AS(laser_set({638e-9, 600e-9, 580e-9}), std::invalid_argument);
  CHECK_THROWS_AS(laser_set({450e-9, 470e-9, 490e-9}), std::invalid_argument);
  CHECK_THROWS_AS(laser_set({638e-9, 620e-9}), std::invalid_argument);
  CHECK_THROWS_AS(laser_set({700e-9, 638e-9, 600e-9, 580e-9}), std::invalid_argument);
}
