// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/virtual_planes/footprint_bins.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "host/common/error.hpp"
#include "host/plan/memory.hpp"
#include "kernels/gather/compact_layout.h"

namespace raywave {
namespace {

/// Numbers of the profiles of a batch.
std::size_t batch_floats_of(const cl::DeviceInfo& device) {
  const std::uint64_t bytes = device.kind == cl::DeviceKind::cpu
                                  ? most_cached_profile_bytes
                                  : std::min(most_profile_bytes, device.largest_buffer_bytes / 2);
  return static_cast<std::size_t>(bytes / sizeof(float));
}

constexpr int none = std::numeric_limits<int>::max();

/// Batches that the device lists at most; units of profiles of a sample at most, and samples whose
/// units 32 bits count for certain. The host divides what is more.
constexpr int most_batches = 1024, most_units = 640, most_samples = INT32_MAX / most_units;
/// Counts of bins, by parts of a batch that are counted side by side.
constexpr int most_chunks = 1024, most_counts = 1 << 22;

int floor_over(int value, int by) { return value >= 0 ? value / by : -((by - 1 - value) / by); }
int modulo(int value, int by) { return value - floor_over(value, by) * by; }

}  // namespace

FootprintBins::OnDevice::OnDevice(const cl::Device& device)
    : program(device, "kernels/gather/bins.cl", {}),
      weigh(program.kernel("weigh_footprints")),
      cut(program.kernel("cut_batches")),
      place(program.kernel("place_profiles")),
      list(program.kernel("list_bins")),
      sum_chunks(program.kernel("sum_chunks")),
      scan_weights(device),
      scan_bins(device),
      found(device, FOOTPRINT_BATCH(most_batches), "batches of samples") {}

FootprintBins::FootprintBins(const cl::Device& device, std::string scene, Counting counting,
                             std::size_t batch_floats)
    : device_(device),
      scene_(std::move(scene)),
      batch_floats_(batch_floats > 0 ? batch_floats : batch_floats_of(device.info())) {
  if (counting == Counting::on_device) on_device_.emplace(device);
}

void FootprintBins::find(const cl::Buffer<device::CompactFootprint>& footprints, int count,
                         glm::ivec2 size, bool is_whole) {
  const auto bins = size / COMPACT_BIN;
  batches.clear();
  left_ = none;
  right_ = -none;
  longest = 0;
  const bool on_device = on_device_ && divide_on_device(footprints, count, bins);
  if (!on_device) {
    footprints_.resize(static_cast<std::size_t>(count));
    footprints.read(footprints_);
    divide_on_host();
  }

  lit = {};
  int low = none, high = -none;  // rows of bins
  for (auto& batch : batches) {
    low = std::min(low, batch.first_row);
    high = std::max(high, batch.first_row + batch.rows);
    batch.rows = std::min(batch.rows, bins.y);
  }
  if (low < high) {
    const auto part = [](int first, int wanted, int all) {
      return LinePart{static_cast<std::size_t>(modulo(first, all)),
                      static_cast<std::size_t>(std::min(wanted, all))};
    };
    lit = {part(left_, right_ - left_, size.x),
           part(COMPACT_BIN * low, COMPACT_BIN * (high - low), size.y)};
  }
  add_dark_rows(size, is_whole ? LinePart{0, static_cast<std::size_t>(size.y)} : lit.y);
  if (on_device)
    list_on_device(footprints, bins);
  else
    list_on_host(bins);
}

void FootprintBins::require_few(std::int64_t entries) const {
  if (entries > 1 << 30)
    throw InputError(
        scene_ +
        ": samples light too many pixels of a virtual plane to be listed; give a larger "
        "sampling.pitch, more wrp.layers, or wrp.propagation \"spectrum\"");
}

/// Lists the samples that light some of the plane, since `profile` takes no others, in batches with
/// as many profiles as fit the memory for them. (Work-items that leave a kernel at once would idle
/// beside those that compute, and Intel's vectorizer (2024.18.7.0) makes wrong code of them: fields
/// were off by 0.25.)
void FootprintBins::divide_on_host() {
  lit_.clear();
  offset_.resize(footprints_.size());
  for (std::size_t i = 0; i < footprints_.size(); ++i) {
    const auto& f = footprints_[i];
    if (f.lines <= 0 || f.columns <= 0 || f.rows <= 0) continue;
    const auto floats = static_cast<std::size_t>(FOOTPRINT_UNIT * FOOTPRINT_UNITS(f));
    if (batches.empty() || batches.back().floats + floats > batch_floats_)
      batches.push_back({.first_sample = static_cast<int>(lit_.size()),
                         .first_row = none,
                         .floats = COMPACT_PACKET});
    auto& batch = batches.back();
    offset_[i] = static_cast<std::int32_t>(batch.floats);
    batch.floats += floats;
    ++batch.samples;
    lit_.push_back(static_cast<std::int32_t>(i));

    const int first = floor_over(f.top, COMPACT_BIN),
              end = floor_over(f.top + f.rows - 1, COMPACT_BIN) + 1;
    const int batch_end = batch.rows > 0 ? std::max(batch.first_row + batch.rows, end) : end;
    batch.first_row = std::min(batch.first_row, first);
    batch.rows = batch_end - batch.first_row;
    left_ = std::min(left_, f.left);
    right_ = std::max(right_, f.left + f.columns);
    longest = std::max({longest, f.columns, f.rows});
  }
}

/// The same on the device; false where it cannot count so many.
bool FootprintBins::divide_on_device(const cl::Buffer<device::CompactFootprint>& footprints,
                                     int count, glm::ivec2 bins) {
  if (count > most_samples) return false;
  if (count == 0) return true;
  auto& d = *on_device_;
  const auto all = static_cast<std::size_t>(count);
  const cl::Range group{64};
  make_room(device_, d.weights, all + 1, "weights of samples");
  make_room(device_, lit_samples, all, "samples that light the plane");
  make_room(device_, offsets, all, "places of profiles");
  d.weigh.run({all}, group, footprints, count, d.weights);
  d.scan_weights.run(d.weights, 0, count);
  const auto units = static_cast<std::int32_t>((batch_floats_ - COMPACT_PACKET) / FOOTPRINT_UNIT);
  d.cut.run({1}, {1}, d.weights, count, std::max(units, most_units), most_batches, d.found);
  d.place.run({all}, group, footprints, d.weights, count, bins.x, bins.y, lit_samples, offsets,
              d.found);
  const auto found = d.found.read();
  int samples = 0;
  for (int number = 0; number < found[FOUND_BATCHES]; ++number) {
    const auto* batch = &found[static_cast<std::size_t>(FOOTPRINT_BATCH(number))];
    batches.push_back(
        {.first_sample = batch[BATCH_FIRST],
         .samples = batch[BATCH_SAMPLES],
         .first_row = batch[BATCH_TOP],
         .rows = batch[BATCH_BOTTOM] - batch[BATCH_TOP] + 1,
         .floats = static_cast<std::size_t>(COMPACT_PACKET + FOOTPRINT_UNIT * batch[BATCH_UNITS]),
         .entries = batch[BATCH_ENTRIES]});
    samples += batch[BATCH_SAMPLES];
  }
  left_ = found[FOUND_LEFT];
  right_ = found[FOUND_RIGHT];
  longest = found[FOUND_LONGEST];
  if (samples == found[FOUND_SAMPLES]) return true;
  batches.clear();
  left_ = none;
  right_ = -none;
  return false;
}

/// Adds batches without samples for the wanted rows of pixels, of whole bins, that no batch lights,
/// and tells which rows of bins each batch is the first to fill.
void FootprintBins::add_dark_rows(glm::ivec2 size, const LinePart& wanted) {
  const int across = size.x / COMPACT_BIN, down = size.y / COMPACT_BIN;
  std::vector<char> is_filled(static_cast<std::size_t>(down), 0);
  std::vector<std::int32_t> fresh;
  std::int64_t bins = 0;
  const auto add_rows = [&](Batch& batch) {
    batch.first_bin = static_cast<int>(bins);
    bins += std::int64_t{batch.rows} * across;
    require_few(bins);
    for (int row = 0; row < batch.rows; ++row) {
      auto& filled = is_filled[static_cast<std::size_t>(modulo(batch.first_row + row, down))];
      fresh.push_back(filled ? 0 : 1);
      filled = 1;
    }
  };
  for (auto& batch : batches) add_rows(batch);
  const auto is_dark = [&](int row) {
    const auto from_first =
        modulo(COMPACT_BIN * row - static_cast<int>(wanted.first), size.y);  // pixels
    return !is_filled[static_cast<std::size_t>(row)] && from_first < static_cast<int>(wanted.count);
  };
  for (int row = 0; row < down; ++row) {
    if (!is_dark(row)) continue;
    int end = row;
    while (end < down && is_dark(end)) ++end;
    batches.push_back({.first_row = row, .rows = end - row});
    add_rows(batches.back());
  }
  upload(device_, fresh, is_fresh, "rows of bins");
}

/// A counting sort: lengths of the lists, where they begin, and then the samples.
void FootprintBins::list_on_host(glm::ivec2 bins) {
  std::size_t count = 0;
  for (const auto& batch : batches)
    count += static_cast<std::size_t>(batch.rows) * static_cast<std::size_t>(bins.x);
  std::vector<std::int32_t> first(count + 1, 0), samples;
  const auto for_each_entry = [&](const auto& use) {
    for (auto& batch : batches) {
      for (int place = batch.first_sample; place < batch.first_sample + batch.samples; ++place) {
        const int i = lit_[static_cast<std::size_t>(place)];
        const auto& f = footprints_[static_cast<std::size_t>(i)];
        const int left = floor_over(f.left, COMPACT_BIN),
                  columns =
                      std::min(bins.x, floor_over(f.left + f.columns - 1, COMPACT_BIN) - left + 1),
                  top = floor_over(f.top, COMPACT_BIN),
                  rows = std::min(bins.y, floor_over(f.top + f.rows - 1, COMPACT_BIN) - top + 1);
        for (int row = 0; row < rows; ++row) {
          const int begin = batch.first_bin + modulo(top + row - batch.first_row, bins.y) * bins.x;
          for (int column = 0; column < columns; ++column)
            use(batch, static_cast<std::size_t>(begin + modulo(left + column, bins.x)), i);
        }
      }
    }
  };
  std::int64_t entries = 0;
  for_each_entry([&](Batch& batch, std::size_t bin, int) {
    ++first[bin + 1];
    ++batch.entries;
    ++entries;
  });
  require_few(entries);
  for (std::size_t bin = 0; bin < count; ++bin) first[bin + 1] += first[bin];
  samples.resize(static_cast<std::size_t>(entries));
  auto next = first;
  for_each_entry([&](Batch&, std::size_t bin, int sample) {
    samples[static_cast<std::size_t>(next[bin]++)] = sample;
  });
  upload(device_, offset_, offsets, "places of profiles");
  upload(device_, lit_, lit_samples, "samples that light the plane");
  upload(device_, first, first_of_bin, "bins of samples");
  upload(device_, samples, bin_samples, "samples of bins");
}

/// The same on the device: chunks of a batch are counted side by side, and then listed.
void FootprintBins::list_on_device(const cl::Buffer<device::CompactFootprint>& footprints,
                                   glm::ivec2 bins) {
  auto& d = *on_device_;
  std::int64_t all_bins = 0, all_entries = 0;
  for (const auto& batch : batches) {
    all_bins += std::int64_t{batch.rows} * bins.x;
    all_entries += batch.entries;
  }
  require_few(all_entries);
  make_room(device_, lit_samples, 1, "samples that light the plane");
  make_room(device_, offsets, 1, "places of profiles");
  make_room(device_, first_of_bin, static_cast<std::size_t>(all_bins) + 1, "bins of samples");
  make_room(device_, bin_samples, static_cast<std::size_t>(std::max<std::int64_t>(all_entries, 1)),
            "samples of bins");
  int entries = 0;
  for (const auto& batch : batches) {
    const int in_batch = batch.rows * bins.x,
              most = std::clamp(most_counts / std::max(in_batch, 1), 1, most_chunks),
              chunk = std::max(1, (batch.samples + most - 1) / most),
              chunks = std::max(1, (batch.samples + chunk - 1) / chunk);
    make_room(device_, d.counts,
              static_cast<std::size_t>(chunks) * static_cast<std::size_t>(in_batch),
              "counts of bins");
    d.counts.fill_zero();
    const auto list = [&](int is_filling) {
      d.list.run({static_cast<std::size_t>(chunks)}, {64}, footprints, lit_samples,
                 batch.first_sample, batch.samples, chunk, chunks, bins.x, bins.y, batch.first_row,
                 in_batch, batch.first_bin, is_filling, first_of_bin, d.counts, bin_samples);
    };
    list(0);
    d.sum_chunks.run({static_cast<std::size_t>(in_batch)}, {64}, d.counts, chunks, in_batch,
                     batch.first_bin, first_of_bin);
    d.scan_bins.run(first_of_bin, batch.first_bin, in_batch, entries);
    list(1);
    entries += static_cast<int>(batch.entries);
  }
}

}  // namespace raywave
