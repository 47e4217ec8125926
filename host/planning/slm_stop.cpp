// SPDX-License-Identifier: Apache-2.0
#include "host/planning/slm_stop.hpp"

#include <cmath>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/geometry/extents.hpp"

namespace raywave {

double cycles_per_sine(const Plan& plan, int axis) {
  return plan.hologram.pitch_m[axis] / plan.hologram.wavelength_m;
}

double frequency_at(const Plan& plan, int axis, double from_m, double z_m, double to_m) {
  const double sine = (to_m - from_m) / std::copysign(std::hypot(to_m - from_m, z_m), z_m);
  return cycles_per_sine(plan, axis) *
         (sine - plan.slm.illumination.sine_at(glm::dvec2(to_m))[axis]);
}

void require_light_through_stop(const Plan& plan, const World& world) {
  if (!plan.slm.stop || plan.specular.bounces > 0) return;  // mirrors show what is not in the box
  const auto half_m = plan.window_m() / 2.0;
  for (int axis = 0; axis < 2; ++axis) {
    Interval cycles;
    for (const double from_m : {world.min_m[axis], world.max_m[axis]})
      for (const double z_m : {plan.extent.near_m, plan.extent.far_m})
        for (const double to_m : {-half_m[axis], half_m[axis]})
          cycles.add(frequency_at(plan, axis, from_m, z_m, to_m));
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
