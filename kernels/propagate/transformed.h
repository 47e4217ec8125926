// SPDX-License-Identifier: Apache-2.0
// The field of a tile of the hologram, as the transform of a virtual plane leaves it. The last step
// of compact propagation (docs/pipeline.md) makes the field of it:
//   field = transform exp(2 pi i c / wavelength) / (window(u) window(v) nx ny),
//   c = sqrt(z0^2 + u^2 + v^2).
// A plane of samples before the hologram, z0 < 0, holds their mirror images through the hologram's
// plane: the field is the conjugate of that with -z0.
// The phase in turns is P(u) + Q(v) - R(u, v): P and Q contain the parabola's u^2 / (2 z0
// wavelength), reduced on the host in double. R = depth (sqrt(1 + a) - 1)^2 is what sphere and
// parabola differ by, with a = (u^2 + v^2) / z0^2 and depth = z0 / (2 wavelength). OpenCL C 1.2.
#ifndef RAYWAVE_TRANSFORMED_H
#define RAYWAVE_TRANSFORMED_H

#include "kernels/common/complex_lanes.h"
#include "kernels/common/double_single.h"
#include "kernels/common/phase.h"
#include "kernels/propagate/options.h"

// Tables by the tile's column (x) or row (y). Those by column may be read in whole packets.
typedef struct {
  const __global float2* plane;  // rows row_stride samples apart
  int row_stride;
  int first;                       // the tile's first pixel
  const __global float* phase_x;   // P
  const __global float* phase_y;   // Q
  const __global float* square_x;  // (u / z0)^2
  const __global float* square_y;  // (v / z0)^2
  const __global float* share_x;   // 1 / (window(u) nx)
  const __global float* share_y;   // 1 / (window(v) ny)
  float depth;
  float side;  // -1: z0 < 0; 1
} Transformed;

// Passed by TransformedPlane (host/propagate/tile_field.hpp).
#define TRANSFORMED_PARAMETERS                                                                     \
  const __global float2 *restrict plane, int row_stride, int first,                                \
      const __global float *restrict phase_x, const __global float *restrict phase_y,              \
      const __global float *restrict square_x, const __global float *restrict square_y,            \
      const __global float *restrict share_x, const __global float *restrict share_y, float depth, \
      float side
#define TRANSFORMED_OF_PARAMETERS \
  { plane, row_stride, first, phase_x, phase_y, square_x, square_y, share_x, share_y, depth, side }

// Reduced turns of R.
static inline floatv sphere_beyond_parabola(floatv square_x, float square_y, float depth) {
#if RAYWAVE_TWO_FLOATS
  const DoubleSingle one = ds((floatv)(1.0f), 0.0f),
                     a = ds_plus(ds(square_x, 0.0f), ds((floatv)(square_y), 0.0f));
  const DoubleSingle t = ds_over(a, ds_plus(one, ds_sqrt(ds_plus(one, a))));
  return ds_turns(ds_times(ds((floatv)(depth), 0.0f), ds_times(t, t)));
#else
  const floatv a = square_x + square_y;
  const floatv t = a / (1.0f + sqrt(1.0f + a));
  return turns_reduced(depth * (t * t));
#endif
}

// The transform at some pixels of a row that begins at `source`; the rest is zero.
static inline void load_transformed(const Transformed* from, const __global float2* source,
                                    int count, floatv* re, floatv* im) {
  load_some_complex(source, count, re, im);
  *im *= from->side;
}

// Turns of the reference wave at the pixels of a row from column i on.
static inline floatv reference_turns(const Transformed* from, int i, int row) {
  return turns_reduced(LANES_LOAD(from->phase_x + i) + from->phase_y[row]) -
         sphere_beyond_parabola(LANES_LOAD(from->square_x + i), from->square_y[row], from->depth);
}

// The factor of the transform there.
static inline floatv transformed_share(const Transformed* from, int i, int row) {
  return LANES_LOAD(from->share_x + i) * from->share_y[row];
}

static inline const __global float2* transformed_row(const Transformed* from, int row) {
  return from->plane + from->first + (size_t)from->row_stride * (size_t)row;
}

#endif
