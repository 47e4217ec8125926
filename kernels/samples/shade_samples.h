// SPDX-License-Identifier: Apache-2.0
// Light of samples without highlights, and what else they take from their surfaces.
#ifndef RAYWAVE_SHADE_SAMPLES_H
#define RAYWAVE_SHADE_SAMPLES_H

#include "kernels/samples/lattice_rays.h"
#include "kernels/samples/surface_layers.h"
#include "kernels/scene/lights.h"
#include "kernels/scene/scattered.h"
#include "kernels/scene/surface.h"

#define SAMPLE_COLOURS (2 * RAYWAVE_COLOURS)
#define LIT_WORDS (RAYWAVE_LIGHTS > 32 ? (RAYWAVE_LIGHTS + 31) / 32 : 1)

// Radiance without highlights. words: the mask of the lights that it comes from, where not together
// (share_of_light).
static inline Radiance scattered(const SceneArrays* scene, const Surface* s, const Lattice* lattice,
                                 bool together, intv active, uintv* words) {
  Radiance radiance = own_light(scene, s);
  ADD_SCATTERED(scene, s, lattice->bias, lattice->reach, active, &radiance);
  for (int w = 0; w < LIT_WORDS; ++w) words[w] = 0;
#if RAYWAVE_LIGHTS > 0
  floatv shares[RAYWAVE_LANES];
  for (int l = 0; l < RAYWAVE_LIGHTS; ++l) {
    const Incident in = incident(scene->lights, l, s, lattice->reach);
    const floatv share =
        share_of_light(scene, l, &in, s, lattice->bias, lattice->reach, together, active, shares);
    for (int k = 0; k < RAYWAVE_COLOURS; ++k)
      radiance.of[k] += share * (s->diffuse[k] * in.facing * intensity_of(&in, k));
    words[l / 32] |= LANES_AS_UINT(LANES_SELECT((intv)(0), (intv)(1), share > 0.0f)) << (l % 32);
  }
#else
  (void)scene, (void)lattice, (void)together, (void)active;
#endif
  return radiance;
}

static inline floatv sum_of_colours(const Radiance* radiance) {
  floatv sum = radiance->of[0];
  for (int k = 1; k < RAYWAVE_COLOURS; ++k) sum += radiance->of[k];
  return sum;
}

// Values that the samples of a packet's hits share with their surfaces.
typedef struct {
  float x[RAYWAVE_LANES];
  float y[RAYWAVE_LANES];
  float z[RAYWAVE_LANES];
  float nx[RAYWAVE_LANES];
  float ny[RAYWAVE_LANES];
  float nz[RAYWAVE_LANES];
#if RAYWAVE_NORMAL_MAPS
  float side_x[RAYWAVE_LANES];
  float side_y[RAYWAVE_LANES];
  float side_z[RAYWAVE_LANES];
#endif
  float radiance[RAYWAVE_COLOURS][RAYWAVE_LANES];
  float specular[RAYWAVE_COLOURS][RAYWAVE_LANES];
  float shininess[RAYWAVE_LANES];
  float own[RAYWAVE_LANES];  // share of the light that is neither mirrored nor let through
  uint lit[LIT_WORDS][RAYWAVE_LANES];
} Shaded;

// column, row  of the cells
CALLED void shade(const SceneArrays* scene, const Lattice* lattice, const Rays* rays,
                  const Hits* hits, intv column, int row, Shaded* shaded) {
  Surface s = surface_at(scene, rays, hits);
  LOOK_FOR_LIGHTS(&s, light_place_of(column, (intv)(row)));
  (void)column, (void)row;
  uintv words[LIT_WORDS];
  intv wanted = hits->triangle >= 0;
#if SHADOWS_PROBED && RAYWAVE_ANTIALIAS
  // The parts tell the radiance; which lights fall on a sample is for highlights only.
  intv shines = s.specular[0] > 0.0f;
  for (int k = 1; k < RAYWAVE_COLOURS; ++k) shines |= s.specular[k] > 0.0f;
  wanted &= shines;
#endif
  const Radiance radiance = scattered(scene, &s, lattice, false, wanted, words);
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) LANES_STORE(radiance.of[k], shaded->radiance[k]);
  for (int w = 0; w < LIT_WORDS; ++w) LANES_STORE(words[w], shaded->lit[w]);
  LANES_STORE(s.x, shaded->x);
  LANES_STORE(s.y, shaded->y);
  LANES_STORE(s.z, shaded->z);
  LANES_STORE(s.nx, shaded->nx);
  LANES_STORE(s.ny, shaded->ny);
  LANES_STORE(s.nz, shaded->nz);
#if RAYWAVE_NORMAL_MAPS
  LANES_STORE(s.side_x, shaded->side_x);
  LANES_STORE(s.side_y, shaded->side_y);
  LANES_STORE(s.side_z, shaded->side_z);
#endif
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) LANES_STORE(s.specular[k], shaded->specular[k]);
  LANES_STORE(s.shininess, shaded->shininess);
  LANES_STORE(1.0f - s.reflectivity - s.transparency, shaded->own);
}

// The same of one hit of a ray with these tangents, in lane 0.
static inline void shade_one(const SceneArrays* scene, const Lattice* lattice, const Hit* hit,
                             float dx, float dy, int column, int row, Shaded* shaded) {
  const Rays ray = lattice_rays(lattice, (floatv)(dx), (floatv)(dy), LANES_INDEX == 0);
  const Hits hits = {(floatv)(hit->t),
                     LANES_SELECT((intv)(-1), (intv)(hit->triangle), LANES_INDEX == 0),
                     (floatv)(hit->u), (floatv)(hit->v)};
  shade(scene, lattice, &ray, &hits, (intv)(column), row, shaded);
}

#endif
