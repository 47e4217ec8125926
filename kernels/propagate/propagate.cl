// SPDX-License-Identifier: Apache-2.0
// Band-limited shifted angular spectrum propagation: the steps around the Fourier transforms.
// Matsushima, Opt. Express 18, 18453 (2010). OpenCL C 1.2, no double, no images.
//
// Planes are row-major with interleaved complex samples. A padded plane has padded_ny rows of
// padded_nx samples, padded_nx being a multiple of 16, and holds the field in its top left corner.
// A work-item takes one row (get_global_id(1)) and every get_global_size(0)-th packet of it: CPUs
// launch one work-item per row, GPUs one per sample.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/items.h"
#include "kernels/propagate/options.h"
#include "kernels/propagate/transfer.h"

// padded: the field, and zero elsewhere.
SINGLE_ITEM_KERNEL void pad(const __global float2* restrict field, __global float2* restrict padded,
                            int frame, int nx, int ny, int padded_nx, int padded_ny) {
  FOR_ITEMS(row, padded_ny, get_global_id(1)) {
    const int live = row < ny ? nx : 0;
    const __global float2* source = field + (size_t)nx * ((size_t)frame * (size_t)ny + (size_t)row);
    __global float2* target = padded + (size_t)padded_nx * (size_t)row;
    const int step = RAYWAVE_LANES * ITEMS(0);
    for (int i = RAYWAVE_LANES * ITEM(0); i < padded_nx; i += step) {
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
}

// field: the top left corner of padded.
SINGLE_ITEM_KERNEL void crop(const __global float2* restrict padded,
                             __global float2* restrict field, int nx, int ny, int padded_nx) {
  FOR_ITEMS(row, ny, get_global_id(1)) {
    const __global float2* source = padded + (size_t)padded_nx * (size_t)row;
    __global float2* target = field + (size_t)nx * (size_t)row;
    const int step = RAYWAVE_LANES * ITEMS(0);
    for (int i = RAYWAVE_LANES * ITEM(0); i < nx; i += step) {
      if (i + RAYWAVE_LANES <= nx) {
        floatv re, im;
        load_complex(source + i, &re, &im);
        store_complex(re, im, target + i);
      } else {
        for (int j = i; j < nx; ++j) target[j] = source[j];
      }
    }
  }
}

// sum (+)= scale * spectrum * H inside the band, with H as in transfer.h. H is zero outside the
// band: nothing is added there, and zero is written unless `accumulate`.
//
// phase_x [nx], phase_y [ny]    X and Y, reduced turns
// power_x [2 nx], power_y       (lambda u)^2 as high parts, then low parts; likewise v
// band_x  [2 nx], band_y        for each column the first and then the last signed row frequency
//                               kept; for each row likewise those of the columns
// fade_left ... fade_last       1 / the frequencies over which H fades: at each row's first and
//                               last column, and at each column's first and last row
SINGLE_ITEM_KERNEL void multiply_add(
    const __global float2* restrict spectrum, __global float2* restrict sum,
    const __global float* restrict phase_x, const __global float* restrict phase_y,
    const __global float* restrict power_x, const __global float* restrict power_y,
    const __global int* restrict band_x, const __global int* restrict band_y, float depth_hi,
    float depth_lo, float fade_left, float fade_right, float fade_first, float fade_last,
    float scale, int nx, int ny, int accumulate) {
  FOR_ITEMS(row, ny, get_global_id(1)) {
#if !RAYWAVE_TWO_FLOATS
    (void)depth_lo;
#endif
    const int kv = row < (ny + 1) / 2 ? row : row - ny;
    const int first = band_y[row], last = band_y[ny + row];
    const float turns_y = phase_y[row];
    const float v_hi = power_y[row];
#if RAYWAVE_TWO_FLOATS
    const float v_lo = power_y[ny + row];
#endif

    const int step = RAYWAVE_LANES * ITEMS(0);
    for (int i = RAYWAVE_LANES * ITEM(0); i < nx; i += step) {
      const size_t at = (size_t)nx * (size_t)row + (size_t)i;
      const intv column = LANES_INDEX + i;
      const intv ku = LANES_SELECT(column, column - nx, column >= (nx + 1) / 2);
      const intv first_row = LANES_LOAD(band_x + i), last_row = LANES_LOAD(band_x + nx + i);
      const intv inside = (ku >= first) & (ku <= last) & (first_row <= kv) & (last_row >= kv);
      floatv sum_re = 0.0f, sum_im = 0.0f;
      if (!LANES_ANY(inside)) {
        if (!accumulate) store_complex(sum_re, sum_im, sum + at);
        continue;
      }
#if RAYWAVE_TWO_FLOATS
      const floatv remainder = remainder_turns_two_floats(
          LANES_LOAD(power_x + i), LANES_LOAD(power_x + nx + i), v_hi, v_lo, depth_hi, depth_lo);
#else
      const floatv remainder = remainder_turns_float(LANES_LOAD(power_x + i), v_hi, depth_hi);
#endif
      floatv c, s;
      transfer_function(LANES_LOAD(phase_x + i), turns_y, remainder, &c, &s);
      const floatv passed =
          scale *
          fade(LANES_TO_FLOAT(ku - first), LANES_TO_FLOAT(last - ku), fade_left, fade_right) *
          fade(LANES_TO_FLOAT(kv - first_row), LANES_TO_FLOAT(last_row - kv), fade_first,
               fade_last);
      c = LANES_SELECT((floatv)(0.0f), c * passed, inside);
      s = LANES_SELECT((floatv)(0.0f), s * passed, inside);
      floatv re, im;
      load_complex(spectrum + at, &re, &im);
      if (accumulate) load_complex(sum + at, &sum_re, &sum_im);
      store_complex(sum_re + (re * c - im * s), sum_im + (re * s + im * c), sum + at);
    }
  }
}
