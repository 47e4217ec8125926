// SPDX-License-Identifier: Apache-2.0
// Light that surface samples send through the parts of the hologram's window: what pictures made of
// samples are made of (host/refine/sample_picture.hpp).
//
// light_of_parts  light[PARTS * PARTS * i] and on: the irradiance A^2 / r^2 that sample first + i
//                 brings to the middles of the window's parts, row by row from the bottom left; 0
//                 where something hides it, or its light is too steep for the pixels
//
// The window is that of visibility masks (kernels/samples/visibility.h); or one in the plane of a
// pupil, which light from the hologram's place h with the slope t meets at a h + b t: the
// irradiance is then of its area. One work-item for each sample. OpenCL C 1.2.
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/gather/options.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/samples/visibility.h"

#define PARTS (RAYWAVE_VISIBILITY_PARTS > 0 ? RAYWAVE_VISIBILITY_PARTS : 8)

// Share of a part whose sines, sine - half_width to sine + half_width, are within the limit. Parts
// shown whole or not at all would leave steps in pictures.
static inline floatv share_within(floatv sine, floatv half_width, float limit) {
  return clamp((limit - fabs(sine)) / fmax(2.0f * half_width, (floatv)(1e-9f)) + 0.5f,
               (floatv)(0.0f), (floatv)(1.0f));
}

// centre     of the hologram, scene frame; half_x, half_y: half sides of the window of masks
// a, b       of the pupil, whose window is around the middle and has the half sides open_x, open_y;
//            b 0: the window is that of masks
// steepest   tangents that masks divide near the hologram; else FLT_MAX
// limit      largest sine that the pixels can show, from the sine of the light on the SLM:
//            reference at the centre, less by `fall` for each metre to the right and up
__kernel void light_of_parts(__global const Light* lights, __global const Sample* samples,
                             __global const uint* lit, __global const uint* visibility_masks,
                             int first, int count, float centre_x, float centre_y, float centre_z,
                             float half_x, float half_y, float a, float b, float middle_x,
                             float middle_y, float open_x, float open_y, float steepest_x,
                             float steepest_y, float limit_x, float limit_y, float reference_x,
                             float reference_y, float fall_x, float fall_y, __global float* light) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const size_t index = (size_t)(first + i);
  __global const Sample* s = samples + index;
  __global const uint* on = lit + index * (size_t)((RAYWAVE_LIGHTS + 31) / 32);
  const float plain = sqrt(s->radiance) * s->weight;
  for (int part = 0; part < PARTS * PARTS; part += RAYWAVE_LANES) {
    const intv number = part + LANES_INDEX;
    const intv column = number % PARTS, row = number / PARTS;
    floatv u = ((2.0f * LANES_TO_FLOAT(column) + 1.0f) / (float)PARTS - 1.0f) * open_x + middle_x,
           v = ((2.0f * LANES_TO_FLOAT(row) + 1.0f) / (float)PARTS - 1.0f) * open_y + middle_y;
    floatv x = centre_x + u - s->x, y = centre_y + v - s->y;
    float z = s->z - centre_z, per_area = 1.0f, half_u = open_x / (float)PARTS,
          half_v = open_y / (float)PARTS;
    intv seen = -1;
    if (b != 0.0f) {
      // From places of the pupil's plane to where light to them passes the hologram
      z = copysign(fmax(fabs(z), 1e-6f), z);
      per_area = z / (a * z + b);
      half_u *= fabs(per_area);
      half_v *= fabs(per_area);
      x = (u - a * (s->x - centre_x)) * per_area;
      y = (v - a * (s->y - centre_y)) * per_area;
      per_area *= per_area;
      u = s->x - centre_x + x;
      v = s->y - centre_y + y;
      seen = (fabs(u) <= half_x) & (fabs(v) <= half_y);
    }
    const floatv inverse = 1.0f / (x * x + y * y + z * z);
    // Light travels to the eye: of what lies before the hologram, away from its parts
    const floatv per_length = copysign(sqrt(inverse), (floatv)(z));
    const floatv amplitude =
        amplitude_towards(lights, on, s, plain, s->specular > 0.0f, x / z, y / z);
    const floatv shown = share_within(x * per_length - (reference_x - u * fall_x),
                                      half_u * fabs(per_length), limit_x) *
                         share_within(y * per_length - (reference_y - v * fall_y),
                                      half_v * fabs(per_length), limit_y);
#if RAYWAVE_VISIBILITY_PARTS > 0
    if (s->hidden) {
      int bits[RAYWAVE_LANES];
      float at_u[RAYWAVE_LANES], at_v[RAYWAVE_LANES];
      const bool is_near = steepest_x < FLT_MAX;
      const floatv mask_x = is_near ? x / (z * steepest_x) : u / half_x,
                   mask_y = is_near ? y / (z * steepest_y) : v / half_y;
      LANES_STORE((mask_x + 1.0f) * (0.5f * (float)PARTS), at_u);
      LANES_STORE((mask_y + 1.0f) * (0.5f * (float)PARTS), at_v);
      for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
        const int bit =
            PARTS * clamp((int)at_v[lane], 0, PARTS - 1) + clamp((int)at_u[lane], 0, PARTS - 1);
        bits[lane] =
            (int)(visibility_masks[index * VISIBILITY_WORDS + bit / 32] >> (bit % 32) & 1u);
      }
      seen &= LANES_LOAD(bits) != 0;
    }
#else
    (void)visibility_masks;
#endif
    LANES_STORE(
        LANES_SELECT((floatv)(0.0f), amplitude * amplitude * inverse * per_area * shown, seen),
        light + (size_t)i * (size_t)(PARTS * PARTS) + part);
  }
}
