// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/slm_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <glm/common.hpp>
#include <numbers>

#include "host/geometry/extents.hpp"
#include "host/plan/lattice.hpp"
#include "host/planning/light_shown.hpp"

namespace raywave {
namespace {

/// Places of the SLM that light of this frequency reaches lie so far from where it starts.
double travel(const Plan& plan, int axis, double cycles, double z_m) {
  const double sine = std::clamp(cycles / cycles_per_sine(plan, axis), -1 + 1e-12, 1 - 1e-12);
  return z_m * sine / std::sqrt(1 - sine * sine);
}

/// Share, along one axis, of the SLM that the point at x_m in the plane z_m lights with frequencies
/// from low to high.
double share_lit(const Plan& plan, int axis, double x_m, double z_m, double low, double high) {
  const double half_m = plan.window_m()[axis] / 2;
  const auto [first_m, last_m] =
      std::minmax({x_m + travel(plan, axis, low, z_m), x_m + travel(plan, axis, high, z_m)});
  return std::max(0.0, std::min(half_m, last_m) - std::max(-half_m, first_m)) / (2 * half_m);
}

/// The same of frequencies that the stop passes.
double share_through(const Plan& plan, const StopSpec& stop, int axis, double x_m, double z_m) {
  double lit = 0;
  for_passed(stop, axis,
             [&](double low, double high) { lit += share_lit(plan, axis, x_m, z_m, low, high); });
  return lit;
}

bool passes(const StopSpec& stop, glm::dvec2 cycles) {
  const auto away = [&](int axis) {
    const double a = cycles[axis] - stop.centre[axis];
    return std::abs(a - std::round(a));
  };
  return away(0) <= stop.size.x / 2 && away(1) <= stop.size.y / 2;
}

/// Share of the SLM, along one axis, that the point at x_m in the plane z_m lights with frequencies
/// from low to high, of the part that it lights with any that the pixels show.
///
/// longer  wavelength of the light over the plan's
double share_between(const Plan& plan, int axis, double x_m, double z_m, double longer, double low,
                     double high) {
  const auto lit = [&](double from, double to) {
    return share_lit(plan, axis, x_m, z_m, from * longer, to * longer);
  };
  const double all = lit(-band_edge, band_edge);
  return all > 0 && low < high ? lit(low, high) / all : 0;
}

/// Share of the places seen, each through all of the SLM, that a shift along one axis makes too
/// steep for the pixels.
double lost_by_shift(const Plan& plan, const FrontView& view, int axis, double longer,
                     double carrier) {
  constexpr int most_looked_at = 64;  // along an axis
  const auto step = glm::max(view.size / most_looked_at, glm::ivec2(1));
  double all = 0, kept = 0;
  for (int y = 0; y < view.size.y; y += step.y) {
    for (int x = 0; x < view.size.x; x += step.x) {
      const double z_m = view.depth_m[view.cell(x, y)];
      if (z_m == 0) continue;
      all += 1;
      kept += share_between(plan, axis, view.place_m(x, y, z_m)[axis], z_m, longer,
                            std::max(-band_edge, -band_edge - carrier),
                            std::min(band_edge, band_edge - carrier));
    }
  }
  return all > 0 ? 1 - kept / all : 0;
}

/// Finds SlmLight::beside_m: along one axis, as short as can be where nothing is lost. It is at the
/// depth |z_m|: planes before the hologram move the other way. None for scenes on both sides of it.
void find_shift_beside(const Plan& plan, const FrontView& view,
                       const std::array<Interval, 2>& picture_m,
                       const std::array<Interval, 2>& cycles,
                       const std::vector<double>& wavelengths_m, SlmLight& light) {
  if (plan.extent.near_m < 0 && plan.extent.far_m > 0) return;
  constexpr double alike = 0.005;  // shares of light that are lost
  double least = most_lost_beside;
  for (int axis = 0; axis < 2; ++axis) {
    const double half_m = plan.window_m()[axis] / 2;
    for (const double touching_m : {half_m - picture_m[axis].low, -half_m - picture_m[axis].high}) {
      const double shift_m = std::copysign(1.05, light.z_m) * touching_m;
      const double sine = shift_m / std::hypot(shift_m, light.z_m);
      std::vector<double> lost;
      for (const double wavelength_m : wavelengths_m) {
        const double longer = wavelength_m / plan.hologram.wavelength_m;
        const double carrier = -cycles_per_sine(plan, axis) / longer * sine;
        const bool has_room = cycles[axis].low / longer + carrier >= -band_edge &&
                              cycles[axis].high / longer + carrier <= band_edge;
        lost.push_back(has_room ? 0 : lost_by_shift(plan, view, axis, longer, carrier));
      }
      const double worst = *std::ranges::max_element(lost);
      const double so_far = std::abs(light.beside_m.x + light.beside_m.y);  // one of them is zero
      // Rounding decides between two sides in nothing: lasers are given one advice
      const bool is_shorter = so_far == 0 || std::abs(shift_m) < 0.99 * so_far;
      if (worst > least + (so_far > 0 ? alike : 0) || (worst > least - alike && !is_shorter))
        continue;
      least = worst;
      light.beside_m = {0, 0};
      light.beside_m[axis] = shift_m;
      light.beside_lost = std::move(lost);
    }
  }
}

double sinc(double t) {
  return t == 0 ? 1 : std::sin(std::numbers::pi * t) / (std::numbers::pi * t);
}

/// What a disc of directions leaves of the variance of speckle, whose grains the disc's diameter
/// holds so many of, per axis.
double variance_under_disc(glm::dvec2 grains) {
  // The covariance sinc^2, weighted by how much of the disc lies so far from itself
  constexpr int points = 400;
  double sum = 0, all = 0;
  for (int j = 0; j < points; ++j) {
    for (int i = 0; i < points; ++i) {
      const glm::dvec2 at = (glm::dvec2(i, j) + 0.5) / double{points};
      const double s = std::hypot(at.x, at.y);
      if (s >= 1) continue;
      const double overlap = std::acos(s) - s * std::sqrt(1 - s * s);
      all += overlap;
      sum += overlap * std::pow(sinc(grains.x * at.x) * sinc(grains.y * at.y), 2);
    }
  }
  return sum / all;
}

/// What a Gaussian spectrum leaves of it. `defocus` and `turns`: what a change of the wavelength by
/// its standard deviation adds at the hologram's edge, and from its middle to there, in turns.
double variance_under_spectrum(glm::dvec2 defocus, glm::dvec2 turns) {
  constexpr int changes = 161, points = 256;
  constexpr double reach = 4;
  double sum = 0, all = 0;
  for (int k = 0; k < changes; ++k) {
    // Of the difference of two colours
    const double t = reach * (2.0 * k / (changes - 1) - 1), change = t * std::numbers::sqrt2;
    double covariance = 1;
    for (int axis = 0; axis < 2; ++axis) {
      std::complex<double> mean = 0;
      for (int i = 0; i < points; ++i) {
        const double at = (2.0 * i + 1) / points - 1;
        mean += std::polar(1.0 / points, 2 * std::numbers::pi * change *
                                             (defocus[axis] * at * at + turns[axis] * at));
      }
      covariance *= std::norm(mean);
    }
    const double weight = std::exp(-t * t / 2);
    sum += weight * covariance;
    all += weight;
  }
  return sum / all;
}

/// Fills in what the beam, the pixels and the source do.
void find_faults(const Plan& plan, const FrontView& view, SlmLight& light) {
  const auto& slm = plan.slm;
  const auto& hologram = plan.hologram;
  if (const auto& profile = slm.illumination.profile; !profile.is_even()) {
    for (int axis = 0; axis < 2 && !profile.picture; ++axis)
      light.on_hologram *=
          std::erf(std::numbers::sqrt2 * plan.window_m()[axis] / profile.diameter_m[axis]);
    light.darkest = darkest_of(profile, hologram.size, hologram.pitch_m);
  }
  if (slm.fill) {
    const auto fill = *slm.fill;
    light.in_order = fill.x * fill.y * fill.x * fill.y;
    view.for_surfaces([&](int x, int y, std::size_t, double z_m) {
      light.at_edge = std::min(light.at_edge, fall_off(plan, view.place_m(x, y, z_m), z_m));
    });
  }
  light.source = source_blur(source_spread(slm, hologram.pitch_m, hologram.wavelength_m),
                             plan.window_m(), hologram.wavelength_m, light.z_m);
}

}  // namespace

double fall_off(const Plan& plan, glm::dvec2 at_m, double z_m) {
  if (!plan.slm.fill) return 1;
  const auto carrier = carrier_of(plan.slm, plan.hologram.pitch_m, plan.hologram.wavelength_m);
  double share = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double fill = (*plan.slm.fill)[axis],
                 cycles = frequency_at(plan, axis, at_m[axis], z_m, 0) + carrier[axis];
    share *= std::pow(amplitude_of_pixel(fill, cycles) / fill, 2);
  }
  return share;
}

SourceBlur source_blur(const SourceSpread& source, glm::dvec2 window_m, double wavelength_m,
                       double z_m) {
  SourceBlur blur;
  const double away_m = std::abs(z_m);
  if (!source.any() || !(away_m > 0)) return blur;
  double variance = 1;
  if (source.size_rad > 0) {
    blur.disc_m = source.size_rad * away_m;
    variance *= variance_under_disc(blur.disc_m * window_m / (wavelength_m * away_m));
  }
  if (source.bandwidth_m > 0) {
    const double change = source.bandwidth_m / wavelength_m,
                 sigma = change / (2 * std::sqrt(2 * std::log(2.0)));
    const auto turned_m = away_m * wavelength_m * glm::abs(source.per_m);
    const auto moved_m = glm::max(window_m / 2.0, turned_m);
    blur.smear_m = change * std::max(moved_m.x, moved_m.y);
    const auto half_m = window_m / 2.0;
    // The hologram's own curvature, less what the SLM adds and a field leaves out
    const auto curvature = 1 / (2 * wavelength_m * z_m) + source.per_m2;
    variance *=
        variance_under_spectrum(sigma * half_m * half_m * curvature, sigma * half_m * source.per_m);
  }
  blur.speckle = std::sqrt(variance);
  return blur;
}

SlmLight slm_light(const Plan& plan, const FrontView& view, std::vector<double> wavelengths_m) {
  if (wavelengths_m.empty()) wavelengths_m = {plan.hologram.wavelength_m};
  const auto& slm = plan.slm;
  const auto half_m = plan.window_m() / 2.0;
  SlmLight light;
  light.z_m = plan.extent.origin_m.z;
  light.zero_order_size_m = plan.window_m();
  find_faults(plan, view, light);
  const auto zero_order = -carrier_of(slm, plan.hologram.pitch_m, plan.hologram.wavelength_m) -
                          own_carrier_of(slm.encoding);
  for (int axis = 0; axis < 2; ++axis)
    light.zero_order_m[axis] = 0.0 - travel(plan, axis, zero_order[axis], light.z_m);
  light.zero_order_stopped = slm.stop && !passes(*slm.stop, zero_order);

  double all = 0, shown = 0, through = 0, under_zero_order = 0;
  std::array<Interval, 2> picture_m, cycles;
  view.for_surfaces([&](int x, int y, std::size_t cell, double z_m) {
    const double here = view.radiance[cell];
    const auto place_m = view.place_m(x, y, z_m);
    double shown_here = here, through_here = here;
    bool is_under = true;
    for (int axis = 0; axis < 2; ++axis) {
      // Near the hologram, what is gathered counts as shown: it lights little of it
      const double edge = cycles_per_sine(plan, axis) * plan.hologram.largest_sine[axis];
      shown_here *= is_near_hologram(plan) ? share_lit(plan, axis, place_m[axis], z_m, -edge, edge)
                                           : share_within_pixels(plan, axis, place_m[axis], z_m);
      if (slm.stop) through_here *= share_through(plan, *slm.stop, axis, place_m[axis], z_m);
      is_under = is_under &&
                 std::abs(place_m[axis] + travel(plan, axis, zero_order[axis], z_m)) < half_m[axis];
      picture_m[axis].add(place_m[axis]);
      for (const double edge_m : {-half_m[axis], half_m[axis]})
        cycles[axis].add(std::clamp(frequency_at(plan, axis, place_m[axis], z_m, edge_m),
                                    -band_edge, band_edge));
    }
    all += here;
    shown += shown_here;
    through += through_here;
    if (is_under) under_zero_order += here;
  });
  if (all > 0) light.on_picture = under_zero_order / all;
  for (const double wavelength_m : wavelengths_m) {
    const auto carrier = carrier_of(slm, plan.hologram.pitch_m, wavelength_m);
    const double longer = wavelength_m / plan.hologram.wavelength_m;
    double kept = 1;
    for (int axis = 0; axis < 2; ++axis)
      if (carrier[axis] != 0) kept *= 1 - lost_by_shift(plan, view, axis, longer, carrier[axis]);
    light.beyond_band = std::max(light.beyond_band, 1 - kept);
  }
  // Of the shortest wavelength, whose frequencies are the highest
  const double steepest = plan.hologram.wavelength_m / *std::ranges::min_element(wavelengths_m);
  if (slm.stop && shown > 0) {
    light.through_stop = std::min(1.0, through / shown);
    for (int axis = 0; axis < 2; ++axis)
      light.open_stop[axis] =
          std::min(1.0, 2 * std::max(steepest * cycles[axis].high - slm.stop->centre[axis],
                                     slm.stop->centre[axis] - steepest * cycles[axis].low));
  }
  if (all > 0) find_shift_beside(plan, view, picture_m, cycles, wavelengths_m, light);
  return light;
}

}  // namespace raywave
