// SPDX-License-Identifier: Apache-2.0
#include "host/encode/encode.hpp"

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>

#include "host/view/reconstruct.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"

namespace raywave {
namespace {

using Field = std::vector<std::complex<float>>;
using std::numbers::pi;

std::vector<int> levels_of(const cl::Device& device, const Field& field) {
  const auto levels = PhaseEncoder(device)(cl::ComplexBuffer(device, field, "field"));
  return {levels.begin(), levels.end()};
}

TEST_CASE("all 256 levels come back from the field they show") {
  Image picture{256, 1, {}};
  std::vector<int> levels;
  for (int level = 0; level < 256; ++level) {
    picture.pixels.push_back(static_cast<float>(level) / 255);
    levels.push_back(level);
  }
  for (const auto& device : test::all_devices())
    CHECK(levels_of(device, field_of_levels(picture).samples) == levels);
}

TEST_CASE(
    "phases round to the nearest level, amplitude does not matter, and just below a full turn is "
    "level 0") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> turns_of(0, 1), exponent(-30, 30);
  Field field;
  std::vector<int> expected;
  while (field.size() < 10007) {
    const double turns = turns_of(random);
    if (std::abs(turns * 256 - std::floor(turns * 256) - 0.5) < 1e-3) continue;  // a tie in float
    field.emplace_back(std::polar(std::pow(10, exponent(random)), 2 * pi * turns));
    expected.push_back(static_cast<int>(std::lround(turns * 256)) % 256);
  }
  field.emplace_back(1.0f, -1e-6f);
  expected.push_back(0);
  for (const auto& device : test::all_devices()) CHECK(levels_of(device, field) == expected);
}

TEST_CASE("zero and values that are not finite get level 0") {
  const float inf = std::numeric_limits<float>::infinity(),
              nan = std::numeric_limits<float>::quiet_NaN();
  const Field field{{0, 0}, {-0.0f, -0.0f}, {nan, 1}, {1, nan}, {inf, inf}, {-1, inf}, {nan, nan}};
  for (const auto& device : test::all_devices())
    CHECK(levels_of(device, field) == std::vector<int>(field.size()));
}

TEST_CASE("every length is encoded to its last sample, in packets of any width") {
  for (const auto& found : test::all_devices()) {
    auto info = found.info();
    for (const int lanes : {1, 4, 8, 16}) {
      info.float_lanes = lanes;
      const cl::Device device(info);
      for (const std::size_t size : {1, 2, 7, 15, 16, 17, 63, 64, 65, 1025})
        CHECK(levels_of(device, Field(size, {0, 2})) == std::vector<int>(size, 64));
    }
  }
}

}  // namespace
}  // namespace raywave
