// SPDX-License-Identifier: Apache-2.0
#include "host/refine/sample_picture.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>

#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
using refinement::Optics;
using refinement::PictureGrid;
using std::numbers::pi;

/// Samples that shine equally on all parts of the hologram, or on those that `sees` names.
std::shared_ptr<SampleLight> light_at(const std::vector<glm::dvec3>& places, glm::dvec2 half_m,
                                      const auto& sees) {
  auto light = std::make_shared<SampleLight>();
  light->parts = 8;
  light->half_m = half_m;
  for (std::size_t s = 0; s < places.size(); ++s) {
    light->at_m.emplace_back(places[s]);
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i) light->irradiance.push_back(sees(s, i, j) ? 1.0f : 0.0f);
  }
  return light;
}

PictureGrid grid_of(const Optics& optics, const std::shared_ptr<SampleLight>& light, double z_m,
                    glm::dvec2 view, glm::dvec2 aperture) {
  refinement::Key key{z_m, view, aperture};
  key.samples = light;
  key.sample_window_m = {3 * mm, 3 * mm};
  return picture_grid(optics, key, refinement::Propagation::fresnel);
}

/// Intensity of one sample's wave on the grid's plane, by direct sums in double.
std::vector<double> intensity_of(const Optics& optics, const PictureGrid& grid, glm::dvec3 at,
                                 const auto& sees) {
  const auto n = grid.size;
  const auto place = [&](int i, int axis) {
    return (grid.open.first[axis] + i - (optics.size[axis] - 1) / 2.0) * optics.pitch_m[axis];
  };
  std::vector<std::complex<double>> h;
  for (int y = 0; y < grid.open.size.y; ++y) {
    for (int x = 0; x < grid.open.size.x; ++x) {
      const double u = place(x, 0), v = -place(y, 1);
      const double path =
          glm::length(at - glm::dvec3(u, v, 0)) - (u * u + v * v) / (2 * grid.z_m) - at.z;
      h.push_back(sees(u, v) ? std::polar(1.0, 2 * pi * path / optics.wavelength_m) : 0.0);
    }
  }
  std::vector<std::complex<double>> rows(static_cast<std::size_t>(n.x) * grid.open.size.y);
  const double rate = 2 * pi / (optics.wavelength_m * grid.z_m);
  for (int p = 0; p < n.x; ++p) {
    for (int x = 0; x < grid.open.size.x; ++x) {
      const auto turn = std::polar(1.0, rate * place(x, 0) * grid.x_m(p));
      for (int y = 0; y < grid.open.size.y; ++y)
        rows[static_cast<std::size_t>(y) * n.x + p] +=
            turn * h[static_cast<std::size_t>(y) * grid.open.size.x + x];
    }
  }
  std::vector<double> result(static_cast<std::size_t>(n.x) * n.y);
  for (int q = 0; q < n.y; ++q) {
    std::vector<std::complex<double>> line(static_cast<std::size_t>(n.x));
    for (int y = 0; y < grid.open.size.y; ++y) {
      const auto turn = std::polar(1.0, rate * -place(y, 1) * grid.y_m(q));
      for (int p = 0; p < n.x; ++p)
        line[static_cast<std::size_t>(p)] += turn * rows[static_cast<std::size_t>(y) * n.x + p];
    }
    for (int p = 0; p < n.x; ++p)
      result[static_cast<std::size_t>(q) * n.x + p] = std::norm(line[static_cast<std::size_t>(p)]);
  }
  return result;
}

/// Blurred by the grid's weights, in the region.
std::vector<double> blurred(const PictureGrid& grid, const auto& value_at) {
  std::vector<double> result;
  for (int y = 0; y < grid.region_size.y; ++y) {
    for (int x = 0; x < grid.region_size.x; ++x) {
      double sum = 0;
      for (int j = -grid.radius_y(); j <= grid.radius_y(); ++j)
        for (int i = -grid.radius_x(); i <= grid.radius_x(); ++i)
          sum += static_cast<double>(grid.weights_x[std::abs(i)]) *
                 static_cast<double>(grid.weights_y[std::abs(j)]) * value_at(x + i, y + j);
      result.push_back(sum);
    }
  }
  return result;
}

double relative_error(const std::vector<double>& a, const std::vector<double>& b) {
  double difference = 0, all = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference += (a[i] - b[i]) * (a[i] - b[i]);
    all += b[i] * b[i];
  }
  return std::sqrt(difference / all);
}

TEST_CASE("a picture made of samples is the sum of the intensities of their waves, blurred") {
  const Optics optics{{96, 80}, {8 * um, 8 * um}, 638e-9, 60 * um, 1};
  const auto half = glm::dvec2(optics.size) * optics.pitch_m / 2.0;
  // In focus, before and behind it, beside the axis, hidden from the left half and from the top
  const std::vector<glm::dvec3> places{
      {0, 0, 20 * mm}, {0.5 * mm, 0.3 * mm, 17 * mm}, {-0.6 * mm, -0.4 * mm, 25 * mm}};
  const auto sees = [](std::size_t s, int i, int j) {
    return s == 0 || (s == 1 && i >= 4) || (s == 2 && j < 4);
  };
  const auto light = light_at(places, half, sees);
  const std::pair<glm::dvec2, glm::dvec2> openings[] = {
      {{0, 0}, {1, 1}}, {{-0.5, 0.5}, {0.5, 0.5}}, {{0, 0}, {0.5, 1}}};
  for (const auto& [view, aperture] : openings) {
    const auto grid = grid_of(optics, light, 20 * mm, view, aperture);
    const auto picture = sample_picture(optics, grid, *light);
    std::vector<double> intensity(static_cast<std::size_t>(grid.size.x) * grid.size.y);
    for (std::size_t s = 0; s < places.size(); ++s) {
      const auto one = intensity_of(optics, grid, places[s], [&](double u, double v) {
        const auto part = [&](double at, double side) {
          return std::clamp(static_cast<int>((at / side + 1) * 4), 0, 7);
        };
        return sees(s, part(u, half.x), part(v, half.y));
      });
      for (std::size_t i = 0; i < one.size(); ++i) intensity[i] += one[i] * grid.unit;
    }
    const auto wide = grid.wide_size();
    const auto expected = blurred(grid, [&](int x, int y) {
      const int at_x = x + grid.region_first.x, at_y = y + grid.region_first.y;
      const bool inside = at_x >= 0 && at_x < grid.size.x && at_y >= 0 && at_y < grid.size.y;
      return inside ? intensity[static_cast<std::size_t>(at_y) * grid.size.x + at_x] : 0.0;
    });
    const auto found = blurred(grid, [&](int x, int y) {
      return static_cast<double>(
          picture[static_cast<std::size_t>(y + grid.radius_y()) * wide.x + x + grid.margin_x()]);
    });
    CAPTURE(view.x, aperture.x, relative_error(found, expected));
    CHECK(relative_error(found, expected) <= 0.08);  // geometry against diffraction at edges
    double sum = 0, all = 0;
    for (std::size_t i = 0; i < found.size(); ++i) sum += found[i], all += expected[i];
    CHECK(sum == Catch::Approx(all).epsilon(0.02));
  }
}

}  // namespace
}  // namespace raywave
