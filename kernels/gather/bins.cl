// SPDX-License-Identifier: Apache-2.0
// Lists of the samples that light each bin of a virtual plane, made on the device. They are what
// host/carriers/virtual_planes/footprint_bins.cpp makes on the host: samples of a bin in the order
// of their numbers. Atomic operations find sums, least and greatest numbers only, which no order
// changes.
//
// weigh_footprints  weights[i]: whether sample i lights some of the plane, and the units of
//                   FOOTPRINT_UNIT floats that its profiles take; then their exclusive sums
// cut_batches       one work-item: batches of samples whose profiles take at most `most_units`
//                   (FOOTPRINT_BATCHES in compact_layout.h)
// place_profiles    lit_samples: the samples that light some, and offsets[i]: where the profiles of
//                   each begin; and the parts of the plane that batches light
// list_bins         work-item c counts in counts[c * bins + b] the samples of its chunk of a batch
//                   that light bin b. With is_filling, it lists them in place of that
// sum_chunks        one work-item for each bin of a batch: counts become where chunks begin in the
//                   bin's list, and first_of_bin its length
//
// OpenCL C 1.2.
#include "kernels/common/shared.h"
#include "kernels/gather/compact_layout.h"

static inline int floor_over(int value, int by) {
  return value >= 0 ? value / by : -((by - 1 - value) / by);
}
static inline int modulo(int value, int by) { return value - floor_over(value, by) * by; }

__kernel void weigh_footprints(__global const CompactFootprint* footprints, int count,
                               __global int2* weights) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const CompactFootprint f = footprints[i];
  const bool lights = f.lines > 0 && f.columns > 0 && f.rows > 0;
  weights[i] = lights ? (int2)(1, FOOTPRINT_UNITS(f)) : (int2)(0, 0);
}

// The first element from `low` on, up to `high`, whose weight in front exceeds `most`.
static inline int first_above(__global const int2* weights, int low, int high, int most) {
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (weights[middle].y > most)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

__kernel void cut_batches(__global const int2* weights, int count, int most_units, int most_batches,
                          __global int* found) {
  int batches = 0;
  for (int first = 0; weights[first].x < weights[count].x && batches < most_batches; ++batches) {
    // Weights of samples that light nothing are 0: the batch ends before the first that exceeds it.
    const int begin = weights[first].y,
              end = first_above(weights, first + 1, count + 1, begin + most_units) - 1;
    __global int* batch = found + FOOTPRINT_BATCH(batches);
    batch[BATCH_FIRST] = weights[first].x;
    batch[BATCH_SAMPLES] = weights[end].x - weights[first].x;
    batch[BATCH_BEGIN] = begin;
    batch[BATCH_UNITS] = weights[end].y - begin;
    batch[BATCH_TOP] = INT_MAX;
    batch[BATCH_BOTTOM] = INT_MIN;
    batch[BATCH_ENTRIES] = 0;
    first = end;
  }
  found[FOUND_BATCHES] = batches;
  found[FOUND_SAMPLES] = weights[count].x;
  found[FOUND_LEFT] = INT_MAX;
  found[FOUND_RIGHT] = INT_MIN;
  found[FOUND_LONGEST] = 0;
}

// The bins that a footprint lights; columns and rows may lie beyond the plane.
typedef struct {
  int left, columns, top, rows;
} LitBins;

static inline LitBins lit_bins(const CompactFootprint* f, int across, int down) {
  LitBins lit;
  lit.left = floor_over(f->left, COMPACT_BIN);
  lit.columns = min(across, floor_over(f->left + f->columns - 1, COMPACT_BIN) - lit.left + 1);
  lit.top = floor_over(f->top, COMPACT_BIN);
  lit.rows = min(down, floor_over(f->top + f->rows - 1, COMPACT_BIN) - lit.top + 1);
  return lit;
}

__kernel void place_profiles(__global const CompactFootprint* footprints,
                             __global const int2* weights, int count, int across, int down,
                             __global int* lit_samples, __global int* offsets,
                             __global int* found) {
  const int i = (int)get_global_id(0);
  if (i >= count || weights[i + 1].x == weights[i].x) return;
  const int place = weights[i].x, batches = found[FOUND_BATCHES];
  int number = 0;
  while (number + 1 < batches && found[FOOTPRINT_BATCH(number + 1) + BATCH_FIRST] <= place)
    ++number;
  __global int* batch = found + FOOTPRINT_BATCH(number);
  lit_samples[place] = i;
  offsets[i] = COMPACT_PACKET + FOOTPRINT_UNIT * (weights[i].y - batch[BATCH_BEGIN]);

  const CompactFootprint f = footprints[i];
  const LitBins lit = lit_bins(&f, across, down);
  atomic_min(batch + BATCH_TOP, lit.top);
  atomic_max(batch + BATCH_BOTTOM, floor_over(f.top + f.rows - 1, COMPACT_BIN));
  atomic_add(batch + BATCH_ENTRIES, lit.columns * lit.rows);
  atomic_min(found + FOUND_LEFT, f.left);
  atomic_max(found + FOUND_RIGHT, f.left + f.columns);
  atomic_max(found + FOUND_LONGEST, max(f.columns, f.rows));
}

__kernel void list_bins(__global const CompactFootprint* footprints,
                        __global const int* lit_samples, int first_sample, int samples, int chunk,
                        int chunks, int across, int down, int first_row, int bins, int first_bin,
                        int is_filling, __global const int* first_of_bin, __global int* counts,
                        __global int* bin_samples) {
  const int number = (int)get_global_id(0);
  if (number >= chunks) return;
  __global int* own = counts + (size_t)number * (size_t)bins;
  for (int place = number * chunk; place < min((number + 1) * chunk, samples); ++place) {
    const int i = lit_samples[first_sample + place];
    const CompactFootprint f = footprints[i];
    const LitBins lit = lit_bins(&f, across, down);
    for (int row = 0; row < lit.rows; ++row) {
      for (int column = 0; column < lit.columns; ++column) {
        const int bin =
            modulo(lit.top + row - first_row, down) * across + modulo(lit.left + column, across);
        const int before = own[bin]++;
        if (is_filling) bin_samples[first_of_bin[first_bin + bin] + before] = i;
      }
    }
  }
}

__kernel void sum_chunks(__global int* counts, int chunks, int bins, int first_bin,
                         __global int* first_of_bin) {
  const int bin = (int)get_global_id(0);
  if (bin >= bins) return;
  int sum = 0;
  for (int chunk = 0; chunk < chunks; ++chunk) {
    __global int* count = counts + (size_t)chunk * (size_t)bins + (size_t)bin;
    const int own = *count;
    *count = sum;
    sum += own;
  }
  first_of_bin[first_bin + bin] = sum;
}
