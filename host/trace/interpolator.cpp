// SPDX-License-Identifier: Apache-2.0
#include "host/trace/interpolator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "host/geometry/kernel_options.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

/// What the sinc's window leaves of frequencies outside the band, in decibels.
constexpr double stop_db = 66;

/// Fewer columns, and rows, than these shares of the hologram's are worth another pass
/// (docs/performance.md).
constexpr std::array worthwhile{2.0 / 3, 0.8};

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

/// Largest frequency along an axis, in cycles per metre, of light from a layer's WRPs to the
/// hologram's window, its cone's soft edge included, without the wave that converges to the
/// hologram's centre.
double largest_frequency(const Plan& plan, const DepthLayer& layer, int axis) {
  const int other = 1 - axis;
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

WrpAxis axis_for_band(const Plan& plan, const DepthLayer& layer, int axis, double oversampling) {
  const int all = plan.tile_size[axis];
  const double frequency = largest_frequency(plan, layer, axis);
  if (!(frequency > 0)) return {all, plan.pitch_m[axis], 0};  // no WRP
  const double pitch_m = 1 / (2 * oversampling * frequency);
  const int half = half_taps(oversampling);
  // Those beyond the edges are for taps
  const double count = std::ceil((all - 1) * plan.pitch_m[axis] / pitch_m) + 1 + 2 * half;
  return count <= worthwhile[static_cast<std::size_t>(axis)] * all
             ? WrpAxis{static_cast<int>(count), pitch_m, half}
             : WrpAxis{all, plan.pitch_m[axis], 0};
}

/// A refinement of columns of which vectors of `lanes` are made together: number v is the sum over
/// j < width of column first[v] + j times coefficients, of which 2 lanes (v width + j) and on are
/// the real parts for each lane, then the imaginary ones.
struct Band {
  int width = 1;
  std::vector<std::int32_t> first;
  std::vector<float> coefficients;
};

/// count  of the columns that there are
Band band_of(const Interpolation& r, int count, int lanes) {
  const auto columns = static_cast<int>(r.first.size());
  const auto first_of = [&](int column) { return r.first[static_cast<std::size_t>(column)]; };
  Band band;
  for (int column = 0; column < columns; column += lanes)
    band.width = std::max(
        band.width, first_of(std::min(column + lanes, columns) - 1) - first_of(column) + r.taps);
  for (int column = 0; column < columns; column += lanes)
    band.first.push_back(std::min(first_of(column), count - band.width));
  const auto size = static_cast<std::size_t>(lanes);
  band.coefficients.resize(2 * size * band.first.size() * static_cast<std::size_t>(band.width));
  for (int column = 0; column < columns; ++column) {
    const int vector = column / lanes,
              from = first_of(column) - band.first[static_cast<std::size_t>(vector)];
    auto* part =
        &band.coefficients[2 * size * static_cast<std::size_t>(vector * band.width + from) +
                           static_cast<std::size_t>(column % lanes)];
    for (int tap = 0; tap < r.taps; ++tap, part += 2 * size) {
      const auto c = r.coefficients[static_cast<std::size_t>(column * r.taps + tap)];
      part[0] = c.real();
      part[size] = c.imag();
    }
  }
  return band;
}

std::size_t groups(int n, int size) { return static_cast<std::size_t>((n + size - 1) / size); }

/// Rows that a work-item makes.
int rows_together(int lanes) { return lanes == 1 ? 1 : 16; }

cl::Range group_of(int lanes) { return lanes == 1 ? cl::Range{64, 1} : cl::Range{1, 1}; }

template <typename Values, typename Buffer>
void upload(const cl::Device& device, const Values& values, Buffer& buffer) {
  if (buffer.size() != values.size()) buffer = {device, values.size(), "columns or rows of a WRP"};
  buffer.write(values);
}

}  // namespace

WrpAxes axes_for_band(const Plan& plan, const DepthLayer& layer, double oversampling) {
  return {axis_for_band(plan, layer, 0, oversampling), axis_for_band(plan, layer, 1, oversampling)};
}

Interpolation interpolation_of(const Plan& plan, const DepthLayer& layer, int axis,
                               double centre_m) {
  const auto& few = layer.axes[static_cast<std::size_t>(axis)];
  const int count = plan.tile_size[axis];
  const double pitch_m = plan.pitch_m[axis];
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

Interpolator::Interpolator(const cl::Device& device)
    : device_(device),
      lanes_(lanes_for(device.info())),
      program_(device, "kernels/gather/interpolate.cl",
               {{option::lanes, std::to_string(lanes_)},
                {option::interpolate_rows, std::to_string(rows_together(lanes_))}}),
      columns_(program_.kernel("interpolate_columns")),
      rows_(program_.kernel("interpolate_rows")) {}

void Interpolator::interpolate(const Plan& plan, const Wrp& wrp, const cl::ComplexBuffer& coarse,
                               int frame, cl::ComplexBuffer& fine) {
  const auto& layer = plan.layer_of(wrp);
  const auto& [columns, rows] = layer.axes;
  const auto centre_m = glm::dvec2(wrp.centre_m) - plan.tile_of(wrp).centre_m;
  if (!rows.interpolates()) {
    make_columns(plan, layer, centre_m.x, coarse, frame, fine);
    return;
  }
  if (!columns.interpolates()) {
    make_rows(plan, layer, -centre_m.y, coarse, frame, fine);
    return;
  }
  // Columns first, of fewer rows.
  if (const auto size =
          static_cast<std::size_t>(plan.tile_size.x) * static_cast<std::size_t>(rows.count);
      between_.size() < size) {
    between_ = {};
    between_ = {device_, size, "gathered rows of a WRP"};
  }
  make_columns(plan, layer, centre_m.x, coarse, frame, between_);
  make_rows(plan, layer, -centre_m.y, between_, 0, fine);
}

void Interpolator::make_columns(const Plan& plan, const DepthLayer& layer, double centre_m,
                                const cl::ComplexBuffer& coarse, int frame,
                                cl::ComplexBuffer& fine) {
  const auto size = plan.gathered_size(layer);
  const auto band = band_of(interpolation_of(plan, layer, 0, centre_m), size.x, lanes_);
  upload(device_, band.first, first_column_);
  upload(device_, band.coefficients, column_coefficients_);
  columns_.run({groups(plan.tile_size.x, lanes_), groups(size.y, rows_together(lanes_))},
               group_of(lanes_), coarse, size.x, size.y, frame, plan.tile_size.x, band.width,
               first_column_, column_coefficients_, fine);
}

void Interpolator::make_rows(const Plan& plan, const DepthLayer& layer, double centre_m,
                             const cl::ComplexBuffer& coarse, int frame, cl::ComplexBuffer& fine) {
  const auto r = interpolation_of(plan, layer, 1, centre_m);
  upload(device_, r.first, first_row_);
  upload(device_, r.coefficients, row_coefficients_);
  rows_.run({groups(plan.tile_size.x, lanes_), groups(plan.tile_size.y, rows_together(lanes_))},
            group_of(lanes_), coarse, layer.axes[1].count, frame, plan.tile_size.x,
            plan.tile_size.y, r.taps, first_row_, row_coefficients_, fine);
}

}  // namespace raywave
