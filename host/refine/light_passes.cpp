// SPDX-License-Identifier: Apache-2.0
#include "host/refine/light_passes.hpp"

#include <algorithm>
#include <atomic>
#include <barrier>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "host/common/kernel_lane.hpp"
#include "host/common/this_cpu.hpp"
#include "host/common/threads.hpp"

namespace raywave::kernel {
#include "kernels/refine/spectrum.h"
}  // namespace raywave::kernel

namespace raywave::refinement {
namespace {

using Sample = std::complex<float>;

constexpr std::size_t rows_together = 8;  // that a thread takes at a time

/// to = from * factors, or times their conjugates.
void multiply(const Sample* from, const std::vector<Sample>& factors, bool conjugate, Sample* to) {
  const float* __restrict in = floats(from);
  const float* __restrict by = floats(factors.data());
  float* __restrict out = floats(to);
  const std::size_t count = factors.size();
  const float side = conjugate ? -1 : 1;
  for_this_cpu([=]() __attribute__((always_inline)) {
    for (std::size_t i = 0; i < count; ++i) {
      const float re = in[2 * i], im = in[2 * i + 1], c = by[2 * i], s = side * by[2 * i + 1];
      out[2 * i] = re * c - im * s;
      out[2 * i + 1] = re * s + im * c;
    }
  });
}

/// A column of the spectrum times its phases, or times their conjugates.
void turn(const LightPath& path, std::size_t column, const Sample* from, bool conjugate,
          Sample* to) {
  const float* __restrict in = floats(from);
  const float* __restrict by = floats(path.y.phases.data());
  float* __restrict out = floats(to);
  const int count = static_cast<int>(path.y.spectrum), middle = count / 2;
  const float along = static_cast<float>(path.x.sine) *
                      static_cast<float>(static_cast<int>(column) -
                                         static_cast<int>(path.x.spectrum) / 2),
              sine = static_cast<float>(path.y.sine), squared = along * along,
              side = conjugate ? -1.0f : 1.0f, turns = path.turns, more = path.more;
  const Sample of_column = path.x.phases[column];
  const float u = of_column.real(), v = of_column.imag();
  for_this_cpu([=]() __attribute__((always_inline)) {
    for (int i = 0; i < count; ++i) {
      const float across = sine * static_cast<float>(i - middle),
                  square = squared + across * across;
      float c, s;
      kernel::spectrum_phase(square, turns, more, &c, &s);
      const float a = by[2 * i], b = by[2 * i + 1], p = c * u - s * v, q = c * v + s * u;
      const float factor_re = square < 1 ? p * a - q * b : 0.0f,
                  factor_im = square < 1 ? side * (p * b + q * a) : 0.0f;
      const float re = in[2 * i], im = in[2 * i + 1];
      out[2 * i] = re * factor_re - im * factor_im;
      out[2 * i + 1] = re * factor_im + im * factor_re;
    }
  });
}

void clear(Sample* line, std::size_t from, std::size_t to) {
  std::fill(line + from, line + std::max(from, to), Sample{});
}

bool is_aligned(const Sample* line) {
  return reinterpret_cast<std::uintptr_t>(line) % LineFft::alignment == 0;
}

std::size_t longest(const LightLine& line) {
  return std::max({line.open, line.spectrum, line.finer, line.picture});
}

}  // namespace

int LightPath::transforms() const { return x.spectrum == 0 ? 1 : x.chirp.empty() ? 2 : 3; }

LightPasses::LightPasses() : scratch_(cl::Threads::shared().count()) {}

LightPasses::Ffts::Ffts(LightPasses& passes, const LightLine& line) {
  const auto fft = [&](std::size_t size) {
    return size == 0 ? nullptr : &passes.ffts_.try_emplace(size, size).first->second;
  };
  spectrum = fft(line.spectrum);
  finer = fft(line.finer);
  picture = fft(line.picture);
}

void LightPasses::prepare(const LightPath& path, std::size_t rows) {
  const Ffts x(*this, path.x), y(*this, path.y);
  fit(path, rows);
}

/// Makes room, also for the open part's rows between the passes, or so many of the picture's.
void LightPasses::fit(const LightPath& path, std::size_t rows) {
  const auto line = std::max(longest(path.x), longest(path.y)) + tile_width;  // whole tiles
  pitch_ = pitch_of_lines(longest(path.y));
  const char* what = "lines of a plane";
  for (auto& s : scratch_) {
    if (s.line < line) {
      for (auto* one : {&s.first, &s.finer, &s.finer_transformed, &s.picture})
        *one = make_lines(line, what);
      s.line = line;
    }
    if (s.column < tile_width * pitch_) {
      for (auto* one : {&s.columns, &s.columns_transformed})
        *one = make_lines(tile_width * pitch_, what);
      s.column = tile_width * pitch_;
    }
  }
  rows_ = std::max(path.y.open, rows);
  widest_ = std::max(path.x.between(), path.x.picture);
  const auto samples = (path.x.between() + tile_width - 1) / tile_width * rows_ * tile_width;
  if (samples <= capacity_) return;
  capacity_ = 0;
  between_.reset();
  between_ = make_lines(samples, "rows between the passes of a propagation");
  capacity_ = samples;
}

// memcpy of a constant size is no call.

void LightPasses::gather(std::size_t row, std::size_t samples, Sample* line) const {
  for (std::size_t x = 0; x < samples; x += tile_width)
    std::memcpy(static_cast<void*>(line + x), tile(x / tile_width) + row * tile_width,
                tile_width * sizeof(Sample));
}

void LightPasses::scatter(const Sample* line, std::size_t row, std::size_t samples) const {
  for (std::size_t x = 0; x < samples; x += tile_width)
    std::memcpy(static_cast<void*>(tile(x / tile_width) + row * tile_width), line + x,
                tile_width * sizeof(Sample));
}

/// Threads that wait for each other between the passes need not be woken for each.
void LightPasses::run(const std::array<Pass, 3>& passes) {
  constexpr std::size_t small_plane = std::size_t{128} * 128;  // samples that one does as quickly
  const auto threads = std::clamp<std::size_t>(widest_ * rows_ / small_plane, 1, scratch_.size());
  std::array<std::atomic<std::size_t>, 3> next{};
  std::barrier all(static_cast<std::ptrdiff_t>(threads));
  cl::Threads::shared().run(threads, [&](std::size_t thread) {
    for (std::size_t k = 0; k < passes.size(); ++k) {
      const auto& pass = passes[k];
      for (std::size_t first; (first = next[k].fetch_add(pass.grain)) < pass.count;)
        for (std::size_t i = first; i < std::min(first + pass.grain, pass.count); ++i)
          pass.work(scratch_[thread], i);
      if (k + 1 < passes.size()) all.arrive_and_wait();
    }
  });
}

/// Calls work for each column: a line of so many samples, which has those of the rows between the
/// passes at `from`, and is zero elsewhere. What it makes at `to` goes there.
LightPasses::Pass LightPasses::over_columns(
    std::size_t count, std::size_t line, const LinePart& from, const LinePart& to,
    const std::function<void(Scratch&, std::size_t, const Sample*, Sample*)>& work) const {
  return {(count + tile_width - 1) / tile_width, 1, [=, this](Scratch& s, std::size_t number) {
            const std::size_t first = number * tile_width,
                              width = std::min(tile_width, count - first);
            transpose_(tile(number), tile_width, from.count, width, s.columns.get() + from.first,
                       pitch_);
            for (std::size_t c = 0; c < width; ++c) {
              Sample* column = s.columns.get() + c * pitch_;
              clear(column, 0, from.first);
              clear(column, from.first + from.count, line);
              work(s, first + c, column, s.columns_transformed.get() + c * pitch_);
            }
            transpose_(s.columns_transformed.get() + to.first, pitch_, width, to.count,
                       tile(number), tile_width);
          }};
}

void LightPasses::show(const LightPath& path, const std::function<void(std::size_t, Sample*)>& open,
                       Sample* picture, const PlanePart& wanted) {
  const Ffts x(*this, path.x), y(*this, path.y);
  const bool by_spectrum = path.x.spectrum > 0;
  const auto columns = path.x.between();
  fit(path, wanted.y.count);
  const auto open_row = [&](Scratch& s, std::size_t row) {
    open(row, s.finer.get());
    if (!by_spectrum) return scatter(s.finer.get(), row, columns);
    clear(s.finer.get(), path.x.open, path.x.spectrum);
    x.spectrum->forward(s.finer.get(), s.first.get());
    scatter(s.first.get(), row, columns);
  };
  const auto last = [&](const LineFft* fft, const Sample* from, Sample* to) {
    path.inverse ? fft->inverse(from, to) : fft->forward(from, to);
  };
  // From a line of the spectrum, or of the open part, in s.finer
  const auto to_picture = [&](const LightLine& line, const Ffts& ffts, Scratch& s, Sample* to) {
    if (line.spectrum == 0) {
      clear(s.finer.get(), line.open, line.picture);
      return last(ffts.picture, s.finer.get(), to);
    }
    clear(s.finer.get(), line.spectrum, line.finer);
    if (line.chirp.empty()) return ffts.finer->inverse(s.finer.get(), to);
    ffts.finer->inverse(s.finer.get(), s.finer_transformed.get());
    multiply(s.finer_transformed.get(), line.chirp, false, s.picture.get());
    clear(s.picture.get(), line.chirp.size(), line.picture);
    last(ffts.picture, s.picture.get(), to);
  };
  const auto column = [&](Scratch& s, std::size_t number, const Sample* from, Sample* to) {
    if (!by_spectrum) return last(y.picture, from, to);
    y.spectrum->forward(from, s.first.get());
    turn(path, number, s.first.get(), false, s.finer.get());
    to_picture(path.y, y, s, to);
  };
  const auto picture_row = [&](Scratch& s, std::size_t row) {
    gather(row, columns, s.finer.get());
    Sample* to = picture + (wanted.y.first + row) * path.x.picture;
    if (is_aligned(to)) return to_picture(path.x, x, s, to);
    to_picture(path.x, x, s, s.first.get());
    std::copy_n(s.first.get() + wanted.x.first, wanted.x.count, to + wanted.x.first);
  };
  run({{{path.y.open, rows_together, open_row},
        over_columns(columns, by_spectrum ? path.y.spectrum : path.y.picture, {0, path.y.open},
                     wanted.y, column),
        {wanted.y.count, rows_together, picture_row}}});
}

void LightPasses::back(const LightPath& path, const Sample* picture, const PlanePart& live,
                       const std::function<void(std::size_t, const Sample*)>& open) {
  const Ffts x(*this, path.x), y(*this, path.y);
  const bool by_spectrum = path.x.spectrum > 0;
  const auto columns = path.x.between();
  fit(path, live.y.count);
  // To a line of the spectrum, or of the open part, and what follows it
  const auto from_picture = [&](const LightLine& line, const Ffts& ffts, Scratch& s,
                                const Sample* from, Sample* to) {
    const auto first = [&](Sample* of) {
      path.inverse ? ffts.picture->forward(from, of) : ffts.picture->inverse(from, of);
    };
    if (line.spectrum == 0) return first(to);
    if (line.chirp.empty()) return ffts.finer->forward(from, to);
    first(s.finer_transformed.get());
    multiply(s.finer_transformed.get(), line.chirp, true, s.finer.get());
    clear(s.finer.get(), line.chirp.size(), line.finer);
    ffts.finer->forward(s.finer.get(), to);
  };
  const auto picture_row = [&](Scratch& s, std::size_t row) {
    Sample* line = s.picture.get();
    clear(line, 0, live.x.first);
    std::copy_n(picture + (live.y.first + row) * path.x.picture + live.x.first, live.x.count,
                line + live.x.first);
    clear(line, live.x.first + live.x.count, path.x.picture);
    from_picture(path.x, x, s, line, s.first.get());
    scatter(s.first.get(), row, columns);
  };
  const auto column = [&](Scratch& s, std::size_t number, const Sample* from, Sample* to) {
    if (!by_spectrum) return from_picture(path.y, y, s, from, to);
    from_picture(path.y, y, s, from, s.first.get());
    turn(path, number, s.first.get(), true, s.finer.get());
    y.spectrum->inverse(s.finer.get(), to);
  };
  const auto open_row = [&](Scratch& s, std::size_t row) {
    gather(row, columns, s.finer.get());
    if (!by_spectrum) return open(row, s.finer.get());
    x.spectrum->inverse(s.finer.get(), s.first.get());
    open(row, s.first.get());
  };
  run({{{live.y.count, rows_together, picture_row},
        over_columns(columns, path.y.picture, live.y, {0, path.y.open}, column),
        {path.y.open, rows_together, open_row}}});
}

}  // namespace raywave::refinement
