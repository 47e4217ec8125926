// SPDX-License-Identifier: Apache-2.0
// Lanes: one work-item handles RAYWAVE_LANES neighbours side by side. CPUs need as many lanes as
// their SIMD width, because PoCL vectorises no divergent loop by itself; GPUs need 1. Masks come
// from comparisons: combine them with !, & and | only, since true is -1 in a vector and 1 in a
// scalar.
#ifndef RAYWAVE_LANES_H
#define RAYWAVE_LANES_H

#include "kernels/common/options.h"

// Long functions that are called in several places, or once from long kernels: on CPUs they are
// compiled alone and called, which halves the compiler's time. Other devices have no calls.
#if RAYWAVE_LANES == 1
#define CALLED static inline
#else
#define CALLED static inline __attribute__((noinline))
#endif

#if RAYWAVE_LANES == 1
typedef float floatv;
typedef int intv;
typedef uint uintv;
#define LANES_ANY(mask) ((mask) != 0)
#define LANES_SELECT(no, yes, mask) ((mask) ? (yes) : (no))
#define LANES_LOAD(p) (*(p))
#define LANES_STORE(v, p) (*(p) = (v))
#define LANES_INDEX 0
#define LANES_FIRST(v) (v)
#define LANES_REVERSED(v) (v)
#define LANES_AS_INT(v) as_int(v)
#define LANES_AS_UINT(v) as_uint(v)
#define LANES_AS_FLOAT(v) as_float(v)
#define LANES_TO_FLOAT(v) convert_float(v)
#define LANES_TO_INT(v) convert_int(v)
#else
#define LANES_PASTE_(a, b) a##b
#define LANES_PASTE(a, b) LANES_PASTE_(a, b)
typedef LANES_PASTE(float, RAYWAVE_LANES) floatv;
typedef LANES_PASTE(int, RAYWAVE_LANES) intv;
typedef LANES_PASTE(uint, RAYWAVE_LANES) uintv;
#define LANES_ANY(mask) lanes_any(mask)
#define LANES_SELECT(no, yes, mask) select(no, yes, mask)
#define LANES_FIRST(v) ((v).s0)
#define LANES_LOAD(p) LANES_PASTE(vload, RAYWAVE_LANES)(0, p)
#define LANES_STORE(v, p) LANES_PASTE(vstore, RAYWAVE_LANES)(v, 0, p)
#define LANES_AS_INT(v) LANES_PASTE(as_int, RAYWAVE_LANES)(v)
#define LANES_AS_UINT(v) LANES_PASTE(as_uint, RAYWAVE_LANES)(v)
#define LANES_AS_FLOAT(v) LANES_PASTE(as_float, RAYWAVE_LANES)(v)
#define LANES_TO_FLOAT(v) LANES_PASTE(convert_float, RAYWAVE_LANES)(v)
#define LANES_TO_INT(v) LANES_PASTE(convert_int, RAYWAVE_LANES)(v)
#if RAYWAVE_LANES == 4
#define LANES_INDEX ((intv)(0, 1, 2, 3))
#define LANES_REVERSED(v) ((v).s3210)
#elif RAYWAVE_LANES == 8
#define LANES_INDEX ((intv)(0, 1, 2, 3, 4, 5, 6, 7))
#define LANES_REVERSED(v) ((v).s76543210)
#else
#define LANES_INDEX ((intv)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#define LANES_REVERSED(v) ((v).sfedcba9876543210)
#endif

// True when any lane of the mask is true. PoCL turns any(int16) into 16 tests and branches; halving
// the vector takes a few instructions.
static inline bool lanes_any(intv mask) {
#if RAYWAVE_LANES == 16
  const int8 eight = mask.lo | mask.hi;
  const int4 four = eight.lo | eight.hi;
#elif RAYWAVE_LANES == 8
  const int4 four = mask.lo | mask.hi;
#else
  const int4 four = mask;
#endif
  const long2 two = as_long2(four);
  return (two.x | two.y) != 0;
}
#endif

// Sum over the lanes. For words that have different bits set, this is their union.
static inline int lanes_sum(intv v) {
#if RAYWAVE_LANES == 1
  return v;
#else
#if RAYWAVE_LANES == 16
  const int8 eight = v.lo + v.hi;
  const int4 four = eight.lo + eight.hi;
#elif RAYWAVE_LANES == 8
  const int4 four = v.lo + v.hi;
#else
  const int4 four = v;
#endif
  return (four.x + four.y) + (four.z + four.w);
#endif
}

// The same of floats.
static inline float lanes_float_sum(floatv v) {
#if RAYWAVE_LANES == 1
  return v;
#else
#if RAYWAVE_LANES == 16
  const float8 eight = v.lo + v.hi;
  const float4 four = eight.lo + eight.hi;
#elif RAYWAVE_LANES == 8
  const float4 four = v.lo + v.hi;
#else
  const float4 four = v;
#endif
  return (four.x + four.y) + (four.z + four.w);
#endif
}

// The k-th of n rows: from the middle outwards on CPUs, whose drivers give each thread many
// work-groups at first and few in the end. Rows of the middle have most to do; the last ones, with
// little, let all threads end together. GPUs take rows in order, so that groups stay coherent.
static inline int row_in_turn(int k, int n) {
#if RAYWAVE_LANES == 1 || defined(RAYWAVE_FPGA)
  (void)n;
  return k;
#else
  return n / 2 + ((k & 1) != 0 ? -((k + 1) / 2) : k / 2);
#endif
}

#endif
