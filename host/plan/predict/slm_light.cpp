// SPDX-License-Identifier: Apache-2.0
#include "host/plan/predict/slm_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/geometry/extents.hpp"
#include "host/plan/predict/light_shown.hpp"

namespace raywave {
namespace {

constexpr double band_edge = 0.5;  // cycles per pixel

/// Cycles per pixel of light with this sine to the axis.
double cycles_per_sine(const Plan& plan, int axis) {
  return plan.pitch_m[axis] / plan.wavelength_m;
}

/// Frequency, in cycles per pixel, at place `to_m` of the SLM, of light from the place `from_m` in
/// the plane z_m.
double frequency(const Plan& plan, int axis, double from_m, double z_m, double to_m) {
  const double sine = (to_m - from_m) / std::copysign(std::hypot(to_m - from_m, z_m), z_m);
  return cycles_per_sine(plan, axis) *
         (sine - plan.slm.illumination.sine_at(glm::dvec2(to_m))[axis]);
}

/// Places of the SLM that light of this frequency reaches lie so far from where it starts.
double travel(const Plan& plan, int axis, double cycles, double z_m) {
  const double sine = std::clamp(cycles / cycles_per_sine(plan, axis), -1 + 1e-12, 1 - 1e-12);
  return z_m * sine / std::sqrt(1 - sine * sine);
}

/// Calls `use` with each part of the SLM's band that the stop passes along an axis. Frequencies
/// that lie a whole number apart are the same to pixels.
template <class Use>
void for_passed(const StopSpec& stop, int axis, const Use& use) {
  for (const int replica : {-1, 0, 1}) {
    const double low = std::max(stop.centre[axis] - stop.size[axis] / 2 + replica, -band_edge),
                 high = std::min(stop.centre[axis] + stop.size[axis] / 2 + replica, band_edge);
    if (low < high) use(low, high);
  }
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
  const bool on_both_sides = plan.near_m < 0 && plan.far_m > 0;
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
  light.z_m = plan.origin_m.z;
  light.zero_order_size_m = plan.window_m();
  const auto zero_order =
      -carrier_of(slm, plan.pitch_m, plan.wavelength_m) - own_carrier_of(slm.encoding);
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
          cycles[axis].add(
              std::clamp(frequency(plan, axis, place_m[axis], z_m, edge_m), -band_edge, band_edge));
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

void require_light_through_stop(const Plan& plan, const World& world) {
  if (!plan.slm.stop || plan.bounces > 0) return;  // mirrors show what is not in the box
  const auto half_m = plan.window_m() / 2.0;
  for (int axis = 0; axis < 2; ++axis) {
    Interval cycles;
    for (const double from_m : {world.min_m[axis], world.max_m[axis]})
      for (const double z_m : {plan.near_m, plan.far_m})
        for (const double to_m : {-half_m[axis], half_m[axis]})
          cycles.add(frequency(plan, axis, from_m, z_m, to_m));
    cycles = {std::max(cycles.low, -band_edge), std::min(cycles.high, band_edge)};
    if (cycles.low > cycles.high) continue;  // too steep for the pixels: the hologram is dark
    bool has_light = false;
    for_passed(*plan.slm.stop, axis, [&](double low, double high) {
      has_light = has_light || (low <= cycles.high && high >= cycles.low);
    });
    if (has_light) continue;
    const auto text = [](double value) { return number_text(std::round(value * 1000) / 1000); };
    auto centre = plan.slm.stop->centre;
    centre[axis] = std::round(cycles.middle() * 1000) / 1000;
    throw InputError(
        one_line(plan.scene_name) + ": slm.stop passes none of the scene's light: of " +
        (axis == 0 ? "x" : "y") + " it passes " +
        text(plan.slm.stop->centre[axis] - plan.slm.stop->size[axis] / 2) + " to " +
        text(plan.slm.stop->centre[axis] + plan.slm.stop->size[axis] / 2) +
        " cycles per pixel, and the light has " + text(cycles.low) + " to " + text(cycles.high) +
        "; give slm.stop_centre = [" + text(centre.x) + ", " + text(centre.y) + "]");
  }
}

}  // namespace raywave
