// SPDX-License-Identifier: Apache-2.0
// Fits a flattened tree to the places that its vertices have moved to. Which triangles share a leaf stays.
//
// fit_tree  of the nodes in runs [first_run, first_run + runs), one run per work-item: triangles, boxes, and which parts turn away from
//           `eye`. Run r is the nodes order[first_of_run[r]] and on, children before parents; what else lies below them must be fitted.
//
// places    3 floats per vertex, scene frame; infinite or NaN nowhere
// margin    that boxes are widened by
// surfaces  surfaces[r]: half the surfaces of all boxes of run r, in square metres
// OpenCL C 1.2.
#include "bvh.h"
#include "shared.h"

typedef struct {
  float min[3], max[3];
  int away;  // BVH_AWAY or 0
} Fit;

// Sixteen roundings of a triple product of lengths: what is seen edge-on, or is a sliver, does not turn away.
#define EDGE_ON 0x1p-20f

static inline Fit fit_leaf(__global Triangle* triangles, __global const TriangleShading* shading, __global const float* places, int first,
                           int count, float margin, const float* eye) {
  Fit fit = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, BVH_AWAY};
  for (int i = first; i < first + count; ++i) {
    __global const float* a = places + 3 * (size_t)shading[i].corner_a;
    __global const float* b = places + 3 * (size_t)shading[i].corner_b;
    __global const float* c = places + 3 * (size_t)shading[i].corner_c;
    const float side = (float)shading[i].side;
    Triangle t;
    for (int axis = 0; axis < 3; ++axis) {
      t.a[axis] = a[axis];
      t.b[axis] = b[axis];
      t.c[axis] = c[axis];
      fit.min[axis] = fmin(fit.min[axis], bvh_min3(t.a[axis], t.b[axis], t.c[axis]));
      fit.max[axis] = fmax(fit.max[axis], -bvh_min3(-t.a[axis], -t.b[axis], -t.c[axis]));
    }
    triangles[i] = t;
    const float ux = t.b[0] - t.a[0], uy = t.b[1] - t.a[1], uz = t.b[2] - t.a[2];
    const float vx = t.c[0] - t.a[0], vy = t.c[1] - t.a[1], vz = t.c[2] - t.a[2];
    const float nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    const float wx = t.a[0] - eye[0], wy = t.a[1] - eye[1], wz = t.a[2] - eye[2];
    const float room = EDGE_ON * (fabs(ux) + fabs(uy) + fabs(uz)) * (fabs(vx) + fabs(vy) + fabs(vz)) * (fabs(wx) + fabs(wy) + fabs(wz));
    if (!((nx * wx + ny * wy + nz * wz) * side > room)) fit.away = 0;
  }
  for (int axis = 0; axis < 3; ++axis) {
    fit.min[axis] -= margin;
    fit.max[axis] += margin;
  }
  return fit;
}

static inline Fit fit_inner(__global const BvhNode* node) {
  Fit fit;
  for (int axis = 0; axis < 3; ++axis) {
    fit.min[axis] = fmin(node->left_min[axis], node->right_min[axis]);
    fit.max[axis] = fmax(node->left_max[axis], node->right_max[axis]);
  }
  fit.away = node->left_child & node->right_child & BVH_AWAY;
  return fit;
}

static inline float half_surface(const Fit* fit) {
  const float x = fit->max[0] - fit->min[0], y = fit->max[1] - fit->min[1], z = fit->max[2] - fit->min[2];
  return x * y + y * z + z * x;
}

__kernel void fit_tree(__global BvhNode* nodes, __global Triangle* triangles, __global const TriangleShading* shading,
                       __global const float* places, __global const int* order, __global const int* first_of_run, int first_run, int runs,
                       float margin, float eye_x, float eye_y, float eye_z, __global float* surfaces) {
  const int index = (int)get_global_id(0);
  if (index >= runs) return;
  const int run = first_run + index;
  const float eye[3] = {eye_x, eye_y, eye_z};
  float surface = 0.0f;
  for (int i = first_of_run[run]; i < first_of_run[run + 1]; ++i) {
    __global BvhNode* node = nodes + order[i];
    const int left = node->left_child & ~BVH_AWAY, right = node->right_child & ~BVH_AWAY;
    const Fit fit =
        node->left_count > 0 ? fit_leaf(triangles, shading, places, left, node->left_count, margin, eye) : fit_inner(nodes + left);
    for (int axis = 0; axis < 3; ++axis) {
      node->left_min[axis] = fit.min[axis];
      node->left_max[axis] = fit.max[axis];
    }
    node->left_child = left | fit.away;
    surface += half_surface(&fit);
    if (node->right_min[0] > node->right_max[0]) continue;  // a tree of one leaf
    const Fit other =
        node->right_count > 0 ? fit_leaf(triangles, shading, places, right, node->right_count, margin, eye) : fit_inner(nodes + right);
    for (int axis = 0; axis < 3; ++axis) {
      node->right_min[axis] = other.min[axis];
      node->right_max[axis] = other.max[axis];
    }
    node->right_child = right | other.away;
    surface += half_surface(&other);
  }
  surfaces[run] = surface;
}
