// SPDX-License-Identifier: Apache-2.0
// Intersects an array of rays with a tree, for the tests, the self-test and the benchmark. OpenCL C
// 1.2.
//
// rays   8 planes of `count` floats: origin x, y, z, direction x, y, z, t_min, t_max
// A work-item handles RAYWAVE_LANES neighbours; lanes from `count` on write nothing.
// Trees alone know of no materials: all surfaces are there everywhere.
#undef RAYWAVE_ALPHA
#define RAYWAVE_ALPHA 0
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/bvh.h"

// Lanes from `count` on repeat the last ray, so that a partial packet reads nothing outside.
static inline floatv load_plane(__global const float* plane, int first, int count) {
  if (first + RAYWAVE_LANES <= count) return LANES_LOAD(plane + first);
  float values[RAYWAVE_LANES];
  for (int i = 0; i < RAYWAVE_LANES; ++i) values[i] = plane[min(first + i, count - 1)];
  return LANES_LOAD(values);
}

static inline Rays load_rays(__global const float* rays, int first, int count) {
  Rays r;
  r.ox = load_plane(rays, first, count);
  r.oy = load_plane(rays + count, first, count);
  r.oz = load_plane(rays + 2 * count, first, count);
  r.dx = load_plane(rays + 3 * count, first, count);
  r.dy = load_plane(rays + 4 * count, first, count);
  r.dz = load_plane(rays + 5 * count, first, count);
  r.t_min = load_plane(rays + 6 * count, first, count);
  r.t_max = load_plane(rays + 7 * count, first, count);
  r.active = first + LANES_INDEX < count;
  return r;
}

static inline void store_floats(floatv values, __global float* plane, int first, int count) {
  float v[RAYWAVE_LANES];
  LANES_STORE(values, v);
  for (int i = 0; i < min(RAYWAVE_LANES, count - first); ++i) plane[first + i] = v[i];
}

static inline void store_ints(intv values, __global int* plane, int first, int count) {
  int v[RAYWAVE_LANES];
  LANES_STORE(values, v);
  for (int i = 0; i < min(RAYWAVE_LANES, count - first); ++i) plane[first + i] = v[i];
}

// Nearest hits.
// hit_triangle  count ints: number among the tree's triangles, or -1
// hit_t_u_v     3 planes of count floats; a miss has t = t_max, u = v = 0
__kernel void intersect_nearest(TREE_PARAMETERS, __global const float* rays, int count,
                                __global int* hit_triangle, __global float* hit_t_u_v) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  if (first >= count) return;
  const Rays r = load_rays(rays, first, count);
  const Tree tree = TREE_OF_PARAMETERS;
  const Hits hits = bvh_nearest(&tree, &r);
  store_ints(hits.triangle, hit_triangle, first, count);
  store_floats(hits.t, hit_t_u_v, first, count);
  store_floats(hits.u, hit_t_u_v + count, first, count);
  store_floats(hits.v, hit_t_u_v + 2 * count, first, count);
}

// occluded: count ints, 1 where anything lies in (t_min, t_max), else 0
__kernel void intersect_any(TREE_PARAMETERS, __global const float* rays, int count,
                            __global int* occluded) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  if (first >= count) return;
  const Rays r = load_rays(rays, first, count);
  const Tree tree = TREE_OF_PARAMETERS;
  const intv mask = bvh_occluded(&tree, &r);
  store_ints(LANES_SELECT((intv)(0), (intv)(1), mask), occluded, first, count);
}
