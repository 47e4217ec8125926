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
// aim      footprints[i]: the pixels that sample i lights; none for other layers' samples.
//          seen: COMPACT_SEEN numbers of each sample for `profile`
// profile  X_k and Y_k of the samples lit_samples[first], ..., each with some line, at
//          offsets[i] of `profiles`: for each k the real parts of X, the imaginary parts,
//          the real parts of Y, the imaginary parts, in COMPACT_ROOM each, with the
//          footprint's middle in the middle
//
// kernels/gather/compact_gather.cl makes the field of it. OpenCL C 1.2.
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
