// SPDX-License-Identifier: Apache-2.0
// Samples as a tile of the hologram sees them: the pixels of the virtual plane that they light, and
// what their profiles need (compact.cl).
#ifndef RAYWAVE_SEEN_H
#define RAYWAVE_SEEN_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/gather/compact_layout.h"
#include "kernels/gather/options.h"
#include "kernels/gather/path_terms.h"
#include "kernels/samples/visibility.h"
#include "kernels/scene/surface.h"

// Lines of a partly hidden sample: one for each row of parts, and two beyond on each side
#define COMPACT_SPLINES (RAYWAVE_VISIBILITY_PARTS + 4)
// Lines of any sample, at most
#define COMPACT_SPLINES_OR_LINES \
  (COMPACT_SPLINES > COMPACT_MOST_LINES ? COMPACT_SPLINES : COMPACT_MOST_LINES)

// Numbers for path differences: only a few turns are left of them, so that floats do.
#if RAYWAVE_PRECISION == PRECISION_DOUBLE
typedef double real;
typedef DoubleSingle realv;
#define REAL_OF_DS(w) (w)
#define REAL_OF(v) DS_CONVERT(v)
#define REAL_TURNS(turns) ds_turns(turns)
#define REAL_TO_FLOAT(w) ds_high(w)
#define REAL_OF_TWO(high, low) ((double)(high) + (double)(low))
#else
typedef float real;
typedef floatv realv;
#define REAL_OF_DS(w) ds_high(w)
#define REAL_OF(v) (v)
#define REAL_TURNS(turns) (turns)
#define REAL_TO_FLOAT(w) (w)
#define REAL_OF_TWO(high, low) (high)
#endif

// 1: light is computed at every node; 0: at the knots. Polynomials in floats would lose what
// doubles are for.
#define LIGHT_AT_NODES (RAYWAVE_PRECISION == PRECISION_DOUBLE)

// A sample as the tile sees it. Metres, y downwards from the tile's origin pixel.
typedef struct {
  real x;
  real y;
  real z;
  real length;   // of (x, y, z)
  real squares;  // z0^2 - length^2
  real sine_x;   // x / length
  real sine_y;
  // Turns per metre by which the sample's direction differs from that of its footprint's middle
  real slope_x;
  real slope_y;
  real turns;  // at the origin pixel
  real kind;   // a sum of SEEN_CUT, SEEN_ROUGH and SEEN_SHINES
  real z0;     // distance to the virtual plane
  real rate;   // turns per metre
} Seen;

#define SEEN_CUT 1     // some of its light is too steep
#define SEEN_ROUGH 2   // its amplitude is no smooth function of the place on the tile
#define SEEN_SHINES 4  // it has highlights

static inline Seen load_seen(__global const real* seen, const CompactPlane* plane) {
  const Seen s = {seen[0],
                  seen[1],
                  seen[2],
                  seen[3],
                  seen[4],
                  seen[5],
                  seen[6],
                  seen[7],
                  seen[8],
                  seen[9],
                  seen[10],
                  REAL_OF_TWO(plane->z0, plane->z0_low),
                  REAL_OF_TWO(plane->turns_hi, plane->turns_lo)};
  return s;
}

static inline void store_seen(realv value, int member, int count, __global real* seen) {
#if RAYWAVE_LANES == 1
  (void)count;
  seen[member] = value;
#else
  real values[RAYWAVE_LANES];
  LANES_STORE(value, values);
  for (int lane = 0; lane < count; ++lane) seen[COMPACT_SEEN * lane + member] = values[lane];
#endif
}

// Samples, one per lane.
typedef struct {
  Surface surface;  // what highlights need
  floatv radiance;
  floatv tilt_x, tilt_y, tilt_z;
  intv hidden;
} SampleLanes;

// The first `count` samples; the last one once more in the other lanes.
static inline SampleLanes load_samples(__global const Sample* samples, int count) {
  float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES], nx[RAYWAVE_LANES], ny[RAYWAVE_LANES],
      nz[RAYWAVE_LANES], radiance[RAYWAVE_LANES], specular[RAYWAVE_LANES], shininess[RAYWAVE_LANES],
      tilt_x[RAYWAVE_LANES], tilt_y[RAYWAVE_LANES], tilt_z[RAYWAVE_LANES];
  int hidden[RAYWAVE_LANES];
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    __global const Sample* s = samples + min(lane, count - 1);
    x[lane] = s->x;
    y[lane] = s->y;
    z[lane] = s->z;
    nx[lane] = s->nx;
    ny[lane] = s->ny;
    nz[lane] = s->nz;
    radiance[lane] = s->radiance;
    specular[lane] = s->specular;
    shininess[lane] = s->shininess;
    tilt_x[lane] = s->tilt_x;
    tilt_y[lane] = s->tilt_y;
    tilt_z[lane] = s->tilt_z;
    hidden[lane] = s->hidden != 0;
  }
  SampleLanes s;
  s.surface.x = LANES_LOAD(x);
  s.surface.y = LANES_LOAD(y);
  s.surface.z = LANES_LOAD(z);
  s.surface.nx = LANES_LOAD(nx);
  s.surface.ny = LANES_LOAD(ny);
  s.surface.nz = LANES_LOAD(nz);
  s.surface.specular[0] = LANES_LOAD(specular);
  s.surface.shininess = LANES_LOAD(shininess);
  LOOK_FOR_LIGHTS(&s.surface, (intv)(0));
  s.radiance = LANES_LOAD(radiance);
  s.tilt_x = LANES_LOAD(tilt_x);
  s.tilt_y = LANES_LOAD(tilt_y);
  s.tilt_z = LANES_LOAD(tilt_z);
  s.hidden = LANES_LOAD(hidden) != 0;
  return s;
}

#if RAYWAVE_PATHS
// A place (u, v) of the tile in half sides of the window of visibility masks.
static inline floatv window_x(const CompactPlane* plane, floatv u) {
  return u * plane->window_scale_x + plane->window_shift_x;
}
static inline floatv window_y(const CompactPlane* plane, floatv v) {
  return plane->window_shift_y - v * plane->window_scale_y;
}

// Paths of samples, one per lane; those that are seen directly have none.
static inline floatv rests_of(__global const Sample* samples, int count,
                              __global const SamplePath* paths, floatv x, floatv y) {
  float xs[RAYWAVE_LANES], ys[RAYWAVE_LANES], rests[RAYWAVE_LANES];
  LANES_STORE(x, xs);
  LANES_STORE(y, ys);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    const int path = samples[min(lane, count - 1)].path;
    rests[lane] =
        path < 0 ? 0.0f
                 : LANES_FIRST(path_rest(paths + path, (floatv)(xs[lane]), (floatv)(ys[lane])));
  }
  return LANES_LOAD(rests);
}

static inline bool any_path(__global const Sample* samples, int count) {
  bool any = false;
  for (int lane = 0; lane < count; ++lane) any |= samples[lane].path >= 0;
  return any;
}

// Turns of coupled phase (path_coupling) that 8 scan lines follow, to some percent
#define MOST_COUPLING_TURNS 0.9f

// Places along a tile's side at which the slopes of paths are taken
#define SLOPES_ALONG 9

// Smallest and largest slope of the paths along one axis of the tile, on three lines, in metres
// per metre.
static inline void path_slopes(__global const Sample* samples, int count,
                               __global const SamplePath* paths, const CompactPlane* plane,
                               bool along_x, intv follows, floatv* low, floatv* high) {
  float lows[RAYWAVE_LANES], highs[RAYWAVE_LANES];
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    lows[lane] = highs[lane] = 0.0f;
    const int path = samples[min(lane, count - 1)].path;
    if (path < 0) continue;
    lows[lane] = 1e30f;
    highs[lane] = -1e30f;
    for (int i = 0; i < 3 * SLOPES_ALONG; ++i) {
      const float along = (float)(i % SLOPES_ALONG) * (2.0f / (SLOPES_ALONG - 1)) - 1.0f,
                  aside = (float)(i / SLOPES_ALONG) - 1.0f;
      const floatv x = window_x(plane, (floatv)((along_x ? along : aside) * plane->half_x)),
                   y = window_y(plane, (floatv)((along_x ? aside : along) * plane->half_y));
      const float slope = LANES_FIRST(along_x ? path_slope_x(paths + path, x, y)
                                              : path_slope_y(paths + path, x, y)) *
                          (along_x ? plane->window_scale_x : -plane->window_scale_y);
      lows[lane] = fmin(lows[lane], slope);
      highs[lane] = fmax(highs[lane], slope);
    }
  }
  *low = LANES_SELECT((floatv)(0.0f), LANES_LOAD(lows), follows);
  *high = LANES_SELECT((floatv)(0.0f), LANES_LOAD(highs), follows);
}

// Metres by which the paths on the tile's top and bottom rows differ from that on the middle row,
// less the same on the middle column: the part that is odd in the row, and the even one.
static inline void path_coupling(__global const Sample* samples, int count,
                                 __global const SamplePath* paths, const CompactPlane* plane,
                                 floatv* odd, floatv* even) {
  *odd = *even = 0.0f;
  for (int side = -1; side <= 1; side += 2) {
    floatv coupled[3];
    for (int row = 0; row < 3; ++row) {
      const floatv y = window_y(plane, (floatv)((float)(row - 1) * plane->half_y));
      coupled[row] = rests_of(samples, count, paths,
                              window_x(plane, (floatv)((float)side * plane->half_x)), y) -
                     rests_of(samples, count, paths, window_x(plane, (floatv)(0.0f)), y);
    }
    *odd = fmax(*odd, fabs(0.5f * (coupled[2] - coupled[0])));
    *even = fmax(*even, fabs(0.5f * (coupled[2] + coupled[0]) - coupled[1]));
  }
}
#endif

// Rays to so many places along one axis of the tile, on three lines, bound a footprint along it.
#define RAYS_ALONG 9

// First pixel, and number, of those that rays from samples to the tile come from, along one axis:
// s, half_m of it and other_s, other_half_m of the other.
//
// least_slope, largest_slope  of the paths over mirrors and through glass, beyond the rays
static inline void footprint_along(floatv s, floatv other_s, floatv z, float z0, float half_m,
                                   float other_half_m, float pixels_per_sine, int most,
                                   floatv margin, floatv least_slope, floatv largest_slope,
                                   intv* first, intv* count) {
  floatv low = 1e30f, high = -1e30f;
  for (int ray = 0; ray < 3 * RAYS_ALONG; ++ray) {
    const float u = ((float)(ray % RAYS_ALONG) * (2.0f / (RAYS_ALONG - 1)) - 1.0f) * half_m,
                v = ((float)(ray / RAYS_ALONG) - 1.0f) * other_half_m;
    const float reference = u / sqrt(u * u + v * v + z0 * z0);
    const floatv du = s - u, dv = other_s - v;
    const floatv x = pixels_per_sine * (du / sqrt(du * du + dv * dv + z * z) + reference);
    low = fmin(low, x);
    high = fmax(high, x);
  }
  low -= pixels_per_sine * largest_slope;
  high -= pixels_per_sine * least_slope;
  const floatv limit = 1e9f;
  *first = LANES_TO_INT(ceil(clamp(low - margin, -limit, limit)));
  *count = LANES_TO_INT(floor(clamp(high + margin, -limit, limit))) + 1 - *first;
  *count += *count & 1;
  const intv beyond = max(*count - most, (intv)(0));
  *first += beyond / 2;
  *count -= beyond;
}

// Mask of the samples some of whose light towards places within half_x and half_y of the tile's
// middle fades out because it is too steep.
static inline intv is_cut(floatv x, floatv y, floatv z, float half_x, float half_y,
                          const CompactPlane* plane) {
#if RAYWAVE_SINE_LIMIT
  const floatv across = fabs(x) + half_x, up = fabs(y) + half_y;
  const floatv x_length = sqrt(across * across + z * z), y_length = sqrt(up * up + z * z);
  const float limit_x = plane->sine_limit_x - fabs(plane->reference_x) -
                        half_x * fabs(plane->reference_fall_x),
              limit_y = plane->sine_limit_y - fabs(plane->reference_y) -
                        half_y * fabs(plane->reference_fall_y);
  return ((limit_x * x_length - across) * plane->per_cut_x < 1.0f - COMPACT_EDGE_BEYOND) |
         ((limit_y * y_length - up) * plane->per_cut_y < 1.0f - COMPACT_EDGE_BEYOND);
#else
  (void)x, (void)y, (void)z, (void)half_x, (void)half_y, (void)plane;
  return LANES_INDEX < 0;
#endif
}

// Mask of the samples whose amplitude is a smooth function of the direction to the tile, which lies
// within half_x and half_y of (tangent_x, tangent_y): their projected area is far from zero and
// from its limit, and highlights are wide against the tile.
//
// shines  samples with highlights
static inline intv is_smooth(const SampleLanes* s, intv shines, floatv tangent_x, floatv half_x,
                             floatv tangent_y, floatv half_y) {
  const floatv middle = s->tilt_x * tangent_x + s->tilt_y * tangent_y - s->tilt_z,
               change = fabs(s->tilt_x) * half_x + fabs(s->tilt_y) * half_y;
  const floatv shininess = s->surface.shininess;
  const intv wide = (shininess * (half_x * half_x + half_y * half_y) < 1.0f) & (shininess >= 8.0f);
  return (middle > 3.0f * change) & (middle + change < 4.0f) & (wide | !shines);
}

// Scan lines of samples: as few as keep within the tolerance (docs/pipeline.md).
//
// path_odd, path_even  of path_coupling
static inline intv lines_of(floatv x, floatv y, floatv z, floatv path_odd, floatv path_even,
                            const CompactPlane* plane) {
  const float h = plane->half_y, z0 = plane->z0;
  const floatv across = x * x + z * z, up = (y - h) * (y - h), down = (y + h) * (y + h);
  // Distances from the column u = 0 to the sample, and to the reference's centre
  const floatv top = sqrt(across + up), middle = sqrt(across + y * y), bottom = sqrt(across + down);
  const float c_middle = z0, c_top = sqrt(z0 * z0 + h * h);
  floatv odd = 0.0f, even = 0.0f;
  for (int side = -1; side <= 1; side += 2) {
    const float u = (float)side * plane->half_x;
    const floatv beyond = u * (u - 2.0f * x), across_there = across + beyond;
    const floatv there_top = sqrt(across_there + up), there_bottom = sqrt(across_there + down);
    const floatv sum_top = there_top + top, sum_bottom = there_bottom + bottom;
    // Differences of paths as products: the paths are a million wavelengths long.
    const floatv nearer = -beyond * (1.0f / sum_top + 1.0f / sum_bottom);
    odd = fmax(odd, fabs(2.0f * h * y * nearer / ((there_top + there_bottom) * (top + bottom))));
    const floatv bend = beyond * (0.5f / sum_top + 0.5f / sum_bottom -
                                  1.0f / (sqrt(across_there + y * y) + middle));
    const float reference_bend =
        u * u *
        (1.0f / (sqrt(c_top * c_top + u * u) + c_top) - 1.0f / (sqrt(z0 * z0 + u * u) + c_middle));
    even = fmax(even, fabs(bend - reference_bend));
  }
  const float radians = 6.2831853f * plane->turns_hi;
  odd = (odd + path_odd) * radians;
  even = (even + path_even) * radians;
  intv lines = plane->lines;
  floatv power = 1.0f;
  for (int fewer = 1; fewer < plane->lines; ++fewer) {
    power *= odd + even;
    const floatv error = COMPACT_LINES_ERROR(fewer, even, power);
    lines = LANES_SELECT(lines, (intv)(fewer),
                         (error <= plane->lines_tolerance) & (lines == plane->lines));
  }
  return lines;
}

#endif
