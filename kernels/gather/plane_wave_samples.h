// SPDX-License-Identifier: Apache-2.0
// Samples whose waves are sums of plane waves (plane_waves.h): their profiles along the columns and
// along the rows, and the products of these.
#ifndef RAYWAVE_PLANE_WAVE_SAMPLES_H
#define RAYWAVE_PLANE_WAVE_SAMPLES_H

#include "kernels/gather/parts_seen.h"
#include "kernels/gather/plane_waves.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/gather/tile.h"

// The plane waves of both axes of a sample. Its amplitude in a direction is approximated by the
// product of its amplitudes along the two axes through its brightest direction. This is right to
// first order for surfaces that turn away, and for highlights that fall off like a Gaussian.
static inline void plane_wave_axes(__global const Light* lights, __global const uint* lit,
                                   __global const Sample* sample, const ProjectedSample* p,
                                   const GatherPlane* plane, PlaneWaves* x, PlaneWaves* y) {
  Gathered along_x = gathered_x(plane, is_before_hologram(p)),
           along_y = gathered_y(plane, is_before_hologram(p));
#if RAYWAVE_NEAR_HOLOGRAM
  // The footprint is small: the light on the SLM is that at its middle.
  along_x.reference = p->tangent_x / sqrt(1.0f + p->tangent_x * p->tangent_x);
  along_y.reference = p->tangent_y / sqrt(1.0f + p->tangent_y * p->tangent_y);
  along_x.reference_fall = along_y.reference_fall = 0.0f;
  along_x.visibility_scale = p->half_tangent_x * plane->visibility_scale_x;
  along_y.visibility_scale = p->half_tangent_y * plane->visibility_scale_y;
  along_x.visibility_shift = p->tangent_x * plane->visibility_scale_x;
  along_y.visibility_shift = p->tangent_y * plane->visibility_scale_y;
#endif
  plane_waves_of(x, p->hidden, p->tangent_x, p->half_tangent_x, p->half_x, p->depth, along_x,
                 plane->turns_hi);
  plane_waves_of(y, p->hidden, p->tangent_y, p->half_tangent_y, p->half_y, p->depth, along_y,
                 plane->turns_hi);
  float best_x = p->tangent_x, best_y = p->tangent_y;
  float best = LANES_FIRST(amplitude_towards(lights, lit, sample, p->amplitude, p->specular,
                                             (floatv)(best_x), (floatv)(best_y)));
#if RAYWAVE_NEAR_HOLOGRAM
  // A surface seen edge-on is brightest, by far, at the corner that it turns to. Elsewhere the
  // middle is where its lattice has seen it
  const float corner_x = p->tangent_x + copysign(p->half_tangent_x, sample->tilt_x),
              corner_y = p->tangent_y + copysign(p->half_tangent_y, sample->tilt_y);
  const float in_corner = LANES_FIRST(amplitude_towards(
      lights, lit, sample, p->amplitude, p->specular, (floatv)(corner_x), (floatv)(corner_y)));
  if (in_corner > 1.5f * best) {
    best = in_corner;
    best_x = corner_x;
    best_y = corner_y;
  }
#endif
#if RAYWAVE_HIGHLIGHTS > 0
  for (int first = 0; first < RAYWAVE_HIGHLIGHTS && p->specular; first += RAYWAVE_LANES) {
    floatv tx, ty;
    highlight_directions(lights, lit, sample, first, p->tangent_x,
                         plane->cone_x * p->half_tangent_x, p->tangent_y,
                         plane->cone_y * p->half_tangent_y, &tx, &ty);
    float amplitudes[RAYWAVE_LANES], txs[RAYWAVE_LANES], tys[RAYWAVE_LANES];
    LANES_STORE(amplitude_towards(lights, lit, sample, p->amplitude, p->specular, tx, ty),
                amplitudes);
    LANES_STORE(tx, txs);
    LANES_STORE(ty, tys);
    for (int i = 0; i < RAYWAVE_LANES; ++i) {
      if (!(amplitudes[i] > 1.01f * best)) continue;  // else rounding would choose among equals
      best = amplitudes[i];
      best_x = txs[i];
      best_y = tys[i];
    }
  }
#endif
  const float scale = best > 0.0f ? plane->turns_hi / best : 0.0f;
  for (int n = 0; n < x->count; n += RAYWAVE_LANES) {
    const floatv amplitude = amplitude_towards(lights, lit, sample, p->amplitude, p->specular,
                                               LANES_LOAD(x->tangent + n), (floatv)(best_y)) *
                             scale;
    LANES_STORE(LANES_LOAD(x->re + n) * amplitude, x->re + n);
    LANES_STORE(LANES_LOAD(x->im + n) * amplitude, x->im + n);
  }
  for (int n = 0; n < y->count; n += RAYWAVE_LANES) {
    const floatv amplitude = amplitude_towards(lights, lit, sample, p->amplitude, p->specular,
                                               (floatv)(best_x), LANES_LOAD(y->tangent + n));
    LANES_STORE(LANES_LOAD(y->re + n) * amplitude, y->re + n);
    LANES_STORE(LANES_LOAD(y->im + n) * amplitude, y->im + n);
  }
}

// Sum of waves `from` to before `to` along x, at pixels of columns first to first + RAYWAVE_LANES -
// 1; zero outside the footprint.
static inline void plane_wave_columns(const PlaneWaves* waves, int from, int to,
                                      const ProjectedSample* p, const GatherPlane* plane, int first,
                                      floatv* re, floatv* im) {
  const DoubleSingle offset =
      ds_minus(ds_steps(first + LANES_INDEX, plane->pitch_x, plane->pitch_x_low),
               ds(p->centre_x, p->centre_x_low));
  const floatv turns =
      ds_turns(ds_times(offset, ds(p->chief_x, p->chief_x_low))) + (p->turns + 0.25f);
  plane_wave_sum(waves, from, to, ds_high(offset), turns, re, im);
  const intv inside = fabs(ds_high(offset)) <= p->half_x;
  *re = LANES_SELECT((floatv)(0.0f), *re, inside);
  *im = LANES_SELECT((floatv)(0.0f), *im, inside);
}

// The same along y, at pixels of rows first to first + RAYWAVE_LANES - 1.
static inline void plane_wave_rows(const PlaneWaves* waves, int from, int to,
                                   const ProjectedSample* p, const GatherPlane* plane, int first,
                                   floatv* re, floatv* im) {
  const DoubleSingle offset =
      ds_minus(ds_steps(-(first + LANES_INDEX), plane->pitch_y, plane->pitch_y_low),
               ds(p->centre_y, p->centre_y_low));
  plane_wave_sum(waves, from, to, ds_high(offset),
                 ds_turns(ds_times(offset, ds(p->chief_y, p->chief_y_low))), re, im);
  const intv inside = fabs(ds_high(offset)) <= p->half_y;
  *re = LANES_SELECT((floatv)(0.0f), *re, inside);
  *im = LANES_SELECT((floatv)(0.0f), *im, inside);
}

// Number of floats of a profile.
static inline size_t profile_size(const GatherPlane* plane) {
  return (size_t)(2 * (plane->room_x + plane->room_y));
}

// Adds the product of a sample's profile along the columns and along the rows, `up`.
static inline void add_product(floatv across_re, floatv across_im, __global const float* up,
                               const ProjectedSample* p, __global const float2* phasors,
                               int sample_count, const GatherPlane* plane, Tile* tile) {
  const int from = max(tile->top, p->top), to = min(tile->bottom, p->top + p->rows - 1);
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    const float2 phasor = phasors[(size_t)frame * (size_t)sample_count];
    const floatv turned_re = across_re * phasor.x - across_im * phasor.y,
                 turned_im = across_re * phasor.y + across_im * phasor.x;
    for (int row = from; row <= to; ++row) {
      const float up_re = up[row - p->top], up_im = up[plane->room_y + row - p->top];
      tile->re[frame][row - tile->top] += turned_re * up_re - turned_im * up_im;
      tile->im[frame][row - tile->top] += turned_re * up_im + turned_im * up_re;
    }
  }
}

// Adds the wave of a plane-wave sample, from its profiles.
static inline void gather_plane_waves(__global const float* profiles,
                                      __global const uint* visibility, const ProjectedSample* p,
                                      __global const float2* phasors, int sample_count,
                                      const GatherPlane* plane, Tile* tile) {
  const size_t size = profile_size(plane);
  __global const float* column = profiles + (tile->first - p->left + RAYWAVE_LANES);
  __global const float* up = profiles + 2 * plane->room_x;
  if (!p->hidden) {
    add_product(LANES_LOAD(column), LANES_LOAD(column + plane->room_x), up, p, phasors,
                sample_count, plane, tile);
    return;
  }
  for (int j = 0; j < PLANE_WAVE_PARTS; ++j) {
    floatv re = 0.0f, im = 0.0f;
    bool any = false;
    for (int i = 0; i < PLANE_WAVE_PARTS; ++i) {
      const float share =
          is_before_hologram(p) && !RAYWAVE_NEAR_HOLOGRAM
              ? visible_share(visibility, PLANE_WAVE_PARTS - 1 - i, PLANE_WAVE_PARTS - 1 - j)
              : visible_share(visibility, i, j);
      if (share <= 0.0f) continue;
      re += share * LANES_LOAD(column + (size_t)i * size);
      im += share * LANES_LOAD(column + (size_t)i * size + plane->room_x);
      any = true;
    }
    if (any) add_product(re, im, up + (size_t)j * size, p, phasors, sample_count, plane, tile);
  }
}

#endif
