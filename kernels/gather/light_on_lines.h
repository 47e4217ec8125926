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
// the twiddles, and the light of the middle node.
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

// Nodes of a footprint along one axis.
typedef struct {
  int n;           // in a period
  int half_nodes;  // on each side of the middle one, where the window function is not zero
  int pixels;      // on each side of the footprint's middle
  int room;        // floats that they take: COMPACT_ROOM
  float step;      // metres between nodes
  __global const float* weights;
} NodeAxis;

static inline NodeAxis nodes_along(int pixels, int plane_pixels, int tile_pixels, float period,
                                   __global const float* weights, int rows_of_weights) {
  const int n = COMPACT_NODES_FOR(pixels);
  const NodeAxis axis = {n,
                         COMPACT_HALF_NODES(n, plane_pixels, tile_pixels),
                         pixels / 2,
                         COMPACT_ROOM(pixels),
                         period / (float)n,
                         weights + COMPACT_WEIGHTS_BEFORE(n, rows_of_weights)};
  return axis;
}

// Writes the transform of the light at the nodes of an axis, in whole packets, times the signs that
// pixels of odd places change: they bring the tile into the transform's middle. Pixels on both
// sides share the twiddles, too. Returns where the next transform goes.
static inline __global float* transform(const Nodes* nodes, const NodeAxis* axis,
                                        __global const float* twiddles, __global float* out) {
  const int n = axis->n, half_nodes = axis->half_nodes, count = axis->pixels;
  __global const float* first = twiddles + COMPACT_TWIDDLES_BEFORE(n);
  for (int pixel = 0; pixel < count; pixel += RAYWAVE_LANES) {
    const floatv sign = 1.0f - 2.0f * LANES_TO_FLOAT((pixel + LANES_INDEX) & 1);
    __global const float* turns = first + pixel;
    floatv even_cos = sign * nodes->middle_re, im_cos = sign * nodes->middle_im, im_sin = 0.0f,
           re_sin = 0.0f;
    for (int node = 0; node < half_nodes; ++node, turns += n) {
      const floatv c = LANES_LOAD(turns), s = LANES_LOAD(turns + n / 2);
      even_cos += nodes->even_re[node] * c;
      im_sin += nodes->odd_im[node] * s;
      im_cos += nodes->even_im[node] * c;
      re_sin += nodes->odd_re[node] * s;
    }
    store_pixels(even_cos - im_sin, -(even_cos + im_sin), pixel, count, out + axis->room / 2);
    store_pixels(im_cos + re_sin, re_sin - im_cos, pixel, count, out + axis->room + axis->room / 2);
  }
  return out + 2 * axis->room;
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

// A sample and its tile, for `profile`.
typedef struct {
  __global const Light* lights;
  __global const Sample* sample;
  __global const uint* lit;
  const CompactPlane* plane;
  Seen seen;
  float plain;                      // amplitude without highlights
  __global const SamplePath* path;  // 0 where the sample is seen directly
  float rest;                       // 0 where lines cannot follow the rest of its path, else 1
  bool hidden, cut, shines, rough;
  int lines, first_line;  // the first one's number among the lines of all counts
  NodeAxis x, y;
  __global const float* weights;
  int splines, knot_rows;  // rows of weights before those of lines, and of knots
} Profiled;

static inline Profiled profiled(__global const Light* lights, __global const Sample* sample,
                                __global const uint* lit, Seen seen,
                                __global const SamplePath* path, const CompactFootprint* footprint,
                                const CompactPlane* plane, __global const float* weights) {
  const int kind = (int)seen.kind;
  const int splines = RAYWAVE_VISIBILITY_PARTS > 0 ? COMPACT_SPLINES : 0,
            rows = COMPACT_WEIGHTS(plane->lines, splines, plane->knots),
            all_lines = COMPACT_LINES_UP_TO(plane->lines);
  const Profiled p = {
      lights,
      sample,
      lit,
      plane,
      seen,
      sqrt(sample->radiance) * sample->weight,
      path,
      footprint->follows ? 1.0f : 0.0f,
      sample->hidden,
      (kind & SEEN_CUT) != 0,
      (kind & SEEN_SHINES) != 0,
      LIGHT_AT_NODES || (kind & SEEN_ROUGH) != 0,
      footprint->lines,
      sample->hidden ? all_lines : COMPACT_LINES_UP_TO(footprint->lines - 1),
      nodes_along(footprint->columns, plane->nx, plane->tile_nx, plane->period_x, weights, rows),
      nodes_along(footprint->rows, plane->ny, plane->tile_ny, plane->period_y, weights, rows),
      weights,
      splines,
      1 + 2 * splines + all_lines};
  return p;
}

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
        (p->rest * p->plane->turns_hi));
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
                     (p->rest * p->plane->turns_hi));
#endif
  return turns;
}

// Share of light, and amplitude, towards places (u, v) of the tile of a sample that is not smooth.
static inline floatv rough_amplitude(const Profiled* p, floatv u, float v) {
  const float x = (float)p->seen.x, y = (float)p->seen.y, z = (float)p->seen.z;
  const floatv offset = u - x;
  const float down = v - y;
  floatv amplitude = 1.0f;
  if (p->rough) {
    const float forwards = p->plane->side * z;
    amplitude = amplitude_towards(p->lights, p->lit, p->sample, p->plain, p->shines,
                                  offset / forwards, (floatv)(-down / forwards));
  }
  if (p->cut)
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

// Light on the column u = 0, which all lines share: on both sides of the middle node, and there.
typedef struct {
  float right_re[COMPACT_NODES], right_im[COMPACT_NODES], left_re[COMPACT_NODES],
      left_im[COMPACT_NODES];
  float middle_re, middle_im, middle_share;
} ColumnLight;

// The share of light that is not too steep at the place v of the column.
static inline floatv column_share(const Profiled* p, floatv v) {
  const float far = (float)(p->seen.x * p->seen.x + p->seen.z * p->seen.z);
  const floatv offset = v - (float)p->seen.y;
  return shown_share(offset, sqrt(offset * offset + far),
                     p->plane->reference_y - v * p->plane->reference_fall_y, p->plane->sine_limit_y,
                     p->plane->per_cut_y);
}

static inline void light_on_column(const Profiled* p, ColumnLight* column) {
  const CompactPlane* plane = p->plane;
#if !LIGHT_AT_NODES
  float turns[COMPACT_MOST_KNOTS + 16];
  const int knots = plane->knots;
  __global const float* basis =
      p->y.weights + (p->knot_rows + knots / 2) * COMPACT_NODE_ROOM(p->y.n);
  for (int knot = 0; knot < knots; knot += RAYWAVE_LANES)
    LANES_STORE(column_turns(p, LANES_LOAD(p->weights + COMPACT_KNOT_ROOM + knot) * plane->half_y),
                turns + knot);
#endif
  const float sample_turns = (float)p->seen.turns;
  for (int node = 0; node < p->y.half_nodes; node += RAYWAVE_LANES) {
    const floatv v = LANES_TO_FLOAT(node + 1 + LANES_INDEX) * p->y.step;
    floatv right, left;
#if LIGHT_AT_NODES
    right = REAL_TURNS(column_turns(p, REAL_OF(v)));
    left = REAL_TURNS(column_turns(p, REAL_OF(-v)));
#else
    between_knots(turns, knots, basis, p->y.n, node, &right, &left);
#endif
    const floatv share_right = p->cut ? column_share(p, v) : (floatv)(1.0f),
                 share_left = p->cut ? column_share(p, -v) : (floatv)(1.0f);
    floatv re, im;
    cos_sin_turns(right + sample_turns, &re, &im);
    LANES_STORE(share_right * re, column->right_re + node);
    LANES_STORE(share_right * im, column->right_im + node);
    cos_sin_turns(left + sample_turns, &re, &im);
    LANES_STORE(share_left * re, column->left_re + node);
    LANES_STORE(share_left * im, column->left_im + node);
  }
  floatv middle_re, middle_im, middle_turns = 0.0f;
#if RAYWAVE_PATHS
  middle_turns = REAL_TURNS(column_turns(p, REAL_OF((floatv)(0.0f))));
#endif
  cos_sin_turns(middle_turns + sample_turns, &middle_re, &middle_im);
  column->middle_re = LANES_FIRST(middle_re);
  column->middle_im = LANES_FIRST(middle_im);
  column->middle_share =
      p->cut ? LANES_FIRST(shown_share((floatv)(-(float)p->seen.y), (floatv)((float)p->seen.length),
                                       (floatv)(plane->reference_y), plane->sine_limit_y,
                                       plane->per_cut_y))
             : 1.0f;
}

// Light at the knots of all lines: turns and amplitude
typedef struct {
  float turns[COMPACT_SPLINES_OR_LINES * COMPACT_MOST_KNOTS + 16];
  float amplitude[COMPACT_SPLINES_OR_LINES * COMPACT_MOST_KNOTS + 16];
} KnotLight;

#if !LIGHT_AT_NODES
static inline void light_at_knots(const Profiled* p, KnotLight* light) {
  const int knots = p->plane->knots;
  __global const float* rows = p->weights + COMPACT_PLACES_OF_LINES + p->first_line * knots;
  for (int at = 0; at < p->lines * knots; at += RAYWAVE_LANES) {
    const floatv u = LANES_LOAD(p->weights + (at & (knots - 1))) * p->plane->half_x,
                 v = LANES_LOAD(rows + at) * p->plane->half_y;
    floatv turns, weight;
    light_on_place(p, u, v, &turns, &weight);
    if (!p->rough) {
      const float z = p->plane->side * (float)p->seen.z;
      weight *= amplitude_towards(p->lights, p->lit, p->sample, p->plain, p->shines,
                                  (u - (float)p->seen.x) / z, ((float)p->seen.y - v) / z);
    }
    LANES_STORE(turns, light->turns + at);
    LANES_STORE(weight, light->amplitude + at);
  }
}
#endif

// Light on a line, less its phase at u = 0.
//
// sign        factor of all values
// seen_parts  bits of the parts of a hidden sample's row
static inline void light_on_line(const Profiled* p, int line, const KnotLight* light, float sign,
                                 uint seen_parts, Nodes* nodes) {
  const int knots = p->plane->knots, n = p->x.n;
  const float v =
      p->weights[COMPACT_PLACES_OF_LINES + (p->first_line + line) * knots] * p->plane->half_y;
  __global const float *window = p->x.weights, *splines = window + COMPACT_NODE_ROOM(n);
  const bool uneven = p->cut || p->rough;
#if LIGHT_AT_NODES
  (void)light;
#else
  __global const float* basis = window + p->knot_rows * COMPACT_NODE_ROOM(n);
  const float *turns = light->turns + line * knots, *amplitude = light->amplitude + line * knots;
#endif
  for (int node = 0; node < p->x.half_nodes; node += RAYWAVE_LANES) {
    const floatv u = LANES_TO_FLOAT(node + 1 + LANES_INDEX) * p->x.step;
    floatv turns_right, turns_left, right, left;
#if LIGHT_AT_NODES
    realv turned;
    light_on_place(p, REAL_OF(u), REAL_OF((floatv)(v)), &turned, &right);
    turns_right = REAL_TURNS(turned);
    light_on_place(p, REAL_OF(-u), REAL_OF((floatv)(v)), &turned, &left);
    turns_left = REAL_TURNS(turned);
#else
    between_knots(turns, knots, basis, n, node, &turns_right, &turns_left);
    between_knots(amplitude, knots, basis, n, node, &right, &left);
#endif
    const floatv weight = sign * LANES_LOAD(window + node);
    right *= weight;
    left *= weight;
    if (uneven) {
      right *= rough_amplitude(p, u, v);
      left *= rough_amplitude(p, -u, v);
    }
    if (p->hidden) {
      right *= seen_share(seen_parts, splines + node, n);
      left *= seen_share(seen_parts, splines + n + node, n);
    }
    floatv right_re, right_im, left_re, left_im;
    cos_sin_turns(turns_right, &right_re, &right_im);
    cos_sin_turns(turns_left, &left_re, &left_im);
    set_nodes(node, right * right_re, right * right_im, left * left_re, left * left_im, nodes);
  }
  float middle;
#if LIGHT_AT_NODES
  realv unused;
  floatv middle_weight;
  light_on_place(p, REAL_OF((floatv)(0.0f)), REAL_OF((floatv)(v)), &unused, &middle_weight);
  middle = LANES_FIRST(middle_weight);
#else
  middle = between_middle_knots(amplitude, knots, basis, n);
#endif
  middle *= sign * window[2 * n];
  if (uneven) middle *= LANES_FIRST(rough_amplitude(p, (floatv)(0.0f), v));
  if (p->hidden) middle *= LANES_FIRST(seen_share(seen_parts, splines + 2 * n, n));
  nodes->middle_re = middle;
  nodes->middle_im = 0.0f;
}

// A line's share of the column's light: Lagrange's polynomial of its row, or a spline.
static inline void shared_light(const Profiled* p, int line, const ColumnLight* column,
                                Nodes* nodes) {
  const int n = p->y.n;
  __global const float* basis =
      p->y.weights + (1 + p->splines + p->first_line + line) * COMPACT_NODE_ROOM(n);
  for (int node = 0; node < p->y.half_nodes; node += RAYWAVE_LANES) {
    const floatv right = LANES_LOAD(basis + node), left = LANES_LOAD(basis + n + node);
    set_nodes(node, right * LANES_LOAD(column->right_re + node),
              right * LANES_LOAD(column->right_im + node),
              left * LANES_LOAD(column->left_re + node), left * LANES_LOAD(column->left_im + node),
              nodes);
  }
  const float middle = basis[2 * n] * column->middle_share;
  nodes->middle_re = middle * column->middle_re;
  nodes->middle_im = middle * column->middle_im;
}

#endif
