// SPDX-License-Identifier: Apache-2.0
// Polynomials of paths over mirrors and through glass (SamplePath in shared.h). x, y: places on the
// window that visibility masks divide, in half sides from its centre.
#ifndef RAYWAVE_PATH_TERMS_H
#define RAYWAVE_PATH_TERMS_H

#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/samples/options.h"

#if RAYWAVE_PATHS
// Path beyond the distance from the virtual point, metres; before the hologram, beyond that of the
// light which converges to it.
static inline floatv path_rest(__global const SamplePath* path, floatv x, floatv y) {
  __global const float* c = path->rest;
  const floatv y0 = ((c[12] * x + c[7]) * x + c[3]) * x + c[0],
               y1 = ((c[13] * x + c[8]) * x + c[4]) * x + c[1],
               y2 = ((c[14] * x + c[9]) * x + c[5]) * x + c[2], y3 = (c[15] * x + c[10]) * x + c[6],
               y4 = c[16] * x + c[11];
  return x * (x * y0 + y * y1) + y * y * (y2 + y * (y3 + y * (y4 + y * c[17])));
}

// Its derivative along x.
static inline floatv path_slope_x(__global const SamplePath* path, floatv x, floatv y) {
  __global const float* c = path->rest;
  const floatv y0 = ((5.0f * c[12] * x + 4.0f * c[7]) * x + 3.0f * c[3]) * x + 2.0f * c[0],
               y1 = ((4.0f * c[13] * x + 3.0f * c[8]) * x + 2.0f * c[4]) * x + c[1],
               y2 = (3.0f * c[14] * x + 2.0f * c[9]) * x + c[5], y3 = 2.0f * c[15] * x + c[10];
  return x * y0 + y * (y1 + y * (y2 + y * (y3 + y * c[16])));
}

// The same along y.
static inline floatv path_slope_y(__global const SamplePath* path, floatv x, floatv y) {
  __global const float* c = path->rest;
  const floatv y1 = ((c[13] * x + c[8]) * x + c[4]) * x + c[1],
               y2 = ((c[14] * x + c[9]) * x + c[5]) * x + c[2], y3 = (c[15] * x + c[10]) * x + c[6],
               y4 = c[16] * x + c[11];
  return x * y1 + y * (2.0f * y2 + y * (3.0f * y3 + y * (4.0f * y4 + y * (5.0f * c[17]))));
}

// Amplitude over that of the virtual point.
static inline floatv path_amplitude(__global const SamplePath* path, floatv x, floatv y) {
  __global const float* c = path->amplitude;
  return c[0] + x * (c[1] + x * c[3] + y * c[4]) + y * (c[2] + y * c[5]);
}
#endif

#endif
