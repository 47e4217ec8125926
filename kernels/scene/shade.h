// SPDX-License-Identifier: Apache-2.0
// Phong radiance at hits (paper, Eq. 3), for packets of lanes.
#ifndef RAYWAVE_SHADE_H
#define RAYWAVE_SHADE_H

#include "kernels/common/lanes.h"
#include "kernels/scene/arrays.h"
#include "kernels/scene/lights.h"
#include "kernels/scene/options.h"
#include "kernels/scene/scattered.h"
#include "kernels/scene/surface.h"

// The part of a radiance that the hologram shows: that of its channel, or the light of its laser. A
// laser cannot take light away.
static inline floatv shown_radiance(const SceneArrays* scene, const Radiance* radiance) {
#if RAYWAVE_COLOURS > 1
  const float* weights = scene->light.laser;
  return fmax(
      weights[0] * radiance->of[0] + weights[1] * radiance->of[1] + weights[2] * radiance->of[2],
      (floatv)(0.0f));
#else
  (void)scene;
  return radiance->of[0];
#endif
}

// Radiance from the surface towards the viewer that the hologram shows, without mirrors and glass:
// ambient part plus the diffuse and specular parts of all lights, and the light of other surfaces
// that it scatters. together: share_of_light
static inline floatv phong(const SceneArrays* scene, const Surface* s, float bias, float reach,
                           bool together, intv active) {
  Radiance radiance = own_light(scene, s);
  ADD_SCATTERED(scene, s, bias, reach, active, &radiance);
#if RAYWAVE_LIGHTS > 0
  // Clear glass and plain mirrors show no light, and ask for none
  intv shows = 0;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k)
    shows |= (s->diffuse[k] > 0.0f) | (s->specular[k] > 0.0f);
  if (!LANES_ANY(active & shows)) return shown_radiance(scene, &radiance);
  if (!together) active &= shows;
  floatv shares[RAYWAVE_LANES];
  for (int i = 0; i < RAYWAVE_LIGHTS; ++i) {
    const Incident in = incident(scene->lights, i, s, reach);
    const floatv share = share_of_light(scene, i, &in, s, bias, reach, together, active, shares);
    if (!LANES_ANY(share > 0.0f)) continue;
#if RAYWAVE_HIGHLIGHTS > 0
    floatv glow = 0.0f;
    if (i < RAYWAVE_HIGHLIGHTS) glow = highlight(scene->lights, i, &in, s);
#endif
    for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
      floatv part = s->diffuse[k] * in.facing;
#if RAYWAVE_HIGHLIGHTS > 0
      if (i < RAYWAVE_HIGHLIGHTS) part += s->specular[k] * glow;
#endif
      radiance.of[k] += share * (part * intensity_of(&in, k));
    }
  }
#endif
  return shown_radiance(scene, &radiance);
}

#endif
