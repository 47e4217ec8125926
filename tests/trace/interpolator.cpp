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

/// A WRP off the axis, 60 mm from a hologram.
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

/// Spherical waves that converge to points in the window of the hologram and at the rim of the
/// cone: their sum at (x, y) on the WRP.
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

/// The converging waves on all columns of these rows.
std::vector<std::complex<float>> sampled(const Plan& plan, const GatheredRows& rows) {
  std::vector<std::complex<float>> field;
  const auto centre = plan.wrps[0].centre_m;
  const auto away_m = [](int i, int count, double pitch_m) {
    return (i - (count - 1) / 2.0) * pitch_m;
  };
  for (int row = 0; row < rows.count; ++row) {
    for (int column = 0; column < plan.size.x; ++column)
      field.emplace_back(converging(plan, centre.x + away_m(column, plan.size.x, plan.pitch_m.x),
                                    centre.y - away_m(row, rows.count, rows.pitch_m)));
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
    "converging waves are interpolated from fewer rows within 1e-3, in every frame and for planes "
    "of any width") {
  for (const glm::ivec2 size : {glm::ivec2(9, 400), {403, 300}}) {
    auto plan = small_plan(size);
    const auto wanted = to_double(sampled(plan, {size.y, plan.pitch_m.y, 0}));
    for (const double oversampling : {1.2, 1.5, 2.0, 3.0}) {
      const auto rows = plan.layers[0].rows = rows_for_band(plan, plan.layers[0], oversampling);
      CAPTURE(size.x, size.y, oversampling, rows.count);
      CHECK(plan.layers[0].interpolates());
      auto stack = std::vector<std::complex<float>>(plan.gathered_pixels(), {NAN, NAN});
      const auto field = sampled(plan, rows);
      stack.insert(stack.end(), field.begin(), field.end());
      for (const auto& found : test::all_devices()) {
        // One lane: one sample per work-item, as on GPUs
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
    "the number of rows follows the band of the light, and all rows are kept when few are saved") {
  auto plan = small_plan({300, 400});
  plan.wrps[0].centre_m = {0, 0, 60e-3};
  const auto rows = [&](double oversampling) {
    return rows_for_band(plan, plan.layers[0], oversampling);
  };
  // The number of rows is the WRP's height times the band of the cone, oversampled, and margin rows
  // for the taps.
  const double half_band = 1.2 * plan.window_m().y / 2 / (638e-9 * 60e-3),
               length = (plan.size.y - 1) * 4e-6;
  CHECK(std::abs(rows(1.5).count - (length * 2 * half_band * 1.5 + 15)) < 3);
  CHECK(rows(100).half_taps == 0);
  CHECK(rows(100).count == plan.size.y);
  CHECK(rows(100).pitch_m == 4e-6);
  // Near the hologram, a hologram with few rows needs fewer rows than it has; one with many rows
  // needs all of them.
  plan.layers[0].distance_m = plan.wrps[0].centre_m.z = 15e-3;
  plan.size = plan.tile_size = {100, 400};
  CHECK(rows(1.5).half_taps == 0);
  plan.size = plan.tile_size = {400, 100};
  CHECK(rows(1.5).half_taps > 0);
}

TEST_CASE("the error due to fewer rows is predicted within a factor of 2", "[slow]") {
  struct Case {
    const char *resolution, *grid, *distance;
  };
  for (const Case& c : {Case{"[400, 200]", "[2, 1]", "17.55 mm"},
                        {"[400, 200]", "[2, 1]", "18.6 mm"},
                        {"[400, 200]", "[2, 1]", "15.55 mm"},
                        {"[400, 200]", "[2, 1]", "['17.55 mm', '19.2 mm']"},
                        {"[200, 200]", "[2, 2]", "17.55 mm"}}) {
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
        if (oversampling == std::string("1.5")) CHECK(got.plan.layers[0].interpolates());
        CHECK(got.plan.oversampling_error >= error / 2);
        CHECK(got.plan.oversampling_error <= 2 * error);
      }
    }
  }
}

}  // namespace
}  // namespace raywave
