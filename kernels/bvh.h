// SPDX-License-Identifier: Apache-2.0
// Rays against the flattened tree of host/bvh.hpp: RAYWAVE_LANES rays travel together through one shared traversal. OpenCL C 1.2.
//
// Watertight: every test below is widened by a bound on its own rounding, so a ray that meets a triangle in exact arithmetic (of the float
// corners) meets it here, contracted to fma or not. A ray within that bound of a triangle's edge, about 1e-6 of the distances and
// coordinates at hand, may meet it as well. Both sides of a triangle are hit. A hit's distance stays within the triangle's own range.
#ifndef RAYWAVE_BVH_H
#define RAYWAVE_BVH_H

#include "lanes.h"
#include "shared.h"

#ifndef RAYWAVE_BVH_DEPTH
#define RAYWAVE_BVH_DEPTH 64  // nodes from the root to a leaf; the host passes Bvh::depth
#endif

// Points origin + t direction with t_min < t < t_max, scene frame. Directions are finite and not zero, but need not be unit vectors.
// Lanes outside the mask `active` meet nothing.
typedef struct {
  floatv ox, oy, oz;
  floatv dx, dy, dz;
  floatv t_min, t_max;
  intv active;
} Rays;

// Nearest hits. A miss has triangle -1, t = t_max and u = v = 0. The hit point is (1 - u - v) a + u b + v c.
typedef struct {
  floatv t;
  intv triangle;
  floatv u, v;
} Hits;

static inline floatv bvh_min(floatv a, floatv b) { return LANES_SELECT(b, a, a < b); }
static inline floatv bvh_max(floatv a, floatv b) { return LANES_SELECT(b, a, a > b); }

static inline floatv bvh_reciprocal(floatv d) {
  const floatv tiny = 1e-25f;  // no more than moves a ray within the margin of the boxes, and 1 / tiny times any length is finite
  return 1.0f / LANES_SELECT(d, tiny, fabs(d) < tiny);
}

// Mask of the rays in the box, and the distances at which they are in it, cut to [near, far].
static inline intv bvh_box(__global const float* box_min, __global const float* box_max, const Rays* rays, const Rays* inverse, floatv far_in,
                           floatv* near, floatv* far) {
  const floatv x0 = (box_min[0] - rays->ox) * inverse->dx, x1 = (box_max[0] - rays->ox) * inverse->dx;
  const floatv y0 = (box_min[1] - rays->oy) * inverse->dy, y1 = (box_max[1] - rays->oy) * inverse->dy;
  const floatv z0 = (box_min[2] - rays->oz) * inverse->dz, z1 = (box_max[2] - rays->oz) * inverse->dz;
  const floatv enter = bvh_max(bvh_max(bvh_min(x0, x1), bvh_min(y0, y1)), bvh_min(z0, z1));
  const floatv leave = bvh_min(bvh_min(bvh_max(x0, x1), bvh_max(y0, y1)), bvh_max(z0, z1));
  *near = bvh_max(enter, rays->t_min);
  // Each plane's distance has a relative error of at most 3 * 2^-24: widen by twice that.
  *far = bvh_min(leave * 1.0000008f, far_in);
  return rays->active & (*near <= *far);
}

// d . ((q - p) x (p' + q')) for the edge from p to q, where ' is relative to the ray's origin: twice the volume that edge and ray span.
static inline floatv bvh_edge(const Rays* r, const float* p, const float* q, floatv sx, floatv sy, floatv sz, floatv scale, floatv* margin) {
  const float ex = q[0] - p[0], ey = q[1] - p[1], ez = q[2] - p[2];
  *margin = scale * (fabs(ex) + fabs(ey) + fabs(ez));
  return r->dx * (ey * sz - ez * sy) + r->dy * (ez * sx - ex * sz) + r->dz * (ex * sy - ey * sx);
}

Hits bvh_nearest(__global const BvhNode* nodes, __global const Triangle* triangles, const Rays* rays);
intv bvh_occluded(__global const BvhNode* nodes, __global const Triangle* triangles, const Rays* rays);  // any hit in (t_min, t_max)

#endif
