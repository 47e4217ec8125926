// SPDX-License-Identifier: Apache-2.0
// Random phases that depend on a place only. Integer arithmetic makes every device draw the same
// phases.
#ifndef RAYWAVE_HASH_H
#define RAYWAVE_HASH_H

#include "kernels/common/lanes.h"

// Well mixed key of the cell (i, j, k).
static inline uintv cell_key(intv i, intv j, intv k) {
  uintv h = LANES_AS_UINT(i) * 0x9e3779b1u ^ (LANES_AS_UINT(j) * 0x85ebca77u + 0x165667b1u);
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h ^= LANES_AS_UINT(k) * 0xc2b2ae3du;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  return h ^ (h >> 15);
}

// Phase in turns, in [0, 1), for a key and a seed.
static inline floatv phase_turns(uintv key, uint seed) {
  uintv h = (key ^ (seed * 0x9e3779b9u)) * 0x846ca68bu;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h ^= h >> 15;
  return LANES_TO_FLOAT(h >> 8) * 0x1p-24f;
}

#endif
