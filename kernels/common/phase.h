// SPDX-License-Identifier: Apache-2.0
// Phases in turns: exact reduction to one turn, and sine and cosine. docs/accuracy.md derives the
// bounds.
#ifndef RAYWAVE_PHASE_H
#define RAYWAVE_PHASE_H

#include "kernels/common/lanes.h"

// x minus the nearest whole number, in [-0.5, 0.5]; exact for |x| < 2^22. Adding 1.5 * 2^23 rounds
// to nearest; PoCL's rint takes ten times as long.
static inline floatv turns_reduced(floatv x) {
#pragma OPENCL FP_CONTRACT OFF
  const floatv rounded = (x + 12582912.0f) - 12582912.0f;
  return x - rounded;
}

// sin(2 pi t) on [-1/4, 1/4]: odd minimax polynomial of degree 9. Each coefficient was rounded to
// float before the next one was fitted.
static inline floatv sin_quarter(floatv t) {
  const floatv s = t * t;
  floatv p = 0x1.3a4c44p+5f;
  p = p * s - 0x1.320c42p+6f;
  p = p * s + 0x1.46658p+6f;
  p = p * s - 0x1.4abba4p+5f;
  p = p * s + 0x1.921fb4p+2f;
  return p * t;
}

// cos and sin of 2 pi turns for |turns| < 2^22, both folded into sin_quarter. Largest absolute
// error 1.7e-7 (tests/cl/device.cpp).
static inline void cos_sin_turns(floatv turns, floatv* c, floatv* s) {
  const floatv t = turns_reduced(turns);
  const floatv a = fabs(t);
  // cos(2 pi t) = sin(2 pi (1/4 - |t|)); sin(2 pi t) folds at |t| = 1/4: |t| -> 1/2 - |t|.
  *c = sin_quarter(0.25f - a);
  *s = copysign(sin_quarter(fmin(a, 0.5f - a)), t);
}

#endif
