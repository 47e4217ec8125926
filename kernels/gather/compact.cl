// SPDX-License-Identifier: Apache-2.0
// Compact gathering (docs/pipeline.md): the field of surface samples on the virtual plane, one
// Fourier transform away from the hologram's tile. With the reference wave exp(i k c) taken off, a
// sample's light on the tile has few frequencies, and so a small footprint W on this plane:
//   W(x, y) = 1 / pitch^2 integral of bell(u, v) A / r exp(i k (r - c)) exp(2 pi i (x u + y v) /
//             (wavelength z0)) du dv,
//   r: distance from the sample to (u, v) on the tile, c = sqrt(z0^2 + u^2 + v^2).
// W is a sum of `lines` products X_k(x) Y_k(y), one for each of as many rows v_k of the tile
// ("scan lines"): X_k is the transform of the light on that row, less its phase at u = 0, Y_k that
// of the light on the column u = 0 times Lagrange's polynomial of v_k. For a partly hidden sample
// the rows are the middles of the visibility mask's parts, and cubic B-splines stand for the
// polynomials and smooth the mask. The bell is divided out at the hologram, and makes footprints
// end quickly.
//
// (u, v) and pixels (x, y) of the plane count from the tile's pixel (size / 2), v and y downwards.
// The plane is periodic: pixel (x, y) lies in column x modulo nx and row y modulo ny.
//
// aim             footprints[i]: the pixels that sample i lights; none for other layers' samples
// profile         X_k and Y_k of the samples first_sample, ..., at offsets[i] of `profiles`: for
//                 each k the real parts of X, the imaginary parts, the real parts of Y, the
//                 imaginary parts, in COMPACT_ROOM each
// gather_compact  field: RAYWAVE_FRAMES planes of plane.ny rows of plane.nx samples. Bins of
//                 COMPACT_BIN x COMPACT_BIN pixels list the samples that light them: those of bin b
//                 are bin_samples[first_of_bin[b]] up to that of b + 1. Only the band of
//                 get_global_size(1) RAYWAVE_TILE_ROWS / COMPACT_BIN rows of bins from first_row on
//                 is filled; is_fresh: whether nothing was written there before
//
// A work-item of `gather_compact` fills RAYWAVE_LANES x RAYWAVE_TILE_ROWS pixels. OpenCL C 1.2.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/common/shared.h"
#include "kernels/gather/compact.h"
#include "kernels/gather/options.h"
#include "kernels/gather/phases.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/samples/visibility.h"
#include "kernels/scene/shade.h"

// Lines of a partly hidden sample: one for each row of parts, and two beyond on each side
#define COMPACT_SPLINES (RAYWAVE_VISIBILITY_PARTS + 4)

// Numbers for path differences: only a few turns are left of them, so that floats do.
#if RAYWAVE_PRECISION == PRECISION_DOUBLE
typedef double real;
typedef DoubleSingle realv;
#define REAL_FIRST(w) LANES_FIRST(w)
#define REAL_OF(v) DS_CONVERT(v)
#define REAL_TURNS(turns) ds_turns(turns)
#define REAL_TO_FLOAT(w) ds_high(w)
#else
typedef float real;
typedef floatv realv;
#define REAL_FIRST(w) LANES_FIRST(ds_high(w))
#define REAL_OF(v) (v)
#define REAL_TURNS(turns) (turns)
#define REAL_TO_FLOAT(w) (w)
#endif

// A sample as the tile sees it. Metres, y downwards from the tile's origin pixel.
typedef struct {
  real x;
  real y;
  real z;
  real z0;       // of the virtual plane
  real length;   // of (x, y, z)
  real squares;  // z0^2 - length^2
  real sine_x;   // x / length
  real sine_y;
  // Turns per metre by which the sample's direction differs from that of its footprint's middle
  real slope_x;
  real slope_y;
  real rate;    // turns per metre
  float turns;  // at the origin pixel
} Seen;

static inline Seen seen_from_tile(__global const Sample* s, const CompactPlane* plane, int middle_x,
                                  int middle_y) {
  const DoubleSingle x = ds_minus(ds(s->x, 0.0f), ds(plane->origin_x, plane->origin_x_low)),
                     y = ds_minus(ds(plane->origin_y, plane->origin_y_low), ds(s->y, 0.0f)),
                     z = ds_minus(ds(s->z, 0.0f), ds(plane->hologram_z, plane->hologram_z_low)),
                     z0 = ds(plane->z0, plane->z0_low), rate = ds(plane->turns_hi, plane->turns_lo);
  const DoubleSingle3 path = {x, y, z};
  const DoubleSingle length = ds_sqrt(ds3_dot(path, path)), nearer = ds_minus(z0, length);
  const DoubleSingle sine_x = ds_over(x, length), sine_y = ds_over(y, length);
  Seen seen;
  seen.x = REAL_FIRST(x);
  seen.y = REAL_FIRST(y);
  seen.z = REAL_FIRST(z);
  seen.z0 = REAL_FIRST(z0);
  seen.length = REAL_FIRST(length);
  seen.squares = REAL_FIRST(ds_times(nearer, ds_plus(z0, length)));
  seen.sine_x = REAL_FIRST(sine_x);
  seen.sine_y = REAL_FIRST(sine_y);
  seen.slope_x =
      REAL_FIRST(ds_minus(ds_times(sine_x, rate),
                          ds_steps((intv)(middle_x), plane->frequency_x, plane->frequency_x_low)));
  seen.slope_y =
      REAL_FIRST(ds_minus(ds_times(sine_y, rate),
                          ds_steps((intv)(middle_y), plane->frequency_y, plane->frequency_y_low)));
  seen.rate = REAL_FIRST(rate);
  seen.turns = -LANES_FIRST(ds_turns(ds_times(nearer, rate)));
  return seen;
}

static inline float lanes_float_min(floatv v) {
  float values[RAYWAVE_LANES];
  LANES_STORE(v, values);
  float least = values[0];
  for (int i = 1; i < RAYWAVE_LANES; ++i) least = fmin(least, values[i]);
  return least;
}

// Rays to so many places along one axis of the tile, on three lines, bound a footprint along it.
#define RAYS_ALONG 9
#define RAYS (3 * RAYS_ALONG)

// First and last pixel that rays from a sample to the tile come from, along one axis: s, half_m of
// it and other_s, other_half_m of the other.
static inline void footprint_along(float s, float other_s, float z, float z0, float half_m,
                                   float other_half_m, float pixels_per_sine, int most,
                                   float margin, int* first, int* count) {
  floatv low = 1e30f, high = -1e30f;
  for (int ray = 0; ray < RAYS; ray += RAYWAVE_LANES) {
    const intv at = min(ray + LANES_INDEX, (intv)(RAYS - 1));
    const intv line = at / RAYS_ALONG;
    const floatv u = (LANES_TO_FLOAT(at - line * RAYS_ALONG) * (2.0f / (RAYS_ALONG - 1)) - 1.0f) *
                     half_m,
                 v = (LANES_TO_FLOAT(line) - 1.0f) * other_half_m;
    const floatv du = s - u, dv = other_s - v;
    const floatv x = pixels_per_sine *
                     (du / sqrt(du * du + dv * dv + z * z) + u / sqrt(u * u + v * v + z0 * z0));
    low = fmin(low, x);
    high = fmax(high, x);
  }
  const float least = clamp(lanes_float_min(low) - margin, -1e9f, 1e9f),
              greatest = clamp(-lanes_float_min(-high) + margin, -1e9f, 1e9f);
  *first = (int)ceil(least);
  *count = (int)floor(greatest) + 1 - *first;
  if (*count > most) {
    *first += (*count - most) / 2;
    *count = most;
  }
}

// Share of the smooth step that lies before the limit. It keeps the energy of a hard one: the
// integral of the step's square is 13 / 35.
#define CUT_BEFORE (1.0f - 13.0f / 35.0f)

// True when some of the sample's light towards the tile fades out because it is too steep.
static inline bool is_cut(float x, float y, float z, const CompactPlane* plane) {
#if RAYWAVE_SINE_LIMIT
  const float across = fabs(x) + plane->half_x, up = fabs(y) + plane->half_y;
  const float x_length = sqrt(across * across + z * z), y_length = sqrt(up * up + z * z);
  return (plane->sine_limit_x * x_length - across) * plane->per_cut_x < 1.0f - CUT_BEFORE ||
         (plane->sine_limit_y * y_length - up) * plane->per_cut_y < 1.0f - CUT_BEFORE;
#else
  (void)x, (void)y, (void)z, (void)plane;
  return false;
#endif
}

__kernel void aim(__global const Sample* samples, int sample_count, CompactPlane plane,
                  __global CompactFootprint* footprints) {
  const int index = (int)get_global_id(0);
  if (index >= sample_count) return;
  __global const Sample* s = samples + index;
  CompactFootprint footprint;
  footprint.left = footprint.columns = footprint.top = footprint.rows = footprint.lines = 0;
  if (plane.begin_z <= s->z && s->z < plane.end_z) {
    const float x = s->x - plane.origin_x, y = plane.origin_y - s->y, z = s->z - plane.hologram_z;
    const int most_x = min(plane.nx, COMPACT_WIDEST), most_y = min(plane.ny, COMPACT_WIDEST);
    const float margin = s->hidden || is_cut(x, y, z, &plane) ? plane.rough_margin : plane.margin;
    footprint_along(x, y, z, plane.z0, plane.half_x, plane.half_y, plane.pixels_per_sine_x, most_x,
                    margin, &footprint.left, &footprint.columns);
    footprint_along(y, x, z, plane.z0, plane.half_y, plane.half_x, plane.pixels_per_sine_y, most_y,
                    margin, &footprint.top, &footprint.rows);
    footprint.lines = s->hidden ? COMPACT_SPLINES : plane.lines;
  }
  footprints[index] = footprint;
}

// A smooth step where light becomes too steep for the pixels, as wide as 1 / per_cut.
static inline floatv shown_share(floatv offset, floatv length, float sine_limit, float per_cut) {
#if RAYWAVE_SINE_LIMIT
  const floatv e = clamp((sine_limit * length - fabs(offset)) * per_cut + CUT_BEFORE,
                         (floatv)(0.0f), (floatv)(1.0f));
  return e * e * (3.0f - 2.0f * e);
#else
  (void)offset, (void)length, (void)sine_limit, (void)per_cut;
  return 1.0f;
#endif
}

// Writes `count` pixels of the transform of light at 2 half_nodes + 1 nodes, in whole packets.
// Pixel 0 is the `first`-th of a period of n. Rotors of opposite nodes are conjugate: their sums
// and differences share the products.
static inline void transform(const float* re, const float* im, int n, int half_nodes,
                             __global const float* rotors, int first, int count,
                             __global float* out_re, __global float* out_im) {
  for (int pixel = 0; pixel < count; pixel += 2 * RAYWAVE_LANES) {
    __global const float* turns = rotors + first + pixel;
    // The middle node, whose rotors are the pixels' signs; the period of nodes is n, too.
    int row = n / 2;
    const floatv sign0 = LANES_LOAD(turns + (size_t)(2 * n) * (size_t)row);
    floatv re0 = sign0 * re[half_nodes], im0 = sign0 * im[half_nodes], re1 = 0.0f, im1 = 0.0f;
    if (count - pixel > RAYWAVE_LANES) {
      const floatv sign1 = LANES_LOAD(turns + (size_t)(2 * n) * (size_t)row + RAYWAVE_LANES);
      re1 = sign1 * re[half_nodes];
      im1 = sign1 * im[half_nodes];
      for (int node = 1; node <= half_nodes; ++node) {
        row = row + 1 == n ? 0 : row + 1;
        __global const float* turn = turns + (size_t)(2 * n) * (size_t)row;
        const float right_re = re[half_nodes + node], left_re = re[half_nodes - node],
                    right_im = im[half_nodes + node], left_im = im[half_nodes - node];
        const float even_re = right_re + left_re, odd_re = right_re - left_re,
                    even_im = right_im + left_im, odd_im = right_im - left_im;
        const floatv c0 = LANES_LOAD(turn), s0 = LANES_LOAD(turn + n);
        const floatv c1 = LANES_LOAD(turn + RAYWAVE_LANES),
                     s1 = LANES_LOAD(turn + n + RAYWAVE_LANES);
        re0 += even_re * c0 - odd_im * s0;
        im0 += even_im * c0 + odd_re * s0;
        re1 += even_re * c1 - odd_im * s1;
        im1 += even_im * c1 + odd_re * s1;
      }
      LANES_STORE(re1, out_re + pixel + RAYWAVE_LANES);
      LANES_STORE(im1, out_im + pixel + RAYWAVE_LANES);
    } else {
      for (int node = 1; node <= half_nodes; ++node) {
        row = row + 1 == n ? 0 : row + 1;
        __global const float* turn = turns + (size_t)(2 * n) * (size_t)row;
        const float right_re = re[half_nodes + node], left_re = re[half_nodes - node],
                    right_im = im[half_nodes + node], left_im = im[half_nodes - node];
        const floatv c0 = LANES_LOAD(turn), s0 = LANES_LOAD(turn + n);
        re0 += (right_re + left_re) * c0;
        re1 -= (right_im - left_im) * s0;
        im0 += (right_im + left_im) * c0;
        im1 += (right_re - left_re) * s0;
      }
      re0 += re1;
      im0 += im1;
    }
    LANES_STORE(re0, out_re + pixel);
    LANES_STORE(im0, out_im + pixel);
  }
}

// Light at the places u on row v of the tile, less its phase on the column u = 0 and with its
// footprint's middle turned to zero.
static inline void light_on_row(const Seen* s, realv u, real v, floatv amplitude, floatv* re,
                                floatv* im, floatv* length) {
  const real one = 1, two = 2;
  const real down = v * (v - two * s->y);  // of squared lengths, from the origin to (0, v)
  const real column_length = sqrt(s->length * s->length + down),
             column_reference = sqrt(s->z0 * s->z0 + v * v);
  const realv across = u * (u - two * s->x);
  const realv r = sqrt(column_length * column_length + across),
              c = sqrt(column_reference * column_reference + u * u);
  const real squares = s->squares + two * v * s->y;
  const real column_nearer = squares / (column_reference + column_length),
             column_beyond = down / (column_length + s->length);
  // c - r and the same at u = 0, over the sums that stand below u^2; r and the column's length,
  // beyond the sample's own. Quotients share their divisions.
  const realv sum = r + column_length, references = c + column_reference, own = r + s->length;
  const realv first = one / ((c + r) * own), second = one / (sum * references * r);
  const realv nearer = (squares + two * u * s->x) * own * first,
              beyond = (across + down) * (c + r) * first + column_beyond;
  const realv turns = s->rate * (u * r * second *
                                 (u * (nearer + column_nearer) + s->sine_x * beyond * references)) -
                      u * s->slope_x;
  floatv cosine, sine;
  cos_sin_turns(REAL_TURNS(turns), &cosine, &sine);
  const floatv weight = amplitude * REAL_TO_FLOAT(sum * references * second);
  *re = weight * cosine;
  *im = weight * sine;
  *length = REAL_TO_FLOAT(r);
}

// Light on the column u = 0, of amplitude 1, likewise.
static inline void light_on_column(const Seen* s, realv v, floatv* re, floatv* im, floatv* length) {
  const real two = 2;
  const realv down = v * (v - two * s->y);
  const realv r = sqrt(s->length * s->length + down), c = sqrt(s->z0 * s->z0 + v * v);
  const realv nearer = (s->squares + two * v * s->y) / (c + r);
  const real own_nearer = s->squares / (s->z0 + s->length);
  const realv sum = r + s->length;
  const realv bend = v * v * (nearer + own_nearer) / (sum * (c + s->z0));
  const realv turns = s->rate * (bend + v * s->sine_y * (down / (sum * sum))) - v * s->slope_y;
  cos_sin_turns(REAL_TURNS(turns) + s->turns, re, im);
  *length = REAL_TO_FLOAT(r);
}

__kernel void profile(__global const Light* lights, __global const Sample* samples,
                      __global const uint* lit, __global const uint* visibility_masks,
                      __global const CompactFootprint* footprints, __global const int* offsets,
                      __global const float* rotors, __global const float* weights, int first_sample,
                      int count, CompactPlane plane, __global float* profiles) {
  const int number = (int)get_global_id(0);
  if (number >= count) return;
  const size_t index = (size_t)(first_sample + number);
  const CompactFootprint footprint = footprints[index];
  if (footprint.lines == 0) return;
  __global const Sample* sample = samples + index;
  const bool hidden = sample->hidden;
  const int middle_x = footprint.left + footprint.columns / 2,
            middle_y = footprint.top + footprint.rows / 2;
  const Seen seen = seen_from_tile(sample, &plane, middle_x, middle_y);

  // Nodes and pixels of both axes
  const int nx = COMPACT_NODES_FOR(footprint.columns), ny = COMPACT_NODES_FOR(footprint.rows);
  const int half_x = COMPACT_HALF_NODES(nx, plane.nx, plane.tile_nx),
            half_y = COMPACT_HALF_NODES(ny, plane.ny, plane.tile_ny);
  const float step_x = plane.period_x / (float)nx, step_y = plane.period_y / (float)ny;
  const int room_x = COMPACT_ROOM(footprint.columns), room_y = COMPACT_ROOM(footprint.rows);
  const int splines = RAYWAVE_VISIBILITY_PARTS > 0 ? COMPACT_SPLINES : 0,
            rows_of_weights = COMPACT_WEIGHTS(plane.lines, splines);
  __global const float *weights_x = weights + COMPACT_WEIGHTS_BEFORE(nx, rows_of_weights),
                       *weights_y = weights + COMPACT_WEIGHTS_BEFORE(ny, rows_of_weights);

  // The column's light, which all lines share
  float column_re[COMPACT_NODES], column_im[COMPACT_NODES];
  for (int node = 0; node <= 2 * half_y; node += RAYWAVE_LANES) {
    const floatv v = LANES_TO_FLOAT(node + LANES_INDEX - half_y) * step_y;
    floatv re, im, length;
    light_on_column(&seen, REAL_OF(v), &re, &im, &length);
    const floatv share =
        shown_share(v - (float)seen.y, length, plane.sine_limit_y, plane.per_cut_y);
    LANES_STORE(share * re, column_re + node);
    LANES_STORE(share * im, column_im + node);
  }

  // Pixels of odd places change their sign, which brings the tile into the transform's middle.
  const float sign = ((middle_x + middle_y) & 1) != 0 ? -1.0f : 1.0f;
  __global float* out = profiles + offsets[index];
  float line_re[COMPACT_NODES], line_im[COMPACT_NODES];
  const float plain = sqrt(sample->radiance) * sample->weight;
  __global const uint* lit_by_lights = lit + index * (size_t)((RAYWAVE_LIGHTS + 31) / 32);
  const float z = (float)seen.z;
  const bool shines =
      shines_within(lights, lit_by_lights, sample, plain, -(float)seen.x / z,
                    0.5f * plane.period_x / z, (float)seen.y / z, 0.5f * plane.period_y / z);
  for (int line = 0; line < footprint.lines; ++line) {
    const float v = weights[hidden ? plane.lines + line : line] * plane.half_y;
#if RAYWAVE_VISIBILITY_PARTS > 0
    // Rows of a mask count upwards; parts beyond the window see what the outermost see.
    const int row = clamp(RAYWAVE_VISIBILITY_PARTS + 1 - line, 0, RAYWAVE_VISIBILITY_PARTS - 1);
    const uint seen_parts =
        hidden ? visibility_row(visibility_masks + index * VISIBILITY_WORDS, row) : 0;
#endif
    for (int node = 0; node <= 2 * half_x; node += RAYWAVE_LANES) {
      const floatv u = LANES_TO_FLOAT(node + LANES_INDEX - half_x) * step_x;
      const floatv offset = u - (float)seen.x;
      const floatv tx = offset / (float)seen.z, ty = ((float)seen.y - v) / (float)seen.z;
      floatv weight = sign * LANES_LOAD(weights_x + node);
#if RAYWAVE_VISIBILITY_PARTS > 0
      if (hidden) {
        floatv share = 0.0f;
        for (int part = 0; part < COMPACT_SPLINES; ++part) {
          if (seen_parts >> clamp(part - 2, 0, RAYWAVE_VISIBILITY_PARTS - 1) & 1u)
            share += LANES_LOAD(weights_x + (1 + part) * COMPACT_NODE_ROOM(nx) + node);
        }
        weight *= share;
      }
#endif
      weight *= amplitude_towards(lights, lit_by_lights, sample, plain, shines, tx, ty);
      floatv re, im, length;
      const realv v_real = REAL_OF((floatv)(v));
      light_on_row(&seen, REAL_OF(u), LANES_FIRST(v_real), weight, &re, &im, &length);
      const floatv share = shown_share(offset, length, plane.sine_limit_x, plane.per_cut_x);
      LANES_STORE(share * re, line_re + node);
      LANES_STORE(share * im, line_im + node);
    }
    transform(line_re, line_im, nx, half_x, rotors + COMPACT_ROTORS_BEFORE(nx),
              nx / 2 - footprint.columns / 2, footprint.columns, out, out + room_x);
    out += 2 * room_x;

    __global const float* basis =
        weights_y + (1 + splines + (hidden ? plane.lines + line : line)) * COMPACT_NODE_ROOM(ny);
    for (int node = 0; node <= 2 * half_y; node += RAYWAVE_LANES) {
      const floatv weight = LANES_LOAD(basis + node);
      LANES_STORE(weight * LANES_LOAD(column_re + node), line_re + node);
      LANES_STORE(weight * LANES_LOAD(column_im + node), line_im + node);
    }
    transform(line_re, line_im, ny, half_y, rotors + COMPACT_ROTORS_BEFORE(ny),
              ny / 2 - footprint.rows / 2, footprint.rows, out, out + room_y);
    out += 2 * room_y;
  }
}

// The pixels of a work-item and their sums.
typedef struct {
  int top;  // row of the plane
  floatv re[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
  floatv im[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
} Tile;

// Adds `lines` products of a sample's profiles, 1 to 4 of them, to rows `from` to before `to` of
// the work-item. across: where the first X has the work-item's first column, and inside: whether it
// has it; up: where the first Y has its row 0.
static inline void add_lines(__global const float* across, __global const float* up, intv inside,
                             int room_x, int room_y, int stride, int lines, int from, int to,
                             __global const float2* phasors, int sample_count, Tile* tile) {
  floatv re[4], im[4];
  for (int line = 0; line < lines; ++line) {
    re[line] = LANES_SELECT((floatv)(0.0f), LANES_LOAD(across + line * stride), inside);
    im[line] = LANES_SELECT((floatv)(0.0f), LANES_LOAD(across + line * stride + room_x), inside);
  }
  for (int row = from; row < to; ++row) {
    floatv sum_re = 0.0f, sum_im = 0.0f;
    for (int line = 0; line < lines; ++line) {
      const float up_re = up[line * stride + row], up_im = up[line * stride + room_y + row];
      sum_re += re[line] * up_re - im[line] * up_im;
      sum_im += re[line] * up_im + im[line] * up_re;
    }
    for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
      const float2 phasor = phasors[(size_t)frame * (size_t)sample_count];
      tile->re[frame][row] += sum_re * phasor.x - sum_im * phasor.y;
      tile->im[frame][row] += sum_re * phasor.y + sum_im * phasor.x;
    }
  }
}

__kernel void gather_compact(__global const CompactFootprint* footprints,
                             __global const int* offsets, __global const float* profiles,
                             __global const float2* phasors, int sample_count,
                             __global const int* first_of_bin, __global const int* bin_samples,
                             __global const int* is_fresh, int first_fresh, int first_bin,
                             int first_row, CompactPlane plane, __global float2* field) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int strip = (int)get_global_id(1) * RAYWAVE_TILE_ROWS, bin_row = strip / COMPACT_BIN;
  if (first >= plane.nx || bin_row >= plane.ny / COMPACT_BIN) return;
  Tile tile;
  tile.top = (first_row * COMPACT_BIN + strip) % plane.ny;
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row)
      tile.re[frame][row] = tile.im[frame][row] = 0.0f;
  }
  const int bin = first_bin + bin_row * (plane.nx / COMPACT_BIN) + first / COMPACT_BIN;
  for (int entry = first_of_bin[bin]; entry < first_of_bin[bin + 1]; ++entry) {
    const int index = bin_samples[entry];
    const CompactFootprint footprint = footprints[index];
    const int room_x = COMPACT_ROOM(footprint.columns), room_y = COMPACT_ROOM(footprint.rows);
    const int stride = 2 * (room_x + room_y);
    // The footprint may begin right of the work-item's columns or below its rows, or reach them
    // from the period before.
    int column = (first - footprint.left) % plane.nx, top = (tile.top - footprint.top) % plane.ny;
    column += column < 0 ? plane.nx : 0;
    top += top < 0 ? plane.ny : 0;
    for (int period = 0; period < 4; ++period) {
      const int left = column - (period & 1) * plane.nx, above = top - (period >> 1) * plane.ny;
      const int from = max(0, -above), to = min(RAYWAVE_TILE_ROWS, footprint.rows - above);
      if (left >= footprint.columns || left <= -RAYWAVE_LANES || from >= to) continue;
      __global const float* across = profiles + offsets[index] + left;
      const intv inside = (left + LANES_INDEX >= 0) & (left + LANES_INDEX < footprint.columns);
      __global const float* up = profiles + offsets[index] + 2 * room_x + above;
      int line = 0;
      for (; line + 4 <= footprint.lines; line += 4)
        add_lines(across + line * stride, up + line * stride, inside, room_x, room_y, stride, 4,
                  from, to, phasors + index, sample_count, &tile);
      switch (footprint.lines - line) {  // constants, which the compiler unrolls
        case 1:
          add_lines(across + line * stride, up + line * stride, inside, room_x, room_y, stride, 1,
                    from, to, phasors + index, sample_count, &tile);
          break;
        case 2:
          add_lines(across + line * stride, up + line * stride, inside, room_x, room_y, stride, 2,
                    from, to, phasors + index, sample_count, &tile);
          break;
        case 3:
          add_lines(across + line * stride, up + line * stride, inside, room_x, room_y, stride, 3,
                    from, to, phasors + index, sample_count, &tile);
          break;
        default:
          break;
      }
    }
  }
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row) {
      __global float2* out =
          field + ((size_t)frame * (size_t)plane.ny + (size_t)(tile.top + row)) * (size_t)plane.nx +
          (size_t)first;
      floatv re = 0.0f, im = 0.0f;
      if (!is_fresh[first_fresh + bin_row]) load_complex(out, &re, &im);
      store_complex(re + tile.re[frame][row], im + tile.im[frame][row], out);
    }
  }
}
