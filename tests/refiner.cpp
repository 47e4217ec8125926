// SPDX-License-Identifier: Apache-2.0
#include "host/refiner.hpp"

#include <cmath>
#include <numbers>

#include "host/reference/propagation.hpp"
#include "host/render.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"

namespace raywave {
namespace {

using Complex = std::complex<double>;
using reference::relative_error;
using reference::to_double;

/// A WRP off the axis, 60 mm before a hologram of 61 x 400 pixels.
Plan small_plan() {
  Plan plan;
  plan.size = plan.tile_size = {61, 400};
  plan.pitch_m = {4e-6, 4e-6};
  plan.wavelength_m = 638e-9;
  plan.slabs = {{.distance_m = 60e-3}};
  plan.fan = 1.2;
  plan.tile_fan = glm::dvec2(1.2);
  plan.wrps = {{{0.2e-3, -0.7e-3, 60e-3}, {}, {0, 0}, 0}};
  return plan;
}

/// Spherical waves that converge to places in the hologram's window and its cone's edge, as they cross the WRP at (x, y).
Complex converging(const Plan& plan, double x_m, double y_m) {
  Complex sum = 0;
  for (int i = 0; i < 9; ++i) {
    const double to_m = (i / 4.0 - 1) * plan.fan * plan.size.y * plan.pitch_m.y / 2;
    const double turns = -std::hypot(x_m - 0.1e-3 * i, y_m - to_m, plan.slabs[0].distance_m) / plan.wavelength_m;
    sum += std::polar(1.0, 2 * std::numbers::pi * (turns - std::round(turns) + 0.37 * i * i));
  }
  return sum;
}

std::vector<std::complex<float>> sampled(const Plan& plan, int rows, double pitch_m) {
  std::vector<std::complex<float>> field;
  const auto centre = plan.wrps[0].centre_m;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < plan.size.x; ++column)
      field.emplace_back(
          converging(plan, centre.x + (column - (plan.size.x - 1) / 2.0) * plan.pitch_m.x, centre.y - (row - (rows - 1) / 2.0) * pitch_m));
  }
  return field;
}

std::vector<std::complex<float>> refined(const cl::Device& device, const Plan& plan, const std::vector<std::complex<float>>& stack,
                                         int frame) {
  const cl::ComplexBuffer coarse(device, stack, "gathered");
  cl::ComplexBuffer fine(device, std::vector<std::complex<float>>(static_cast<std::size_t>(plan.size.x * plan.size.y), {7, 7}), "refined");
  Refiner(device).refine(plan, plan.wrps[0], coarse, frame, fine);
  return fine.read();
}

TEST_CASE("rows of converging waves are made from fewer ones to a part in a thousand, of every frame") {
  auto plan = small_plan();
  const auto wanted = to_double(sampled(plan, plan.size.y, plan.pitch_m.y));
  for (const double oversampling : {1.2, 1.5, 2.0, 3.0}) {
    plan.slabs[0].rows = rows_for_band(plan, plan.slabs[0], oversampling);
    CAPTURE(oversampling, plan.slabs[0].rows.count);
    CHECK(plan.slabs[0].rows.count < 0.8 * plan.size.y);
    auto stack = std::vector<std::complex<float>>(static_cast<std::size_t>(plan.size.x * plan.slabs[0].rows.count), {NAN, NAN});
    const auto field = sampled(plan, plan.slabs[0].rows.count, plan.slabs[0].rows.pitch_m);
    stack.insert(stack.end(), field.begin(), field.end());
    for (const auto& device : test::all_devices()) {
      const double error = relative_error(to_double(refined(device, plan, stack, 1)), wanted);
      INFO(device.info().name << ": error " << error);
      CHECK(error < 1.5e-3);
    }
  }
}

TEST_CASE("rows are as many as the light's band needs, and all of the hologram's where that saves little") {
  auto plan = small_plan();
  // Half the cone's height over wavelength and distance, twice, and 14 rows for the sums.
  const double half_band = 1.2 * 0.8e-3 / (638e-9 * 60e-3), height = 399 * 4e-6;
  plan.wrps[0].centre_m = {0, 0, 60e-3};
  CHECK(std::abs(rows_for_band(plan, plan.slabs[0], 1.5).count - (height * 2 * half_band * 1.5 + 15)) < 3);
  CHECK(rows_for_band(plan, plan.slabs[0], 100).half_taps == 0);
  CHECK(rows_for_band(plan, plan.slabs[0], 100).count == 400);
  CHECK(rows_for_band(plan, plan.slabs[0], 100).pitch_m == 4e-6);
  plan.slabs[0].distance_m = plan.wrps[0].centre_m.z = 10e-3;  // its cone fills the pixels' band
  CHECK(rows_for_band(plan, plan.slabs[0], 1.5).half_taps == 0);
}

TEST_CASE("what fewer rows cost the hologram is predicted within a factor of 2") {
  for (const char* distance : {"17.55 mm", "18.6 mm", "15.55 mm", "['17.55 mm', '19.2 mm']"}) {
    const std::vector<std::string> common{"sampling.frames=2", "hologram.resolution=[400, 200]", "wrp.grid=[2, 1]", "wrp.padding=1.5",
                                          std::string("wrp.distance=") + distance};
    const auto scene_with = [&](const char* oversampling) {
      auto set = common;
      set.push_back(std::string("wrp.oversampling=") + oversampling);
      return load_scene(RAYWAVE_DATA_DIR "/study.toml", set);
    };
    for (const auto& device : test::all_devices()) {
      const auto wanted = render(device, scene_with("full"));
      REQUIRE_FALSE(wanted.plan.slabs[0].refines());
      for (const char* oversampling : {"1.25", "1.5", "2"}) {
        const auto got = render(device, scene_with(oversampling));
        REQUIRE(got.plan.slabs[0].refines());
        const double error = relative_error(to_double(got.field.samples), to_double(wanted.field.samples));
        INFO(device.info().name << ", WRPs at " << distance << ", oversampling " << oversampling << ", " << got.plan.slabs[0].rows.count
                                << " rows: error " << error << ", predicted " << got.plan.rows_error);
        CHECK(got.plan.rows_error >= error / 2);
        CHECK(got.plan.rows_error <= 2 * error);
      }
    }
  }
}

}  // namespace
}  // namespace raywave
