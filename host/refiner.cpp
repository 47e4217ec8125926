// SPDX-License-Identifier: Apache-2.0
#include "host/refiner.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/device_scene.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

/// What the sinc's window leaves of frequencies outside the band, in decibels.
constexpr double stop_db = 66;

/// Fewer rows than this share of the hologram's are worth another pass.
constexpr double worthwhile = 0.8;

/// Half of the rows that make one (Kaiser's formula): the passband ends at 1 / (2 oversampling) of the rows' rate, its first picture
/// begins at 1 less that.
int half_taps(double oversampling) {
  const double transition = 2 * pi * (1 - 1 / oversampling);
  return std::max(2, static_cast<int>(std::ceil((stop_db - 8) / (2.285 * transition) / 2)));
}

/// The sinc's window at `share` of the way from its middle to its end: as good as Kaiser's, and quicker.
double window_at(double share) {
  const double beta = 0.1102 * (stop_db - 8.7);
  return std::abs(share) < 1 ? std::exp(beta * (std::sqrt(1 - share * share) - 1)) : 0;
}

/// Turns by which light from y to the hologram's centre is ahead of that from the axis.
double converging_turns(double wavelength_m, double distance_m, double y_m) {
  const double length_m = std::hypot(y_m, distance_m);
  return -y_m * y_m / (length_m + distance_m) / wavelength_m;
}

/// Largest frequency along y, in cycles per metre, of light from a slab's WRPs to the hologram's window, its cone's soft edge included,
/// without the wave that converges to the hologram's centre.
double largest_frequency(const Plan& plan, const Slab& slab) {
  const auto half_window = plan.tile_window_m() / 2.0;
  const auto reach = plan.tile_fan * half_window;
  double largest = 0;
  for (const auto& wrp : plan.wrps) {
    if (&plan.slab_of(wrp) != &slab) continue;
    const auto centre = glm::dvec2(wrp.centre_m) - plan.tile_of(wrp).centre_m;
    const double least_x = std::max(0.0, std::abs(centre.x) - half_window.x - reach.x),
                 most_x = std::abs(centre.x) + half_window.x + reach.x;
    for (int i = 0; i <= 8; ++i) {
      const double y = centre.y + (i / 4.0 - 1) * half_window.y;
      const double taken_out = y / std::hypot(y, slab.distance_m);
      for (const double to : {-reach.y, reach.y}) {
        for (const double x : {least_x, most_x})
          largest = std::max(largest, std::abs((y - to) / std::hypot(x, y - to, slab.distance_m) - taken_out) / plan.wavelength_m);
      }
    }
  }
  return largest;
}

}  // namespace

WrpRows rows_for_band(const Plan& plan, const Slab& slab, double oversampling) {
  const WrpRows all{plan.tile_size.y, plan.pitch_m.y, 0};
  const double frequency = largest_frequency(plan, slab);
  if (!(frequency > 0)) return all;  // no WRP
  const double pitch_m = 1 / (2 * oversampling * frequency);
  const int half = half_taps(oversampling);
  const double rows = std::ceil((plan.tile_size.y - 1) * plan.pitch_m.y / pitch_m) + 1 + 2 * half;  // those beyond the edges are for taps
  return rows <= worthwhile * plan.tile_size.y ? WrpRows{static_cast<int>(rows), pitch_m, half} : all;
}

Refinement refinement_of(const Plan& plan, const Slab& slab, double centre_y_m) {
  const auto& rows = slab.rows;
  const auto converging_at = [&](int row, int count, double pitch_m) {
    const double turns = converging_turns(plan.wavelength_m, slab.distance_m, centre_y_m - (row - (count - 1) / 2.0) * pitch_m);
    return std::polar(1.0, 2 * pi * (turns - std::round(turns)));
  };
  std::vector<std::complex<double>> taken_out;
  for (int row = 0; row < rows.count; ++row) taken_out.push_back(std::conj(converging_at(row, rows.count, rows.pitch_m)));

  Refinement r;
  r.taps = 2 * rows.half_taps;
  std::vector<double> weights(static_cast<std::size_t>(r.taps));
  for (int i = 0; i < plan.tile_size.y; ++i) {
    const double place = (i - (plan.tile_size.y - 1) / 2.0) * plan.pitch_m.y / rows.pitch_m + (rows.count - 1) / 2.0;
    const int first = static_cast<int>(std::floor(place)) - rows.half_taps + 1;
    const double sine = std::sin(pi * (place - std::floor(place))) / pi;
    double sum = 0;
    for (int tap = 0; tap < r.taps; ++tap) {
      const double away = place - (first + tap);
      const bool odd = (rows.half_taps - 1 - tap) % 2 != 0;  // sin(pi away) = +-sin(pi of its fraction)
      const double sinc = std::abs(away) < 1e-9 ? 1 : (odd ? -sine : sine) / away;
      sum += weights[static_cast<std::size_t>(tap)] = sinc * window_at(away / rows.half_taps);
    }
    r.first.push_back(first);
    const auto put_back = converging_at(i, plan.tile_size.y, plan.pitch_m.y) / sum;  // a constant stays as it is
    for (int tap = 0; tap < r.taps; ++tap)
      r.coefficients.emplace_back(put_back * taken_out[static_cast<std::size_t>(first + tap)] * weights[static_cast<std::size_t>(tap)]);
  }
  return r;
}

Refiner::Refiner(const cl::Device& device)
    : device_(device),
      lanes_(lanes_for(device.info())),
      refine_(
          cl::Program(device, "refine.cl", {{"RAYWAVE_LANES", std::to_string(lanes_)}, {"RAYWAVE_REFINE_ROWS", lanes_ == 1 ? "1" : "16"}})
              .kernel("refine")) {}

void Refiner::refine(const Plan& plan, const Wrp& wrp, const cl::ComplexBuffer& coarse, int frame, cl::ComplexBuffer& fine) {
  const auto& slab = plan.slab_of(wrp);
  const auto r = refinement_of(plan, slab, wrp.centre_m.y - plan.tile_of(wrp).centre_m.y);
  if (first_.size() != r.first.size()) first_ = {device_, r.first.size(), "rows of a WRP"};
  if (coefficients_.size() != r.coefficients.size()) coefficients_ = {device_, r.coefficients.size(), "rows of a WRP"};
  first_.write(r.first);
  coefficients_.write(r.coefficients);
  const auto groups = [](int n, int size) { return static_cast<std::size_t>((n + size - 1) / size); };
  const bool wide = lanes_ > 1;
  refine_.run({groups(plan.tile_size.x, lanes_), groups(plan.tile_size.y, wide ? 16 : 1)}, wide ? cl::Range{1, 1} : cl::Range{64, 1},
              coarse, slab.rows.count, frame, plan.tile_size.x, plan.tile_size.y, r.taps, first_, coefficients_, fine);
}

}  // namespace raywave
