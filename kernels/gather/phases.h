// SPDX-License-Identifier: Apache-2.0
// The random phases of the samples, for every kernel file that gathers them.
//
// draw_phases  phasors[frame * sample_count + i]: exp(i phase) of sample i in that frame;
//              -exp(-i phase) of samples with z < turned_below
#ifndef RAYWAVE_PHASES_H
#define RAYWAVE_PHASES_H

#include "kernels/common/hash.h"
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/common/shared.h"

__kernel void draw_phases(__global const Sample* samples, int sample_count, int frames, uint seed,
                          float turned_below, __global float2* phasors) {
  const int index = (int)get_global_id(0);
  if (index >= sample_count) return;
  for (int frame = 0; frame < frames; ++frame) {
    floatv c, s;
    cos_sin_turns(phase_turns((uintv)(samples[index].key), seed + (uint)frame), &c, &s);
    float cs[RAYWAVE_LANES], ss[RAYWAVE_LANES];
    LANES_STORE(c, cs);
    LANES_STORE(s, ss);
    phasors[(size_t)frame * (size_t)sample_count + (size_t)index] =
        (float2)(samples[index].z < turned_below ? -cs[0] : cs[0], ss[0]);
  }
}

#endif
