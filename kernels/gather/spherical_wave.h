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
#if RAYWAVE_VISIBILITY_PARTS > 0 && !RAYWAVE_SMOOTH_PARTS
  const float left_x = plane->pitch_x * (float)tile->first,
              right_x = left_x + plane->pitch_x * (float)(RAYWAVE_LANES - 1);
  const float top_y = -plane->pitch_y * (float)top, bottom_y = -plane->pitch_y * (float)bottom;
#endif
  const DoubleSingle from_x = ds_minus(x, ds(p->x, p->x_low)), depth = ds(p->depth, p->depth_low);
  const floatv dx = ds_high(from_x);
  const floatv off_chief = ds_high(ds_minus(x, ds(p->centre_x, p->centre_x_low)));
  // Where the light of a pixel meets the hologram, in half windows from its centre
  const floatv across = fabs(off_chief * p->scale_x);
  intv inside_x = (across <= plane->cone_x) & (column < plane->nx);
  const floatv edge_x = apodization_weights(across, plane->cone_x, plane->apodization_rate_x);
  const float sign = p->depth < 0.0f ? -1.0f : 1.0f;
#if RAYWAVE_SINE_LIMIT
  // Of the light that the SLM is lit with, where this light meets it
#if RAYWAVE_NEAR_HOLOGRAM
  const float reference_rate_x = plane->reference_fall_x / plane->half_window_x,
              reference_rate_y = plane->reference_fall_y / plane->half_window_y;
  const floatv reference_x =
      plane->reference_x - (off_chief + chief_place_x(p, plane)) * reference_rate_x;
  const float chief_reference_y = plane->reference_y - chief_place_y(p, plane) * reference_rate_y;
#else
  const floatv reference_x =
      plane->reference_x - off_chief * (sign * p->scale_x * plane->reference_fall_x);
  const float reference_rate_y = sign * p->scale_y * plane->reference_fall_y;
  const float chief_reference_y = plane->reference_y;
#endif
#endif
#if RAYWAVE_PATHS
  // Where the light meets the window, in half sides
  const float to_window_y = sign * p->scale_y * plane->visibility_scale_y;
  const floatv window_x =
      off_chief * (sign * p->scale_x * plane->visibility_scale_x) + plane->visibility_shift_x;
#endif
#if RAYWAVE_VISIBILITY_PARTS > 0
  // Visibility of the tile's pixels: all, none, or by the bit of each pixel's part of the window.
  int state = VISIBILITY_CLEAR;
#if RAYWAVE_NEAR_HOLOGRAM
  const float to_mask_x = plane->visibility_scale_x / plane->half_window_x,
              to_mask_y = plane->visibility_scale_y / plane->half_window_y;
  const float mask_x = chief_place_x(p, plane) * to_mask_x + plane->visibility_shift_x,
              mask_y = chief_place_y(p, plane) * to_mask_y + plane->visibility_shift_y;
#else
  const float to_mask_x = sign * p->scale_x * plane->visibility_scale_x;
  const float to_mask_y = sign * p->scale_y * plane->visibility_scale_y;
  const float mask_x = plane->visibility_shift_x, mask_y = plane->visibility_shift_y;
#endif
#if RAYWAVE_SMOOTH_PARTS
  const floatv parts_across =
      (off_chief * to_mask_x + mask_x + 1.0f) * (0.5f * RAYWAVE_VISIBILITY_PARTS) - 0.5f;
  if (p->hidden) state = VISIBILITY_MIXED;
#else
  intv part = 0;
  if (p->hidden) {
    const float u0 = (fmax(left_x, p->centre_x - p->half_x) - p->centre_x) * to_mask_x + mask_x;
    const float u1 = (fmin(right_x, p->centre_x + p->half_x) - p->centre_x) * to_mask_x + mask_x;
    const float v0 = (fmax(bottom_y, p->centre_y - p->half_y) - p->centre_y) * to_mask_y + mask_y;
    const float v1 = (fmin(top_y, p->centre_y + p->half_y) - p->centre_y) * to_mask_y + mask_y;
    state = visibility_state(visibility, fmin(u0, u1), fmax(u0, u1), fmin(v0, v1), fmax(v0, v1));
    if (state == VISIBILITY_NONE) return;
    part = clamp(
        LANES_TO_INT((off_chief * to_mask_x + mask_x + 1.0f) * (0.5f * RAYWAVE_VISIBILITY_PARTS)),
        (intv)(0), (intv)(RAYWAVE_VISIBILITY_PARTS - 1));
  }
#endif
#endif
  const floatv squared_x = dx * dx + p->depth * p->depth;
#if RAYWAVE_PRECISION == PRECISION_FLOAT
  // The phase of each lane counts from its pixel in the tile's middle row.
  const int middle = (top + bottom) / 2;
  const DoubleSingle middle_y = ds_steps((intv)(-middle), plane->pitch_y, plane->pitch_y_low);
  const DoubleSingle from_y = ds_minus(middle_y, ds(p->y, p->y_low));
  floatv middle_length;
  const floatv middle_turns = path_turns(from_x, from_y, depth, rate, &middle_length) * sign;
  const float middle_dy = LANES_FIRST(ds_high(from_y));
  const float middle_off_chief =
      LANES_FIRST(ds_high(ds_minus(middle_y, ds(p->centre_y, p->centre_y_low))));
#endif

  for (int row = top; row <= bottom; ++row) {
#if RAYWAVE_PRECISION == PRECISION_FLOAT
    const float step_y = plane->pitch_y * (float)(middle - row);
    const float dy = middle_dy + step_y, off_chief_y = middle_off_chief + step_y;
#else
    const DoubleSingle y = ds_steps((intv)(-row), plane->pitch_y, plane->pitch_y_low),
                       from_y = ds_minus(y, ds(p->y, p->y_low));
    const float dy = LANES_FIRST(ds_high(from_y));
    const float off_chief_y = LANES_FIRST(ds_high(ds_minus(y, ds(p->centre_y, p->centre_y_low))));
#endif
    const float up = fabs(off_chief_y * p->scale_y);
    if (up > plane->cone_y) continue;
    const float edge_y = apodization_weight(up, plane->cone_y, plane->apodization_rate_y);
    const floatv length = sqrt(squared_x + dy * dy);
    const floatv inverse_length = 1.0f / fmax(length, nearest_to(plane));
    intv counts = inside_x;
#if RAYWAVE_SINE_LIMIT
    const float reference_y = chief_reference_y - off_chief_y * reference_rate_y;
    counts &= (fabs(sign * dx * inverse_length - reference_x) <= plane->sine_limit_x) &
              (fabs(sign * dy * inverse_length - reference_y) <= plane->sine_limit_y);
#endif
    floatv share = edge_x * edge_y;
#if RAYWAVE_VISIBILITY_PARTS > 0
    if (state == VISIBILITY_MIXED) {
      const float at = off_chief_y * to_mask_y + mask_y;
#if RAYWAVE_SMOOTH_PARTS
      share *= smooth_share(visibility, parts_across,
                            (at + 1.0f) * (0.5f * RAYWAVE_VISIBILITY_PARTS) - 0.5f);
#else
      const uint seen = visibility_row(visibility, visibility_part(at));
      counts &= ((intv)((int)seen) >> part & 1) != 0;
      if (!LANES_ANY(counts)) continue;
#endif
    }
#endif
    floatv amplitude = p->amplitude;
#if RAYWAVE_HIGHLIGHTS > 0
    // The direction through the pixel, or away from it where the sample is in front of the plane.
    if (p->specular) {
#if RAYWAVE_SHARP
#if RAYWAVE_PRECISION == PRECISION_FLOAT
      const DoubleSingle from_row = ds_plus(from_y, ds((floatv)(step_y), 0.0f));
#else
      const DoubleSingle from_row = from_y;
#endif
      const DoubleSingle3 from_sample = {from_x, from_row, ds_minus(ds(0.0f, 0.0f), depth)};
      const Towards towards = ds3_scaled(from_sample, ds((floatv)(sign), 0.0f));
#else
      const floatv unit = sign * inverse_length;
      const Towards towards = {dx * unit, dy * unit, -p->depth * unit};
#endif
      amplitude = shaded_amplitude(lights, lit, sample, towards);
    }
#endif
    const floatv area = projected_area(p->tilt_z, p->tilt_x * dx, (floatv)(p->tilt_y * dy));
    amplitude = LANES_SELECT((floatv)(0.0f), amplitude * sqrt(area) * share * sign * inverse_length,
                             counts);
#if RAYWAVE_PRECISION == PRECISION_FLOAT
    const floatv turns = middle_turns + turns_beyond(middle_dy, step_y, length + middle_length,
                                                     plane->turns_hi * sign);
#else
    floatv path_length;
    const floatv turns = path_turns(from_x, from_y, depth, rate, &path_length) * sign;
#endif
    floatv rest = 0.0f;
#if RAYWAVE_PATHS
    if (p->path >= 0) {
      const floatv window_y = off_chief_y * to_window_y + plane->visibility_shift_y;
      rest = path_rest(paths + p->path, window_x, window_y) * plane->turns_hi;
      amplitude *= path_amplitude(paths + p->path, window_x, window_y);
    }
#endif
    floatv c, s;
    cos_sin_turns(turns + rest, &c, &s);
    c *= amplitude;
    s *= amplitude;
    for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
      const float2 phasor = phasors[(size_t)frame * (size_t)sample_count];
      tile->re[frame][row - top] += c * phasor.x - s * phasor.y;
      tile->im[frame][row - top] += c * phasor.y + s * phasor.x;
    }
  }
}

#endif
