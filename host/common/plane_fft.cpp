// SPDX-License-Identifier: Apache-2.0
#include "host/common/plane_fft.hpp"

#include <fftw3.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstring>
#include <fstream>
#include <mutex>
#include <optional>
#include <type_traits>

#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/memory_need.hpp"
#include "host/common/rehearsal.hpp"
#include "host/common/threads.hpp"

namespace raywave {
namespace {

// FFTW, one line at a time. Transforms from one line into another are up to a quarter faster than
// in place (1440 samples: 1.2 us against 1.6), and lines side by side, one sample of each next to
// the other, half as slow again. Threads are the caller's: plans are then quick to measure, and
// neither they nor a single bit of a result depends on the number of threads.

using Sample = std::complex<float>;

constexpr double planning_seconds = 5;   // at most, for each of the two plans of a size
constexpr std::size_t small_line = 512;  // samples; below, measuring costs more than it gains

// FFTW's planner and its wisdom are one global state.
std::mutex& planner_mutex() {
  static std::mutex mutex;
  return mutex;
}

struct DestroyPlan {
  void operator()(fftwf_plan plan) const {
    const std::lock_guard lock(planner_mutex());
    fftwf_destroy_plan(plan);
  }
};
using Plan = std::unique_ptr<std::remove_pointer_t<fftwf_plan>, DestroyPlan>;

struct Free {
  void operator()(void* pointer) const { fftwf_free(pointer); }
};

fftwf_complex* fftw(const Sample* samples) {
  return reinterpret_cast<fftwf_complex*>(const_cast<Sample*>(samples));
}

/// Wisdom holds for one FFTW and CPU.
std::string wisdom_file() {
  std::string cpu;
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; cpu.empty() && std::getline(in, line);) {
    if (line.starts_with("model name")) cpu = line;
  }
  return "fftw-" + hash_name(fftwf_version + ('\n' + cpu)) + ".wisdom";
}

std::string exported_wisdom() {
  const std::unique_ptr<char, Free> text(fftwf_export_wisdom_to_string());
  return text ? text.get() : "";
}

/// to[c][r] = from[r][c], in blocks of 8 x 8 samples, so that each cache line is read and written
/// once. Rows of the field lie too far apart for the processor's prefetcher.
[[gnu::always_inline]] inline void transpose(const Sample* from, std::size_t from_pitch,
                                             std::size_t rows, std::size_t columns, Sample* to,
                                             std::size_t to_pitch) {
  using Quad = double __attribute__((vector_size(32)));  // four samples
  constexpr std::size_t block = 8, quad = 4;
  for (std::size_t r0 = 0; r0 < rows; r0 += block) {
    for (std::size_t c0 = 0; c0 < columns; c0 += block) {
      if (r0 + block > rows || c0 + block > columns) {
        for (std::size_t r = r0; r < std::min(rows, r0 + block); ++r)
          for (std::size_t c = c0; c < std::min(columns, c0 + block); ++c)
            to[c * to_pitch + r] = from[r * from_pitch + c];
        continue;
      }
      for (std::size_t i = 0; i < block; ++i) {
        __builtin_prefetch(from + (r0 + 2 * block + i) * from_pitch + c0);
        __builtin_prefetch(to + (c0 + 2 * block + i) * to_pitch + r0, 1);
      }
      for (std::size_t r = r0; r < r0 + block; r += quad) {
        for (std::size_t c = c0; c < c0 + block; c += quad) {
          const Sample* in = from + r * from_pitch + c;
          Sample* out = to + c * to_pitch + r;
          Quad a, b, d, e;
          std::memcpy(&a, in, sizeof a);
          std::memcpy(&b, in + from_pitch, sizeof b);
          std::memcpy(&d, in + 2 * from_pitch, sizeof d);
          std::memcpy(&e, in + 3 * from_pitch, sizeof e);
          const Quad even_ab = __builtin_shufflevector(a, b, 0, 4, 2, 6),
                     odd_ab = __builtin_shufflevector(a, b, 1, 5, 3, 7);
          const Quad even_de = __builtin_shufflevector(d, e, 0, 4, 2, 6),
                     odd_de = __builtin_shufflevector(d, e, 1, 5, 3, 7);
          a = __builtin_shufflevector(even_ab, even_de, 0, 1, 4, 5);
          b = __builtin_shufflevector(odd_ab, odd_de, 0, 1, 4, 5);
          d = __builtin_shufflevector(even_ab, even_de, 2, 3, 6, 7);
          e = __builtin_shufflevector(odd_ab, odd_de, 2, 3, 6, 7);
          std::memcpy(static_cast<void*>(out), &a, sizeof a);
          std::memcpy(static_cast<void*>(out + to_pitch), &b, sizeof b);
          std::memcpy(static_cast<void*>(out + 2 * to_pitch), &d, sizeof d);
          std::memcpy(static_cast<void*>(out + 3 * to_pitch), &e, sizeof e);
        }
      }
    }
  }
}

void transpose_any(const Sample* from, std::size_t from_pitch, std::size_t rows,
                   std::size_t columns, Sample* to, std::size_t to_pitch) {
  transpose(from, from_pitch, rows, columns, to, to_pitch);
}
#if defined(__x86_64__)
[[gnu::target("avx2")]] void transpose_avx2(const Sample* from, std::size_t from_pitch,
                                            std::size_t rows, std::size_t columns, Sample* to,
                                            std::size_t to_pitch) {
  transpose(from, from_pitch, rows, columns, to, to_pitch);
}
#endif

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

Lines make_lines(std::size_t samples, const std::string& name) {
  const std::size_t bytes =
      (samples * sizeof(std::complex<float>) / LineFft::alignment + 1) * LineFft::alignment;
  Lines lines(static_cast<std::complex<float>*>(std::aligned_alloc(LineFft::alignment, bytes)));
  if (!lines) throw MemoryError(name + ": " + format_bytes(bytes) + " asked, out of host memory");
  return lines;
}

Lines make_zero_lines(std::size_t samples, const std::string& name) {
  auto lines = make_lines(samples, name);
  std::fill_n(lines.get(), samples, std::complex<float>{});
  return lines;
}

struct LineFft::Plans {
  Plan forward, inverse;
};

LineFft::LineFft(std::size_t size, bool is_fast) : size_(size), plans_(std::make_unique<Plans>()) {
  if (size < 1 || size > INT_MAX)
    throw DeviceError("FFTW transforms 1 to 2147483647 samples, not " + std::to_string(size));
  const auto in = make_lines(size, "line of an FFT"), out = make_lines(size, "line of an FFT");
  const bool is_measured = is_fast && size >= small_line && !is_rehearsal;

  std::string known;
  const auto file = wisdom_file();
  {
    const std::lock_guard lock(planner_mutex());
    // Processes that begin together take one's plans, and round alike
    std::optional<CacheLock> measures;
    if (is_measured) {
      measures.emplace();
      if (const auto stored = load_cached(file))
        fftwf_import_wisdom_from_string(std::string(stored->begin(), stored->end()).c_str());
      known = exported_wisdom();
    }
    fftwf_set_timelimit(planning_seconds);
    const auto plan = [&](int sign) {
      return fftwf_plan_dft_1d(static_cast<int>(size), fftw(in.get()), fftw(out.get()), sign,
                               (is_measured ? FFTW_MEASURE : FFTW_ESTIMATE) | FFTW_PRESERVE_INPUT);
    };
    plans_->forward.reset(plan(FFTW_FORWARD));
    plans_->inverse.reset(plan(FFTW_BACKWARD));
    if (is_measured) {
      if (const auto learnt = exported_wisdom(); learnt != known)
        store_cached(file, learnt.data(), learnt.size());
    }
  }
  if (!plans_->forward || !plans_->inverse)
    throw DeviceError("FFTW has no plan for " + std::to_string(size) + " samples");
}

LineFft::~LineFft() = default;
LineFft::LineFft(LineFft&&) noexcept = default;

void LineFft::forward(const Sample* in, Sample* out) const {
  fftwf_execute_dft(plans_->forward.get(), fftw(in), fftw(out));
}

void LineFft::inverse(const Sample* in, Sample* out) const {
  fftwf_execute_dft(plans_->inverse.get(), fftw(in), fftw(out));
}

Transpose transpose_here() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return transpose_avx2;
#endif
  return transpose_any;
}

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
