// SPDX-License-Identifier: Apache-2.0
#include "host/refine/picture_grid.hpp"

#include "host/common/error.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/keys.hpp"
#include "tests/support/scenes.hpp"

namespace raywave::refinement {
namespace {

using std::numbers::pi;
using namespace test;

TEST_CASE("open parts are those that reconstruct lets through") {
  const auto open = open_part({8, 6}, {0, 0}, {1, 1});
  CHECK(open.first == glm::ivec2(0, 0));
  CHECK(open.size == glm::ivec2(8, 6));
  // Right and up: columns towards the end, rows towards the beginning
  const auto quarter = open_part({8, 6}, {0.5, 0.5}, {0.5, 0.5});
  CHECK(quarter.first == glm::ivec2(4, 0));
  CHECK(quarter.size == glm::ivec2(4, 3));
  CHECK(open_part({8, 6}, {3, 0}, {0.5, 0.5}).size.x == 0);
}

TEST_CASE("a spot becomes the closed form of its blur, from samples and from means of any size") {
  const Optics optics{{128, 96}, {3.74 * um, 3.74 * um}, 638e-9, 15 * um};
  constexpr double spot_m = 20 * um;
  const double wide_m = std::hypot(spot_m, optics.blur_m);
  const glm::dvec2 centre_m(31 * um, -18 * um);
  for (const bool area : {false, true}) {
    for (const double pixel_m : {3.74 * um, 7 * um, 10 * um}) {
      const int n = 2 * static_cast<int>(0.2 * mm / pixel_m);
      auto key = key_at(18 * mm, {0, 0}, {1, 1}, {n, n}, {pixel_m, pixel_m});
      key.area = area;
      // exp(-d^2 / (2 spot^2)) at the middle of a pixel, or its mean over it
      const auto value = [&](double d_m) {
        const auto below = [&](double x) { return std::erf(x / (spot_m * std::sqrt(2))); };
        return area ? (below(d_m + pixel_m / 2) - below(d_m - pixel_m / 2)) * spot_m *
                          std::sqrt(pi / 2) / pixel_m
                    : std::exp(-d_m * d_m / (2 * spot_m * spot_m));
      };
      for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
          const double right = (x - (n - 1) / 2.0) * pixel_m, up = ((n - 1) / 2.0 - y) * pixel_m;
          key.picture.pixels[static_cast<std::size_t>(y) * n + x] =
              static_cast<float>(value(right - centre_m.x) * value(up - centre_m.y));
        }
      }
      const auto grid = picture_grid(optics, key, Propagation::fresnel);
      const auto target = blurred_target(optics, key, grid);
      double worst = 0;
      int unknown = 0;
      for (int y = 0; y < grid.region_size.y; ++y) {
        for (int x = 0; x < grid.region_size.x; ++x) {
          const double got = target[static_cast<std::size_t>(y) * grid.region_size.x + x];
          unknown += got < 0;
          if (got < 0) continue;
          const glm::dvec2 d =
              glm::dvec2(grid.x_m(grid.region_first.x + x), grid.y_m(grid.region_first.y + y)) -
              centre_m;
          const double share = spot_m / wide_m;
          worst = std::max(worst, std::abs(got - share * share *
                                                     std::exp(-(d.x * d.x + d.y * d.y) /
                                                              (2 * wide_m * wide_m))));
        }
      }
      INFO("pixels of " << pixel_m << " m, " << (area ? "means" : "samples"));
      CHECK(unknown == (grid.region_size.x - grid.known_size.x) * grid.region_size.y);
      CHECK(worst <= 5e-4);  // the blur ends at 4 sigma
    }
  }
}

TEST_CASE("Fresnel holds for narrow scenes; wide ones are corrected, and near ones exact") {
  const Optics study{{384, 384}, {3.74 * um, 3.74 * um}, 638e-9, 15 * um},
      steep{{384, 384}, {0.5 * um, 0.5 * um}, 638e-9, 1 * um};
  const auto propagation = [](const Optics& optics, double z_m, double window_m) {
    return key_propagation(optics.size, optics.pitch_m, optics.wavelength_m, optics.blur_m, z_m,
                           glm::dvec2(window_m));
  };
  CHECK(propagation(study, 18.55 * mm, 1.436 * mm) == Propagation::fresnel);
  CHECK(propagation(study, 18.55 * mm, 4 * mm) == Propagation::corrected);  // light folds
  CHECK(propagation(steep, 0.2 * mm, 0.1 * mm) == Propagation::exact);      // wide angles, and near
  CHECK(propagation(study, 1 * mm, 1.436 * mm) == Propagation::exact);
}

TEST_CASE("impossible pictures are refused") {
  const Optics optics{{32, 32}, {4 * um, 4 * um}, 638e-9, 10 * um};
  const auto refused = [&](const Key& key) {
    CHECK_THROWS_AS(picture_grid(optics, key, Propagation::fresnel), InputError);
  };
  refused(key_at(0, {0, 0}, {1, 1}, {8, 8}, {4 * um, 4 * um}));
  refused(key_at(1 * mm, {5, 0}, {0.5, 0.5}, {8, 8}, {4 * um, 4 * um}));
  refused(key_at(1 * mm, {0, 0}, {1, 1}, {1, 1}, {1e-9, 1e-9}));
}

}  // namespace
}  // namespace raywave::refinement
