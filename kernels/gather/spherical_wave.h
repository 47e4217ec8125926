// SPDX-License-Identifier: Apache-2.0
// The spherical wave of a sample, one path for each pixel of a tile.
#ifndef RAYWAVE_SPHERICAL_WAVE_H
#define RAYWAVE_SPHERICAL_WAVE_H

#include "kernels/common/phase.h"
#include "kernels/gather/footprint.h"
#include "kernels/gather/parts_seen.h"
#include "kernels/gather/path_terms.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/gather/tile.h"

#if RAYWAVE_PRECISION == PRECISION_FLOAT
// Turns by which a path is longer than the path that ends `step` below it in y, where dy is the
// latter's offset from the sample: r - r0 = (r^2 - r0^2) / (r + r0). Only a few turns lie between
// neighbours, so that their rounding error stays below 10^-6.
static inline floatv turns_beyond(float dy, float step, floatv sum_of_lengths,
                                  float turns_per_metre) {
  return (2.0f * dy + step) * step * turns_per_metre / sum_of_lengths;
}
#endif

#if RAYWAVE_SINE_LIMIT
// Sines of the light on the SLM, where a sample's light meets it: in each column, and in the row of
// the chief ray, with what it loses per metre upwards.
typedef struct {
  floatv x;
  float chief_y, rate_y;
} Reference;

static inline Reference reference_of(const ProjectedSample* p, const GatherPlane* plane,
                                     floatv off_chief, float sign) {
#if RAYWAVE_NEAR_HOLOGRAM
  const float rate_x = plane->reference_fall_x / plane->half_window_x,
              rate_y = plane->reference_fall_y / plane->half_window_y;
  (void)sign;
  const Reference reference = {plane->reference_x - (off_chief + chief_place_x(p, plane)) * rate_x,
                               plane->reference_y - chief_place_y(p, plane) * rate_y, rate_y};
#else
  const Reference reference = {
      plane->reference_x - off_chief * (sign * p->scale_x * plane->reference_fall_x),
      plane->reference_y, sign * p->scale_y * plane->reference_fall_y};
#endif
  return reference;
}
#endif

#if RAYWAVE_VISIBILITY_PARTS > 0
// Visibility of a tile's pixels: all, none, or by the bit of each pixel's part of the window.
typedef struct {
  int state;
  float to_mask_y, mask_y;
#if RAYWAVE_SMOOTH_PARTS
  floatv parts_across;
#else
  intv part;
#endif
} TileVisibility;

static inline TileVisibility tile_visibility(const ProjectedSample* p, const GatherPlane* plane,
                                             __global const uint* visibility, floatv off_chief,
                                             float sign, const Tile* tile) {
  TileVisibility v;
  v.state = VISIBILITY_CLEAR;
#if RAYWAVE_NEAR_HOLOGRAM
  (void)sign;
  const float to_mask_x = p->inverse_depth * plane->visibility_scale_x,
              mask_x = p->tangent_x * plane->visibility_scale_x;
  v.to_mask_y = p->inverse_depth * plane->visibility_scale_y;
  v.mask_y = p->tangent_y * plane->visibility_scale_y;
#else
  const float to_mask_x = sign * p->scale_x * plane->visibility_scale_x,
              mask_x = plane->visibility_shift_x;
  v.to_mask_y = sign * p->scale_y * plane->visibility_scale_y;
  v.mask_y = plane->visibility_shift_y;
#endif
  const floatv parts_across =
      (off_chief * to_mask_x + mask_x + 1.0f) * (0.5f * RAYWAVE_VISIBILITY_PARTS);
#if RAYWAVE_SMOOTH_PARTS
  (void)visibility, (void)tile;
  v.parts_across = parts_across - 0.5f;
  if (p->hidden) v.state = VISIBILITY_MIXED;
#else
  v.part = 0;
  if (!p->hidden) return v;
  const float left = plane->pitch_x * (float)tile->first,
              right = left + plane->pitch_x * (float)(RAYWAVE_LANES - 1);
  const float top = -plane->pitch_y * (float)tile->top,
              bottom = -plane->pitch_y * (float)tile->bottom;
  const float u0 = (fmax(left, p->centre_x - p->half_x) - p->centre_x) * to_mask_x + mask_x;
  const float u1 = (fmin(right, p->centre_x + p->half_x) - p->centre_x) * to_mask_x + mask_x;
  const float v0 = (fmax(bottom, p->centre_y - p->half_y) - p->centre_y) * v.to_mask_y + v.mask_y;
  const float v1 = (fmin(top, p->centre_y + p->half_y) - p->centre_y) * v.to_mask_y + v.mask_y;
  v.state = visibility_state(visibility, fmin(u0, u1), fmax(u0, u1), fmin(v0, v1), fmax(v0, v1));
  v.part = clamp(LANES_TO_INT(parts_across), (intv)(0), (intv)(RAYWAVE_VISIBILITY_PARTS - 1));
#endif
  return v;
}

// Share of light that a row's pixels see; with a hard mask, `counts` loses those that see none.
static inline floatv visible_in_row(const TileVisibility* v, __global const uint* visibility,
                                    float off_chief_y, intv* counts) {
  const float at = off_chief_y * v->to_mask_y + v->mask_y;
#if RAYWAVE_SMOOTH_PARTS
  (void)counts;
  return smooth_share(visibility, v->parts_across,
                      (at + 1.0f) * (0.5f * RAYWAVE_VISIBILITY_PARTS) - 0.5f);
#else
  const uint seen = visibility_row(visibility, visibility_part(at));
  *counts &= ((intv)((int)seen) >> v->part & 1) != 0;
  return 1.0f;
#endif
}
#endif

// A row of a tile as a sample lights it.
typedef struct {
  DoubleSingle from_y;  // upwards from the sample: float, to the tile's middle row; double, to this
  float step_y;         // from there to this row, 0 with double
  float dy;             // sum of both
  float off_chief;      // upwards from the chief ray
} TileRow;

static inline TileRow tile_row(const ProjectedSample* p, const GatherPlane* plane, int row) {
  const DoubleSingle y = ds_steps((intv)(-row), plane->pitch_y, plane->pitch_y_low),
                     from_y = ds_minus(y, ds(p->y, p->y_low));
  const TileRow r = {from_y, 0.0f, LANES_FIRST(ds_high(from_y)),
                     LANES_FIRST(ds_high(ds_minus(y, ds(p->centre_y, p->centre_y_low))))};
  return r;
}

#if RAYWAVE_HIGHLIGHTS > 0
// The direction from a sample through a pixel, or away from it where the sample is in front of the
// plane.
static inline Towards towards_pixel(DoubleSingle from_x, const TileRow* row, DoubleSingle depth,
                                    float sample_depth, floatv inverse_length, float sign) {
#if RAYWAVE_SHARP
#if RAYWAVE_PRECISION == PRECISION_FLOAT
  const DoubleSingle from_y = ds_plus(row->from_y, ds((floatv)(row->step_y), 0.0f));
#else
  const DoubleSingle from_y = row->from_y;
#endif
  (void)sample_depth, (void)inverse_length;
  const DoubleSingle3 from_sample = {from_x, from_y, ds_minus(ds(0.0f, 0.0f), depth)};
  return ds3_scaled(from_sample, ds((floatv)(sign), 0.0f));
#else
  (void)depth;
  const floatv unit = sign * inverse_length;
  const Towards towards = {ds_high(from_x) * unit, row->dy * unit, -sample_depth * unit};
  return towards;
#endif
}
#endif

// Adds light to a row of a tile, each frame with its phasor of the sample.
static inline void add_wave(floatv amplitude, floatv turns, __global const float2* phasors,
                            int sample_count, int row, Tile* tile) {
  floatv c, s;
  cos_sin_turns(turns, &c, &s);
  c *= amplitude;
  s *= amplitude;
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    const float2 phasor = phasors[(size_t)frame * (size_t)sample_count];
    tile->re[frame][row] += c * phasor.x - s * phasor.y;
    tile->im[frame][row] += c * phasor.y + s * phasor.x;
  }
}

// Adds the spherical wave of a sample, one path per pixel.
static inline void gather_spherical_wave(__global const Light* lights, __global const uint* lit,
                                         __global const Sample* sample,
                                         __global const SamplePath* paths,
                                         __global const uint* visibility, const ProjectedSample* p,
                                         __global const float2* phasors, int sample_count,
                                         const GatherPlane* plane, Tile* tile) {
#if !RAYWAVE_PATHS
  (void)paths;
#endif
  const int top = tile->top, bottom = tile->bottom;
  const intv column = tile->first + LANES_INDEX;
  const DoubleSingle x = ds_steps(column, plane->pitch_x, plane->pitch_x_low),
                     rate = ds(plane->turns_hi, plane->turns_lo);
  const DoubleSingle from_x = ds_minus(x, ds(p->x, p->x_low)), depth = ds(p->depth, p->depth_low);
  const floatv dx = ds_high(from_x);
  const floatv off_chief = ds_high(ds_minus(x, ds(p->centre_x, p->centre_x_low)));
  // Where the light of a pixel meets the hologram, in half windows from its centre
  const floatv across = fabs(off_chief * p->scale_x);
  intv inside_x = (across <= plane->cone_x) & (column < plane->nx);
  const floatv edge_x = apodization_weights(across, plane->cone_x, plane->apodization_rate_x);
  const float sign = p->depth < 0.0f ? -1.0f : 1.0f;
#if RAYWAVE_SINE_LIMIT
  const Reference reference = reference_of(p, plane, off_chief, sign);
#endif
#if RAYWAVE_PATHS
  // Where the light meets the window, in half sides
  const float to_window_y = sign * p->scale_y * plane->visibility_scale_y;
  const floatv window_x =
      off_chief * (sign * p->scale_x * plane->visibility_scale_x) + plane->visibility_shift_x;
#endif
#if RAYWAVE_VISIBILITY_PARTS > 0
  const TileVisibility visible = tile_visibility(p, plane, visibility, off_chief, sign, tile);
  if (visible.state == VISIBILITY_NONE) return;
#endif
  const floatv squared_x = dx * dx + p->depth * p->depth;
#if RAYWAVE_PRECISION == PRECISION_FLOAT
  // The phase of each lane counts from its pixel in the tile's middle row.
  const int middle = (top + bottom) / 2;
  const TileRow middle_row = tile_row(p, plane, middle);
  floatv middle_length;
  const floatv middle_turns =
      path_turns(from_x, middle_row.from_y, depth, rate, &middle_length) * sign;
#endif

  for (int row = top; row <= bottom; ++row) {
#if RAYWAVE_PRECISION == PRECISION_FLOAT
    const float step_y = plane->pitch_y * (float)(middle - row);
    const TileRow r = {middle_row.from_y, step_y, middle_row.dy + step_y,
                       middle_row.off_chief + step_y};
#else
    const TileRow r = tile_row(p, plane, row);
#endif
    const float up = fabs(r.off_chief * p->scale_y);
    if (up > plane->cone_y) continue;
    const float edge_y = apodization_weight(up, plane->cone_y, plane->apodization_rate_y);
    const floatv length = sqrt(squared_x + r.dy * r.dy);
    const floatv inverse_length = 1.0f / fmax(length, nearest_to(plane));
    intv counts = inside_x;
#if RAYWAVE_SINE_LIMIT
    const float reference_y = reference.chief_y - r.off_chief * reference.rate_y;
    counts &= (fabs(sign * dx * inverse_length - reference.x) <= plane->sine_limit_x) &
              (fabs(sign * r.dy * inverse_length - reference_y) <= plane->sine_limit_y);
#endif
    floatv share = edge_x * edge_y;
#if RAYWAVE_VISIBILITY_PARTS > 0
    if (visible.state == VISIBILITY_MIXED) {
      share *= visible_in_row(&visible, visibility, r.off_chief, &counts);
      if (!LANES_ANY(counts)) continue;
    }
#endif
    floatv amplitude = p->amplitude;
#if RAYWAVE_HIGHLIGHTS > 0
    if (p->specular)
      amplitude = shaded_amplitude(
          lights, lit, sample, towards_pixel(from_x, &r, depth, p->depth, inverse_length, sign));
#endif
    const floatv area = projected_area(p->tilt_z, p->tilt_x * dx, (floatv)(p->tilt_y * r.dy));
    amplitude = LANES_SELECT((floatv)(0.0f), amplitude * sqrt(area) * share * sign * inverse_length,
                             counts);
#if RAYWAVE_PRECISION == PRECISION_FLOAT
    const floatv turns = middle_turns + turns_beyond(middle_row.dy, step_y, length + middle_length,
                                                     plane->turns_hi * sign);
#else
    floatv path_length;
    const floatv turns = path_turns(from_x, r.from_y, depth, rate, &path_length) * sign;
#endif
    floatv rest = 0.0f;
#if RAYWAVE_PATHS
    if (p->path >= 0) {
      const floatv window_y = r.off_chief * to_window_y + plane->visibility_shift_y;
      rest = path_rest(paths + p->path, window_x, window_y) * copysign(plane->turns_hi, p->scale_x);
      amplitude *= path_amplitude(paths + p->path, window_x, window_y);
    }
#endif
    add_wave(amplitude, turns + rest, phasors, sample_count, row - top, tile);
  }
}

#endif
