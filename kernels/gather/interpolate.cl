// SPDX-License-Identifier: Apache-2.0
// Band-limited interpolation (host/trace/interpolator.hpp): columns and rows of a plane from fewer
// ones, as sums of neighbours times coefficients.
//
// interpolate_columns  nx columns of `rows` rows, from plane number `frame` of coarse_nx columns.
//                      Vector v of RAYWAVE_LANES columns is the sum of `width` columns of `coarse`
//                      from first[v] on, times coefficients[2 RAYWAVE_LANES (v width + j)] and on:
//                      the real parts for each lane, then the imaginary ones
// interpolate_rows     ny rows of nx columns, from plane number `frame` of coarse_rows rows. Row i
//                      is the sum of `taps` rows of `coarse` from first[i] on, times
//                      coefficients[i * taps] and on
//
// A work-item makes RAYWAVE_LANES samples of RAYWAVE_INTERPOLATE_ROWS rows. Global size: (ceil(nx /
// lanes), ceil(rows / RAYWAVE_INTERPOLATE_ROWS)). OpenCL C 1.2.
#include "kernels/common/complex_lanes.h"
#include "kernels/gather/options.h"

__kernel void interpolate_columns(__global const float2* coarse, int coarse_nx, int rows, int frame,
                                  int nx, int width, __global const int* first,
                                  __global const float* coefficients, __global float2* fine) {
  const int vector = (int)get_global_id(0), x = vector * RAYWAVE_LANES;
  if (x >= nx) return;
  const int top = (int)get_global_id(1) * RAYWAVE_INTERPOLATE_ROWS;
  __global const float* c = coefficients + (size_t)vector * (size_t)(2 * RAYWAVE_LANES * width);
  for (int row = top; row < min(top + RAYWAVE_INTERPOLATE_ROWS, rows); ++row) {
    __global const float2* in =
        coarse + ((size_t)frame * (size_t)rows + (size_t)row) * (size_t)coarse_nx + first[vector];
    // Four independent sums: a single one would wait for its own last result.
    floatv re_re = 0.0f, im_im = 0.0f, re_im = 0.0f, im_re = 0.0f;
    for (int j = 0; j < width; ++j) {
      const floatv re = LANES_LOAD(c + 2 * RAYWAVE_LANES * j),
                   im = LANES_LOAD(c + 2 * RAYWAVE_LANES * j + RAYWAVE_LANES);
      re_re += re * in[j].x;
      im_im += im * in[j].y;
      re_im += re * in[j].y;
      im_re += im * in[j].x;
    }
    store_some_complex(re_re - im_im, re_im + im_re, fine + (size_t)row * (size_t)nx + x, nx - x);
  }
}

__kernel void interpolate_rows(__global const float2* coarse, int coarse_rows, int frame, int nx,
                               int ny, int taps, __global const int* first,
                               __global const float2* coefficients, __global float2* fine) {
  const int x = (int)get_global_id(0) * RAYWAVE_LANES;
  if (x >= nx) return;
  const int top = (int)get_global_id(1) * RAYWAVE_INTERPOLATE_ROWS;
  __global const float2* plane = coarse + (size_t)frame * (size_t)coarse_rows * (size_t)nx;
  for (int row = top; row < min(top + RAYWAVE_INTERPOLATE_ROWS, ny); ++row) {
    __global const float2* in = plane + (size_t)first[row] * (size_t)nx;
    __global const float2* c = coefficients + row * taps;
    __global float2* out = fine + (size_t)row * (size_t)nx;
    if (x + RAYWAVE_LANES <= nx) {
      // Real and imaginary parts stay interleaved until all is summed.
      floatv first_by_re = 0.0f, first_by_im = 0.0f, second_by_re = 0.0f, second_by_im = 0.0f;
      for (int tap = 0; tap < taps; ++tap) {
        __global const float* parts = (__global const float*)(in + (size_t)tap * (size_t)nx + x);
        const floatv left = LANES_LOAD(parts), right = LANES_LOAD(parts + RAYWAVE_LANES);
        first_by_re += c[tap].x * left;
        first_by_im += c[tap].y * left;
        second_by_re += c[tap].x * right;
        second_by_im += c[tap].y * right;
      }
      floatv re_re, im_re, re_im, im_im;
      split_complex(first_by_re, second_by_re, &re_re, &im_re);
      split_complex(first_by_im, second_by_im, &re_im, &im_im);
      store_complex(re_re - im_im, im_re + re_im, out + x);
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
