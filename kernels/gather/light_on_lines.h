// SPDX-License-Identifier: Apache-2.0
// A sample's light on scan lines of the hologram, and its transform (compact.cl).
#ifndef RAYWAVE_LIGHT_ON_LINES_H
#define RAYWAVE_LIGHT_ON_LINES_H

#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/gather/compact_layout.h"
#include "kernels/gather/options.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/gather/seen.h"
#include "kernels/samples/visibility.h"

// A smooth step where light becomes too steep for the pixels, as wide as 1 / per_cut.
//
// reference  sine of the light on the SLM, there
static inline floatv shown_share(floatv offset, floatv length, floatv reference, float sine_limit,
                                 float per_cut) {
#if RAYWAVE_SINE_LIMIT
  const floatv e = clamp(
      (sine_limit * length - fabs(offset - reference * length)) * per_cut + COMPACT_EDGE_BEYOND,
      (floatv)(0.0f), (floatv)(1.0f));
  return e * e * (3.0f - 2.0f * e);
#else
  (void)offset, (void)length, (void)reference, (void)sine_limit, (void)per_cut;
  return 1.0f;
#endif
}

// Light at nodes on both sides of the middle one: sums and differences of each pair, which share
// the rotors, and the light of the middle node.
typedef struct {
  float even_re[COMPACT_NODES];
  float even_im[COMPACT_NODES];
  float odd_re[COMPACT_NODES];
  float odd_im[COMPACT_NODES];
  float middle_re;
  float middle_im;
} Nodes;

static inline void set_nodes(int node, floatv right_re, floatv right_im, floatv left_re,
                             floatv left_im, Nodes* nodes) {
  LANES_STORE(right_re + left_re, nodes->even_re + node);
  LANES_STORE(right_im + left_im, nodes->even_im + node);
  LANES_STORE(right_re - left_re, nodes->odd_re + node);
  LANES_STORE(right_im - left_im, nodes->odd_im + node);
}

// Stores pixels `pixel` and on, right of the middle, and those left of it. A profile has room for
// whole packets of eight.
static inline void store_pixels(floatv right, floatv left, int pixel, int count,
                                __global float* middle) {
  const floatv mirrored = LANES_REVERSED(left);
#if RAYWAVE_LANES == 16
  if (count - pixel <= 8) {
    vstore8(right.lo, 0, middle + pixel);
    vstore8(mirrored.hi, 0, middle - pixel - 8);
    return;
  }
#endif
  (void)count;
  LANES_STORE(right, middle + pixel);
  LANES_STORE(mirrored, middle - pixel - RAYWAVE_LANES);
}

// Writes the transform of the light at 2 half_nodes + 1 nodes: `count` pixels on each side of the
// middle, in whole packets, times the signs that pixels of odd places change. They bring the tile
// into the transform's middle. Pixels on both sides share the rotors, too.
//
// out_re, out_im  the first pixel right of the middle
static inline void transform(const Nodes* nodes, int n, int half_nodes,
                             __global const float* rotors, int count, __global float* out_re,
                             __global float* out_im) {
  for (int pixel = 0; pixel < count; pixel += RAYWAVE_LANES) {
    const floatv sign = 1.0f - 2.0f * LANES_TO_FLOAT((pixel + LANES_INDEX) & 1);
    __global const float* turns = rotors + pixel;
    floatv even_cos = sign * nodes->middle_re, im_cos = sign * nodes->middle_im, im_sin = 0.0f,
           re_sin = 0.0f;
    for (int node = 0; node < half_nodes; ++node, turns += n) {
      const floatv c = LANES_LOAD(turns), s = LANES_LOAD(turns + n / 2);
      even_cos += nodes->even_re[node] * c;
      im_sin += nodes->odd_im[node] * s;
      im_cos += nodes->even_im[node] * c;
      re_sin += nodes->odd_re[node] * s;
    }
    store_pixels(even_cos - im_sin, -(even_cos + im_sin), pixel, count, out_re);
    store_pixels(im_cos + re_sin, re_sin - im_cos, pixel, count, out_im);
  }
}

// Light of amplitude 1 at places (u, v) of the tile, less its phase at (0, v) and with its
// footprint's middle turned to zero: turns, and the weight 1 / distance.
static inline void light_on_row(const Seen* s, realv u, realv v, realv* turns, floatv* weight) {
  const real one = 1, two = 2;
  const realv down = v * (v - two * s->y);  // of squared lengths, from the origin to (0, v)
  const realv column_length = sqrt(s->length * s->length + down),
              column_reference = sqrt(s->z0 * s->z0 + v * v);
  const realv across = u * (u - two * s->x);
  const realv r = sqrt(column_length * column_length + across),
              c = sqrt(column_reference * column_reference + u * u);
  const realv squares = s->squares + two * v * s->y;
  const realv column_nearer = squares / (column_reference + column_length),
              column_beyond = down / (column_length + s->length);
  // c - r and the same at u = 0, over the sums that stand below u^2; r and the column's length,
  // beyond the sample's own. Quotients share their divisions.
  const realv sum = r + column_length, references = c + column_reference, own = r + s->length;
  const realv first = one / ((c + r) * own), second = one / (sum * references * r);
  const realv nearer = (squares + two * u * s->x) * own * first,
              beyond = (across + down) * (c + r) * first + column_beyond;
  *turns = s->rate *
               (u * r * second * (u * (nearer + column_nearer) + s->sine_x * beyond * references)) -
           u * s->slope_x;
  *weight = REAL_TO_FLOAT(sum * references * second);
}

// Turns of light on the column u = 0, likewise.
static inline realv turns_on_column(const Seen* s, realv v) {
  const real two = 2;
  const realv down = v * (v - two * s->y);
  const realv r = sqrt(s->length * s->length + down), c = sqrt(s->z0 * s->z0 + v * v);
  const realv nearer = (s->squares + two * v * s->y) / (c + r);
  const real own_nearer = s->squares / (s->z0 + s->length);
  const realv sum = r + s->length;
  const realv bend = v * v * (nearer + own_nearer) / (sum * (c + s->z0));
  return s->rate * (bend + v * s->sine_y * (down / (sum * sum))) - v * s->slope_y;
}

// Values at the knots of a line: the first half right of the middle, then those left of it in the
// same order. The polynomial through them at nodes on both sides of the middle one.
//
// basis  rows of weights from the knots' first on
static inline void between_knots(const float* values, int knots, __global const float* basis, int n,
                                 int node, floatv* right, floatv* left) {
  floatv even = 0.0f, odd = 0.0f;
  for (int knot = 0; knot < knots / 2; ++knot) {
    __global const float* row = basis + knot * COMPACT_NODE_ROOM(n) + node;
    even += (values[knot] + values[knot + knots / 2]) * LANES_LOAD(row);
    odd += (values[knot] - values[knot + knots / 2]) * LANES_LOAD(row + n);
  }
  *right = even + odd;
  *left = even - odd;
}

// The same at the middle node.
static inline float between_middle_knots(const float* values, int knots,
                                         __global const float* basis, int n) {
  float even = 0.0f;
  for (int knot = 0; knot < knots / 2; ++knot)
    even += (values[knot] + values[knot + knots / 2]) * basis[knot * COMPACT_NODE_ROOM(n) + 2 * n];
  return even;
}

// What `profile` knows of a sample and its tile.
typedef struct {
  __global const Light* lights;
  __global const Sample* sample;
  __global const uint* lit;
  const CompactPlane* plane;
  Seen seen;
  float plain;                      // amplitude without highlights
  __global const SamplePath* path;  // 0 where the sample is seen directly
} Profiled;

static inline __global const SamplePath* path_of(__global const Sample* sample,
                                                 __global const SamplePath* paths) {
  return RAYWAVE_PATHS && sample->path >= 0 ? paths + sample->path : 0;
}

// light_on_row, and what the path over mirrors and through glass adds.
static inline void light_on_place(const Profiled* p, realv u, realv v, realv* turns,
                                  floatv* weight) {
  light_on_row(&p->seen, u, v, turns, weight);
#if RAYWAVE_PATHS
  if (p->path) {
    const floatv x = window_x(p->plane, REAL_TO_FLOAT(u)), y = window_y(p->plane, REAL_TO_FLOAT(v));
    *turns += REAL_OF(
        (path_rest(p->path, x, y) - path_rest(p->path, (floatv)(p->plane->window_shift_x), y)) *
        p->plane->turns_hi);
    *weight *= path_amplitude(p->path, x, y);
  }
#endif
}

// turns_on_column, likewise.
static inline realv column_turns(const Profiled* p, realv v) {
  realv turns = turns_on_column(&p->seen, v);
#if RAYWAVE_PATHS
  if (p->path)
    turns += REAL_OF(path_rest(p->path, (floatv)(p->plane->window_shift_x),
                               window_y(p->plane, REAL_TO_FLOAT(v))) *
                     p->plane->turns_hi);
#endif
  return turns;
}

// Share of light, and amplitude, towards places (u, v) of the tile of a sample that is not smooth.
static inline floatv rough_amplitude(const Profiled* p, bool cut, bool rough, bool shines, floatv u,
                                     float v) {
  const float x = (float)p->seen.x, y = (float)p->seen.y, z = (float)p->seen.z;
  const floatv offset = u - x;
  const float down = v - y;
  floatv amplitude = 1.0f;
  if (rough) {
    const float forwards = p->plane->side * z;
    amplitude = amplitude_towards(p->lights, p->lit, p->sample, p->plain, shines, offset / forwards,
                                  (floatv)(-down / forwards));
  }
  if (cut)
    amplitude *= shown_share(offset, sqrt(offset * offset + down * down + z * z),
                             p->plane->reference_x - u * p->plane->reference_fall_x,
                             p->plane->sine_limit_x, p->plane->per_cut_x);
  return amplitude;
}

// The share of the light along a row that hidden samples show at nodes.
//
// seen_parts  bits of the row's parts
// weights     of the first spline at these nodes
static inline floatv seen_share(uint seen_parts, __global const float* weights, int n) {
  floatv share = 0.0f;
#if RAYWAVE_VISIBILITY_PARTS > 0
  for (int part = 0; part < COMPACT_SPLINES; ++part) {
    if (seen_parts >> clamp(part - 2, 0, RAYWAVE_VISIBILITY_PARTS - 1) & 1u)
      share += LANES_LOAD(weights + part * COMPACT_NODE_ROOM(n));
  }
#else
  (void)seen_parts, (void)weights, (void)n;
#endif
  return share;
}

#endif
