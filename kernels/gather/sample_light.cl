// SPDX-License-Identifier: Apache-2.0
// Light that surface samples send through the parts of the hologram's window: what pictures made of
// samples are made of (host/refine/sample_picture.hpp).
//
// light_of_parts  light[PARTS * PARTS * i] and on: the irradiance A^2 / r^2 that sample first + i
//                 brings to the middles of the window's parts, row by row from the bottom left; 0
//                 where something hides it, or its light is too steep for the pixels
//
// The window is that of visibility masks (kernels/samples/visibility.h). One work-item for each
// sample. OpenCL C 1.2.
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/gather/options.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/samples/visibility.h"

#define PARTS (RAYWAVE_VISIBILITY_PARTS > 0 ? RAYWAVE_VISIBILITY_PARTS : 8)

// centre     of the window, scene frame; half_x, half_y: its half sides
// limit      largest sine that the pixels can show, from the sine of the light on the SLM:
//            reference at the centre, less by `fall` for each metre to the right and up
__kernel void light_of_parts(__global const Light* lights, __global const Sample* samples,
                             __global const uint* lit, __global const uint* visibility_masks,
                             int first, int count, float centre_x, float centre_y, float centre_z,
                             float half_x, float half_y, float limit_x, float limit_y,
                             float reference_x, float reference_y, float fall_x, float fall_y,
                             __global float* light) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const size_t index = (size_t)(first + i);
  __global const Sample* s = samples + index;
  __global const uint* on = lit + index * (size_t)((RAYWAVE_LIGHTS + 31) / 32);
  const float plain = sqrt(s->radiance) * s->weight;
  for (int part = 0; part < PARTS * PARTS; part += RAYWAVE_LANES) {
    const intv number = part + LANES_INDEX;
    const intv column = number % PARTS, row = number / PARTS;
    const floatv u = ((2.0f * LANES_TO_FLOAT(column) + 1.0f) / (float)PARTS - 1.0f) * half_x,
                 v = ((2.0f * LANES_TO_FLOAT(row) + 1.0f) / (float)PARTS - 1.0f) * half_y;
    const floatv x = centre_x + u - s->x, y = centre_y + v - s->y;
    const float z = s->z - centre_z;
    const floatv inverse = 1.0f / (x * x + y * y + z * z), per_length = sqrt(inverse);
    const floatv amplitude =
        amplitude_towards(lights, on, s, plain, s->specular > 0.0f, x / z, y / z);
    intv seen = (fabs(x * per_length - (reference_x - u * fall_x)) <= limit_x) &
                (fabs(y * per_length - (reference_y - v * fall_y)) <= limit_y);
#if RAYWAVE_VISIBILITY_PARTS > 0
    if (s->hidden) {
      int bits[RAYWAVE_LANES];
      for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
        const int bit = part + lane;
        bits[lane] =
            (int)(visibility_masks[index * VISIBILITY_WORDS + bit / 32] >> (bit % 32) & 1u);
      }
      seen &= LANES_LOAD(bits) != 0;
    }
#else
    (void)visibility_masks;
#endif
    LANES_STORE(LANES_SELECT((floatv)(0.0f), amplitude * amplitude * inverse, seen),
                light + (size_t)i * (size_t)(PARTS * PARTS) + part);
  }
}
