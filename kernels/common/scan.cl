// SPDX-License-Identifier: Apache-2.0
// Exclusive sums in place (host/trace/scan.hpp): values[first + i] becomes `base` plus the sum of
// the i values from values[first] on, and values[first + count] `base` plus that of all `count`.
//
// sum_segments   sums[s]: sum of segment s, `segment` values from s * segment on; segments beyond
//                the values are empty
// scan_sums      the same of the sums, in place; one work-item
// scan_segments  the sums in each segment, from where the segments before it end
//
// For T: int, int2. A work-item takes one segment. OpenCL C 1.2.
#define DEFINE_SCAN(T)                                                                        \
  __kernel void sum_segments_##T(__global const T* values, int first, int count, int segment, \
                                 __global T* sums) {                                          \
    const int number = (int)get_global_id(0);                                                 \
    T sum = 0;                                                                                \
    for (int i = number * segment; i < min((number + 1) * segment, count); ++i)               \
      sum += values[first + i];                                                               \
    sums[number] = sum;                                                                       \
  }                                                                                           \
  __kernel void scan_sums_##T(__global T* sums, int segments, T base) {                       \
    T sum = base;                                                                             \
    for (int i = 0; i < segments; ++i) {                                                      \
      const T own = sums[i];                                                                  \
      sums[i] = sum;                                                                          \
      sum += own;                                                                             \
    }                                                                                         \
  }                                                                                           \
  __kernel void scan_segments_##T(__global T* values, int first, int count, int segment,      \
                                  __global const T* sums) {                                   \
    const int number = (int)get_global_id(0), end = min((number + 1) * segment, count);       \
    T sum = sums[number];                                                                     \
    for (int i = number * segment; i < end; ++i) {                                            \
      const T own = values[first + i];                                                        \
      values[first + i] = sum;                                                                \
      sum += own;                                                                             \
    }                                                                                         \
    if (number + 1 == (int)get_global_size(0)) values[first + count] = sum;                   \
  }

DEFINE_SCAN(int)
DEFINE_SCAN(int2)
