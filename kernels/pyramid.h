// SPDX-License-Identifier: Apache-2.0
// Does anything stand in a pyramid of directions? Asked once for many rays from one point: all of a sample's rays to the hologram, or to a
// tile.
#ifndef RAYWAVE_PYRAMID_H
#define RAYWAVE_PYRAMID_H

#include "bvh.h"
#include "shared.h"

// The directions (u, v, -1) with u in [left, right] and v in [lower, upper], from a point of a surface.
typedef struct {
  float3 apex;
  float left, right, lower, upper;
  float3 surface;  // normal of the surface at the apex, on the pyramid's side
} Pyramid;

#define PYRAMID_CLEAR 0   // no triangle stands in it
#define PYRAMID_MIXED 1   // some may
#define PYRAMID_CLOSED 2  // one triangle, or a patch of triangles, fills it

static inline float3 corner_of(__global const float* p) { return (float3)(p[0], p[1], p[2]); }

static inline float3 triangle_normal(__global const Triangle* t) {
  return normalize(cross(corner_of(t->b) - corner_of(t->a), corner_of(t->c) - corner_of(t->a)));
}

static inline bool triangle_fills(__global const Triangle* t, const Pyramid* pyramid) {
  const float3 a = corner_of(t->a) - pyramid->apex, b = corner_of(t->b) - pyramid->apex, c = corner_of(t->c) - pyramid->apex;
  if (fmax(fmax(a.z, b.z), c.z) >= 0.0f) return false;
  const float3 sides[3] = {cross(b, c), cross(c, a), cross(a, b)};
  float lowest = INFINITY, highest = -INFINITY;
  for (int i = 0; i < 3; ++i) {
    const float x0 = sides[i].x * pyramid->left, x1 = sides[i].x * pyramid->right;
    const float y0 = sides[i].y * pyramid->lower, y1 = sides[i].y * pyramid->upper;
    lowest = fmin(lowest, fmin(x0, x1) + fmin(y0, y1) - sides[i].z);
    highest = fmax(highest, fmax(x0, x1) + fmax(y0, y1) - sides[i].z);
  }
  return lowest > 0.0f || highest < 0.0f;
}

// Separating planes decide, so MIXED may be said of a clear pyramid, never CLEAR of one that something enters by more than `slack`.
// found counts the triangles that may stand in a MIXED pyramid; the first `capacity` of them go to `list`.
static inline int pyramid_state(__global const BvhNode* nodes, __global const Triangle* triangles, const Pyramid* pyramid, float slack,
                                int* list, int capacity, int* found) {
  // Outward normals of the sides, of the plane through the apex, and of the surface where the whole pyramid stands before it.
  const float3 n = pyramid->surface;
  const float3 planes[6] = {(float3)(1.0f, 0.0f, pyramid->right), (float3)(-1.0f, 0.0f, -pyramid->left),
                            (float3)(0.0f, 1.0f, pyramid->upper), (float3)(0.0f, -1.0f, -pyramid->lower),
                            (float3)(0.0f, 0.0f, 1.0f),           -n};
  const float lowest = fmin(n.x * pyramid->right, n.x * pyramid->left) + fmin(n.y * pyramid->upper, n.y * pyramid->lower) - n.z;
  const int plane_count = lowest > 0.0f ? 6 : 5;
  const float3 p = pyramid->apex;

  int stack[RAYWAVE_BVH_DEPTH];
  int waiting = 0, node_index = 0, state = PYRAMID_CLEAR;
  *found = 0;
  for (;;) {
    __global const BvhNode* node = nodes + node_index;
    int next = -1;
    for (int side = 0; side < 2; ++side) {
      __global const float* lo = side ? node->right_min : node->left_min;
      __global const float* hi = side ? node->right_max : node->left_max;
      bool apart = lo[0] > hi[0];  // an empty child
      for (int i = 0; i < plane_count && !apart; ++i) {
        // The box's corner that reaches farthest inwards decides.
        const float3 q = planes[i];
        const float x = (q.x > 0.0f ? lo[0] : hi[0]) - p.x, y = (q.y > 0.0f ? lo[1] : hi[1]) - p.y, z = (q.z > 0.0f ? lo[2] : hi[2]) - p.z;
        apart = q.x * x + q.y * y + q.z * z >= -slack;
      }
      if (apart) continue;
      const int child = side ? node->right_child : node->left_child;
      const int count = side ? node->right_count : node->left_count;
      if (count == 0) {
        if (next >= 0) stack[waiting++] = next;
        next = child;
        continue;
      }
      for (int t = child; t < child + count; ++t) {
        const float3 a = corner_of(triangles[t].a) - p, b = corner_of(triangles[t].b) - p, c = corner_of(triangles[t].c) - p;
        bool clear = false;
        for (int i = 0; i < plane_count && !clear; ++i)
          clear = fmin(fmin(dot(planes[i], a), dot(planes[i], b)), dot(planes[i], c)) >= -slack;
        if (clear) continue;
        if (triangle_fills(triangles + t, pyramid)) return PYRAMID_CLOSED;
        state = PYRAMID_MIXED;
        if (*found < capacity) list[*found] = t;
        ++*found;
      }
    }
    if (next < 0) {
      if (waiting == 0) return state;
      next = stack[--waiting];
    }
    node_index = next;
  }
}

static inline bool same_corner(__global const float* p, __global const float* q) { return p[0] == q[0] && p[1] == q[1] && p[2] == q[2]; }

static inline __global const float* corner_number(__global const Triangle* t, int i) {
  return i % 3 == 0 ? t->a : i % 3 == 1 ? t->b : t->c;
}

// Whether the triangles that may stand in a pyramid fill it together. Going over its directions, one leaves a triangle only across an edge:
// when behind every edge that may cross the pyramid another triangle goes on, and one direction is covered, all are.
static inline bool patch_fills(__global const Triangle* triangles, const int* list, int count, const Pyramid* pyramid) {
  const float3 p = pyramid->apex;
  const float3 planes[4] = {(float3)(1.0f, 0.0f, pyramid->right), (float3)(-1.0f, 0.0f, -pyramid->left),
                            (float3)(0.0f, 1.0f, pyramid->upper), (float3)(0.0f, -1.0f, -pyramid->lower)};
  const Pyramid middle = {p,
                          0.5f * (pyramid->left + pyramid->right),
                          0.5f * (pyramid->left + pyramid->right),
                          0.5f * (pyramid->lower + pyramid->upper),
                          0.5f * (pyramid->lower + pyramid->upper),
                          pyramid->surface};
  bool covered = false;
  for (int i = 0; i < count; ++i) {
    __global const Triangle* t = triangles + list[i];
    if (fmax(fmax(t->a[2], t->b[2]), t->c[2]) >= p.z) return false;
    covered = covered || triangle_fills(t, &middle);
    for (int e = 0; e < 3; ++e) {
      __global const float* from = corner_number(t, e);
      __global const float* to = corner_number(t, e + 1);
      const float3 a = corner_of(from) - p, b = corner_of(to) - p;
      bool apart = false;
      for (int k = 0; k < 4; ++k) apart = apart || (dot(planes[k], a) > 0.0f && dot(planes[k], b) > 0.0f);
      if (apart) continue;
      const float3 side = cross(a, b);
      const float own = dot(side, corner_of(corner_number(t, e + 2)) - p);
      bool goes_on = false;
      for (int j = 0; j < count && !goes_on; ++j) {
        __global const Triangle* other = triangles + list[j];
        for (int f = 0; f < 3 && j != i && !goes_on; ++f) {
          __global const float* c = corner_number(other, f);
          __global const float* d = corner_number(other, f + 1);
          if (!(same_corner(c, to) && same_corner(d, from)) && !(same_corner(c, from) && same_corner(d, to))) continue;
          goes_on = own * dot(side, corner_of(corner_number(other, f + 2)) - p) < 0.0f;
        }
      }
      if (!goes_on) return false;
    }
  }
  return covered;
}

// Triangles that may stand in a pyramid are kept up to this many.
#define OBSTACLES 16

typedef struct {
  int state;  // PYRAMID_...
  int count;
  int triangles[OBSTACLES];
} Obstacles;

// What stands in a pyramid; patches of triangles that fill it are found when they are no more than OBSTACLES.
static inline Obstacles obstacles_in(__global const BvhNode* nodes, __global const Triangle* triangles, const Pyramid* pyramid,
                                     float slack) {
  Obstacles o;
  o.state = pyramid_state(nodes, triangles, pyramid, slack, o.triangles, OBSTACLES, &o.count);
  if (o.state == PYRAMID_MIXED && o.count <= OBSTACLES && patch_fills(triangles, o.triangles, o.count, pyramid)) o.state = PYRAMID_CLOSED;
  return o;
}

#endif
