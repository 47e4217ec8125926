// SPDX-License-Identifier: Apache-2.0
#include "host/common/plane_fft.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "host/reference/propagation.hpp"
#include "tests/support/catch.hpp"

namespace raywave {
namespace {

TEST_CASE(
    "the wanted part of a plane is the direct sum over the live part, whatever is elsewhere") {
  struct Case {
    int nx, ny;
    PlanePart live, wanted;
    int row_stride = 0;
  };
  const Case cases[] = {{48, 30, {{0, 31}, {0, 19}}, {{16, 16}, {3, 20}}},
                        {48, 30, {{16, 16}, {3, 20}}, {{0, 31}, {0, 19}}},
                        {32, 42, {{5, 1}, {0, 42}}, {{0, 32}, {41, 1}}},
                        {48, 30, {{40, 30}, {29, 5}}, {{2, 40}, {28, 12}}},
                        {48, 60, {{3, 41}, {50, 60}}, {{44, 20}, {10, 9}}},
                        {16, 7, {{0, 16}, {0, 7}}, {{0, 16}, {0, 7}}},
                        {160, 150, {{0, 101}, {0, 99}}, {{30, 80}, {40, 61}}},
                        {48, 30, {{40, 30}, {29, 5}}, {{2, 40}, {28, 12}}, 53}};
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1, 1);
  for (const auto& c : cases) {
    const auto nx = static_cast<std::size_t>(c.nx), ny = static_cast<std::size_t>(c.ny);
    const std::size_t stride = c.row_stride > 0 ? static_cast<std::size_t>(c.row_stride) : nx;
    std::vector<std::complex<double>> plane(nx * ny);
    std::vector<std::complex<float>> start(stride * ny);
    for (std::size_t y = 0; y < ny; ++y) {
      for (std::size_t x = 0; x < nx; ++x) {
        const auto in = [](const LinePart& part, std::size_t i, std::size_t n) {
          return (i + n - part.first) % n < part.count;
        };
        start[y * stride + x] = {value(random), value(random)};
        if (in(c.live.x, x, nx) && in(c.live.y, y, ny)) plane[y * nx + x] = start[y * stride + x];
      }
    }
    double energy = 0;
    for (const auto& v : plane) energy += std::norm(v);
    const double rms = std::sqrt(energy);
    PlaneFft fft(nx, ny, stride);
    for (const int sign : {-1, 1}) {
      const auto expected = reference::direct_transform(plane, {c.nx, c.ny}, sign);
      auto got = start;
      sign < 0 ? fft.forward(got.data(), c.live, c.wanted)
               : fft.inverse(got.data(), c.live, c.wanted);
      double worst = 0;
      for (std::size_t y = c.wanted.y.first; y < c.wanted.y.first + c.wanted.y.count; ++y) {
        for (std::size_t x = c.wanted.x.first; x < c.wanted.x.first + c.wanted.x.count; ++x)
          worst = std::max(worst, std::abs(std::complex<double>(got[y % ny * stride + x % nx]) -
                                           expected[y % ny * nx + x % nx]));
      }
      INFO(c.nx << " x " << c.ny << ", sign " << sign);
      CHECK(worst <= 4 * 0x1p-24 * std::sqrt(1 + std::log2(nx * ny)) * rms);
    }
  }
}

}  // namespace
}  // namespace raywave
