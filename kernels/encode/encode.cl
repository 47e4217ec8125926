// SPDX-License-Identifier: Apache-2.0
// Grey levels of an SLM that show a complex field. With RAYWAVE_TRANSFORMED the field comes as a
// transform (kernels/propagate/transformed.h), and this is the last step of propagation, too: the
// reference wave is added to the phase, without a sine or cosine. OpenCL C 1.2, no double, no
// images.
//
// A work-item takes one row (get_global_id(1)) and every get_global_size(0)-th packet of it: CPUs
// launch one work-item per row, GPUs one per packet. docs/slm.md gives formulas and papers.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/items.h"
#include "kernels/common/phase.h"
#include "kernels/encode/options.h"
#include "kernels/propagate/transformed.h"

// LEVEL: the type of a grey level. A macro, as drivers name the types of arguments as written.
#if RAYWAVE_GREY_LEVELS > 256
#define LEVEL ushort
#define CONVERT_LEVELS convert_ushort
#else
#define LEVEL uchar
#define CONVERT_LEVELS convert_uchar
#endif

#if RAYWAVE_LANES == 1
#define LOAD_TURNS(p) (*(p))
#define TURNS_TO_FLOAT(v) convert_float(v)
#define STORE_LEVELS(v, p) (*(p) = (LEVEL)(v))
#else
#define LOAD_TURNS(p) LANES_PASTE(vload, RAYWAVE_LANES)(0, p)
#define TURNS_TO_FLOAT(v) LANES_TO_FLOAT(v)
#define STORE_LEVELS(v, p) \
  LANES_PASTE(vstore, RAYWAVE_LANES)(LANES_PASTE(CONVERT_LEVELS, RAYWAVE_LANES)(v), 0, p)
#endif

// Turns in one unit of a stored added phase.
#define TURNS_PER_UNIT (1.0f / 65536.0f)

// The nearest whole number, of two the even one, of 0 <= v < 2^22: adding 1.5 * 2^23 leaves it in
// the lowest bits. PoCL's convert_int_rte takes twenty instructions.
static inline intv rounded(floatv v) {
#pragma OPENCL FP_CONTRACT OFF
  return LANES_AS_INT(v + 12582912.0f) - 0x4b400000;
}

// Amplitude and phase, in turns from -0.5 to 0.5, of re + i im. Zero and numbers that are not
// finite have both 0. Calls of builtins such as atan2 would stop PoCL's vectoriser.
static inline void polar(floatv re, floatv im, floatv* amplitude, floatv* turns) {
  const floatv x = fabs(re), y = fabs(im);
  const intv known = (x <= FLT_MAX) & (y <= FLT_MAX) & (x + y > 0.0f);
  const intv steep = y > x;
  const floatv larger = LANES_SELECT(x, y, steep), smaller = LANES_SELECT(y, x, steep);
  // The first octant: atan(t) / (2 pi), Abramowitz and Stegun 4.4.49, error 2e-8 rad
  const floatv t = LANES_SELECT((floatv)(0.0f), smaller / larger, known);
  const floatv s = t * t;
  floatv p = -0.0040540580f;
  p = p * s + 0.0218612288f;
  p = p * s - 0.0559098861f;
  p = p * s + 0.0964200441f;
  p = p * s - 0.1390853351f;
  p = p * s + 0.1994653599f;
  p = p * s - 0.3332985605f;
  p = p * s + 0.9999993329f;
  floatv a = p * t * 0.15915494f;
  a = LANES_SELECT(a, 0.25f - a, steep);
  a = LANES_SELECT(a, 0.5f - a, re < 0.0f);
  a = LANES_SELECT(a, -a, im < 0.0f);
  *turns = LANES_SELECT((floatv)(0.0f), a, known);
  *amplitude = LANES_SELECT((floatv)(0.0f), larger * sqrt(1.0f + s), known);
}

// acos(a) in turns for 0 <= a <= 1: Abramowitz and Stegun 4.4.46, error 2e-8 rad.
static inline floatv acos_turns(floatv a) {
  floatv p = -0.0012624911f;
  p = p * a + 0.0066700901f;
  p = p * a - 0.0170881256f;
  p = p * a + 0.0308918810f;
  p = p * a - 0.0501743046f;
  p = p * a + 0.0889789874f;
  p = p * a - 0.2145988016f;
  p = p * a + 1.5707963050f;
  return 0.15915494f * p * sqrt(1.0f - a);
}

// Level of a phase in turns, any number of them, or its place in the table.
static inline intv level_of_phase(floatv turns, int levels_per_turn) {
  floatv t = turns_reduced(turns);
  t = LANES_SELECT(t, t + 1.0f, t < 0.0f);
  if (RAYWAVE_LEVEL_TABLE) return rounded(t * (float)LEVEL_TABLE_SIZE) & (LEVEL_TABLE_SIZE - 1);
  if (levels_per_turn < 0) t = 1.0f - t;
  const intv level = rounded(t * (float)abs(levels_per_turn));
  return LANES_SELECT(level, (intv)(0), level > RAYWAVE_GREY_LEVELS - 1);
}

// Level of an amplitude, 0 to 1, or its place in the table.
static inline intv level_of_amplitude(floatv amplitude) {
  if (RAYWAVE_LEVEL_TABLE)
    return rounded(amplitude * (float)(LEVEL_TABLE_SIZE - 1)) & (LEVEL_TABLE_SIZE - 1);
  return rounded(amplitude * (float)(RAYWAVE_GREY_LEVELS - 1));
}

#if RAYWAVE_TRANSFORMED
#define FIELD_PARAMETERS TRANSFORMED_PARAMETERS
#define FIELD_OF_PARAMETERS TRANSFORMED_OF_PARAMETERS
typedef Transformed Field;
#else
#define FIELD_PARAMETERS const __global float2* restrict field
#define FIELD_OF_PARAMETERS \
  { field }
typedef struct {
  const __global float2* samples;  // rows without gaps
} Field;
#endif

// Amplitude, and phase in turns, of a vector of samples of row `row` from column i on, of nx in
// a row; what lies beyond the row is not read.
static inline void polar_field(const Field* field, int nx, int i, int row, floatv* amplitude,
                               floatv* turns) {
  floatv re, im;
#if RAYWAVE_TRANSFORMED
  load_transformed(field, transformed_row(field, row) + i, nx - i, &re, &im);
  polar(re, im, amplitude, turns);
  *amplitude *= transformed_share(field, i, row);
  // Where no light is, no phase is either, as of a field
  const floatv reference = reference_turns(field, i, row);
  *turns += LANES_SELECT((floatv)(0.0f), reference, *amplitude > 0.0f);
#else
  load_some_complex(field->samples + (size_t)nx * (size_t)row + i, nx - i, &re, &im);
  polar(re, im, amplitude, turns);
#endif
}

// Levels of samples in the columns x of row y, or their places in the table. An amplitude of
// 1 / inverse_clip is the largest that is shown.
static inline intv levels_of(floatv amplitude, floatv turns, intv x, int y, float inverse_clip,
                             int levels_per_turn) {
  if (RAYWAVE_ENCODING == ENCODING_PHASE) return level_of_phase(turns, levels_per_turn);

  const floatv a = fmin(amplitude * inverse_clip, (floatv)(1.0f));
  if (RAYWAVE_ENCODING == ENCODING_DOUBLE_PHASE) {
    const floatv apart = acos_turns(a);
    const intv odd = ((x + y) & 1) != 0;
    return level_of_phase(turns + LANES_SELECT(-apart, apart, odd), levels_per_turn);
  }
  if (RAYWAVE_ENCODING == ENCODING_OFF_AXIS) {
    floatv c, s;
    cos_sin_turns(turns, &c, &s);
    return level_of_amplitude(0.5f + 0.5f * a * c);
  }
  if (RAYWAVE_ENCODING == ENCODING_BURCKHARDT) {
    // The part along the direction of this column is what two neighbours leave of the vector.
    const floatv third = LANES_TO_FLOAT(x - 3 * (x / 3)) * (1.0f / 3.0f);
    const floatv away = fabs(turns_reduced(turns - third));
    floatv c, s;
    cos_sin_turns(fmax(1.0f / 3.0f - away, (floatv)(0.0f)), &c, &s);
    return level_of_amplitude(fmin(a * s, (floatv)(1.0f)));
  }
  // Lee: bright where the stripe, whose width shows the amplitude, covers the pixel
  const floatv half_width = 0.25f - acos_turns(a);
  return LANES_SELECT((intv)(0), (intv)(RAYWAVE_GREY_LEVELS - 1),
                      fabs(turns_reduced(turns)) < half_width);
}

// Stores the levels of a packet, or those at its places of the table.
static inline void store_levels(intv level, const __global LEVEL* restrict table,
                                __global LEVEL* restrict levels) {
  if (!RAYWAVE_LEVEL_TABLE) {
    STORE_LEVELS(level, levels);
    return;
  }
  uint places[RAYWAVE_LANES];
  LANES_STORE(LANES_AS_UINT(level), places);
  // One by one: PoCL's vectoriser would join the levels to packets again, at twice the time.
#pragma clang loop vectorize(disable) unroll(full)
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) levels[lane] = table[places[lane]];
}

// 1 over the beam at a packet of pixels; 1 beyond the row's end.
static inline floatv load_beam(const __global float* beam, int count) {
  float values[RAYWAVE_LANES];
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) values[lane] = lane < count ? beam[lane] : 1.0f;
  return LANES_LOAD(values);
}

// levels: those of the field, rows of nx samples. The field begins in column x0 and row y0 of the
// SLM.
//
// added  phase of each pixel in units of 1/65536 turn, where RAYWAVE_ADDED_TURNS
// beam   1 over the amplitude of the light on each pixel, where RAYWAVE_BEAM
// table  levels by phase or amplitude, where RAYWAVE_LEVEL_TABLE
// levels_per_turn  where levels are proportional to the phase: at most RAYWAVE_GREY_LEVELS;
//                  negative where the phase falls as levels rise
SINGLE_ITEM_KERNEL void encode(FIELD_PARAMETERS, const __global ushort* restrict added,
                               const __global float* restrict beam,
                               const __global LEVEL* restrict table,
                               __global LEVEL* restrict levels, int nx, int ny, int x0, int y0,
                               float inverse_clip, float least_lit, int levels_per_turn) {
  FOR_ITEMS(row, ny, get_global_id(1)) {
    const Field from = FIELD_OF_PARAMETERS;
    const size_t start = (size_t)nx * (size_t)row;
    const int step = RAYWAVE_LANES * ITEMS(0);
    for (int i = RAYWAVE_LANES * ITEM(0); i < nx; i += step) {
      const intv x = x0 + i + LANES_INDEX;
      const bool is_whole = i + RAYWAVE_LANES <= nx;
      floatv amplitude, turns;
      polar_field(&from, nx, i, row, &amplitude, &turns);
      // Phases of what is nearly dark are as good as random: the checkerboard would shine there
      if (RAYWAVE_ENCODING == ENCODING_DOUBLE_PHASE)
        turns = LANES_SELECT(turns, (floatv)(0.0f), amplitude * inverse_clip < least_lit);
      if (RAYWAVE_ADDED_TURNS && is_whole)
        turns += TURNS_TO_FLOAT(LOAD_TURNS(added + start + i)) * TURNS_PER_UNIT;
      if (RAYWAVE_ADDED_TURNS && !is_whole) {
        float more[RAYWAVE_LANES];
        for (int lane = 0; lane < RAYWAVE_LANES; ++lane)
          more[lane] = lane < nx - i ? (float)added[start + i + lane] * TURNS_PER_UNIT : 0.0f;
        turns += LANES_LOAD(more);
      }
      if (RAYWAVE_BEAM) amplitude *= load_beam(beam + start + i, nx - i);
      const intv found = levels_of(amplitude, turns, x, y0 + row, inverse_clip, levels_per_turn);
      if (is_whole) {
        store_levels(found, table, levels + start + i);
      } else {
        int level[RAYWAVE_LANES];
        LANES_STORE(found, level);
        for (int lane = 0; lane < nx - i; ++lane)
          levels[start + i + lane] = RAYWAVE_LEVEL_TABLE ? table[level[lane]] : (LEVEL)level[lane];
      }
    }
  }
}

// The light of a field of nx samples in each of ny rows, and what is shown of it where no
// amplitude over the beam's exceeds 1: sums of |scale u|^2, of both for each work-item of each row.
// Work-items and beam as above.
SINGLE_ITEM_KERNEL void sum_light(FIELD_PARAMETERS, const __global float* restrict beam, int nx,
                                  int ny, float scale, __global float2* restrict sums) {
  FOR_ITEMS(row, ny, get_global_id(1)) {
    const Field from = FIELD_OF_PARAMETERS;
    const int step = RAYWAVE_LANES * ITEMS(0);
    floatv all = (floatv)(0.0f), shown = (floatv)(0.0f);
    for (int i = RAYWAVE_LANES * ITEM(0); i < nx; i += step) {
      floatv re, im, a = (floatv)(scale), most = (floatv)(1.0f);
#if RAYWAVE_TRANSFORMED
      load_transformed(&from, transformed_row(&from, row) + i, nx - i, &re, &im);
      a *= transformed_share(&from, i, row);
#else
      load_some_complex(from.samples + (size_t)nx * (size_t)row + i, nx - i, &re, &im);
#endif
      if (RAYWAVE_BEAM) most = 1.0f / load_beam(beam + (size_t)nx * (size_t)row + i, nx - i);
      re *= a;
      im *= a;
      const floatv light = re * re + im * im;
      all += light;
      shown += fmin(light, most * most);
    }
    sums[row * ITEMS(0) + ITEM(0)] = (float2)(lanes_float_sum(all), lanes_float_sum(shown));
  }
}

// Amplitudes of every stride-th sample of a field, row by row; beam as above.
SINGLE_ITEM_KERNEL void sample_amplitudes(FIELD_PARAMETERS, int nx,
                                          const __global float* restrict beam,
                                          __global float* restrict amplitudes, uint stride,
                                          uint count) {
  FOR_ITEMS(i, (int)count, get_global_id(0)) {
    const Field from = FIELD_OF_PARAMETERS;
    const size_t number = (size_t)i * stride;
#if RAYWAVE_TRANSFORMED
    const int column = (int)(number % (size_t)nx), row = (int)(number / (size_t)nx);
    const float2 u = transformed_row(&from, row)[column];
    const float share = from.share_x[column] * from.share_y[row];
#else
    (void)nx;
    const float2 u = from.samples[number];
    const float share = 1.0f;
#endif
    const float larger = fmax(fabs(u.x), fabs(u.y)), smaller = fmin(fabs(u.x), fabs(u.y));
    const float t = larger > 0.0f ? smaller / larger : 0.0f;
    amplitudes[i] = larger * sqrt(1.0f + t * t) * share * (RAYWAVE_BEAM ? beam[number] : 1.0f);
  }
}
