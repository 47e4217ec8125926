// SPDX-License-Identifier: Apache-2.0
// Fits a flattened tree to the places that its vertices have moved to. Which triangles share a leaf stays.
//
// fit_tree  of the nodes in runs [first_run, first_run + runs), one run per work-item: boxes, and which parts turn away from
//           `eye`. Run r is nodes_of_runs[first_of_run[r]] and on, children before parents; what else lies below them must be fitted.
//
// positions  3 floats per vertex, scene frame, finite
// margin     that boxes are widened by
// surfaces   surfaces[r]: half the surfaces of all boxes of run r, in square metres
// OpenCL C 1.2.
#include "bvh.h"
#include "shared.h"

// Of the terms of a triple product: more than they can round. What is seen edge-on, or is a sliver, does not turn away.
#define ROUNDING 0x1p-20f

typedef struct {
  float3 min, max;
  int away;  // BVH_AWAY or 0
} Fit;

// Whether a triangle shows the eye its inner side. side 0: it has none.
BVH_INLINE bool turns_away(float3 a, float3 b, float3 c, int side, float3 eye) {
  const float3 u = b - a, v = c - a, way = a - eye;
  const float3 one = u.yzx * v.zxy, other = u.zxy * v.yzx;
  return dot(one - other, way) * (float)side > ROUNDING * dot(fabs(one) + fabs(other), fabs(way));
}

BVH_INLINE Fit fit_leaf(__global const Triangle* triangles, __global const float* positions, int first, int count, float margin,
                        float3 eye) {
  Fit fit = {(float3)(INFINITY), (float3)(-INFINITY), BVH_AWAY};
  for (int i = first; i < first + count; ++i) {
    __global const Triangle* t = triangles + i;
    const float3 a = vload3((size_t)t->corner_a, positions), b = vload3((size_t)t->corner_b, positions);
    const float3 c = vload3((size_t)t->corner_c, positions);
    fit.min = min(fit.min, min(a, min(b, c)));
    fit.max = max(fit.max, max(a, max(b, c)));
    if (fit.away && !turns_away(a, b, c, t->side, eye)) fit.away = 0;
  }
  fit.min -= margin;
  fit.max += margin;
  return fit;
}

BVH_INLINE Fit fit_inner(__global const BvhNode* node) {
  const Fit fit = {min(vload3(0, node->left_min), vload3(0, node->right_min)), max(vload3(0, node->left_max), vload3(0, node->right_max)),
                   node->left_child & node->right_child & BVH_AWAY};
  return fit;
}

BVH_INLINE float half_surface(const Fit* fit) {
  const float3 size = fit->max - fit->min;
  return dot(size, size.yzx);
}

BVH_INLINE Fit fit_child(__global const BvhNode* nodes, __global const Triangle* triangles, __global const float* positions, int child,
                         int count, float margin, float3 eye) {
  return count > 0 ? fit_leaf(triangles, positions, child, count, margin, eye) : fit_inner(nodes + child);
}

__kernel void fit_tree(__global BvhNode* nodes, __global const Triangle* triangles, __global const float* positions,
                       __global const int* nodes_of_runs, __global const int* first_of_run, int first_run, int runs, float margin,
                       float eye_x, float eye_y, float eye_z, __global float* surfaces) {
  const int index = (int)get_global_id(0);
  if (index >= runs) return;
  const int run = first_run + index;
  const float3 eye = (float3)(eye_x, eye_y, eye_z);
  float surface = 0.0f;
  for (int i = first_of_run[run]; i < first_of_run[run + 1]; ++i) {
    __global BvhNode* node = nodes + nodes_of_runs[i];
    const int left_child = node->left_child & ~BVH_AWAY, right_child = node->right_child & ~BVH_AWAY;
    const Fit left = fit_child(nodes, triangles, positions, left_child, node->left_count, margin, eye);
    vstore3(left.min, 0, node->left_min);
    node->left_child = left_child | left.away;
    vstore3(left.max, 0, node->left_max);
    surface += half_surface(&left);
    if (node->right_min[0] > node->right_max[0]) continue;  // a tree of one leaf
    const Fit right = fit_child(nodes, triangles, positions, right_child, node->right_count, margin, eye);
    vstore3(right.min, 0, node->right_min);
    node->right_child = right_child | right.away;
    vstore3(right.max, 0, node->right_max);
    surface += half_surface(&right);
  }
  surfaces[run] = surface;
}
