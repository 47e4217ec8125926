// SPDX-License-Identifier: Apache-2.0
#include "host/trace/interpolator.hpp"

#include <cmath>
#include <numbers>

#include "host/plan/interpolation.hpp"
#include "host/reference/propagation.hpp"
#include "host/render.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"

namespace raywave {
namespace {

using Complex = std::complex<double>;
using reference::relative_error;
using reference::to_double;

/// A WRP off the axis, 60 mm before a hologram.
Plan small_plan(glm::ivec2 size) {
  Plan plan;
  plan.size = plan.tile_size = size;
  plan.pitch_m = {4e-6, 4e-6};
  plan.wavelength_m = 638e-9;
  plan.layers = {{.distance_m = 60e-3}};
  plan.cone_half_width = 1.2;
  plan.tile_cone = glm::dvec2(1.2);
  plan.wrps = {{{0.2e-3, -0.7e-3, 60e-3}, {}, {0, 0}, 0}};
  return plan;
}

WrpAxis every(const Plan& plan, int axis) { return {plan.size[axis], plan.pitch_m[axis], 0}; }

/// Spherical waves that converge to places in the hologram's window and its cone's edge, as they
/// cross the WRP at (x, y).
Complex converging(const Plan& plan, double x_m, double y_m) {
  const auto reach = plan.cone_half_width * plan.window_m() / 2.0;
  Complex sum = 0;
  for (int i = 0; i < 9; ++i) {
    const double to_x_m = (i * 2 % 9 / 4.0 - 1) * reach.x, to_y_m = (i / 4.0 - 1) * reach.y;
    const double turns =
        -std::hypot(x_m - to_x_m, y_m - to_y_m, plan.layers[0].distance_m) / plan.wavelength_m;
    sum += std::polar(1.0, 2 * std::numbers::pi * (turns - std::round(turns) + 0.37 * i * i));
  }
  return sum;
}

std::vector<std::complex<float>> sampled(const Plan& plan, const WrpAxes& axes) {
  std::vector<std::complex<float>> field;
  const auto centre = plan.wrps[0].centre_m;
  const auto away_m = [&](int axis, int i) {
    const auto& a = axes[static_cast<std::size_t>(axis)];
    return (i - (a.count - 1) / 2.0) * a.pitch_m;
  };
  for (int row = 0; row < axes[1].count; ++row) {
    for (int column = 0; column < axes[0].count; ++column)
      field.emplace_back(converging(plan, centre.x + away_m(0, column), centre.y - away_m(1, row)));
  }
  return field;
}

std::vector<std::complex<float>> interpolated(const cl::Device& device, const Plan& plan,
                                              const std::vector<std::complex<float>>& stack,
                                              int frame) {
  const cl::ComplexBuffer coarse(device, stack, "gathered");
  cl::ComplexBuffer fine(
      device,
      std::vector<std::complex<float>>(static_cast<std::size_t>(plan.size.x * plan.size.y), {7, 7}),
      "interpolated");
  Interpolator(device).interpolate(plan, plan.wrps[0], coarse, frame, fine);
  return fine.read();
}

TEST_CASE(
    "converging waves are made from fewer columns, rows or both to a part in a thousand, in every "
    "frame") {
  // Of 9 columns or rows more are needed for the sums than are saved.
  for (const glm::ivec2 size : {glm::ivec2(9, 400), {403, 9}, {403, 300}}) {
    auto plan = small_plan(size);
    const auto wanted = to_double(sampled(plan, {every(plan, 0), every(plan, 1)}));
    for (const double oversampling : {1.2, 1.5, 2.0, 3.0}) {
      const auto axes = plan.layers[0].axes = axes_for_band(plan, plan.layers[0], oversampling);
      CAPTURE(size.x, size.y, oversampling, axes[0].count, axes[1].count);
      CHECK(axes[0].interpolates() == (size.x > 9));
      CHECK(axes[1].interpolates() == (size.y > 9));
      auto stack = std::vector<std::complex<float>>(plan.gathered_pixels(), {NAN, NAN});
      const auto field = sampled(plan, axes);
      stack.insert(stack.end(), field.begin(), field.end());
      for (const auto& found : test::all_devices()) {
        // As GPUs, one sample per work-item
        for (const int lanes : {found.info().float_lanes, 1}) {
          auto info = found.info();
          info.float_lanes = lanes;
          const double error =
              relative_error(to_double(interpolated(cl::Device(info), plan, stack, 1)), wanted);
          INFO(info.name << ", " << lanes << " lanes: error " << error);
          CHECK(error < 1.5e-3);
        }
      }
    }
  }
}

TEST_CASE(
    "columns and rows are as many as the light's band needs, and all of the hologram's where that "
    "saves little") {
  auto plan = small_plan({300, 400});
  plan.wrps[0].centre_m = {0, 0, 60e-3};
  const auto axes = [&](double oversampling) {
    return axes_for_band(plan, plan.layers[0], oversampling);
  };
  for (const int axis : {0, 1}) {
    CAPTURE(axis);
    // Half the cone over wavelength and distance, twice, and 14 for the sums.
    const double half_band = 1.2 * plan.window_m()[axis] / 2 / (638e-9 * 60e-3),
                 length = (plan.size[axis] - 1) * 4e-6;
    const auto at = static_cast<std::size_t>(axis);
    CHECK(std::abs(axes(1.5)[at].count - (length * 2 * half_band * 1.5 + 15)) < 3);
    CHECK_FALSE(axes(100)[at].interpolates());
    CHECK(axes(100)[at].count == plan.size[axis]);
    CHECK(axes(100)[at].pitch_m == 4e-6);
  }
  // A cone that fills the pixels' band along the long side alone, and along both.
  plan.layers[0].distance_m = plan.wrps[0].centre_m.z = 15e-3;
  plan.size = plan.tile_size = {100, 400};
  CHECK(axes(1.5)[0].interpolates());
  CHECK_FALSE(axes(1.5)[1].interpolates());
  plan.size = plan.tile_size = {400, 100};
  CHECK_FALSE(axes(1.5)[0].interpolates());
  CHECK(axes(1.5)[1].interpolates());
  plan.size = plan.tile_size = {400, 400};
  CHECK_FALSE(axes(1.5)[0].interpolates());
  CHECK_FALSE(axes(1.5)[1].interpolates());
}

TEST_CASE("what fewer columns and rows cost the hologram is predicted within a factor of 2") {
  struct Case {
    const char *resolution, *grid, *distance;
    bool columns, rows;  // fewer at oversampling 1.5
  };
  for (const Case& c : {Case{"[400, 200]", "[2, 1]", "17.55 mm", false, true},
                        {"[400, 200]", "[2, 1]", "18.6 mm", false, true},
                        {"[400, 200]", "[2, 1]", "15.55 mm", false, true},
                        {"[400, 200]", "[2, 1]", "['17.55 mm', '19.2 mm']", false, true},
                        {"[200, 400]", "[1, 2]", "18.6 mm", true, false},
                        {"[200, 200]", "[2, 2]", "17.55 mm", true, true}}) {
    const auto scene_with = [&](const char* oversampling) {
      return load_scene(
          RAYWAVE_DATA_DIR "/study.toml",
          {"sampling.frames=2", "wrp.padding=1.5",
           std::string("hologram.resolution=") + c.resolution, std::string("wrp.grid=") + c.grid,
           std::string("wrp.distance=") + c.distance,
           std::string("wrp.oversampling=") + oversampling});
    };
    for (const auto& device : test::all_devices()) {
      const auto wanted = render(device, scene_with("full"));
      REQUIRE_FALSE(wanted.plan.layers[0].interpolates());
      for (const char* oversampling : {"1.25", "1.5", "2"}) {
        const auto got = render(device, scene_with(oversampling));
        const auto size = got.plan.gathered_size(got.plan.layers[0]);
        const double error =
            relative_error(to_double(got.field.samples), to_double(wanted.field.samples));
        INFO(device.info().name << ", " << c.resolution << ", WRPs at " << c.distance
                                << ", oversampling " << oversampling << ", " << size.x << " x "
                                << size.y << " pixels: error " << error << ", predicted "
                                << got.plan.oversampling_error);
        if (oversampling == std::string("1.5")) {
          CHECK(got.plan.layers[0].axes[0].interpolates() == c.columns);
          CHECK(got.plan.layers[0].axes[1].interpolates() == c.rows);
        }
        CHECK(got.plan.oversampling_error >= error / 2);
        CHECK(got.plan.oversampling_error <= 2 * error);
      }
    }
  }
}

}  // namespace
}  // namespace raywave
