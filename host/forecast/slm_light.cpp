// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/slm_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/geometry/extents.hpp"
#include "host/planning/light_shown.hpp"

namespace raywave {
namespace {

/// Places of the SLM that light of this frequency reaches lie so far from where it starts.
double travel(const Plan& plan, int axis, double cycles, double z_m) {
  const double sine = std::clamp(cycles / cycles_per_sine(plan, axis), -1 + 1e-12, 1 - 1e-12);
  return z_m * sine / std::sqrt(1 - sine * sine);
}

/// Share, along one axis, of the SLM that the point at x_m in the plane z_m lights with frequencies
/// that the stop passes.
double share_through(const Plan& plan, const StopSpec& stop, int axis, double x_m, double z_m) {
  const double half_m = plan.window_m()[axis] / 2;
  double lit_m = 0;
  for_passed(stop, axis, [&](double low, double high) {
    const auto [first_m, last_m] =
        std::minmax({x_m + travel(plan, axis, low, z_m), x_m + travel(plan, axis, high, z_m)});
    lit_m += std::max(0.0, std::min(half_m, last_m) - std::max(-half_m, first_m));
  });
  return lit_m / (2 * half_m);
}

bool passes(const StopSpec& stop, glm::dvec2 cycles) {
  const auto away = [&](int axis) {
    const double a = cycles[axis] - stop.centre[axis];
    return std::abs(a - std::round(a));
  };
  return away(0) <= stop.size.x / 2 && away(1) <= stop.size.y / 2;
}

/// The shortest slm.shift, along one axis, that moves a picture of this extent beside a zero order
/// of the SLM's own size, at the depth |z_m|: planes before the hologram move the other way. Zero
/// where the band has no room for it, and for scenes on both sides of the hologram.
glm::dvec2 shift_beside(const Plan& plan, const std::array<Interval, 2>& picture_m,
                        const std::array<Interval, 2>& cycles, double z_m) {
  glm::dvec2 best_m(0);
  const bool on_both_sides = plan.extent.near_m < 0 && plan.extent.far_m > 0;
  for (int axis = 0; axis < 2 && !on_both_sides; ++axis) {
    const double half_m = plan.window_m()[axis] / 2;
    for (const double touching_m : {half_m - picture_m[axis].low, -half_m - picture_m[axis].high}) {
      const double shift_m = std::copysign(1.05, z_m) * touching_m;
      const double carrier = -cycles_per_sine(plan, axis) * shift_m / std::hypot(shift_m, z_m);
      const bool has_room =
          cycles[axis].low + carrier >= -band_edge && cycles[axis].high + carrier <= band_edge;
      const double best = std::abs(best_m.x + best_m.y);  // one of them is zero
      if (has_room && (best == 0 || std::abs(shift_m) < best)) {
        best_m = {0, 0};
        best_m[axis] = shift_m;
      }
    }
  }
  return best_m;
}

}  // namespace

SlmLight slm_light(const Plan& plan, const FrontView& view) {
  const auto& slm = plan.slm;
  const auto half_m = plan.window_m() / 2.0;
  SlmLight light;
  light.z_m = plan.extent.origin_m.z;
  light.zero_order_size_m = plan.window_m();
  const auto zero_order = -carrier_of(slm, plan.hologram.pitch_m, plan.hologram.wavelength_m) -
                          own_carrier_of(slm.encoding);
  for (int axis = 0; axis < 2; ++axis)
    light.zero_order_m[axis] = 0.0 - travel(plan, axis, zero_order[axis], light.z_m);
  light.zero_order_stopped = slm.stop && !passes(*slm.stop, zero_order);

  double all = 0, shown = 0, through = 0, under_zero_order = 0;
  std::array<Interval, 2> picture_m, cycles;
  for (int y = 0; y < view.size.y; ++y) {
    for (int x = 0; x < view.size.x; ++x) {
      const auto cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) +
                        static_cast<std::size_t>(x);
      const double z_m = view.depth_m[cell], here = view.radiance[cell];
      if (z_m == 0) continue;
      const auto place_m = view.place_m(x, y, z_m);
      double shown_here = here, through_here = here;
      bool is_under = true;
      for (int axis = 0; axis < 2; ++axis) {
        shown_here *= share_within_pixels(plan, axis, place_m[axis], z_m);
        if (slm.stop) through_here *= share_through(plan, *slm.stop, axis, place_m[axis], z_m);
        is_under = is_under && std::abs(place_m[axis] + travel(plan, axis, zero_order[axis], z_m)) <
                                   half_m[axis];
        picture_m[axis].add(place_m[axis]);
        for (const double edge_m : {-half_m[axis], half_m[axis]})
          cycles[axis].add(std::clamp(frequency_at(plan, axis, place_m[axis], z_m, edge_m),
                                      -band_edge, band_edge));
      }
      all += here;
      shown += shown_here;
      through += through_here;
      if (is_under) under_zero_order += here;
    }
  }
  if (all > 0) light.on_picture = under_zero_order / all;
  if (slm.stop && shown > 0) {
    light.through_stop = std::min(1.0, through / shown);
    for (int axis = 0; axis < 2; ++axis)
      light.open_stop[axis] =
          std::min(1.0, 2 * std::max(cycles[axis].high - slm.stop->centre[axis],
                                     slm.stop->centre[axis] - cycles[axis].low));
  }
  if (all > 0) light.beside_m = shift_beside(plan, picture_m, cycles, light.z_m);
  return light;
}

}  // namespace raywave
