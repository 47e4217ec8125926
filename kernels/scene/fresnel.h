// SPDX-License-Identifier: Apache-2.0
// Light that mirrors reflect and glass lets through, for packets of lanes.
#ifndef RAYWAVE_FRESNEL_H
#define RAYWAVE_FRESNEL_H

#include "kernels/common/lanes.h"

// Share of unpolarised light that a clear surface reflects, by Fresnel's formulas; 1 for total
// internal reflection.
//
// ratio    index of refraction on the side of the light over that beyond
// along    cosine between the ray and the normal; interpolated normals may give it either sign
// squared  1 - ratio^2 (1 - along^2): the same beyond the surface, squared; <= 0 where all is
//          reflected
static inline floatv fresnel_share(floatv ratio, floatv along, floatv squared) {
  const floatv slope = fabs(along), beyond = sqrt(fmax(squared, (floatv)(0.0f)));
  const floatv s_wave = (ratio * slope - beyond) / fmax(ratio * slope + beyond, (floatv)(1e-30f)),
               p_wave = (slope - ratio * beyond) / fmax(slope + ratio * beyond, (floatv)(1e-30f));
  return LANES_SELECT((floatv)(1.0f), 0.5f * (s_wave * s_wave + p_wave * p_wave), squared > 0.0f);
}

// Share of light that is left after `length` metres in a medium that takes `rate` per metre.
static inline floatv attenuated_share(floatv rate, floatv length) {
  if (!LANES_ANY(rate > 0.0f)) return 1.0f;
  return exp(-rate * length);
}

#endif
