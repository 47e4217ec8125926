// SPDX-License-Identifier: Apache-2.0
#include "host/common/plane_fft.hpp"

#include <algorithm>
#include <array>

#include "host/common/threads.hpp"

namespace raywave {
namespace {

using Sample = std::complex<float>;

constexpr std::size_t tile_width = 16;  // columns that are transposed together: two cache lines
// Samples per thread below which waking it does not pay
constexpr std::size_t small_plane = std::size_t{128} * 128;

/// The part up to the end of a line of n samples, and what goes on at its beginning.
std::array<LinePart, 2> pieces_of(const LinePart& part, std::size_t n) {
  const auto before_end = std::min(part.count, n - part.first);
  return {{{part.first, before_end}, {0, part.count - before_end}}};
}

std::size_t tiles_of(const LinePart& part) { return (part.count + tile_width - 1) / tile_width; }

}  // namespace

PlaneFft::PlaneFft(std::size_t nx, std::size_t ny, std::size_t row_stride)
    : nx_(nx),
      ny_(ny),
      row_stride_(row_stride > 0 ? row_stride : nx),
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
  const auto copy = [](const Sample* from, Sample* to, const auto& pieces) {
    for (const auto& piece : pieces) std::copy_n(from + piece.first, piece.count, to + piece.first);
  };
  const auto from = pieces_of(live, nx_), to = pieces_of(wanted, nx_);
  for (auto& s : scratch_) std::fill_n(s.in.get(), nx_, Sample{});
  cl::Threads::shared().for_each(scratch_.size(), rows.count, 8,
                                 [&](std::size_t thread, std::size_t i) {
                                   auto& s = scratch_[thread];
                                   Sample* row = plane + (rows.first + i) % ny_ * row_stride_;
                                   copy(row, s.in.get(), from);
                                   inverse ? row_fft_.inverse(s.in.get(), s.out.get())
                                           : row_fft_.forward(s.in.get(), s.out.get());
                                   copy(s.out.get(), row, to);
                                 });
}

void PlaneFft::columns(Sample* plane, const LinePart& columns, const LinePart& live,
                       const LinePart& wanted, bool inverse) {
  const std::size_t pitch = pitch_of_lines(ny_);
  for (auto& s : scratch_) std::fill_n(s.in.get(), tile_width * pitch, Sample{});
  const auto sides = pieces_of(columns, nx_);
  cl::Threads::shared().for_each(
      scratch_.size(), tiles_of(sides[0]) + tiles_of(sides[1]), 1,
      [&](std::size_t thread, std::size_t tile) {
        auto& s = scratch_[thread];
        const bool is_past_end = tile >= tiles_of(sides[0]);
        const auto& side = sides[is_past_end];
        if (is_past_end) tile -= tiles_of(sides[0]);
        const std::size_t first = side.first + tile * tile_width,
                          count = std::min(tile_width, side.count - tile * tile_width);
        for (const auto& piece : pieces_of(live, ny_))
          transpose_(plane + piece.first * row_stride_ + first, row_stride_, piece.count, count,
                     s.in.get() + piece.first, pitch);
        for (std::size_t c = 0; c < count; ++c) {
          const std::size_t at = c * pitch;
          inverse ? column_fft_.inverse(s.in.get() + at, s.out.get() + at)
                  : column_fft_.forward(s.in.get() + at, s.out.get() + at);
        }
        for (const auto& piece : pieces_of(wanted, ny_))
          transpose_(s.out.get() + piece.first, pitch, count, piece.count,
                     plane + piece.first * row_stride_ + first, row_stride_);
      });
}

}  // namespace raywave
