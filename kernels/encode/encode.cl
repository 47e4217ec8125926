// SPDX-License-Identifier: Apache-2.0
// Phase of a complex field as 8-bit grey levels. OpenCL C 1.2.
#include "kernels/common/complex_lanes.h"

#if RAYWAVE_LANES == 1
#define ROUNDED(v) convert_int_rte(v)
#define STORE_LEVELS(v, p) (*(p) = (uchar)(v))
#else
#define ROUNDED(v) LANES_PASTE(LANES_PASTE(convert_int, RAYWAVE_LANES), _rte)(v)
#define STORE_LEVELS(v, p) \
  LANES_PASTE(vstore, RAYWAVE_LANES)(LANES_PASTE(convert_uchar, RAYWAVE_LANES)(v), 0, p)
#endif

// Grey level of the phase of re + i im: 256 to the turn, rounded to nearest, in 0..255. Zero and
// numbers that are not finite have level 0.
static inline intv level_of(floatv re, floatv im) {
  const floatv x = fabs(re), y = fabs(im);
  const intv known = (x <= FLT_MAX) & (y <= FLT_MAX) & (x + y > 0.0f);
  const floatv larger = fmax(x, y), smaller = fmin(x, y);
  // Turns in the first octant: atan(t) / (2 pi), Abramowitz and Stegun 4.4.49, error 2e-8 rad.
  // Calls of builtins such as atan2 would stop PoCL's vectoriser.
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
  floatv turns = p * t * 0.15915494f;
  turns = LANES_SELECT(turns, 0.25f - turns, y > x);
  turns = LANES_SELECT(turns, 0.5f - turns, re < 0.0f);
  turns = LANES_SELECT(turns, -turns, im < 0.0f);
  const intv level = ROUNDED(turns * 256.0f) & 255;
  return LANES_SELECT((intv)(0), level, known);
}

// levels[i]: grey level of field[i]. A work-item takes one packet.
__kernel void encode(const __global float2* restrict field, __global uchar* restrict levels,
                     uint size) {
  const uint i = RAYWAVE_LANES * (uint)get_global_id(0);
  if (i >= size) return;
  floatv re = 0.0f, im = 0.0f;
  if (i + RAYWAVE_LANES <= size) {
    load_complex(field + i, &re, &im);
    STORE_LEVELS(level_of(re, im), levels + i);
    return;
  }
  for (uint lane = 0; lane < size - i; ++lane) {
    ((float*)&re)[lane] = field[i + lane].x;
    ((float*)&im)[lane] = field[i + lane].y;
  }
  const intv level = level_of(re, im);
  for (uint lane = 0; lane < size - i; ++lane) levels[i + lane] = (uchar)((const int*)&level)[lane];
}
