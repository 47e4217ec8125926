// SPDX-License-Identifier: Apache-2.0
// What an SLM shows of the phases that are refined (host/refine/panel_light.hpp). OpenCL C 1.2, no
// double, no images. A work-item takes one row (get_global_id(1)) and every get_global_size(0)-th
// packet of it.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/phase.h"

// told: what each level tells its pixel, with a margin of copies of the pixels at the edges;
// rows of told_pitch numbers. ny: rows with their margin.
__kernel void tell(const __global uchar* restrict levels, int nx, int ny, int margin_x,
                   int margin_y, const __global float* restrict by_level,
                   __global float* restrict told, int told_pitch) {
  const int row = (int)get_global_id(1);
  if (row >= ny) return;
  const __global uchar* source =
      levels + (size_t)nx * (size_t)clamp(row - margin_y, 0, ny - 2 * margin_y - 1);
  __global float* target = told + (size_t)told_pitch * (size_t)row;
  for (int i = (int)get_global_id(0); i < told_pitch; i += (int)get_global_size(0))
    target[i] = by_level[source[clamp(i - margin_x, 0, nx - 1)]];
}

// Weighted sum over the neighbours, from the first of them on.
static inline floatv of_neighbours(const __global float* told, int pitch,
                                   const __global float* weights, int columns, int rows) {
  floatv sum = (floatv)(0.0f);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      sum +=
          weights[row * columns + column] * LANES_LOAD(told + (size_t)pitch * (size_t)row + column);
  return sum;
}

// Turns that are added to the pixels, of whole packets.
static inline floatv added_turns(const __global ushort* added, int count) {
  float turns[RAYWAVE_LANES];
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane)
    turns[lane] = lane < count ? (float)added[lane] * (1.0f / 65536.0f) : 0.0f;
  return LANES_LOAD(turns);
}

// modulated: share * a exp(2 pi i (t - added)), phases t and amplitudes a being what pixels take of
// what they and their neighbours are told; light: the same and what leaves as it came, `plain` of
// amplitude, less the added phases.
//
// amplitudes  as turns, where has_amplitudes
// weights     columns x rows of them, row 0 the top
// added       in units of 1/65536 turn, where has_added
__kernel void show_told(const __global float* restrict turns,
                        const __global float* restrict amplitudes, int has_amplitudes,
                        int told_pitch, const __global float* restrict weights, int columns,
                        int rows, const __global ushort* restrict added, int has_added, float share,
                        float plain, __global float2* restrict modulated,
                        __global float2* restrict light, int pitch, int nx, int ny) {
  const int row = (int)get_global_id(1);
  if (row >= ny) return;
  const size_t start = (size_t)pitch * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < nx; i += step) {
    const size_t at = (size_t)told_pitch * (size_t)row + (size_t)i;
    floatv t = of_neighbours(turns + at, told_pitch, weights, columns, rows), a = (floatv)(share);
    if (has_amplitudes) a *= of_neighbours(amplitudes + at, told_pitch, weights, columns, rows);
    const floatv more =
        has_added ? added_turns(added + (size_t)nx * (size_t)row + i, nx - i) : (floatv)(0.0f);
    floatv c, s, plain_c, plain_s;
    cos_sin_turns(t - more, &c, &s);
    cos_sin_turns(-more, &plain_c, &plain_s);
    c *= a;
    s *= a;
    store_some_complex(c, s, modulated + start + i, nx - i);
    store_some_complex(c + plain * plain_c, s + plain * plain_s, light + start + i, nx - i);
  }
}

// hologram: turned as `modulated` was since show_told made it, by half of that for each of
// `halvings`; its samples have modulus 1.
__kernel void turn_phases(__global float2* restrict hologram, uint first,
                          const __global float2* restrict modulated,
                          const __global float2* restrict light,
                          const __global ushort* restrict added, int has_added, float plain,
                          int halvings, int pitch, int nx, int ny) {
  const int row = (int)get_global_id(1);
  if (row >= ny) return;
  const size_t start = (size_t)pitch * (size_t)row;
  __global float2* samples = hologram + (size_t)first + start;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < nx; i += step) {
    floatv re, im, now_re, now_im, c, s, plain_c, plain_s;
    load_complex(samples + i, &re, &im);
    load_complex(modulated + start + i, &now_re, &now_im);
    load_complex(light + start + i, &c, &s);
    const floatv more =
        has_added ? added_turns(added + (size_t)nx * (size_t)row + i, nx - i) : (floatv)(0.0f);
    cos_sin_turns(-more, &plain_c, &plain_s);
    c -= plain * plain_c;
    s -= plain * plain_s;
    // now / before, and the hologram times its phase
    floatv turn_re = now_re * c + now_im * s;
    const floatv turn_im = now_im * c - now_re * s;
    for (int k = 0; k < halvings; ++k) turn_re += sqrt(turn_re * turn_re + turn_im * turn_im);
    const floatv u = re * turn_re - im * turn_im, v = re * turn_im + im * turn_re;
    const floatv square = u * u + v * v, inverse = 1.0f / sqrt(square);
    const intv is_known = square > 1e-12f;
    store_some_complex(LANES_SELECT(re, u * inverse, is_known),
                       LANES_SELECT(im, v * inverse, is_known), samples + i, nx - i);
  }
}
