// SPDX-License-Identifier: Apache-2.0
// Compact gathering (docs/pipeline.md): the field of surface samples on the virtual plane, one
// Fourier transform away from the hologram's tile. With the reference wave exp(i k c) taken off, a
// sample's light on the tile has few frequencies, and so a small footprint W on this plane:
//   W(x, y) = 1 / pitch^2 integral of window(u, v) A / r exp(i k (r - c)) exp(2 pi i (x u + y v) /
//             (wavelength z0)) du dv,
//   r: distance from the sample to (u, v) on the tile, c = sqrt(z0^2 + u^2 + v^2).
// W is a sum of `lines` products X_k(x) Y_k(y), one for each of as many rows v_k of the tile
// ("scan lines"): X_k is the transform of the light on that row, less its phase at u = 0, Y_k that
// of the light on the column u = 0 times Lagrange's polynomial of v_k. For a partly hidden sample
// the rows are the middles of the visibility mask's parts, and cubic B-splines stand for the
// polynomials and smooth the mask. The window is divided out at the hologram, and makes footprints
// end quickly.
//
// Samples before the hologram (z < 0) light planes of their own, as their mirror images through the
// hologram's plane: their waves on the tile are the conjugates of those of the mirror images
// (kernels/propagate/transformed.h). Directions in which they shine are their own.
//
// (u, v) and pixels (x, y) of the plane count from the tile's pixel (size / 2), v and y downwards.
// The plane is periodic: pixel (x, y) lies in column x modulo nx and row y modulo ny.
//
// aim             footprints[i]: the pixels that sample i lights; none for other layers' samples.
//                 seen: COMPACT_SEEN numbers of each sample for `profile`
// profile         X_k and Y_k of the samples lit_samples[first], ..., each with some line, at
//                 offsets[i] of `profiles`: for each k the real parts of X, the imaginary parts,
//                 the real parts of Y, the imaginary parts, in COMPACT_ROOM each, with the
//                 footprint's middle in the middle
// gather_compact  field: RAYWAVE_FRAMES planes of plane.ny rows, each plane.row_stride samples in
//                 memory with plane.nx of the plane. Bins of
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
#include "kernels/gather/compact_layout.h"
#include "kernels/gather/light_on_lines.h"
#include "kernels/gather/options.h"
#include "kernels/gather/phases.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/gather/seen.h"
#include "kernels/samples/visibility.h"

// Stores the samples as the tile sees them, without how their amplitudes depend on the direction.
// left, columns, top, rows: their footprints
static inline void store_paths(const SampleLanes* s, const CompactPlane* plane, intv left,
                               intv columns, intv top, intv rows, int count, __global real* out) {
  const floatv zero = 0.0f;
  const DoubleSingle far_x =
                         ds_minus(ds(s->surface.x, zero), ds(plane->origin_x, plane->origin_x_low)),
                     far_y =
                         ds_minus(ds(plane->origin_y, plane->origin_y_low), ds(s->surface.y, zero)),
                     far_z = ds_times(ds_minus(ds(s->surface.z, zero),
                                               ds(plane->hologram_z, plane->hologram_z_low)),
                                      ds((floatv)(plane->side), zero)),
                     z0 = ds(plane->z0, plane->z0_low), rate = ds(plane->turns_hi, plane->turns_lo);
  const DoubleSingle3 path = {far_x, far_y, far_z};
  const DoubleSingle length = ds_sqrt(ds3_dot(path, path)), nearer = ds_minus(z0, length);
  const DoubleSingle sine_x = ds_over(far_x, length), sine_y = ds_over(far_y, length);
  store_seen(REAL_OF_DS(far_x), 0, count, out);
  store_seen(REAL_OF_DS(far_y), 1, count, out);
  store_seen(REAL_OF_DS(far_z), 2, count, out);
  store_seen(REAL_OF_DS(length), 3, count, out);
  store_seen(REAL_OF_DS(ds_times(nearer, ds_plus(z0, length))), 4, count, out);
  store_seen(REAL_OF_DS(sine_x), 5, count, out);
  store_seen(REAL_OF_DS(sine_y), 6, count, out);
  // The footprint's middle lies half a pixel from the one that counts as its middle.
  const intv twice_x = 2 * left + columns - 1, twice_y = 2 * top + rows - 1;
  store_seen(
      REAL_OF_DS(ds_minus(ds_times(sine_x, rate), ds_steps(twice_x, 0.5f * plane->frequency_x,
                                                           0.5f * plane->frequency_x_low))),
      7, count, out);
  store_seen(
      REAL_OF_DS(ds_minus(ds_times(sine_y, rate), ds_steps(twice_y, 0.5f * plane->frequency_y,
                                                           0.5f * plane->frequency_y_low))),
      8, count, out);
  store_seen(REAL_OF(-ds_turns(ds_times(nearer, rate))), 9, count, out);
}

__kernel void aim(__global const Light* lights, __global const Sample* samples,
                  __global const uint* lit, __global const SamplePath* paths, int sample_count,
                  CompactPlane plane, __global CompactFootprint* footprints, __global float* seen) {
  const int index = (int)get_global_id(0) * RAYWAVE_LANES;
  if (index >= sample_count) return;
  const int count = min(RAYWAVE_LANES, sample_count - index);
  SampleLanes s = load_samples(samples + index, count);

  // The pixels that samples of this layer light
  const floatv x = s.surface.x - plane.origin_x, y = plane.origin_y - s.surface.y,
               z = plane.side * (s.surface.z - plane.hologram_z);
  const intv is_here = (plane.begin_z <= s.surface.z) & (s.surface.z < plane.end_z);
  const floatv tangent_x = -plane.side * x / z, half_x = 0.5f * plane.period_x / z,
               tangent_y = plane.side * y / z, half_y = 0.5f * plane.period_y / z;
  const intv shines = shine_within(lights, lit, index, count, s.radiance, &s.surface, tangent_x,
                                   half_x, tangent_y, half_y);
  const floatv margin = LANES_SELECT(
      LANES_SELECT((floatv)(plane.margin), (floatv)(plane.highlight_margin), shines),
      (floatv)(plane.rough_margin), s.hidden | is_cut(x, y, z, plane.half_x, plane.half_y, &plane));
  intv left, columns, top, rows;
  floatv low_x = 0.0f, high_x = 0.0f, low_y = 0.0f, high_y = 0.0f, odd = 0.0f, even = 0.0f;
  intv follows = LANES_INDEX < 0;
#if RAYWAVE_PATHS
  if (any_path(samples + index, count)) {
    path_coupling(samples + index, count, paths, &plane, &odd, &even);
    // Paths that scan lines cannot follow shine from their virtual points, with their amplitudes.
    follows = (odd + even) * plane.turns_hi < MOST_COUPLING_TURNS;
    odd = LANES_SELECT((floatv)(0.0f), odd, follows);
    even = LANES_SELECT((floatv)(0.0f), even, follows);
    path_slopes(samples + index, count, paths, &plane, true, follows, &low_x, &high_x);
    path_slopes(samples + index, count, paths, &plane, false, follows, &low_y, &high_y);
  }
#else
  (void)paths;
#endif
  footprint_along(x, y, z, plane.z0, plane.half_x, plane.half_y, plane.pixels_per_sine_x,
                  min(plane.nx, COMPACT_WIDEST), margin, low_x, high_x, &left, &columns);
  footprint_along(y, x, z, plane.z0, plane.half_y, plane.half_x, plane.pixels_per_sine_y,
                  min(plane.ny, COMPACT_WIDEST), margin, low_y, high_y, &top, &rows);
  const intv fewest = lines_of(x, y, z, odd, even, &plane);
  const intv lines_in_sight =
      LANES_SELECT(fewest, max(fewest, (intv)(plane.highlight_lines)), shines);
  int lefts[RAYWAVE_LANES], columnss[RAYWAVE_LANES], tops[RAYWAVE_LANES], rowss[RAYWAVE_LANES],
      liness[RAYWAVE_LANES], followss[RAYWAVE_LANES];
  LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), follows), followss);
  LANES_STORE(left, lefts);
  LANES_STORE(columns, columnss);
  LANES_STORE(top, tops);
  LANES_STORE(rows, rowss);
  LANES_STORE(
      LANES_SELECT((intv)(0), LANES_SELECT(lines_in_sight, (intv)(COMPACT_SPLINES), s.hidden),
                   is_here),
      liness);
  for (int lane = 0; lane < count; ++lane) {
    const bool lights_some = liness[lane] > 0;
    CompactFootprint footprint;
    footprint.left = lights_some ? lefts[lane] : 0;
    footprint.columns = lights_some ? columnss[lane] : 0;
    footprint.top = lights_some ? tops[lane] : 0;
    footprint.rows = lights_some ? rowss[lane] : 0;
    footprint.lines = liness[lane];
    footprint.follows = followss[lane];
    footprints[index + lane] = footprint;
  }

  __global real* out = (__global real*)seen + COMPACT_SEEN * (size_t)index;
  store_paths(&s, &plane, left, columns, top, rows, count, out);

  // How their amplitudes depend on the direction
  // The window function reaches beyond the tile.
  const intv cut =
      is_cut(x, y, z, plane.period_x - plane.half_x, plane.period_y - plane.half_y, &plane);
  const intv rough = !is_smooth(&s, shines, tangent_x, half_x, tangent_y, half_y);
  const floatv kind = LANES_SELECT((floatv)(0.0f), (floatv)(SEEN_CUT), cut) +
                      LANES_SELECT((floatv)(0.0f), (floatv)(SEEN_ROUGH), rough) +
                      LANES_SELECT((floatv)(0.0f), (floatv)(SEEN_SHINES), shines);
  store_seen(REAL_OF(kind), 10, count, out);
}

__kernel void profile(__global const Light* lights, __global const Sample* samples,
                      __global const uint* lit, __global const uint* visibility_masks,
                      __global const SamplePath* paths, __global const CompactFootprint* footprints,
                      __global const float* all_seen, __global const int* lit_samples,
                      __global const int* offsets, __global const float* twiddles,
                      __global const float* weights, int first, int count, CompactPlane plane,
                      __global float* profiles) {
  const int number = (int)get_global_id(0);
  if (number >= count) return;
  const size_t index = (size_t)lit_samples[first + number];
  const CompactFootprint footprint = footprints[index];
  __global const Sample* sample = samples + index;
  const Profiled p =
      profiled(lights, sample, lit + index * (size_t)((RAYWAVE_LIGHTS + 31) / 32),
               load_seen((__global const real*)all_seen + COMPACT_SEEN * index, &plane),
               path_of(sample, paths), &footprint, &plane, weights);
  ColumnLight column;
  light_on_column(&p, &column);
  KnotLight light;
#if !LIGHT_AT_NODES
  light_at_knots(&p, &light);
#endif

  // Pixels of odd places change their sign.
  const int odd = (footprint.left + footprint.columns / 2 + footprint.top + footprint.rows / 2) & 1;
  const float sign = odd ? -1.0f : 1.0f;
  __global float* out = profiles + offsets[index];
  Nodes nodes;
  for (int line = 0; line < footprint.lines; ++line) {
    uint seen_parts = 0;
#if RAYWAVE_VISIBILITY_PARTS > 0
    // Rows of a mask count upwards; parts beyond the window see what the outermost see.
    const int row = clamp(RAYWAVE_VISIBILITY_PARTS + 1 - line, 0, RAYWAVE_VISIBILITY_PARTS - 1);
    if (p.hidden) seen_parts = visibility_row(visibility_masks + index * VISIBILITY_WORDS, row);
#endif
    light_on_line(&p, line, &light, sign, seen_parts, &nodes);
    out = transform(&nodes, &p.x, twiddles, out);
    shared_light(&p, line, &column, &nodes);
    out = transform(&nodes, &p.y, twiddles, out);
  }
}

// The pixels of a work-item and their sums.
typedef struct {
  int top;  // row of the plane
  floatv re[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
  floatv im[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
} Tile;

// A sample in a work-item: its profiles from some line on. X counts from the work-item's first
// column, where it is `inside` the footprint, Y from its first row.
typedef struct {
  __global const float* across;
  __global const float* up;
  intv inside;
  int room_x;
  int room_y;
  int stride;    // floats of a line
  int from, to;  // rows of the work-item
  __global const float2* phasors;
  int sample_count;
} Part;

// X of a line, with the sample's phase where there is one only.
static inline void load_line(const Part* p, int line, floatv* re, floatv* im) {
  __global const float* across = p->across + line * p->stride;
  *re = LANES_SELECT((floatv)(0.0f), LANES_LOAD(across), p->inside);
  *im = LANES_SELECT((floatv)(0.0f), LANES_LOAD(across + p->room_x), p->inside);
#if RAYWAVE_FRAMES == 1
  const float2 phasor = p->phasors[0];
  const floatv turned = *re * phasor.x - *im * phasor.y;
  *im = *re * phasor.y + *im * phasor.x;
  *re = turned;
#endif
}

// Adds the product of a line to a sum.
static inline void add_line(floatv line_re, floatv line_im, __global const float* up, int room,
                            floatv* re, floatv* im) {
  *re += line_re * up[0];
  *im += line_re * up[room];
  *re -= line_im * up[room];
  *im += line_im * up[0];
}

static inline void add_to_tile(const Part* p, int row, floatv re, floatv im, Tile* tile) {
#if RAYWAVE_FRAMES == 1
  (void)p;
  tile->re[0][row] += re;
  tile->im[0][row] += im;
#else
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    const float2 phasor = p->phasors[(size_t)frame * (size_t)p->sample_count];
    tile->re[frame][row] += re * phasor.x - im * phasor.y;
    tile->im[frame][row] += re * phasor.y + im * phasor.x;
  }
#endif
}

// Adds `lines` lines, 1 to 4 of them and a constant, to the work-item.
static inline __attribute__((always_inline)) void add_lines(const Part* p, const int lines,
                                                            Tile* tile) {
  floatv re0, im0, re1 = 0.0f, im1 = 0.0f, re2 = 0.0f, im2 = 0.0f, re3 = 0.0f, im3 = 0.0f;
  load_line(p, 0, &re0, &im0);
  if (lines > 1) load_line(p, 1, &re1, &im1);
  if (lines > 2) load_line(p, 2, &re2, &im2);
  if (lines > 3) load_line(p, 3, &re3, &im3);
  for (int row = p->from; row < p->to; ++row) {
    __global const float* up = p->up + row;
    floatv re = 0.0f, im = 0.0f;
    add_line(re0, im0, up, p->room_y, &re, &im);
    if (lines > 1) add_line(re1, im1, up + p->stride, p->room_y, &re, &im);
    if (lines > 2) add_line(re2, im2, up + 2 * p->stride, p->room_y, &re, &im);
    if (lines > 3) add_line(re3, im3, up + 3 * p->stride, p->room_y, &re, &im);
    add_to_tile(p, row, re, im, tile);
  }
}

__kernel void gather_compact(__global const CompactFootprint* footprints,
                             __global const int* offsets, __global const float* profiles,
                             __global const float2* phasors, int sample_count,
                             __global const int* first_of_bin, __global const int* bin_samples,
                             __global const int* is_fresh, int first_fresh, int first_bin,
                             int first_row, CompactPlane plane, __global float2* field) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int turn = (int)get_global_id(1), strips = (int)get_global_size(1),
            strip = row_in_turn(turn, strips) * RAYWAVE_TILE_ROWS, bin_row = strip / COMPACT_BIN;
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
    __global const float* middle_across = profiles + offsets[index] + room_x / 2;
    __global const float* middle_up = profiles + offsets[index] + 2 * room_x + room_y / 2;
    // The footprint may begin right of the work-item's columns or below its rows, or reach them
    // from the period before.
    int column = (first - footprint.left) % plane.nx, top = (tile.top - footprint.top) % plane.ny;
    column += column < 0 ? plane.nx : 0;
    top += top < 0 ? plane.ny : 0;
    for (int left = column; left > -RAYWAVE_LANES; left -= plane.nx) {
      if (left >= footprint.columns) continue;
      Part part;
      part.inside = (left + LANES_INDEX >= 0) & (left + LANES_INDEX < footprint.columns);
      part.room_x = room_x;
      part.room_y = room_y;
      part.stride = stride;
      part.phasors = phasors + index;
      part.sample_count = sample_count;
      for (int above = top; above > -RAYWAVE_TILE_ROWS; above -= plane.ny) {
        part.from = max(0, -above);
        part.to = min(RAYWAVE_TILE_ROWS, footprint.rows - above);
        if (part.from >= part.to) continue;
        part.across = middle_across + (left - footprint.columns / 2);
        part.up = middle_up + (above - footprint.rows / 2);
        int left_over = footprint.lines;
        for (; left_over >= 4; left_over -= 4) {
          add_lines(&part, 4, &tile);
          part.across += 4 * stride;
          part.up += 4 * stride;
        }
        if (left_over == 3) add_lines(&part, 3, &tile);
        if (left_over == 2) add_lines(&part, 2, &tile);
        if (left_over == 1) add_lines(&part, 1, &tile);
      }
    }
  }
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row) {
      __global float2* out =
          field +
          ((size_t)frame * (size_t)plane.ny + (size_t)(tile.top + row)) * (size_t)plane.row_stride +
          (size_t)first;
      floatv re = 0.0f, im = 0.0f;
      if (!is_fresh[first_fresh + bin_row]) load_complex(out, &re, &im);
      store_complex(re + tile.re[frame][row], im + tile.im[frame][row], out);
    }
  }
}
