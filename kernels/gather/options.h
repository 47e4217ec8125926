// SPDX-License-Identifier: Apache-2.0
// Compile-time options of gathering and fan tracing (kernels/common/options.h).
#ifndef RAYWAVE_GATHER_OPTIONS_H
#define RAYWAVE_GATHER_OPTIONS_H

// Rows of pixels that a work-item of `gather` fills, 1 to 64; Gatherer, from the work shape
#ifndef RAYWAVE_TILE_ROWS
#define RAYWAVE_TILE_ROWS 1
#endif

// Frames gathered together, 1 to 16; Gatherer
#ifndef RAYWAVE_FRAMES
#define RAYWAVE_FRAMES 1
#endif

// 1: some light would be steeper than the SLM's pixels can show; Gatherer, from the Plan
#ifndef RAYWAVE_SINE_LIMIT
#define RAYWAVE_SINE_LIMIT 1
#endif

// 1: cubic B-splines smooth the visibility mask; 0: a pixel sees what its part of the window sees.
// Gatherer, 1 at the hologram itself
#ifndef RAYWAVE_SMOOTH_PARTS
#define RAYWAVE_SMOOTH_PARTS 0
#endif

// 1: each sample lights as much of the hologram as its steepest light reaches, at the hologram
// itself; Gatherer, where surfaces lie near it or in its plane
#ifndef RAYWAVE_NEAR_HOLOGRAM
#define RAYWAVE_NEAR_HOLOGRAM 0
#endif

#define RAYWAVE_GATHER_OPTIONS(OPTION)       \
  OPTION(tile_rows, RAYWAVE_TILE_ROWS)       \
  OPTION(frames, RAYWAVE_FRAMES)             \
  OPTION(sine_limit, RAYWAVE_SINE_LIMIT)     \
  OPTION(smooth_parts, RAYWAVE_SMOOTH_PARTS) \
  OPTION(near_hologram, RAYWAVE_NEAR_HOLOGRAM)

#endif
