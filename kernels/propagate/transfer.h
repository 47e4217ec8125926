// SPDX-License-Identifier: Apache-2.0
// The transfer function of free space, for kernels/propagate/propagate.cl and, compiled as C++, for
// host/propagate/propagator_host.cpp.
//
// H = exp(2 pi i (x0 u + y0 v + z sqrt(1 / lambda^2 - u^2 - v^2))). Its phase in turns is X(u) +
// Y(v) - R(u, v). X and Y contain x0 u - z lambda u^2 / 2 and likewise for v, reduced on the host
// in double. R is the difference between sphere and parabola, small enough for floats or for pairs
// of floats.
#ifndef RAYWAVE_TRANSFER_H
#define RAYWAVE_TRANSFER_H

#include "kernels/common/phase.h"

// Reduced turns of R = depth (1 - sqrt(1 - a))^2. Here a = (lambda u)^2 + (lambda v)^2 is the sum
// of two pairs of floats (hi, lo), and depth = z / (2 lambda), in turns, is one too. For R above a
// few turns.
static inline floatv remainder_turns_two_floats(floatv u_hi, floatv u_lo, float v_hi, float v_lo,
                                                float depth_hi, float depth_lo) {
#pragma OPENCL FP_CONTRACT OFF
  // 1 - a, exact except for the last bits of the low parts. u_hi and v_hi are at most 1.
  const floatv p = 1.0f - u_hi;
  const floatv p_error = (1.0f - p) - u_hi;
  const floatv q = p - v_hi;
  const floatv v_part = p - q;
  const floatv q_error = (p - (q + v_part)) + (v_part - v_hi);
  const floatv low = (p_error + q_error) - (u_lo + v_lo);
  // Its square root by one step of Newton's method from the rounded root.
  const floatv root = sqrt(fmax(q + low, (floatv)(1e-30f)));
  const floatv root_low =
      ((q - root * root) - fma(root, root, -(root * root)) + low) / (2.0f * root);
  // t = 1 - root, t^2, depth t^2.
  const floatv t = 1.0f - root;
  const floatv t_low = ((1.0f - t) - root) - root_low;
  const floatv square = t * t;
  const floatv square_low = fma(t, t, -square) + 2.0f * t * t_low;
  const floatv turns = square * depth_hi;
  const floatv turns_low =
      fma(square, (floatv)(depth_hi), -turns) + (square * depth_lo + square_low * depth_hi);
  return turns_reduced(turns) + turns_low;
}

// Reduced turns of R in float, for R below a few turns.
static inline floatv remainder_turns_float(floatv u_hi, float v_hi, float depth_hi) {
  const floatv a = u_hi + v_hi;
  const floatv t = a / (1.0f + sqrt(fmax(1.0f - a, (floatv)(0.0f))));
  return turns_reduced(depth_hi * (t * t));
}

// Share of the light at frequency k of a band from `first` to `last` that is let through: it fades
// within 1 / low steps of the first and 1 / high of the last.
static inline floatv fade(floatv above_first, floatv below_last, float low, float high) {
  const floatv t =
      fmin(fmin((above_first + 0.5f) * low, (below_last + 0.5f) * high), (floatv)(1.0f));
  return t * t * (3.0f - 2.0f * t);
}

// H from X, Y and R.
static inline void transfer_function(floatv turns_x, float turns_y, floatv remainder, floatv* re,
                                     floatv* im) {
  cos_sin_turns(turns_reduced(turns_x + turns_y) - remainder, re, im);
}

#endif
