// SPDX-License-Identifier: Apache-2.0
// For host/evaluate/selftest/selfcheck.cpp: where a device places the members of shared structs,
// and how accurate phase.h is there. OpenCL C 1.2.
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/common/shared.h"
#include "kernels/common/shared_layout.h"

// layout: size of the struct, offset and size of the member, in bytes, for each member of
// RAYWAVE_LAYOUT. One work-item.
__kernel void struct_layout(__global int* layout) {
  int i = 0;
#define MEMBER(T, member)                                                          \
  {                                                                                \
    T value;                                                                       \
    layout[i++] = (int)sizeof(T);                                                  \
    layout[i++] = (int)((__private char*)&value.member - (__private char*)&value); \
    layout[i++] = (int)sizeof(value.member);                                       \
  }
  RAYWAVE_LAYOUT(MEMBER)
#undef MEMBER
}

// Cosine and sine of 2 pi turns[i]. One work-item for each of `blocks` runs of RAYWAVE_LANES
// values.
//
__kernel void cos_sin(__global const float* turns, __global float* cosines, __global float* sines,
                      int blocks) {
  const int block = (int)get_global_id(0);
  if (block >= blocks) return;
  floatv c, s;
  cos_sin_turns(LANES_LOAD(turns + block * RAYWAVE_LANES), &c, &s);
  LANES_STORE(c, cosines + block * RAYWAVE_LANES);
  LANES_STORE(s, sines + block * RAYWAVE_LANES);
}
