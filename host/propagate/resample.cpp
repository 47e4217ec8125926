// SPDX-License-Identifier: Apache-2.0
#include "host/propagate/resample.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/threads.hpp"

namespace raywave {
namespace {

constexpr int taps = 20;  // of each grid, of the two along an axis
constexpr std::size_t most_windows = 4096;

/// The sinc that passes the band and stops its first repetition, `at` so many samples of both grids
/// from its middle. The window's main lobe is as wide as the gap between the two.
double weight(double at) {
  constexpr double half_width = taps, beta = std::numbers::pi * half_width / 2;
  const double inside = 1 - at * at / (half_width * half_width);
  if (inside <= 0) return 0;
  const double turns = std::numbers::pi * at;
  const double sinc = std::abs(turns) < 1e-9 ? 1 : std::sin(turns) / turns;
  return sinc * std::cyl_bessel_i(0, beta * std::sqrt(inside)) / std::cyl_bessel_i(0, beta);
}

/// The sum of `taps` samples, `stride` apart, times these weights.
template <class Complex>
Complex sum(const Complex* samples, std::ptrdiff_t stride, const double* weights) {
  double real = 0, imaginary = 0;
  for (int k = 0; k < taps; ++k) {
    real += weights[k] * double{samples[k * stride].real()};
    imaginary += weights[k] * double{samples[k * stride].imag()};
  }
  return {static_cast<typename Complex::value_type>(real),
          static_cast<typename Complex::value_type>(imaginary)};
}

}  // namespace

/// What the samples of a grid add to points along one axis.
struct Resampler::Weights {
  std::vector<int> first;      // by point: the first sample that counts
  std::vector<double> values;  // `taps` of each point
};

Resampler::Weights Resampler::weights_of(int count, double point_pitch_m, int grid, double pitch_m,
                                         int half) {
  Weights all;
  for (int i = 0; i < count; ++i) {
    const double at = 2 * (i - (count - 1) / 2.0) * point_pitch_m / pitch_m + (grid - 1);
    const auto first = static_cast<int>(std::ceil((at - half) / 2 - taps / 2.0));
    all.first.push_back(first);
    for (int k = 0; k < taps; ++k) all.values.push_back(weight(2 * (first + k) + half - at));
  }
  return all;
}

Resampler::Resampler(glm::ivec2 size, glm::dvec2 pitch_m, const PointGrid& points)
    : size_(size),
      pitch_m_(pitch_m),
      points_(points),
      halves_{{0, 0}},
      columns_(parts_of(points.size.x, points.pitch_m.x, size.x * pitch_m.x)),
      rows_(parts_of(points.size.y, points.pitch_m.y, size.y * pitch_m.y)) {
  if (points.size != size || points.pitch_m != pitch_m) {
    margin_ = taps / 2 + 1;
    halves_ = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  }
  if (columns_.size() * rows_.size() > most_windows)
    throw InputError("out_pitch: the points spread over " + std::to_string(columns_.size()) +
                     " x " + std::to_string(rows_.size()) + " windows of the field's size, and " +
                     std::to_string(most_windows) +
                     " are the most: give fewer points, or nearer ones");
}

std::vector<Resampler::Part> Resampler::parts_of(int points, double pitch_m, double window_m) {
  const auto most = static_cast<int>(std::clamp(std::floor(window_m / pitch_m + 1e-9), 1.0, 1e9));
  std::vector<Part> parts;
  for (int first = 0; first < points; first += most) {
    const int count = std::min(most, points - first);
    parts.push_back({first, count, first + (count - points) / 2.0});
  }
  return parts;
}

glm::dvec2 Resampler::centre_m(const Part& columns, const Part& rows, glm::ivec2 half) const {
  // Rows count downwards, y upwards
  return points_.centre_m + glm::dvec2(columns.centre, -rows.centre) * points_.pitch_m +
         glm::dvec2(half.x, -half.y) * pitch_m_ / 2.0;
}

std::vector<glm::dvec2> Resampler::centres_m() const {
  std::vector<glm::dvec2> all;
  for (const auto& rows : rows_)
    for (const auto& columns : columns_)
      for (const auto half : halves_) all.push_back(centre_m(columns, rows, half));
  return all;
}

template <class Complex>
std::vector<Complex> Resampler::padded(const Complex* source) const {
  const auto grid = grid_size();
  std::vector<Complex> plane(static_cast<std::size_t>(grid.x) * grid.y);
  for (std::ptrdiff_t y = 0; y < size_.y; ++y)
    std::copy_n(source + y * size_.x, size_.x, plane.data() + (y + margin_) * grid.x + margin_);
  return plane;
}

template <class Complex>
std::vector<Complex> Resampler::at_points(
    const std::function<std::vector<Complex>(glm::dvec2 centre_m)>& arrived) const {
  if (margin_ == 0) return arrived(points_.centre_m);
  const auto grid = grid_size();
  std::vector<Complex> points(static_cast<std::size_t>(points_.size.x) * points_.size.y);
  auto& threads = cl::Threads::shared();
  const auto each = [&](int count, const auto& work) {
    threads.for_each(threads.count(), static_cast<std::size_t>(count), 8,
                     [&](std::size_t, std::size_t i) { work(static_cast<std::ptrdiff_t>(i)); });
  };
  for (const auto& rows : rows_) {
    for (const auto& columns : columns_) {
      for (const auto half : halves_) {
        const auto plane = arrived(centre_m(columns, rows, half));
        if (plane.empty()) continue;
        const auto along_x =
                       weights_of(columns.count, points_.pitch_m.x, grid.x, pitch_m_.x, half.x),
                   along_y = weights_of(rows.count, points_.pitch_m.y, grid.y, pitch_m_.y, half.y);
        std::vector<Complex> lines(static_cast<std::size_t>(columns.count) * grid.y);
        each(grid.y, [&](std::ptrdiff_t y) {
          for (std::ptrdiff_t i = 0; i < columns.count; ++i)
            lines[y * columns.count + i] =
                sum(&plane[y * grid.x + along_x.first[i]], 1, &along_x.values[i * taps]);
        });
        each(rows.count, [&](std::ptrdiff_t j) {
          auto* row = &points[(rows.first + j) * points_.size.x + columns.first];
          for (std::ptrdiff_t i = 0; i < columns.count; ++i)
            row[i] += sum(&lines[along_y.first[j] * std::ptrdiff_t{columns.count} + i],
                          columns.count, &along_y.values[j * taps]);
        });
      }
    }
  }
  return points;
}

template std::vector<std::complex<float>> Resampler::padded(const std::complex<float>*) const;
template std::vector<std::complex<double>> Resampler::padded(const std::complex<double>*) const;
template std::vector<std::complex<float>> Resampler::at_points(
    const std::function<std::vector<std::complex<float>>(glm::dvec2)>&) const;
template std::vector<std::complex<double>> Resampler::at_points(
    const std::function<std::vector<std::complex<double>>(glm::dvec2)>&) const;

}  // namespace raywave
