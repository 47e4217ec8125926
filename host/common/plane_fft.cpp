// SPDX-License-Identifier: Apache-2.0
#include "host/common/plane_fft.hpp"

#include <algorithm>

#include "host/common/threads.hpp"

namespace raywave {
namespace {

using Sample = std::complex<float>;

constexpr std::size_t tile_width = 16;  // columns that are transposed together: two cache lines
// Samples per thread below which waking it does not pay
constexpr std::size_t small_plane = std::size_t{128} * 128;

/// Zeros before and after the live part of a line.
void clear_around(Sample* line, std::size_t size, const LinePart& live) {
  std::fill_n(line, live.first, Sample{});
  std::fill(line + live.first + live.count, line + size, Sample{});
}

}  // namespace

PlaneFft::PlaneFft(std::size_t nx, std::size_t ny)
    : nx_(nx),
      ny_(ny),
      row_fft_(nx),
      column_fft_(ny),
      scratch_(std::clamp<std::size_t>(nx * ny / small_plane, 1, cl::Threads::shared().count())) {
  for (auto& s : scratch_) {
    const std::size_t samples = std::max(nx, tile_width * pitch_of_lines(ny));
    s.in = make_lines(samples, "lines of a plane");
    s.out = make_lines(samples, "lines of a plane");
  }
}

void PlaneFft::forward(Sample* plane, const PlanePart& live, const PlanePart& wanted) {
  transform(plane, live, wanted, false);
}

void PlaneFft::inverse(Sample* plane, const PlanePart& live, const PlanePart& wanted) {
  transform(plane, live, wanted, true);
}

/// The first pass makes the lines that have light, the second those that are wanted.
void PlaneFft::transform(Sample* plane, const PlanePart& live, const PlanePart& wanted,
                         bool inverse) {
  const std::size_t rows_first = live.y.count * nx_ + wanted.x.count * ny_,
                    columns_first = live.x.count * ny_ + wanted.y.count * nx_;
  if (rows_first <= columns_first) {
    rows(plane, live.y, live.x, wanted.x, inverse);
    columns(plane, wanted.x, live.y, wanted.y, inverse);
  } else {
    columns(plane, live.x, live.y, wanted.y, inverse);
    rows(plane, wanted.y, live.x, wanted.x, inverse);
  }
}

void PlaneFft::rows(Sample* plane, const LinePart& rows, const LinePart& live,
                    const LinePart& wanted, bool inverse) {
  for (auto& s : scratch_) clear_around(s.in.get(), nx_, live);
  cl::Threads::shared().for_each(
      scratch_.size(), rows.count, 8, [&](std::size_t thread, std::size_t i) {
        auto& s = scratch_[thread];
        Sample* row = plane + (rows.first + i) * nx_;
        std::copy_n(row + live.first, live.count, s.in.get() + live.first);
        inverse ? row_fft_.inverse(s.in.get(), s.out.get())
                : row_fft_.forward(s.in.get(), s.out.get());
        std::copy_n(s.out.get() + wanted.first, wanted.count, row + wanted.first);
      });
}

void PlaneFft::columns(Sample* plane, const LinePart& columns, const LinePart& live,
                       const LinePart& wanted, bool inverse) {
  const std::size_t pitch = pitch_of_lines(ny_);
  for (auto& s : scratch_) {
    for (std::size_t c = 0; c < tile_width; ++c) clear_around(s.in.get() + c * pitch, ny_, live);
  }
  const auto tiles = (columns.count + tile_width - 1) / tile_width;
  cl::Threads::shared().for_each(
      scratch_.size(), tiles, 1, [&](std::size_t thread, std::size_t tile) {
        auto& s = scratch_[thread];
        const std::size_t first = columns.first + tile * tile_width,
                          count = std::min(tile_width, columns.count - tile * tile_width);
        transpose_(plane + live.first * nx_ + first, nx_, live.count, count,
                   s.in.get() + live.first, pitch);
        for (std::size_t c = 0; c < count; ++c) {
          const std::size_t at = c * pitch;
          inverse ? column_fft_.inverse(s.in.get() + at, s.out.get() + at)
                  : column_fft_.forward(s.in.get() + at, s.out.get() + at);
        }
        transpose_(s.out.get() + wanted.first, pitch, count, wanted.count,
                   plane + wanted.first * nx_ + first, nx_);
      });
}

}  // namespace raywave
