// SPDX-License-Identifier: Apache-2.0
// Rows of a plane from fewer ones (host/trace/interpolator.hpp): sums of neighbours times
// coefficients.
//
// interpolate_rows  ny rows of nx columns, from plane number `frame` of coarse_rows rows: row i is
//                   the sum of `taps` rows of `coarse` from first[i] on, times
//                   coefficients[i * taps] and on
//
// A work-item makes RAYWAVE_LANES samples of RAYWAVE_INTERPOLATE_ROWS rows: global size (ceil(nx /
// lanes), ceil(ny / those)). OpenCL C 1.2.
#include "kernels/common/complex_lanes.h"
#include "kernels/gather/options.h"

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
