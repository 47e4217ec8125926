// SPDX-License-Identifier: Apache-2.0
// The last step of compact propagation (docs/pipeline.md): from the transform of the virtual plane
// to the field on the hologram's tile,
//   field (+)= transform exp(2 pi i c / wavelength) / (bell(u) bell(v) nx ny),
//   c = sqrt(z0^2 + u^2 + v^2).
// The phase in turns is P(u) + Q(v) - R(u, v): P and Q contain the parabola's u^2 / (2 z0
// wavelength), reduced on the host in double. R = depth (sqrt(1 + a) - 1)^2 is what sphere and
// parabola differ by, with a = (u^2 + v^2) / z0^2 and depth = z0 / (2 wavelength).
//
// finish  plane: nx samples in a row; the tile's first pixel is number `first`
//         phase_x [field_nx], phase_y   P and Q
//         square_x [field_nx], square_y  (u / z0)^2 and (v / z0)^2
//         share_x [field_nx], share_y    1 / (bell(u) nx), 1 / (bell(v) ny)
//
// A work-item takes one row (get_global_id(1)) and every get_global_size(0)-th packet of it. OpenCL
// C 1.2.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/double_single.h"
#include "kernels/common/phase.h"
#include "kernels/propagate/options.h"

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

__kernel void finish(const __global float2* restrict plane, int nx, int first,
                     const __global float* restrict phase_x, const __global float* restrict phase_y,
                     const __global float* restrict square_x,
                     const __global float* restrict square_y,
                     const __global float* restrict share_x, const __global float* restrict share_y,
                     float depth, int field_nx, int field_ny, int accumulate,
                     __global float2* restrict field) {
  const int row = (int)get_global_id(1);
  if (row >= field_ny) return;
  const __global float2* source = plane + first + (size_t)nx * (size_t)row;
  __global float2* target = field + (size_t)field_nx * (size_t)row;
  const int step = RAYWAVE_LANES * (int)get_global_size(0);
  for (int i = RAYWAVE_LANES * (int)get_global_id(0); i < field_nx; i += step) {
    const floatv turns = turns_reduced(LANES_LOAD(phase_x + i) + phase_y[row]) -
                         sphere_beyond_parabola(LANES_LOAD(square_x + i), square_y[row], depth);
    floatv c, s, re, im;
    cos_sin_turns(turns, &c, &s);
    const floatv share = LANES_LOAD(share_x + i) * share_y[row];
    load_some_complex(source + i, field_nx - i, &re, &im);
    floatv sum_re = share * (re * c - im * s), sum_im = share * (re * s + im * c);
    if (accumulate) {
      floatv old_re, old_im;
      load_some_complex(target + i, field_nx - i, &old_re, &old_im);
      sum_re += old_re;
      sum_im += old_im;
    }
    store_some_complex(sum_re, sum_im, target + i, field_nx - i);
  }
}
