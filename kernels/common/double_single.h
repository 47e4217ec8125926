// SPDX-License-Identifier: Apache-2.0
// Double-single numbers: RAYWAVE_LANES numbers of about 48 bits side by side, each the unevaluated
// sum of two floats. With RAYWAVE_PRECISION PRECISION_DOUBLE they are doubles. Optical paths need
// them: a path of a metre is more than 10^6 wavelengths, so that floats hold its phase only after
// whole turns are subtracted.
//
// Relative error of sum, product, quotient and square root <= 2^-44 (sum: relative to the larger
// term). After Dekker, Numer. Math. 18, 224 (1971), and Joldes, Muller & Popescu, ACM Trans. Math.
// Softw. 44, 15res (2017).
#ifndef RAYWAVE_DOUBLE_SINGLE_H
#define RAYWAVE_DOUBLE_SINGLE_H

#include "kernels/common/lanes.h"
#include "kernels/common/options.h"
#include "kernels/common/phase.h"

#if RAYWAVE_PRECISION == PRECISION_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#if RAYWAVE_LANES == 1
typedef double DoubleSingle;
#define DS_CONVERT(v) convert_double(v)
#define DS_TO_FLOAT(w) convert_float(w)
#else
typedef LANES_PASTE(double, RAYWAVE_LANES) DoubleSingle;
#define DS_CONVERT(v) LANES_PASTE(convert_double, RAYWAVE_LANES)(v)
#define DS_TO_FLOAT(w) LANES_PASTE(convert_float, RAYWAVE_LANES)(w)
#endif

static inline DoubleSingle ds(floatv hi, floatv lo) { return DS_CONVERT(hi) + DS_CONVERT(lo); }
static inline floatv ds_high(DoubleSingle a) { return DS_TO_FLOAT(a); }
static inline floatv ds_low(DoubleSingle a) { return DS_TO_FLOAT(a - DS_CONVERT(ds_high(a))); }
static inline DoubleSingle ds_plus(DoubleSingle a, DoubleSingle b) { return a + b; }
static inline DoubleSingle ds_minus(DoubleSingle a, DoubleSingle b) { return a - b; }
static inline DoubleSingle ds_times(DoubleSingle a, DoubleSingle b) { return a * b; }
static inline DoubleSingle ds_over(DoubleSingle a, DoubleSingle b) { return a / b; }
static inline DoubleSingle ds_sqrt(DoubleSingle a) { return sqrt(a); }
static inline floatv ds_turns(DoubleSingle turns) { return DS_TO_FLOAT(turns - rint(turns)); }
#else
typedef struct {
  floatv hi, lo;
} DoubleSingle;

// hi + lo as a double-single number. |lo| may be as large as an ulp of hi, and hi may be zero.
static inline DoubleSingle ds(floatv hi, floatv lo) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv sum = hi + lo;
  const DoubleSingle w = {sum, lo - (sum - hi)};
  return w;
}

static inline floatv ds_high(DoubleSingle a) { return a.hi; }
static inline floatv ds_low(DoubleSingle a) { return a.lo; }

static inline DoubleSingle ds_plus(DoubleSingle a, DoubleSingle b) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv sum = a.hi + b.hi;
  const floatv part = sum - a.hi;
  const floatv error = (a.hi - (sum - part)) + (b.hi - part);
  return ds(sum, error + (a.lo + b.lo));
}

static inline DoubleSingle ds_minus(DoubleSingle a, DoubleSingle b) {
  const DoubleSingle negated = {-b.hi, -b.lo};
  return ds_plus(a, negated);
}

static inline DoubleSingle ds_times(DoubleSingle a, DoubleSingle b) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv product = a.hi * b.hi;
  const floatv error = fma(a.hi, b.hi, -product);
  return ds(product, fma(a.hi, b.lo, fma(a.lo, b.hi, error)));
}

static inline DoubleSingle ds_over(DoubleSingle a, DoubleSingle b) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv quotient = a.hi / b.hi;
  const floatv rest = fma(-quotient, b.hi, a.hi) + fma(-quotient, b.lo, a.lo);
  return ds(quotient, rest / b.hi);
}

// Square root for a >= 0: one step of Newton's method from the rounded root.
static inline DoubleSingle ds_sqrt(DoubleSingle a) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv root = sqrt(a.hi);
  const floatv rest = fma(-root, root, a.hi) + a.lo;
  return ds(root, rest / fmax(root + root, (floatv)(1e-30f)));
}

// Reduced turns. Beyond 2^22 turns the first reduction leaves whole turns over, because a float
// rounds there to more than one turn; the second reduction removes them.
static inline floatv ds_turns(DoubleSingle turns) {
  return turns_reduced(turns_reduced(turns.hi)) + turns.lo;
}
#endif

static inline DoubleSingle ds_select(DoubleSingle no, DoubleSingle yes, intv mask) {
  return ds(LANES_SELECT(ds_high(no), ds_high(yes), mask),
            LANES_SELECT(ds_low(no), ds_low(yes), mask));
}

// Vectors of double-single numbers.
typedef struct {
  DoubleSingle x, y, z;
} DoubleSingle3;

static inline DoubleSingle3 ds3(floatv x, floatv y, floatv z) {
  const DoubleSingle3 v = {ds(x, 0.0f), ds(y, 0.0f), ds(z, 0.0f)};
  return v;
}

static inline DoubleSingle3 ds3_minus(DoubleSingle3 a, DoubleSingle3 b) {
  const DoubleSingle3 v = {ds_minus(a.x, b.x), ds_minus(a.y, b.y), ds_minus(a.z, b.z)};
  return v;
}

static inline DoubleSingle3 ds3_scaled(DoubleSingle3 a, DoubleSingle s) {
  const DoubleSingle3 v = {ds_times(a.x, s), ds_times(a.y, s), ds_times(a.z, s)};
  return v;
}

// a + b s
static inline DoubleSingle3 ds3_along(DoubleSingle3 a, DoubleSingle3 b, DoubleSingle s) {
  const DoubleSingle3 v = {ds_plus(a.x, ds_times(b.x, s)), ds_plus(a.y, ds_times(b.y, s)),
                           ds_plus(a.z, ds_times(b.z, s))};
  return v;
}

static inline DoubleSingle ds3_dot(DoubleSingle3 a, DoubleSingle3 b) {
  return ds_plus(ds_plus(ds_times(a.x, b.x), ds_times(a.y, b.y)), ds_times(a.z, b.z));
}

static inline DoubleSingle3 ds3_cross(DoubleSingle3 a, DoubleSingle3 b) {
  const DoubleSingle3 v = {ds_minus(ds_times(a.y, b.z), ds_times(a.z, b.y)),
                           ds_minus(ds_times(a.z, b.x), ds_times(a.x, b.z)),
                           ds_minus(ds_times(a.x, b.y), ds_times(a.y, b.x))};
  return v;
}

// i times the pitch.
static inline DoubleSingle ds_steps(intv i, float pitch, float pitch_low) {
  return ds_times(ds(LANES_TO_FLOAT(i), 0.0f), ds(pitch, pitch_low));
}

// Reduced turns of a straight path with `rate` turns per metre. *length: its length in metres.
static inline floatv path_turns(DoubleSingle dx, DoubleSingle dy, DoubleSingle dz,
                                DoubleSingle rate, floatv* length) {
  const DoubleSingle3 path = {dx, dy, dz};
  const DoubleSingle root = ds_sqrt(ds3_dot(path, path));
  *length = ds_high(root);
  return ds_turns(ds_times(root, rate));
}

#endif
