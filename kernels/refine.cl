// SPDX-License-Identifier: Apache-2.0
// Rows of a plane from fewer ones (host/refiner.hpp): row i of `fine` is the sum of `taps` rows of `coarse` from first[i] on, plane number
// `frame` of `coarse_rows` rows, times coefficients[i * taps] and on.
//
// A work-item makes RAYWAVE_LANES samples of RAYWAVE_REFINE_ROWS rows: global size (ceil(nx / lanes), ceil(ny / rows)). OpenCL C 1.2.
#include "complex_lanes.h"

#ifndef RAYWAVE_REFINE_ROWS
#define RAYWAVE_REFINE_ROWS 1  // host/refiner.cpp
#endif

__kernel void refine(__global const float2* coarse, int coarse_rows, int frame, int nx, int ny, int taps, __global const int* first,
                     __global const float2* coefficients, __global float2* fine) {
  const int x = (int)get_global_id(0) * RAYWAVE_LANES;
  if (x >= nx) return;
  const int top = (int)get_global_id(1) * RAYWAVE_REFINE_ROWS;
  __global const float2* plane = coarse + (size_t)frame * (size_t)coarse_rows * (size_t)nx;
  for (int row = top; row < min(top + RAYWAVE_REFINE_ROWS, ny); ++row) {
    __global const float2* in = plane + (size_t)first[row] * (size_t)nx;
    __global const float2* c = coefficients + row * taps;
    __global float2* out = fine + (size_t)row * (size_t)nx;
    if (x + RAYWAVE_LANES <= nx) {
      floatv sum_re = 0.0f, sum_im = 0.0f;
      for (int tap = 0; tap < taps; ++tap) {
        floatv re, im;
        load_complex(in + (size_t)tap * (size_t)nx + x, &re, &im);
        sum_re += c[tap].x * re - c[tap].y * im;
        sum_im += c[tap].x * im + c[tap].y * re;
      }
      store_complex(sum_re, sum_im, out + x);
    } else {
      for (int i = x; i < nx; ++i) {
        float2 sum = (float2)(0.0f, 0.0f);
        for (int tap = 0; tap < taps; ++tap) {
          const float2 z = in[(size_t)tap * (size_t)nx + i];
          sum += (float2)(c[tap].x * z.x - c[tap].y * z.y, c[tap].x * z.y + c[tap].y * z.x);
        }
        out[i] = sum;
      }
    }
  }
}
