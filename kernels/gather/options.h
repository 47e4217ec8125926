// SPDX-License-Identifier: Apache-2.0
// Compile-time options of gathering, fan tracing and interpolation (kernels/common/options.h).
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

// Where the light of a ray of the fan comes from; Tracer
#define SOURCE_HIT 0      // its hit
#define SOURCE_SURFACE 1  // the sample of the table nearest to its hit
#define SOURCE_BOUNCED 2  // hits behind mirrors and glass only, added to what `field` holds
#ifndef RAYWAVE_SOURCE
#define RAYWAVE_SOURCE SOURCE_HIT
#endif

// Rows of samples that a work-item interpolates, 1 or more; Interpolator
#ifndef RAYWAVE_INTERPOLATE_ROWS
#define RAYWAVE_INTERPOLATE_ROWS 1
#endif

#define RAYWAVE_GATHER_OPTIONS(OPTION)         \
  OPTION(tile_rows, RAYWAVE_TILE_ROWS)         \
  OPTION(frames, RAYWAVE_FRAMES)               \
  OPTION(sine_limit, RAYWAVE_SINE_LIMIT)       \
  OPTION(smooth_parts, RAYWAVE_SMOOTH_PARTS)   \
  OPTION(near_hologram, RAYWAVE_NEAR_HOLOGRAM) \
  OPTION(source, RAYWAVE_SOURCE)               \
  OPTION(interpolate_rows, RAYWAVE_INTERPOLATE_ROWS)

#endif
