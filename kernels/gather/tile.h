// SPDX-License-Identifier: Apache-2.0
// The pixels of a work-item of `gather`, and how they lie to a sample.
#ifndef RAYWAVE_TILE_H
#define RAYWAVE_TILE_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/gather/options.h"

// The pixels of a work-item and their sums.
typedef struct {
  int first;  // column
  int top;    // row
  int bottom;
  floatv re[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
  floatv im[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
} Tile;

// True for samples before the hologram, z < 0: light from them on to the eye comes from the other
// side of the hologram's middle.
static inline bool is_before_hologram(const ProjectedSample* p) { return p->scale_x < 0.0f; }

// Distances between light and a pixel are at least this long.
static inline float nearest_to(const GatherPlane* plane) {
  return 0x1p-10f * fmin(plane->pitch_x, plane->pitch_y);
}

static inline void put(DoubleSingle value, float* hi, float* lo) {
  *hi = LANES_FIRST(ds_high(value));
  *lo = LANES_FIRST(ds_low(value));
}

#if RAYWAVE_NEAR_HOLOGRAM
// Differences of tangents, per axis, between a sample's middle ray with these sines and the
// steepest light that pixels show beside it.
static inline float2 steepest_beside(float sine_x, float sine_y, const GatherPlane* plane) {
  const float most_x = fmin(fabs(sine_x) + plane->sine_limit_x, 0.99f),
              most_y = fmin(fabs(sine_y) + plane->sine_limit_y, 0.99f);
  const float cosine = sqrt(fmax(1.0f - most_x * most_x - most_y * most_y, 0.01f)),
              middle = sqrt(fmax(1.0f - sine_x * sine_x - sine_y * sine_y, 0.01f));
  return (float2)(most_x / cosine - fabs(sine_x) / middle, most_y / cosine - fabs(sine_y) / middle);
}

// Where the chief ray of a sample meets the hologram, from the middle of the tile's window.
static inline float chief_place_x(const ProjectedSample* p, const GatherPlane* plane) {
  return p->centre_x - (plane->hologram_x - plane->left);
}
static inline float chief_place_y(const ProjectedSample* p, const GatherPlane* plane) {
  return p->centre_y - (plane->hologram_y - plane->top);
}
#endif

#endif
