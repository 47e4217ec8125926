// SPDX-License-Identifier: Apache-2.0
// Light of a sample in a direction: highlights, and the area that it turns there.
#ifndef RAYWAVE_RADIANCE_TOWARDS_H
#define RAYWAVE_RADIANCE_TOWARDS_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/lights.h"
#include "kernels/scene/surface.h"

#if RAYWAVE_HIGHLIGHTS > 0
// A direction towards the hologram: double-single and of any length, or a unit vector.
#if RAYWAVE_SHARP
typedef DoubleSingle3 Towards;
#else
typedef struct {
  floatv x, y, z;
} Towards;
#endif

// The surface of a sample for its highlights, except for the viewing direction.
static inline Surface sample_surface(__global const Sample* sample) {
  Surface s;
  s.x = sample->x;
  s.y = sample->y;
  s.z = sample->z;
  s.nx = sample->nx;
  s.ny = sample->ny;
  s.nz = sample->nz;
#if RAYWAVE_SHARP
  s.place = ds3((floatv)(sample->x), (floatv)(sample->y), (floatv)(sample->z));
  s.normal = ds3((floatv)(sample->nx), (floatv)(sample->ny), (floatv)(sample->nz));
#endif
  s.specular[0] = sample->specular;
  s.shininess = sample->shininess;
  LOOK_FOR_LIGHTS(&s, (intv)((int)(sample->key & 15u)));
  return s;
}

static inline bool is_lit(__global const uint* lit, int light) {
  return lit[light / 32] >> (light % 32) & 1u;
}

// Amplitude of a sample with the highlights that it shows in a direction.
static inline floatv shaded_amplitude(__global const Light* lights, __global const uint* lit,
                                      __global const Sample* sample, Towards towards) {
  Surface s = sample_surface(sample);
#if RAYWAVE_SHARP
  s.towards = towards;
#else
  s.vx = towards.x;
  s.vy = towards.y;
  s.vz = towards.z;
#endif
  floatv radiance = sample->radiance;
  for (int i = 0; i < RAYWAVE_HIGHLIGHTS; ++i) {
    if (!is_lit(lit, i)) continue;
    const Incident in = incident(lights, i, &s, 0.0f);
    radiance += s.specular[0] * highlight(lights, i, &in, &s) * laser_intensity(&in);
  }
  return sqrt(radiance) * sample->weight;
}

// Tangents of the directions, within half_x and half_y of (tangent_x, tangent_y), in which the
// highlights of lights `first` and on are brightest; (tangent_x, tangent_y) where there is none.
static inline void highlight_directions(__global const Light* lights, __global const uint* lit,
                                        __global const Sample* sample, int first, float tangent_x,
                                        float half_x, float tangent_y, float half_y, floatv* tx,
                                        floatv* ty) {
  const Surface s = sample_surface(sample);
  float txs[RAYWAVE_LANES], tys[RAYWAVE_LANES];
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    const int light = first + lane;
    txs[lane] = tangent_x;
    tys[lane] = tangent_y;
    if (light >= RAYWAVE_HIGHLIGHTS || !is_lit(lit, light)) continue;
    const Incident in = incident(lights, light, &s, 0.0f);
    if (!(LANES_FIRST(laser_intensity(&in)) > 0.0f)) continue;
    const float twice = 2.0f * LANES_FIRST(in.facing);
    const float x = twice * sample->nx - LANES_FIRST(in.x),
                y = twice * sample->ny - LANES_FIRST(in.y);
    const float down = fmax(LANES_FIRST(in.z) - twice * sample->nz, 1e-6f);
    txs[lane] = clamp(x / down, tangent_x - half_x, tangent_x + half_x);
    tys[lane] = clamp(y / down, tangent_y - half_y, tangent_y + half_y);
  }
  *tx = LANES_LOAD(txs);
  *ty = LANES_LOAD(tys);
}
#endif

// Projected area of a sample in a direction: a surface that is turned away shows less of itself. At
// grazing angles it is limited to four times the area.
static inline floatv projected_area(float tilt_z, floatv along_x, floatv along_y) {
  return clamp(along_x + along_y - tilt_z, (floatv)(0.0f), (floatv)(4.0f));
}

// Amplitude that a sample shows in directions, given as tangents.
//
// plain   without highlights: sqrt(radiance) weight
// shines  it may have highlights
static inline floatv amplitude_towards(__global const Light* lights, __global const uint* lit,
                                       __global const Sample* sample, float plain, bool shines,
                                       floatv tx, floatv ty) {
  floatv amplitude = plain;
#if RAYWAVE_HIGHLIGHTS > 0
  if (shines) {
#if RAYWAVE_SHARP
    const floatv down = -1.0f;
    const Towards towards = ds3(tx, ty, down);
#else
    const floatv cosine = 1.0f / sqrt(1.0f + tx * tx + ty * ty);
    const Towards towards = {tx * cosine, ty * cosine, -cosine};
#endif
    amplitude = shaded_amplitude(lights, lit, sample, towards);
  }
#else
  (void)lights, (void)lit, (void)shines;
#endif
  return amplitude * sqrt(projected_area(sample->tilt_z, sample->tilt_x * tx, sample->tilt_y * ty));
}

// Mask of samples, one per lane, with highlights worth computing in directions within half_x and
// half_y of (tangent_x, tangent_y).
//
// first     of the samples, `count` of them
// radiance  without highlights
// surface   place, normal, specular and shininess
static inline intv shine_within(__global const Light* lights, __global const uint* lit, int first,
                                int count, floatv radiance, Surface* surface, floatv tangent_x,
                                floatv half_x, floatv tangent_y, floatv half_y) {
  intv shines = LANES_INDEX < 0;
#if RAYWAVE_HIGHLIGHTS > 0
  if (!LANES_ANY(surface->specular[0] > 0.0f)) return shines;
#if RAYWAVE_SHARP
  surface->place = ds3(surface->x, surface->y, surface->z);
  surface->normal = ds3(surface->nx, surface->ny, surface->nz);
#endif
  // The sum of what each highlight is where it is brightest: no direction shows more.
  floatv brightest = 0.0f;
  for (int i = 0; i < RAYWAVE_HIGHLIGHTS; ++i) {
    int is_on[RAYWAVE_LANES];
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane)
      is_on[lane] = is_lit(
          lit + (size_t)(first + min(lane, count - 1)) * (size_t)((RAYWAVE_LIGHTS + 31) / 32), i);
    const intv on = LANES_LOAD(is_on) != 0;
    if (!LANES_ANY(on)) continue;
    const Incident in = incident(lights, i, surface, 0.0f);
    const floatv twice = 2.0f * in.facing;
    const floatv down = fmax(in.z - twice * surface->nz, (floatv)(1e-6f));
    const floatv tx = clamp((twice * surface->nx - in.x) / down, tangent_x - half_x,
                            tangent_x + half_x),
                 ty = clamp((twice * surface->ny - in.y) / down, tangent_y - half_y,
                            tangent_y + half_y);
#if RAYWAVE_SHARP
    const floatv ahead = -1.0f;
    surface->towards = ds3(tx, ty, ahead);
#else
    const floatv cosine = 1.0f / sqrt(1.0f + tx * tx + ty * ty);
    surface->vx = tx * cosine;
    surface->vy = ty * cosine;
    surface->vz = -cosine;
#endif
    brightest += LANES_SELECT(
        (floatv)(0.0f),
        surface->specular[0] * highlight(lights, i, &in, surface) * laser_intensity(&in), on);
  }
  shines = brightest > 2e-6f * radiance;
#else
  (void)lights, (void)lit, (void)first, (void)count, (void)radiance, (void)surface;
  (void)tangent_x, (void)half_x, (void)tangent_y, (void)half_y;
#endif
  return shines;
}

#endif
