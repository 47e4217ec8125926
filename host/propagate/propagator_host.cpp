// SPDX-License-Identifier: Apache-2.0
// Propagation by the host's threads. Memory bandwidth limits it, so every pass makes its lines in
// the cache and writes only the samples that the next pass reads:
//   load     columns of the field with any light, zeros below it -> transform -> the rows that the
//            targets' bands keep
//   collect  each of these rows, zeros right of it -> transform -> times the transfer function,
//            summed over the sources -> transform back -> its part inside the window, in the place
//            of a source's row; then columns of these rows, zeros elsewhere -> transform back ->
//            the field
// Rows between the passes lie in tiles: 16 columns of each row next to each other, so that passes
// over columns read and write a tile from beginning to end. Sources wait until `collect`, or until
// they fill the memory of two padded planes; their sum is then kept by rows.
#include <cmath>
#include <type_traits>

#include "host/common/kernel_lane.hpp"
#include "host/common/plane_fft.hpp"
#include "host/common/this_cpu.hpp"
#include "host/common/threads.hpp"
#include "host/propagate/propagator_engine.hpp"

namespace raywave::kernel {
#include "kernels/propagate/transfer.h"
}  // namespace raywave::kernel

namespace raywave {
namespace {

using Sample = std::complex<float>;

constexpr std::size_t tile_width = 16;  // columns: two cache lines
// Samples per thread below which waking it does not pay
constexpr std::size_t small_plane = std::size_t{256} * 256;

std::size_t size(int n) { return static_cast<std::size_t>(n); }

/// Input of multiply_add for `count` columns of one row: tables from the first of these columns on.
struct RowPart {
  const Sample* line;
  Sample* sum;
  const float *phase_x, *power_hi, *power_lo;
  const std::int32_t *first_row, *last_row;
  int count, row;
  int above_first, below_last;  // the first column, in the row's band
  float phase_y, v_hi, v_lo, depth_hi, depth_lo, scale;
  Fades fades;
};

/// sum += scale * line * H inside the band, as multiply_add in kernels/propagate/propagate.cl.
template <bool two_floats>
[[gnu::always_inline]] inline void multiply_add(const RowPart& p) {
  const float* __restrict line = reinterpret_cast<const float*>(p.line);
  float* __restrict sum = reinterpret_cast<float*>(p.sum);
  for (int i = 0; i < p.count; ++i) {
    const float remainder =
        two_floats ? kernel::remainder_turns_two_floats(p.power_hi[i], p.power_lo[i], p.v_hi,
                                                        p.v_lo, p.depth_hi, p.depth_lo)
                   : kernel::remainder_turns_float(p.power_hi[i], p.v_hi, p.depth_hi);
    float c, s;
    kernel::transfer_function(p.phase_x[i], p.phase_y, remainder, &c, &s);
    const float passed =
        kernel::fade(static_cast<float>(p.above_first + i), static_cast<float>(p.below_last - i),
                     p.fades.left, p.fades.right) *
        kernel::fade(static_cast<float>(p.row - p.first_row[i]),
                     static_cast<float>(p.last_row[i] - p.row), p.fades.first, p.fades.last);
    const float scale =
        (p.first_row[i] <= p.row) & (p.row <= p.last_row[i]) ? p.scale * passed : 0.0f;
    c *= scale;
    s *= scale;
    const float re = line[2 * i], im = line[2 * i + 1];
    sum[2 * i] += re * c - im * s;
    sum[2 * i + 1] += re * s + im * c;
  }
}

/// Rows of a plane between the passes, in tiles.
struct Rows {
  Band band;
  Lines tiles;
  std::size_t capacity = 0;  // samples
  bool once = false;         // nothing reads them after the next `collect`

  Sample* tile(std::size_t number) const {
    return tiles.get() + number * size(band.count()) * tile_width;
  }

  void reserve(const Band& rows, std::size_t tile_count) {
    band = rows;
    const std::size_t wanted = tile_count * size(band.count()) * tile_width;
    if (wanted <= capacity) return;
    capacity = 0;
    tiles.reset();
    tiles = make_lines(wanted, "rows of a padded plane");
    capacity = wanted;
  }
};

class HostEngine final : public PropagationEngine {
public:
  explicit HostEngine(const PropagationPlan& plan)
      : plan_(plan),
        nx_(size(plan.spec.size.x)),
        ny_(size(plan.spec.size.y)),
        padded_nx_(size(plan.x.padded)),
        padded_ny_(size(plan.y.padded)),
        tiles_((nx_ + tile_width - 1) / tile_width),
        row_fft_(padded_nx_),
        column_fft_(padded_ny_),
        threads_(std::clamp<std::size_t>(padded_nx_ * padded_ny_ / small_plane, 1,
                                         cl::Threads::shared().count())) {
    for (std::size_t i = 0; i < threads_; ++i) {
      Scratch s;
      const char* what = "lines of a padded plane";
      for (auto* row : {&s.row, &s.row_transformed, &s.row_sum})
        *row = make_zero_lines(padded_nx_, what);
      for (auto* columns : {&s.field_columns, &s.band_columns, &s.columns_transformed})
        *columns = make_zero_lines(tile_width * pitch_of_lines(padded_ny_), what);
      scratch_.push_back(std::move(s));
    }
  }

  void load(const cl::ComplexBuffer& field, int frame, const Band& rows, bool once) override {
    if (pending_.empty())
      source_ = 0;
    else if (pending_.back().source == source_)
      ++source_;
    if (source_ > 0 && size(rows.count()) * nx_ * (source_ + 1) > 2 * padded_nx_ * padded_ny_) {
      transform_rows(pending_rows(), false);
      source_ = 0;
    }
    if (source_ == sources_.size()) sources_.emplace_back();
    auto& source = sources_[source_];
    source.reserve(rows, tiles_);
    source.once = once;
    if (rows.empty()) return;
    field.on_host([&](std::span<const Sample> samples) { columns_forward(samples.data(), source); },
                  size(frame) * nx_ * ny_, nx_ * ny_);
  }

  void add(const std::shared_ptr<const Transfer>& transfer) override {
    pending_.push_back({source_, transfer});
  }

  void collect(cl::ComplexBuffer& field) override {
    const Band rows = pending_rows().joined(sum_rows_);
    if (rows.empty()) return field.fill_zero();
    if (!(rows.first == arrived_rows_.first && rows.last == arrived_rows_.last)) {
      for (auto& s : scratch_)
        std::fill_n(s.band_columns.get(), tile_width * pitch_of_lines(padded_ny_), Sample{});
    }
    arrived_rows_ = rows;
    find_places(rows);
    transform_rows(rows, true);
    field.on_host([&](std::span<Sample> samples) { columns_inverse(samples.data()); },
                  CL_MAP_WRITE_INVALIDATE_REGION);
  }

private:
  /// Lines of the padded plane, for one thread. These parts stay zero: right of the field in `row`,
  /// below the field in `field_columns`, and outside the band in `band_columns`.
  struct Scratch {
    Lines row, row_transformed, row_sum;
    Lines field_columns, band_columns, columns_transformed;
  };

  struct Pending {
    std::size_t source;
    std::shared_ptr<const Transfer> transfer;
  };

  /// Rows that come back, and whose memory they are written to.
  struct Place {
    Band rows;
    Rows* in;
  };

  /// A row comes back to where a source had it that nothing reads any more. Others need memory of
  /// their own.
  void find_places(const Band& rows) {
    places_.clear();
    for (int k = rows.first; k <= rows.last; k = places_.back().rows.last + 1) {
      Place place{{k, rows.last}, &more_};
      for (std::size_t i = 0; i <= source_ && !pending_.empty(); ++i) {
        if (!sources_[i].once) continue;
        const Band& band = sources_[i].band;
        if (band.contains(k))
          place = {{k, std::min(band.last, rows.last)}, &sources_[i]};
        else if (place.in == &more_ && band.first > k)
          place.rows.last = std::min(place.rows.last, band.first - 1);
      }
      if (place.in == &more_) more_.reserve(rows, tiles_);
      places_.push_back(place);
    }
  }

  const Rows& rows_with(int k) const {
    return *std::ranges::find_if(places_, [&](const Place& place) {
              return place.rows.contains(k);
            })->in;
  }

  Band pending_rows() const {
    Band rows;
    for (const auto& p : pending_) rows = rows.joined(p.transfer->rows);
    return rows;
  }

  std::size_t columns_of(std::size_t tile) const {
    return std::min(tile_width, nx_ - tile * tile_width);
  }

  /// Calls f(frequency of the first, place of the first in a transform, count) for the rows below
  /// and above zero frequency.
  void for_each_run(const Band& rows, const auto& f) const {
    if (rows.first < 0)
      f(rows.first, size(plan_.y.index(rows.first)),
        size(std::min(rows.last, -1) - rows.first + 1));
    if (rows.last >= 0)
      f(std::max(rows.first, 0), size(std::max(rows.first, 0)),
        size(rows.last - std::max(rows.first, 0) + 1));
  }

  /// Calls f(part of row k in its tile, its first column, columns) for all its parts; copies of
  /// constant size are quicker.
  void for_each_part(const Rows& rows, int k, const auto& f) const {
    for (std::size_t tile = 0; tile < tiles_; ++tile) {
      Sample* in_tile = rows.tile(tile) + size(k - rows.band.first) * tile_width;
      if (columns_of(tile) == tile_width) {
        f(in_tile, tile * tile_width, std::integral_constant<std::size_t, tile_width>());
      } else {
        f(in_tile, tile * tile_width, columns_of(tile));
      }
    }
  }

  /// WRPs reach beyond the light. A scan that ends at the first nonzero sample costs little.
  bool is_dark(const Sample* field_columns, std::size_t columns, std::size_t pitch) const {
    for (std::size_t c = 0; c < columns; ++c) {
      const Sample* column = field_columns + c * pitch;
      if (!std::all_of(column, column + ny_,
                       [](const Sample& sample) { return sample == Sample{}; }))
        return false;
    }
    return true;
  }

  void columns_forward(const Sample* field, Rows& rows) {
    const std::size_t pitch = pitch_of_lines(padded_ny_);
    cl::Threads::shared().for_each(threads_, tiles_, 1, [&](std::size_t thread, std::size_t tile) {
      auto& s = scratch_[thread];
      const std::size_t columns = columns_of(tile);
      transpose_(field + tile * tile_width, nx_, ny_, columns, s.field_columns.get(), pitch);
      if (is_dark(s.field_columns.get(), columns, pitch)) {
        std::fill_n(rows.tile(tile), size(rows.band.count()) * tile_width, Sample{});
        return;
      }
      for (std::size_t c = 0; c < columns; ++c)
        column_fft_.forward(s.field_columns.get() + c * pitch,
                            s.columns_transformed.get() + c * pitch);
      for_each_run(rows.band, [&](int first, std::size_t at, std::size_t count) {
        transpose_(s.columns_transformed.get() + at, pitch, columns, count,
                   rows.tile(tile) + size(first - rows.band.first) * tile_width, tile_width);
      });
    });
  }

  void columns_inverse(Sample* field) {
    const std::size_t pitch = pitch_of_lines(padded_ny_);
    cl::Threads::shared().for_each(threads_, tiles_, 1, [&](std::size_t thread, std::size_t tile) {
      auto& s = scratch_[thread];
      const std::size_t columns = columns_of(tile);
      for (const auto& [rows, in] : places_)
        for_each_run(rows, [&, from = in](int first, std::size_t at, std::size_t count) {
          transpose_(from->tile(tile) + size(first - from->band.first) * tile_width, tile_width,
                     count, columns, s.band_columns.get() + at, pitch);
        });
      for (std::size_t c = 0; c < columns; ++c)
        column_fft_.inverse(s.band_columns.get() + c * pitch,
                            s.columns_transformed.get() + c * pitch);
      transpose_(s.columns_transformed.get(), pitch, columns, ny_, field + tile * tile_width, nx_);
    });
  }

  /// Pending sources and the sum so far, row by row: back to `places_`, or into the sum.
  void transform_rows(const Band& rows, bool back) {
    if (!back && !sum_) sum_ = make_lines(padded_nx_ * padded_ny_, "sum of spectra");
    const auto sum_row = [&](int k) { return sum_.get() + size(plan_.y.index(k)) * padded_nx_; };
    const Band whole = rows.joined(sum_rows_);
    cl::Threads::shared().for_each(
        threads_, size(whole.count()), 4, [&](std::size_t thread, std::size_t i) {
          auto& s = scratch_[thread];
          const int k = whole.first + static_cast<int>(i);
          Sample* sum = back ? s.row_sum.get() : sum_row(k);
          if (back && sum_rows_.contains(k)) {
            std::copy_n(sum_row(k), padded_nx_, sum);
          } else if (!sum_rows_.contains(k)) {
            std::fill_n(sum, padded_nx_, Sample{});
          }
          for (const auto& p : pending_) add_row(s, p, k, sum);
          if (!back) return;
          row_fft_.inverse(sum, s.row_transformed.get());
          for_each_part(rows_with(k), k, [&](Sample* in_tile, std::size_t x, auto columns) {
            std::copy_n(s.row_transformed.get() + x, columns, in_tile);
          });
        });
    pending_.clear();
    sum_rows_ = back ? Band{} : whole;
  }

  /// Row k of one source, transformed and multiplied by its transfer function, onto `sum`.
  void add_row(Scratch& s, const Pending& p, int k, Sample* sum) const {
    const auto& t = *p.transfer;
    const int row = plan_.y.index(k);
    const Band kept = t.columns_of(row);
    if (kept.empty()) return;
    for_each_part(sources_[p.source], k, [&](const Sample* in_tile, std::size_t x, auto columns) {
      std::copy_n(in_tile, columns, s.row.get() + x);
    });
    row_fft_.forward(s.row.get(), s.row_transformed.get());

    const auto part = [&](int first, int last) {
      const int i = plan_.x.index(first);
      const RowPart work{s.row_transformed.get() + i,
                         sum + i,
                         t.phase_x.data() + i,
                         plan_.power_x.data() + i,
                         plan_.power_x.data() + padded_nx_ + i,
                         t.band_x.data() + i,
                         t.band_x.data() + padded_nx_ + i,
                         last - first + 1,
                         k,
                         first - kept.first,
                         kept.last - first,
                         t.phase_y[row],
                         plan_.power_y[row],
                         plan_.power_y[padded_ny_ + row],
                         t.depth_hi,
                         t.depth_lo,
                         static_cast<float>(plan_.scale),
                         t.fades};
      if (t.two_floats)
        for_this_cpu([&]() __attribute__((always_inline)) { multiply_add<true>(work); });
      else
        for_this_cpu([&]() __attribute__((always_inline)) { multiply_add<false>(work); });
    };
    if (kept.first < 0) part(kept.first, std::min(kept.last, -1));
    if (kept.last >= 0) part(std::max(kept.first, 0), kept.last);
  }

  PropagationPlan plan_;
  std::size_t nx_, ny_, padded_nx_, padded_ny_, tiles_;
  LineFft row_fft_, column_fft_;
  std::size_t threads_;
  Transpose transpose_ = transpose_here();
  std::vector<Scratch> scratch_;  // one per thread
  std::vector<Rows> sources_;     // loaded since the last `collect`, the last being number source_
  std::size_t source_ = 0;
  std::vector<Pending> pending_;  // added, not summed
  std::vector<Place> places_;     // of what comes back
  Rows more_;                     // the others of them
  Band arrived_rows_;
  Lines sum_;  // spectra of the rows sum_rows_; only where sources did not fit
  Band sum_rows_;
};

}  // namespace

std::unique_ptr<PropagationEngine> make_host_engine(const PropagationPlan& plan) {
  return std::make_unique<HostEngine>(plan);
}

}  // namespace raywave
