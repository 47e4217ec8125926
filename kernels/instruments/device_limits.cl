// SPDX-License-Identifier: Apache-2.0
// Measures how many multiply-adds a device does in a second
// (host/evaluate/bench/bench.cpp). OpenCL C 1.2.
#include "kernels/common/lanes.h"

// Eight chains of multiply-adds per work-item, so that none waits for its own last result: 16 *
// rounds * RAYWAVE_LANES operations. The values tend to 1 and stay finite. sums: RAYWAVE_LANES
// values per work-item.
__kernel void multiply_add(__global float* sums, int rounds, int work_items) {
  const int item = (int)get_global_id(0);
  if (item >= work_items) return;
  const floatv start = (floatv)((float)item * 0x1p-20f);
  floatv a = start, b = start + 0.1f, c = start + 0.2f, d = start + 0.3f, e = start + 0.4f,
         f = start + 0.5f, g = start + 0.6f, h = start + 0.7f;
  const floatv scale = (floatv)(0.75f), more = (floatv)(0.25f);
  for (int round = 0; round < rounds; ++round) {
    a = mad(a, scale, more);
    b = mad(b, scale, more);
    c = mad(c, scale, more);
    d = mad(d, scale, more);
    e = mad(e, scale, more);
    f = mad(f, scale, more);
    g = mad(g, scale, more);
    h = mad(h, scale, more);
  }
  LANES_STORE(((a + b) + (c + d)) + ((e + f) + (g + h)), sums + item * RAYWAVE_LANES);
}
