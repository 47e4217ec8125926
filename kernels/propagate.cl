// SPDX-License-Identifier: Apache-2.0
// Band-limited shifted angular spectrum propagation: the steps around the Fourier transforms.
// Matsushima, Opt. Express 18, 18453 (2010). OpenCL C 1.2, no double, no images.
//
// Planes are row-major, complex samples interleaved. A padded plane has padded_ny rows of padded_nx samples, padded_nx a multiple of 16,
// and holds the field in its top left corner. A work-item takes one row (get_global_id(1)) and every get_global_size(0)-th packet of it:
// CPUs launch one work-item per row, GPUs one per sample.
#include "complex_lanes.h"
#include "phase.h"

#ifndef RAYWAVE_TWO_FLOATS
#define RAYWAVE_TWO_FLOATS 0  // 1 where the remainder below exceeds a few turns; host/propagator.cpp decides per propagation
#endif

// padded: the field, zero elsewhere.
__kernel void pad(const __global float2* restrict field, __global float2* restrict padded, int frame, int nx, int ny, int padded_nx,
                  int padded_ny) {
  const int row = (int)get_global_id(1);
  if (row >= padded_ny) return;
  const int live = row < ny ? nx : 0;
  const __global float2* source = field + (size_t)nx * ((size_t)frame * (size_t)ny + (size_t)row);
  __global float2* target = padded + (size_t)padded_nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < padded_nx; i += step) {
    floatv re = 0.0f, im = 0.0f;
    if (i + RAYWAVE_LANES <= live) {
      load_complex(source + i, &re, &im);
      store_complex(re, im, target + i);
    } else {
      store_complex(re, im, target + i);
      for (int j = i; j < live; ++j) target[j] = source[j];
    }
  }
}

// field: the top left corner of padded.
__kernel void crop(const __global float2* restrict padded, __global float2* restrict field, int nx, int ny, int padded_nx) {
  const int row = (int)get_global_id(1);
  if (row >= ny) return;
  const __global float2* source = padded + (size_t)padded_nx * (size_t)row;
  __global float2* target = field + (size_t)nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < nx; i += step) {
    if (i + RAYWAVE_LANES <= nx) {
      floatv re, im;
      load_complex(source + i, &re, &im);
      store_complex(re, im, target + i);
    } else {
      for (int j = i; j < nx; ++j) target[j] = source[j];
    }
  }
}

// Reduced turns of R = depth (1 - sqrt(1 - a))^2, where a = (lambda u)^2 + (lambda v)^2 is the sum of two pairs of floats (hi, lo), and so
// is depth = z / (2 lambda), in turns.
static inline floatv remainder_turns(floatv u_hi, floatv u_lo, float v_hi, float v_lo, float depth_hi, float depth_lo) {
#pragma OPENCL FP_CONTRACT OFF
#if RAYWAVE_TWO_FLOATS
  // 1 - a, error-free but for the last bits of the low parts. u_hi and v_hi are no larger than 1.
  const floatv p = 1.0f - u_hi;
  const floatv p_error = (1.0f - p) - u_hi;
  const floatv q = p - v_hi;
  const floatv v_part = p - q;
  const floatv q_error = (p - (q + v_part)) + (v_part - v_hi);
  const floatv low = (p_error + q_error) - (u_lo + v_lo);
  // Its root by one step of Newton's method from the rounded root.
  const floatv root = sqrt(fmax(q + low, (floatv)(1e-30f)));
  const floatv root_low = ((q - root * root) - fma(root, root, -(root * root)) + low) / (2.0f * root);
  // t = 1 - root, t^2, depth t^2.
  const floatv t = 1.0f - root;
  const floatv t_low = ((1.0f - t) - root) - root_low;
  const floatv square = t * t;
  const floatv square_low = fma(t, t, -square) + 2.0f * t * t_low;
  const floatv turns = square * depth_hi;
  const floatv turns_low = fma(square, (floatv)(depth_hi), -turns) + (square * depth_lo + square_low * depth_hi);
  return turns_reduced(turns) + turns_low;
#else
  (void)u_lo, (void)v_lo, (void)depth_lo;
  const floatv a = u_hi + v_hi;
  const floatv t = a / (1.0f + sqrt(fmax(1.0f - a, (floatv)(0.0f))));
  return turns_reduced(depth_hi * (t * t));
#endif
}

// sum (+)= scale * spectrum * H inside the band, H = exp(2 pi i (x0 u + y0 v + z sqrt(1 / lambda^2 - u^2 - v^2))). Out of it H is zero:
// nothing is added, and zero is written unless `accumulate`.
//
// The phase in turns is X(u) + Y(v) - R(u, v): X and Y hold x0 u - z lambda u^2 / 2 and so on, reduced on the host in double; R is what the
// parabola leaves of the sphere, small enough for float arithmetic, or for two floats.
//
// phase_x [nx], phase_y [ny]    X and Y, reduced turns
// power_x [2 nx], power_y       (lambda u)^2 as high parts, then low parts; likewise v
// band_x  [2 nx], band_y        per column the first and then the last signed row frequency kept; per row those of the columns
__kernel void multiply_add(const __global float2* restrict spectrum, __global float2* restrict sum, const __global float* restrict phase_x,
                           const __global float* restrict phase_y, const __global float* restrict power_x,
                           const __global float* restrict power_y, const __global int* restrict band_x, const __global int* restrict band_y,
                           float depth_hi, float depth_lo, float scale, int nx, int ny, int accumulate) {
  const int row = (int)get_global_id(1);
  if (row >= ny) return;
  const int kv = row < (ny + 1) / 2 ? row : row - ny;
  const int first = band_y[row], last = band_y[ny + row];
  const floatv turns_y = phase_y[row];
  const float v_hi = power_y[row], v_lo = power_y[ny + row];

  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < nx; i += step) {
    const size_t at = (size_t)nx * (size_t)row + (size_t)i;
    const intv column = LANES_INDEX + i;
    const intv ku = LANES_SELECT(column, column - nx, column >= (nx + 1) / 2);
    const intv inside = (ku >= first) & (ku <= last) & (LANES_LOAD(band_x + i) <= kv) & (LANES_LOAD(band_x + nx + i) >= kv);
    floatv sum_re = 0.0f, sum_im = 0.0f;
    if (!LANES_ANY(inside)) {
      if (!accumulate) store_complex(sum_re, sum_im, sum + at);
      continue;
    }
    const floatv remainder = remainder_turns(LANES_LOAD(power_x + i), LANES_LOAD(power_x + nx + i), v_hi, v_lo, depth_hi, depth_lo);
    floatv c, s;
    cos_sin_turns(turns_reduced(LANES_LOAD(phase_x + i) + turns_y) - remainder, &c, &s);
    c = LANES_SELECT((floatv)(0.0f), c * scale, inside);
    s = LANES_SELECT((floatv)(0.0f), s * scale, inside);
    floatv re, im;
    load_complex(spectrum + at, &re, &im);
    if (accumulate) load_complex(sum + at, &sum_re, &sum_im);
    store_complex(sum_re + (re * c - im * s), sum_im + (re * s + im * c), sum + at);
  }
}
