// SPDX-License-Identifier: Apache-2.0
#include "host/plan/interpolation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace raywave {
namespace {

using std::numbers::pi;

/// Attenuation of frequencies outside the band by the sinc's window, in decibels.
constexpr double stop_db = 66;

/// Fewer rows than this share of the hologram's are worth another pass (docs/accuracy.md).
constexpr double worthwhile = 0.8;

/// Half of the samples that make one (Kaiser's formula): the passband ends at 1 / (2 oversampling)
/// of their rate, its first picture begins at 1 less that.
int half_taps(double oversampling) {
  const double transition = 2 * pi * (1 - 1 / oversampling);
  return std::max(2, static_cast<int>(std::ceil((stop_db - 8) / (2.285 * transition) / 2)));
}

/// The sinc's window at `share` of the way from its middle to its end: as good as Kaiser's, and
/// quicker.
double window_at(double share) {
  const double beta = 0.1102 * (stop_db - 8.7);
  return std::abs(share) < 1 ? std::exp(beta * (std::sqrt(1 - share * share) - 1)) : 0;
}

/// Turns by which light from `away_m` off the axis to the hologram's centre is ahead of that from
/// the axis.
double converging_turns(double wavelength_m, double distance_m, double away_m) {
  const double length_m = std::hypot(away_m, distance_m);
  return -away_m * away_m / (length_m + distance_m) / wavelength_m;
}

/// Largest frequency along columns, in cycles per metre, of light from a layer's WRPs to the
/// hologram's window, its cone's apodization included, without the wave that converges to the
/// hologram's centre.
double largest_frequency(const Plan& plan, const DepthLayer& layer) {
  constexpr int axis = 1, other = 0;
  const auto half_window = plan.tile_window_m() / 2.0;
  const auto reach = plan.tile_cone * half_window;
  double largest = 0;
  for (const auto& wrp : plan.wrps) {
    if (&plan.layer_of(wrp) != &layer) continue;
    const auto centre = glm::dvec2(wrp.centre_m) - plan.tile_of(wrp).centre_m;
    const double least_other =
                     std::max(0.0, std::abs(centre[other]) - half_window[other] - reach[other]),
                 most_other = std::abs(centre[other]) + half_window[other] + reach[other];
    for (int i = 0; i <= 8; ++i) {
      const double from = centre[axis] + (i / 4.0 - 1) * half_window[axis];
      const double taken_out = from / std::hypot(from, layer.distance_m);
      for (const double to : {-reach[axis], reach[axis]}) {
        for (const double across : {least_other, most_other}) {
          const double sine = (from - to) / std::hypot(across, from - to, layer.distance_m);
          largest = std::max(largest, std::abs(sine - taken_out) / plan.wavelength_m);
        }
      }
    }
  }
  return largest;
}

}  // namespace

GatheredRows rows_for_band(const Plan& plan, const DepthLayer& layer, double oversampling) {
  const int all = plan.tile_size.y;
  const double frequency = largest_frequency(plan, layer);
  if (!(frequency > 0)) return {all, plan.pitch_m.y, 0};  // no WRP
  const double pitch_m = 1 / (2 * oversampling * frequency);
  const int half = half_taps(oversampling);
  // Those beyond the edges are for taps
  const double count = std::ceil((all - 1) * plan.pitch_m.y / pitch_m) + 1 + 2 * half;
  return count <= worthwhile * all ? GatheredRows{static_cast<int>(count), pitch_m, half}
                                   : GatheredRows{all, plan.pitch_m.y, 0};
}

Interpolation interpolation_of(const Plan& plan, const DepthLayer& layer, double centre_m) {
  const auto& few = layer.rows;
  const int count = plan.tile_size.y;
  const double pitch_m = plan.pitch_m.y;
  const auto converging_at = [&](int number, int of, double apart_m) {
    const double turns = converging_turns(plan.wavelength_m, layer.distance_m,
                                          centre_m + (number - (of - 1) / 2.0) * apart_m);
    return std::polar(1.0, 2 * pi * (turns - std::round(turns)));
  };
  std::vector<std::complex<double>> taken_out;
  for (int i = 0; i < few.count; ++i)
    taken_out.push_back(std::conj(converging_at(i, few.count, few.pitch_m)));

  Interpolation r;
  r.taps = 2 * few.half_taps;
  std::vector<double> weights(static_cast<std::size_t>(r.taps));
  for (int i = 0; i < count; ++i) {
    const double place = (i - (count - 1) / 2.0) * pitch_m / few.pitch_m + (few.count - 1) / 2.0;
    const int first = static_cast<int>(std::floor(place)) - few.half_taps + 1;
    const double sine = std::sin(pi * (place - std::floor(place))) / pi;
    double sum = 0;
    for (int tap = 0; tap < r.taps; ++tap) {
      const double away = place - (first + tap);
      // sin(pi away) = +-sin(pi of its fraction)
      const bool odd = (few.half_taps - 1 - tap) % 2 != 0;
      const double sinc = std::abs(away) < 1e-9 ? 1 : (odd ? -sine : sine) / away;
      sum += weights[static_cast<std::size_t>(tap)] = sinc * window_at(away / few.half_taps);
    }
    r.first.push_back(first);
    const auto put_back = converging_at(i, count, pitch_m) / sum;  // a constant stays as it is
    for (int tap = 0; tap < r.taps; ++tap)
      r.coefficients.emplace_back(put_back * taken_out[static_cast<std::size_t>(first + tap)] *
                                  weights[static_cast<std::size_t>(tap)]);
  }
  return r;
}

}  // namespace raywave
