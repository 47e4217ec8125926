// SPDX-License-Identifier: Apache-2.0
// Which part of a sample's light reaches a pixel, by the sample's visibility mask (visibility.h).
#ifndef RAYWAVE_PARTS_SEEN_H
#define RAYWAVE_PARTS_SEEN_H

#include "kernels/common/lanes.h"
#include "kernels/gather/options.h"
#include "kernels/samples/visibility.h"

#define VISIBILITY_CLEAR 0
#define VISIBILITY_MIXED 1
#define VISIBILITY_NONE 2

#if !RAYWAVE_SMOOTH_PARTS
// Visibility of a sample from a box of the hologram's window, in half sides of the window that the
// mask divides: VISIBILITY_CLEAR, _MIXED or _NONE.
static inline int visibility_state(__global const uint* visibility, float x0, float x1, float y0,
                                   float y1) {
  const int left = visibility_part(x0), right = visibility_part(x1);
  const uint columns = (2u << right) - (1u << left);
  uint all = columns, any = 0;
  for (int j = visibility_part(y0); j <= visibility_part(y1); ++j) {
    const uint row = visibility_row(visibility, j) & columns;
    all &= row;
    any |= row;
  }
  return all == columns ? VISIBILITY_CLEAR : any ? VISIBILITY_MIXED : VISIBILITY_NONE;
}
#endif

#if RAYWAVE_SMOOTH_PARTS && RAYWAVE_VISIBILITY_PARTS > 0
// Cubic B-splines of four parts at `place`, in parts from the middle of the first part of a side:
// their weights. Returns the first of the four, which may lie beyond the side.
static inline intv splines_at(floatv place, floatv* weights) {
  const intv before = LANES_TO_INT(clamp(place, -1.0f, (float)RAYWAVE_VISIBILITY_PARTS) + 2.0f) - 2;
  const floatv t = place - LANES_TO_FLOAT(before), rest = 1.0f - t;
  weights[0] = rest * rest * rest / 6.0f;
  weights[1] = 2.0f / 3.0f - t * t + 0.5f * t * t * t;
  weights[2] = 2.0f / 3.0f - rest * rest + 0.5f * rest * rest * rest;
  weights[3] = t * t * t / 6.0f;
  return before - 1;
}

// Share of the light that pixels see, at places across the window and on one row of it, in parts
// from the middle of the first. Parts beyond the window see what the outermost see.
static inline floatv smooth_share(__global const uint* visibility, floatv across, float up) {
  floatv columns[4], rows[4];
  const intv column = splines_at(across, columns), row = splines_at((floatv)(up), rows);
  floatv share = 0.0f;
  for (int j = 0; j < 4; ++j) {
    const int part = clamp(LANES_FIRST(row) + j, 0, RAYWAVE_VISIBILITY_PARTS - 1);
    const intv seen = (intv)((int)visibility_row(visibility, part));
    floatv of_row = 0.0f;
    for (int i = 0; i < 4; ++i) {
      const intv bit =
          seen >> clamp(column + i, (intv)(0), (intv)(RAYWAVE_VISIBILITY_PARTS - 1)) & 1;
      of_row += LANES_SELECT((floatv)(0.0f), columns[i], bit != 0);
    }
    share += rows[j] * of_row;
  }
  return share;
}
#endif

// Share of part (i, j) of PLANE_WAVE_PARTS x PLANE_WAVE_PARTS parts of the window that sees the
// sample.
static inline float visible_share(__global const uint* visibility, int i, int j) {
#if RAYWAVE_VISIBILITY_PARTS > 0
  const int side = RAYWAVE_VISIBILITY_PARTS / PLANE_WAVE_PARTS;
  int seen = 0;
  for (int row = j * side; row < (j + 1) * side; ++row)
    seen += (int)popcount(visibility_row(visibility, row) >> (i * side) & ((1u << side) - 1u));
  return (float)seen / (float)(side * side);
#else
  (void)visibility, (void)i, (void)j;
  return 1.0f;
#endif
}

#endif
