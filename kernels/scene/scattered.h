// SPDX-License-Identifier: Apache-2.0
// Light of surfaces that no light makes directly: their own, and what they scatter of others.
#ifndef RAYWAVE_SCATTERED_H
#define RAYWAVE_SCATTERED_H

#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/scene/arrays.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/lights.h"
#include "kernels/scene/options.h"
#include "kernels/scene/surface.h"

// Radiance in each of the colours.
typedef struct {
  floatv of[RAYWAVE_COLOURS];
} Radiance;

// Radiance that no light with a place or a direction makes: ambient light and emission.
static inline Radiance own_light(const SceneArrays* scene, const Surface* s) {
  Radiance own;
  int k = 0;
  do {  // once at least: no compiler can doubt that it has a value
#if RAYWAVE_TEXTURES > TEXTURES_PLAIN
    own.of[k] = s->ambient[k] * scene->light.ambient + s->emission[k];
#else
    own.of[k] = s->ambient[k] * scene->light.ambient;
#endif
  } while (++k < RAYWAVE_COLOURS);
  return own;
}

#if RAYWAVE_DIFFUSE_RAYS > 0 || RAYWAVE_GLOSS_RAYS > 0
// Unit vectors, and the light that comes from there.
typedef struct {
  floatv x, y, z;
} Direction;

// At an angle with this cosine to a unit vector, `turn` turns around it from anywhere.
static inline Direction around(Direction axis, floatv cosine, floatv turn) {
  // A frame that has no singular direction (Duff et al. 2017)
  const floatv sign = copysign((floatv)(1.0f), axis.z), a = -1.0f / (sign + axis.z),
               b = axis.x * axis.y * a, sine = sqrt(fmax(1.0f - cosine * cosine, (floatv)(0.0f)));
  floatv c, s;
  cos_sin_turns(turn, &c, &s);
  c *= sine;
  s *= sine;
  const Direction d = {c * (1.0f + sign * axis.x * axis.x * a) + s * b + cosine * axis.x,
                       c * sign * b + s * (sign + axis.y * axis.y * a) + cosine * axis.y,
                       -c * sign * axis.x - s * axis.y + cosine * axis.z};
  return d;
}

// Adds the light of other surfaces that comes from a direction: ambient light, emission, and what
// they scatter of lights. What they mirror or let through, and their highlights, are left out.
CALLED void add_light_from(const SceneArrays* scene, const Surface* s, Direction to, float bias,
                           float reach, intv active, Radiance* sum) {
  const Rays rays = {s->x + bias * SIDE_X(s),
                     s->y + bias * SIDE_Y(s),
                     s->z + bias * SIDE_Z(s),
                     to.x,
                     to.y,
                     to.z,
                     (floatv)(0.0f),
                     (floatv)(reach),
                     active & (to.x * SIDE_X(s) + to.y * SIDE_Y(s) + to.z * SIDE_Z(s) > 0.0f)};
  if (!LANES_ANY(rays.active)) return;
  const Hits hits = bvh_nearest(&scene->tree, &rays);
  const intv hit = hits.triangle >= 0;
  if (!LANES_ANY(hit)) return;
  Surface met = surface_at(scene, &rays, &hits);
  LOOK_FOR_LIGHTS(&met, s->light_place);
  Radiance radiance = own_light(scene, &met);
#if RAYWAVE_LIGHTS > 0
  for (int i = 0; i < RAYWAVE_LIGHTS; ++i) {
    const Incident in = incident(scene->lights, i, &met, reach);
    const intv lit = lit_by(scene, &in, &met, bias, hit);
    for (int k = 0; k < RAYWAVE_COLOURS; ++k)
      radiance.of[k] +=
          LANES_SELECT((floatv)(0.0f), met.diffuse[k] * in.facing * intensity_of(&in, k), lit);
  }
#endif
  const floatv own = 1.0f - met.reflectivity - met.transparency;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k)
    sum->of[k] += LANES_SELECT((floatv)(0.0f), own * radiance.of[k], hit);
}

// Direction i of `rays` of each lane of a surface around an axis, of the set that the 16 places
// share: even in what `share` gets, which lies within 0 to 1, and in the turns around the axis.
static inline floatv direction_of(const Surface* s, int i, int rays, floatv* share) {
  const floatv number = LANES_TO_FLOAT(16 * i + s->light_place);
  *share = (number + 0.5f) / (16.0f * (float)rays);
  return number * 0.6180339887f;
}

// Adds to a radiance towards the viewer what the surface scatters of the light of others.
CALLED void add_scattered(const SceneArrays* scene, const Surface* s, float bias, float reach,
                          intv active, Radiance* radiance) {
  floatv share;
#if RAYWAVE_DIFFUSE_RAYS > 0
  intv matt = 0;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) matt |= s->diffuse[k] > 0.0f;
  const Direction normal = {s->nx, s->ny, s->nz};
  Radiance diffuse;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) diffuse.of[k] = 0.0f;
  for (int i = 0; i < RAYWAVE_DIFFUSE_RAYS && LANES_ANY(active & matt); ++i) {
    const floatv turn = direction_of(s, i, RAYWAVE_DIFFUSE_RAYS, &share);
    add_light_from(scene, s, around(normal, sqrt(share), turn), bias, reach, active & matt,
                   &diffuse);
  }
  for (int k = 0; k < RAYWAVE_COLOURS; ++k)
    radiance->of[k] += s->diffuse[k] * diffuse.of[k] / (float)RAYWAVE_DIFFUSE_RAYS;
#endif
#if RAYWAVE_GLOSS_RAYS > 0
  intv glossy = 0;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) glossy |= s->specular[k] > 0.0f;
  const floatv twice = 2.0f * (s->vx * s->nx + s->vy * s->ny + s->vz * s->nz);
  const Direction mirrored = {twice * s->nx - s->vx, twice * s->ny - s->vy, twice * s->nz - s->vz};
  Radiance gloss;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) gloss.of[k] = 0.0f;
  for (int i = 0; i < RAYWAVE_GLOSS_RAYS && LANES_ANY(active & glossy); ++i) {
    const floatv turn = direction_of(s, i, RAYWAVE_GLOSS_RAYS, &share);
    const floatv cosine = pow_unit(1.0f - share, 1.0f / (s->shininess + 1.0f));
    add_light_from(scene, s, around(mirrored, cosine, turn), bias, reach, active & glossy, &gloss);
  }
  for (int k = 0; k < RAYWAVE_COLOURS; ++k)
    radiance->of[k] +=
        s->specular[k] * gloss.of[k] / ((0.5f * s->shininess + 1.0f) * (float)RAYWAVE_GLOSS_RAYS);
#endif
}
#define ADD_SCATTERED(scene, s, bias, reach, active, radiance) \
  add_scattered(scene, s, bias, reach, active, radiance)
#else
#define ADD_SCATTERED(scene, s, bias, reach, active, radiance) ((void)0)
#endif

#endif
