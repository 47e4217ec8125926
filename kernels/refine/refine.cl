// SPDX-License-Identifier: Apache-2.0
// One step of the refinement of a hologram for a phase-only SLM, around its Fourier transforms
// (host/refine/refine.hpp). OpenCL C 1.2, no double, no images.
//
// A key is a picture that the hologram should show: a depth, and the aperture through which it is
// seen. Planes:
//
//   beam      where RAYWAVE_BEAM: amplitude of the light on each pixel of a hologram, in rows like
//             its own; else one number, which is not read
//   hologram  frames x hologram_ny rows of hologram_pitch samples, of modulus 1; hologram_pitch is
//             at least 15 samples wider than the hologram, so that packets may begin in any column
//   plane     ny rows of nx samples: the aperture's part of the hologram in its top left corner,
//             then the light in the picture; nx is a multiple of 16
//   region    the pixels of the picture that have a target: rows of region_nx floats, from column
//             x0 and row y0 of the plane on; x0 and region_nx are multiples of 16
//   wide      the region with the margin that the blur reaches into, margin_x columns and margin_y
//             rows on every side; margin_x is a multiple of 16
//
// column_chirp, row_chirp: the aperture's columns and rows of the chirp that makes the transform a
// Fresnel propagation, zero behind the aperture's end, so that their product is the mask too.
// A work-item takes one row (get_global_id(1)) and every get_global_size(0)-th packet of it.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/phase.h"
#include "kernels/refine/rows_together.h"
#include "kernels/refine/spectrum.h"

// hologram: the phases of `field`, rows of nx samples without gaps; first: where its first sample
// goes. Where the field is dark the phase is 0.
//
// inverse_clip  > 0: over that amplitude, phases keep amplitudes as double phase does: they go acos
//               of it to one side and the other, as squares of a checkerboard; 0: they do not
__kernel void take_phases(const __global float2* restrict field, int nx, int ny,
                          __global float2* restrict hologram, uint first, int hologram_pitch,
                          float inverse_clip) {
  const int row = (int)get_global_id(1);
  if (row >= ny) return;
  const __global float2* source = field + (size_t)nx * (size_t)row;
  __global float2* target = hologram + (size_t)first + (size_t)hologram_pitch * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < nx; i += step) {
    floatv re, im;
    load_some_complex(source + i, nx - i, &re, &im);
    // Scaled, so that squares of very bright or faint light stay floats
    const floatv most = fmax(fabs(re), fabs(im)), scale = 1.0f / most;
    re *= scale;
    im *= scale;
    const floatv modulus = sqrt(re * re + im * im), inverse = 1.0f / modulus;
    const intv is_dark = !(most > 1e-37f);
    re = LANES_SELECT(re * inverse, (floatv)(1.0f), is_dark);
    im = LANES_SELECT(im * inverse, (floatv)(0.0f), is_dark);
    if (inverse_clip > 0.0f) {
      const floatv a = LANES_SELECT(fmin(modulus * most * inverse_clip, (floatv)(1.0f)),
                                    (floatv)(0.0f), is_dark);
      const floatv side = 1.0f - 2.0f * LANES_TO_FLOAT((i + row + LANES_INDEX) & 1),
                   b = side * sqrt(1.0f - a * a), turned = re * a - im * b;
      im = re * b + im * a;
      re = turned;
    }
    store_some_complex(re, im, target + i, nx - i);
  }
}

// plane: hologram * chirp in the aperture, zero elsewhere.
//
// side            -1: of the hologram's conjugate, for pictures before it; 1
// first           sample of `hologram` where the aperture begins; beam_first: of `beam`
// aperture_nx,ny  samples of the aperture
__kernel void spread(const __global float2* restrict hologram, uint first, int hologram_pitch,
                     float side, const __global float* restrict beam, uint beam_first,
                     const __global float2* restrict column_chirp,
                     const __global float2* restrict row_chirp, int aperture_nx, int aperture_ny,
                     __global float2* restrict plane, int nx, int ny) {
  const int row = (int)get_global_id(1);
  if (row >= ny) return;
  const float2 chirp = row < aperture_ny ? row_chirp[row] : (float2)(0.0f, 0.0f);
  const __global float2* source =
      hologram + (size_t)first + (size_t)hologram_pitch * (size_t)(row < aperture_ny ? row : 0);
  const __global float* light =
      beam + (RAYWAVE_BEAM && row < aperture_ny
                  ? (size_t)beam_first + (size_t)hologram_pitch * (size_t)row
                  : 0);
  __global float2* target = plane + (size_t)nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < nx; i += step) {
    floatv re = 0.0f, im = 0.0f;
    if (row < aperture_ny && i < aperture_nx) {
      floatv a, b, c, s;
      load_complex(source + i, &a, &b);
      b *= side;
      if (RAYWAVE_BEAM) {
        const floatv here = LANES_LOAD(light + i);
        a *= here;
        b *= here;
      }
      load_complex(column_chirp + i, &c, &s);
      const floatv u = a * c - b * s, v = a * s + b * c;
      re = u * chirp.x - v * chirp.y;
      im = u * chirp.y + v * chirp.x;
    }
    store_some_complex(re, im, target + i, nx - i);
  }
}

// target: the spectrum `source` times its phases (spectrum.h) and those of columns and rows; zero
// behind its nx x ny samples. With `back`, times the conjugates. Frequencies begin with the lowest.
//
// sine_x,y  from a sample to the next
__kernel void turn_spectrum(const __global float2* restrict source, int source_nx,
                            const __global float2* restrict column_phases,
                            const __global float2* restrict row_phases, int nx, int ny,
                            float sine_x, float sine_y, float turns, float more, int back,
                            __global float2* restrict target, int target_nx, int target_ny) {
  const int row = (int)get_global_id(1);
  if (row >= target_ny) return;
  const int inside = row < ny;
  const float2 phase = inside ? row_phases[row] : (float2)(0.0f, 0.0f);
  const float across = sine_y * (float)(row - ny / 2), side = back ? -1.0f : 1.0f;
  const __global float2* from = source + (size_t)source_nx * (size_t)(inside ? row : 0);
  __global float2* to = target + (size_t)target_nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < target_nx; i += step) {
    floatv re = 0.0f, im = 0.0f;
    if (inside && i < nx) {
      const floatv along = sine_x * LANES_TO_FLOAT(i - nx / 2 + LANES_INDEX),
                   square = along * along + across * across;
      floatv a, b, c, s, u, v;
      spectrum_phase(square, turns, more, &c, &s);
      load_complex(column_phases + i, &u, &v);
      const floatv p = c * u - s * v, q = c * v + s * u;
      const intv known = (square < 1.0f) & (i + LANES_INDEX < nx);
      c = LANES_SELECT((floatv)(0.0f), p * phase.x - q * phase.y, known);
      s = side * LANES_SELECT((floatv)(0.0f), p * phase.y + q * phase.x, known);
      load_some_complex(from + i, nx - i, &a, &b);
      re = a * c - b * s;
      im = a * s + b * c;
    }
    store_some_complex(re, im, to + i, target_nx - i);
  }
}

// wide: q |plane|^2, zero outside the plane.
__kernel void intensity(const __global float2* restrict plane, int nx, int ny,
                        __global float* restrict wide, int x0, int y0, int region_nx, int region_ny,
                        int margin_x, int margin_y, float q) {
  const int row = (int)get_global_id(1);
  if (row >= region_ny + 2 * margin_y) return;
  const int y = y0 - margin_y + row, left = x0 - margin_x, wide_nx = region_nx + 2 * margin_x;
  const int inside = y >= 0 && y < ny;
  const __global float2* source = plane + (size_t)nx * (size_t)(inside ? y : 0);
  __global float* target = wide + (size_t)wide_nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < wide_nx; i += step) {
    const int x = left + i;
    floatv value = 0.0f;
    if (inside && x >= 0 && x < nx) {
      floatv re, im;
      load_complex(source + x, &re, &im);
      value = q * (re * re + im * im);
    }
    LANES_STORE(value, target + i);
  }
}

// blurred: the rows of `wide`, blurred along x, without the margins at both ends.
//
// weights  of the blur at 0, 1, ..., radius; radius is at most margin_x
__kernel void blur_rows(const __global float* restrict wide, const __global float* restrict weights,
                        int radius, __global float* restrict blurred, int region_nx, int margin_x,
                        int rows) {
  const int row = (int)get_global_id(1);
  if (row >= rows) return;
  const __global float* source = wide + (size_t)(region_nx + 2 * margin_x) * (size_t)row + margin_x;
  __global float* target = blurred + (size_t)region_nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < region_nx; i += step) {
    floatv sum = weights[0] * LANES_LOAD(source + i);
    for (int k = 1; k <= radius; ++k)
      sum += weights[k] * (LANES_LOAD(source + (i - k)) + LANES_LOAD(source + (i + k)));
    LANES_STORE(sum, target + i);
  }
}

// Blur along y: packets of `count` rows of the region, from rows that are blurred along x.
// `blurred` points at the first one's own samples.
static inline void blurred_columns(const __global float* blurred, int region_nx,
                                   const __global float* weights, int radius, int count,
                                   floatv* sums) {
  floatv a = (floatv)(0.0f), b = a, c = a, d = a;
  float of_a = 0.0f, of_b = 0.0f, of_c = 0.0f, of_d = 0.0f;  // weights of this row in theirs
  for (int k = -radius; k < radius + count; ++k) {
    of_d = of_c;
    of_c = of_b;
    of_b = of_a;
    of_a = k <= radius ? weights[abs(k)] : 0.0f;
    const floatv here = LANES_LOAD(blurred + (ptrdiff_t)region_nx * k);
    a += of_a * here;
    b += of_b * here;
    c += of_c * here;
    d += of_d * here;
  }
  sums[0] = a;
  sums[1] = b;
  sums[2] = c;
  sums[3] = d;
}

// plane: (c - 1) plane in the region, zero elsewhere in its rows first_row to first_row + rows - 1
// and columns first_column to first_column + columns - 1. c is the root of what the picture lacks:
// wanted * target - former, over its own intensity. A work-item takes ROWS_TOGETHER rows.
//
// target  radiance, blurred; negative where nothing is known of it: c = 1
// former  intensities of the frames before, summed; has_former 0: none, and not read
// wanted  frames so far over the scale of the brightness
__kernel void correct(__global float2* restrict plane, int nx,
                      const __global float* restrict blurred,
                      const __global float* restrict weights, int radius,
                      const __global float* restrict target, const __global float* restrict former,
                      int has_former, float wanted, int x0, int y0, int region_nx, int region_ny,
                      int margin_y, int first_column, int columns, int first_row, int rows) {
  const int first = ROWS_TOGETHER * (int)get_global_id(1), end = min(first + ROWS_TOGETHER, rows),
            beside = first_row - y0;  // from these rows to the region's
  if (first >= rows) return;
  const int low = max(first, -beside), high = min(end, region_ny - beside);  // in the region
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < columns; i += step) {
    const int column = first_column + i - x0;
    const bool inside = column >= 0 && column < region_nx;
    floatv shown[ROWS_TOGETHER];
    if (inside && low < high)
      blurred_columns(blurred + (size_t)region_nx * (size_t)(margin_y + low + beside) + column,
                      region_nx, weights, radius, high - low, shown);
    for (int row = first; row < end; ++row) {
      __global float2* samples = plane + (size_t)nx * (size_t)(first_row + row) + first_column + i;
      floatv re = 0.0f, im = 0.0f;
      if (inside && row >= low && row < high) {
        const size_t at = (size_t)region_nx * (size_t)(row + beside) + column;
        const floatv known = LANES_LOAD(target + at);
        const floatv before = has_former ? LANES_LOAD(former + at) : (floatv)(0.0f);
        const floatv lacks = fmax(wanted * known - before, (floatv)(0.0f));
        const floatv ratio = fmin(
            fmax(lacks / fmax(shown[row - low], (floatv)(1e-30f)), (floatv)(0.1f)), (floatv)(8.0f));
        const floatv change = LANES_SELECT((floatv)(0.0f), sqrt(ratio) - 1.0f, known >= 0.0f);
        load_complex(samples, &re, &im);
        re *= change;
        im *= change;
      }
      store_complex(re, im, samples);
    }
  }
}

// sums: of the values in each row of the region whose target is known, one number for each row.
__kernel void sum_known(const __global float* restrict values,
                        const __global float* restrict target, __global float* restrict sums,
                        int region_nx, int region_ny) {
  const int row = (int)get_global_id(0);
  if (row >= region_ny) return;
  floatv sum = 0.0f;
  for (int i = 0; i < region_nx; i += RAYWAVE_LANES) {
    const size_t at = (size_t)region_nx * (size_t)row + (size_t)i;
    sum += LANES_SELECT((floatv)(0.0f), LANES_LOAD(values + at), LANES_LOAD(target + at) >= 0.0f);
  }
  float lanes[RAYWAVE_LANES], all = 0.0f;
  LANES_STORE(sum, lanes);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) all += lanes[lane];
  sums[row] = all;
}

// sum (+)= the blurred intensity in the region. A work-item takes ROWS_TOGETHER rows.
__kernel void add_picture(const __global float* restrict blurred,
                          const __global float* restrict weights, int radius,
                          __global float* restrict sum, int accumulate, int region_nx,
                          int region_ny, int margin_y) {
  const int row = ROWS_TOGETHER * (int)get_global_id(1),
            count = min(ROWS_TOGETHER, region_ny - row);
  if (count <= 0) return;
  const __global float* rows_blurred = blurred + (size_t)region_nx * (size_t)(margin_y + row);
  __global float* target = sum + (size_t)region_nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < region_nx; i += step) {
    floatv values[ROWS_TOGETHER];
    blurred_columns(rows_blurred + i, region_nx, weights, radius, count, values);
    for (int k = 0; k < count; ++k) {
      __global float* at = target + (size_t)region_nx * (size_t)k + i;
      LANES_STORE(accumulate ? values[k] + LANES_LOAD(at) : values[k], at);
    }
  }
}

// hologram: its phase after beam * hologram + step * conj(chirp) * plane, in the aperture. Phases
// need no trigonometry: the sum is divided by its modulus. side: as of `spread`
__kernel void step_phase(__global float2* restrict hologram, uint first, int hologram_pitch,
                         float side, const __global float* restrict beam, uint beam_first,
                         const __global float2* restrict column_chirp,
                         const __global float2* restrict row_chirp, int aperture_nx,
                         int aperture_ny, const __global float2* restrict plane, int nx,
                         float step_size) {
  const int row = (int)get_global_id(1);
  if (row >= aperture_ny) return;
  const float2 chirp = step_size * row_chirp[row];
  __global float2* samples = hologram + (size_t)first + (size_t)hologram_pitch * (size_t)row;
  const __global float* light =
      beam + (RAYWAVE_BEAM ? (size_t)beam_first + (size_t)hologram_pitch * (size_t)row : 0);
  const __global float2* change = plane + (size_t)nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < aperture_nx; i += step) {
    floatv re, im, c, s, a, b;
    load_complex(samples + i, &re, &im);
    load_complex(column_chirp + i, &c, &s);
    load_some_complex(change + i, aperture_nx - i, &a, &b);
    if (RAYWAVE_BEAM) {
      const floatv here = LANES_LOAD(light + i);
      re *= here;
      im *= here;
    }
    const floatv u = a * c + b * s, v = b * c - a * s;
    re += u * chirp.x + v * chirp.y;
    im += side * (v * chirp.x - u * chirp.y);
    const floatv inverse = 1.0f / sqrt(fmax(re * re + im * im, (floatv)(1e-30f)));
    store_some_complex(re * inverse, im * inverse, samples + i, aperture_nx - i);
  }
}

// part: conj(chirp) * plane * factor, in a plane of rows of part_pitch samples, from `first` on.
__kernel void put_back(__global float2* restrict part, uint first, int part_pitch,
                       const __global float2* restrict column_chirp,
                       const __global float2* restrict row_chirp, int part_nx, int part_ny,
                       const __global float2* restrict plane, int nx, float factor) {
  const int row = (int)get_global_id(1);
  if (row >= part_ny) return;
  const float2 chirp = factor * row_chirp[row];
  __global float2* samples = part + (size_t)first + (size_t)part_pitch * (size_t)row;
  const __global float2* change = plane + (size_t)nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < part_nx; i += step) {
    floatv c, s, a, b;
    load_complex(column_chirp + i, &c, &s);
    load_some_complex(change + i, part_nx - i, &a, &b);
    const floatv u = a * c + b * s, v = b * c - a * s;
    store_some_complex(u * chirp.x + v * chirp.y, v * chirp.x - u * chirp.y, samples + i,
                       part_nx - i);
  }
}
