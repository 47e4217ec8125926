// SPDX-License-Identifier: Apache-2.0
// Lengths of some 48 bits, RAYWAVE_LANES side by side: pairs of floats whose sum is meant, or
// doubles. A path of a metre is more than 10^6 wavelengths; floats hold its phase only once whole
// turns are taken off.
//
// Relative error of sum, product, quotient and root <= 2^-44 (of a sum: relative to the larger
// term). After Dekker, Numer. Math. 18, 224 (1971), and Joldes, Muller & Popescu, ACM Trans. Math.
// Softw. 44, 15res (2017).
#ifndef RAYWAVE_WIDE_H
#define RAYWAVE_WIDE_H

#include "kernels/common/lanes.h"
#include "kernels/common/options.h"
#include "kernels/common/phase.h"

#if RAYWAVE_PRECISION == PRECISION_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#if RAYWAVE_LANES == 1
typedef double Wide;
#define WIDE_CONVERT(v) convert_double(v)
#define WIDE_TO_FLOAT(w) convert_float(w)
#else
typedef LANES_PASTE(double, RAYWAVE_LANES) Wide;
#define WIDE_CONVERT(v) LANES_PASTE(convert_double, RAYWAVE_LANES)(v)
#define WIDE_TO_FLOAT(w) LANES_PASTE(convert_float, RAYWAVE_LANES)(w)
#endif

static inline Wide wide(floatv hi, floatv lo) { return WIDE_CONVERT(hi) + WIDE_CONVERT(lo); }
static inline floatv wide_high(Wide a) { return WIDE_TO_FLOAT(a); }
static inline floatv wide_low(Wide a) { return WIDE_TO_FLOAT(a - WIDE_CONVERT(wide_high(a))); }
static inline Wide wide_plus(Wide a, Wide b) { return a + b; }
static inline Wide wide_minus(Wide a, Wide b) { return a - b; }
static inline Wide wide_times(Wide a, Wide b) { return a * b; }
static inline Wide wide_over(Wide a, Wide b) { return a / b; }
static inline Wide wide_sqrt(Wide a) { return sqrt(a); }
static inline floatv wide_turns(Wide turns) { return WIDE_TO_FLOAT(turns - rint(turns)); }
#else
typedef struct {
  floatv hi, lo;
} Wide;

// |lo| may be as large as an ulp of hi, or hi may be zero.
static inline Wide wide(floatv hi, floatv lo) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv sum = hi + lo;
  const Wide w = {sum, lo - (sum - hi)};
  return w;
}

static inline floatv wide_high(Wide a) { return a.hi; }
static inline floatv wide_low(Wide a) { return a.lo; }

static inline Wide wide_plus(Wide a, Wide b) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv sum = a.hi + b.hi;
  const floatv part = sum - a.hi;
  const floatv error = (a.hi - (sum - part)) + (b.hi - part);
  return wide(sum, error + (a.lo + b.lo));
}

static inline Wide wide_minus(Wide a, Wide b) {
  const Wide negated = {-b.hi, -b.lo};
  return wide_plus(a, negated);
}

static inline Wide wide_times(Wide a, Wide b) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv product = a.hi * b.hi;
  const floatv error = fma(a.hi, b.hi, -product);
  return wide(product, fma(a.hi, b.lo, fma(a.lo, b.hi, error)));
}

static inline Wide wide_over(Wide a, Wide b) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv quotient = a.hi / b.hi;
  const floatv rest = fma(-quotient, b.hi, a.hi) + fma(-quotient, b.lo, a.lo);
  return wide(quotient, rest / b.hi);
}

// One step of Newton's method from the rounded root. a >= 0.
static inline Wide wide_sqrt(Wide a) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv root = sqrt(a.hi);
  const floatv rest = fma(-root, root, a.hi) + a.lo;
  return wide(root, rest / fmax(root + root, (floatv)(1e-30f)));
}

// Reduced turns. Beyond 2^22 turns a float's rounding to whole ones leaves some over, which the
// second step takes.
static inline floatv wide_turns(Wide turns) {
  return turns_reduced(turns_reduced(turns.hi)) + turns.lo;
}
#endif

static inline Wide wide_select(Wide no, Wide yes, intv mask) {
  return wide(LANES_SELECT(wide_high(no), wide_high(yes), mask),
              LANES_SELECT(wide_low(no), wide_low(yes), mask));
}

// Vectors.
typedef struct {
  Wide x, y, z;
} Wide3;

static inline Wide3 wide3(floatv x, floatv y, floatv z) {
  const Wide3 v = {wide(x, 0.0f), wide(y, 0.0f), wide(z, 0.0f)};
  return v;
}

static inline Wide3 wide3_minus(Wide3 a, Wide3 b) {
  const Wide3 v = {wide_minus(a.x, b.x), wide_minus(a.y, b.y), wide_minus(a.z, b.z)};
  return v;
}

static inline Wide3 wide3_scaled(Wide3 a, Wide s) {
  const Wide3 v = {wide_times(a.x, s), wide_times(a.y, s), wide_times(a.z, s)};
  return v;
}

// a + b s
static inline Wide3 wide3_along(Wide3 a, Wide3 b, Wide s) {
  const Wide3 v = {wide_plus(a.x, wide_times(b.x, s)), wide_plus(a.y, wide_times(b.y, s)),
                   wide_plus(a.z, wide_times(b.z, s))};
  return v;
}

static inline Wide wide3_dot(Wide3 a, Wide3 b) {
  return wide_plus(wide_plus(wide_times(a.x, b.x), wide_times(a.y, b.y)), wide_times(a.z, b.z));
}

static inline Wide3 wide3_cross(Wide3 a, Wide3 b) {
  const Wide3 v = {wide_minus(wide_times(a.y, b.z), wide_times(a.z, b.y)),
                   wide_minus(wide_times(a.z, b.x), wide_times(a.x, b.z)),
                   wide_minus(wide_times(a.x, b.y), wide_times(a.y, b.x))};
  return v;
}

// Places i pitch.
static inline Wide wide_steps(intv i, float pitch, float pitch_low) {
  return wide_times(wide(LANES_TO_FLOAT(i), 0.0f), wide(pitch, pitch_low));
}

// Reduced turns of a straight path, `rate` turns per metre, and its length.
static inline floatv path_turns(Wide dx, Wide dy, Wide dz, Wide rate, floatv* length) {
  const Wide3 way = {dx, dy, dz};
  const Wide root = wide_sqrt(wide3_dot(way, way));
  *length = wide_high(root);
  return wide_turns(wide_times(root, rate));
}

#endif
