// SPDX-License-Identifier: Apache-2.0
// Rays against the flattened trees of host/geometry/bvh.hpp: RAYWAVE_LANES rays travel together
// through one shared traversal. OpenCL C 1.2.
//
// Each instance has a tree in its own frame. Rays are turned into that frame, so that a moving
// instance needs no new tree. A small tree over the boxes of all instances, in the scene frame,
// tells which instances a ray may meet; it is made anew for every pose.
//
// Watertight: every test is widened by a bound on its own rounding error. A ray that meets a
// triangle in exact arithmetic (with the float corners) therefore meets it here, whether or not the
// compiler contracts to fma. A ray that passes an edge within that bound, about 1e-6 of the
// distance, may meet the triangle as well. Both sides of a triangle are hit. A hit lies on the
// triangle and in its box. Error of a hit's distance, rms: 0.15 nm at 5 mm, 4 nm at 100 mm, 30 nm
// at 1 m (tests/geometry/bvh.cpp), about twice a float's resolution.
#ifndef RAYWAVE_BVH_H
#define RAYWAVE_BVH_H

#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/arrays.h"
#include "kernels/scene/look.h"
#include "kernels/scene/normal_cones.h"
#include "kernels/scene/options.h"

// The corners of a triangle, 3 floats each, frame of its instance.
typedef struct {
  __global const float *a, *b, *c;
} Corners;

// Points origin + t direction with 0 <= t_min < t < t_max, in the scene frame or an instance's.
// Directions are finite and not zero, but need not be unit vectors. Lanes outside the mask `active`
// meet nothing.
typedef struct {
  floatv ox, oy, oz;
  floatv dx, dy, dz;
  floatv t_min, t_max;
  intv active;
} Rays;

// Nearest hits. A miss has triangle -1, t = t_max and u = v = 0. The hit point is (1 - u - v) a + u
// b + v c.
typedef struct {
  floatv t;
  intv triangle;
  floatv u, v;
} Hits;

// The nearest hits of each ray, near to far. Unused places have triangle -1 and t = t_max.
#define BVH_LAYERS 8
typedef struct {
  floatv t[BVH_LAYERS];
  intv triangle[BVH_LAYERS];
  floatv u[BVH_LAYERS], v[BVH_LAYERS];
} Layers;

// Inlining keeps the rays in registers; PoCL would keep them in memory.
#define BVH_INLINE static inline __attribute__((always_inline))

BVH_INLINE Corners corners_of(const Tree* tree, int index) {
  __global const Triangle* t = tree->triangles + index;
  const Corners corners = {tree->positions + 3 * (size_t)t->corner_a,
                           tree->positions + 3 * (size_t)t->corner_b,
                           tree->positions + 3 * (size_t)t->corner_c};
  return corners;
}

// row . (v + low), rounded once.
BVH_INLINE floatv bvh_turned(__global const float* row, __global const float* row_low,
                             const floatv* v, const floatv* low) {
#pragma OPENCL FP_CONTRACT OFF
  floatv sum = row[0] * v[0], rest = fma((floatv)(row[0]), v[0], -sum);
  for (int i = 1; i < 3; ++i) {
    const floatv product = row[i] * v[i], next = sum + product, part = next - sum;
    rest += fma((floatv)(row[i]), v[i], -product) + ((sum - (next - part)) + (product - part));
    sum = next;
  }
  for (int i = 0; i < 3; ++i) rest += row[i] * low[i] + row_low[i] * v[i];
  return sum + rest;
}

// Rays of the scene in the frame of an instance. Distances along them do not change. With `exact`
// their origins are rounded once, which moves hits by no more than the rounding of the corners
// does.
BVH_INLINE Rays rays_of_instance(__global const Instance* instance, const Rays* rays, bool exact) {
#pragma OPENCL FP_CONTRACT OFF
  Rays turned = *rays;
  if (!instance->moved) return turned;
  __global const float* m = instance->inward;
  turned.dx = m[0] * rays->dx + m[1] * rays->dy + m[2] * rays->dz;
  turned.dy = m[3] * rays->dx + m[4] * rays->dy + m[5] * rays->dz;
  turned.dz = m[6] * rays->dx + m[7] * rays->dy + m[8] * rays->dz;
  const floatv from[3] = {rays->ox, rays->oy, rays->oz};
  floatv off[3], low[3];
  for (int axis = 0; axis < 3; ++axis) {
    const floatv centre = instance->centre[axis];
    off[axis] = from[axis] - centre;
    const floatv part = off[axis] - from[axis];
    low[axis] = ((from[axis] - (off[axis] - part)) - (centre + part)) - instance->centre_low[axis];
  }
  if (exact) {
    turned.ox = bvh_turned(m, instance->inward_low, off, low);
    turned.oy = bvh_turned(m + 3, instance->inward_low + 3, off, low);
    turned.oz = bvh_turned(m + 6, instance->inward_low + 6, off, low);
  } else {
    turned.ox = m[0] * off[0] + m[1] * off[1] + m[2] * off[2];
    turned.oy = m[3] * off[0] + m[4] * off[1] + m[5] * off[2];
    turned.oz = m[6] * off[0] + m[7] * off[1] + m[8] * off[2];
  }
  return turned;
}

// A direction of a triangle's instance in the scene, scaled as the instance is.
BVH_INLINE float3 direction_in_scene(const Tree* tree, int triangle, float3 d) {
  __global const Instance* instance = tree->instances + tree->triangles[triangle].instance;
  if (!instance->moved) return d;
  __global const float* m = instance->outward;
  return (float3)(m[0] * d.x + m[1] * d.y + m[2] * d.z, m[3] * d.x + m[4] * d.y + m[5] * d.z,
                  m[6] * d.x + m[7] * d.y + m[8] * d.z);
}

BVH_INLINE floatv bvh_min(floatv a, floatv b) { return LANES_SELECT(b, a, a < b); }
BVH_INLINE floatv bvh_max(floatv a, floatv b) { return LANES_SELECT(b, a, a > b); }

// 1 / d, with zero replaced by a tiny number. This moves a ray by less than the margin of the
// tree's boxes, and 1 / tiny times any length is finite.
BVH_INLINE floatv bvh_reciprocal(floatv d) {
  const floatv tiny = 1e-25f;
  return 1.0f / LANES_SELECT(d, tiny, fabs(d) < tiny);
}

// Mask of the rays that meet a box after t_min. *enter: the distances at which they enter it.
BVH_INLINE intv bvh_box(float min_x, float min_y, float min_z, float max_x, float max_y,
                        float max_z, const Rays* rays, const floatv* inverse, floatv* enter) {
  const floatv x0 = (min_x - rays->ox) * inverse[0], x1 = (max_x - rays->ox) * inverse[0];
  const floatv y0 = (min_y - rays->oy) * inverse[1], y1 = (max_y - rays->oy) * inverse[1];
  const floatv z0 = (min_z - rays->oz) * inverse[2], z1 = (max_z - rays->oz) * inverse[2];
  *enter =
      bvh_max(bvh_max(bvh_max(bvh_min(x0, x1), bvh_min(y0, y1)), bvh_min(z0, z1)), rays->t_min);
  // Each distance has a relative error of at most 3 * 2^-24; the interval is widened by twice the
  // error of two distances.
  const floatv leave =
      bvh_min(bvh_min(bvh_max(x0, x1), bvh_max(y0, y1)), bvh_max(z0, z1)) * (1.0f + 0xcp-24f);
  return *enter <= leave;
}

// Side of the edge from p to q on which the rays pass: d . ((q - p) x (p' + q')), where ' means
// relative to the ray's origin. Differences of the corners come first, so that the rounding error
// scales with the edge's length times its distance, not with its distance squared.
BVH_INLINE floatv bvh_side(__global const float* p, __global const float* q, const Rays* r) {
  const float ex = q[0] - p[0], ey = q[1] - p[1], ez = q[2] - p[2];
  const floatv sx = (p[0] - r->ox) + (q[0] - r->ox);
  const floatv sy = (p[1] - r->oy) + (q[1] - r->oy);
  const floatv sz = (p[2] - r->oz) + (q[2] - r->oz);
  return r->dx * (ey * sz - ez * sy) + r->dy * (ez * sx - ex * sz) + r->dz * (ex * sy - ey * sx);
}

BVH_INLINE float bvh_norm1(__global const float* p, __global const float* q) {
  return fabs(q[0] - p[0]) + fabs(q[1] - p[1]) + fabs(q[2] - p[2]);
}

// One coordinate of the point with weights u and v, relative to the ray's origin o.
BVH_INLINE floatv bvh_blend(float a, float b, float c, floatv u, floatv v, floatv o) {
  return (a - o) + (u * (b - a) + v * (c - a));
}

BVH_INLINE float bvh_min3(float a, float b, float c) {
  const float ab = a < b ? a : b;
  return ab < c ? ab : c;
}

// Mask of the rays that meet the triangle's own box, widened like the boxes of the tree.
BVH_INLINE intv bvh_box_of(const Corners* t, const Rays* rays, const floatv* inverse) {
  const float min_x = bvh_min3(t->a[0], t->b[0], t->c[0]),
              max_x = -bvh_min3(-t->a[0], -t->b[0], -t->c[0]);
  const float min_y = bvh_min3(t->a[1], t->b[1], t->c[1]),
              max_y = -bvh_min3(-t->a[1], -t->b[1], -t->c[1]);
  const float min_z = bvh_min3(t->a[2], t->b[2], t->c[2]),
              max_z = -bvh_min3(-t->a[2], -t->b[2], -t->c[2]);
  const float margin = 0x1p-22f * (fabs(min_x) + fabs(max_x) + fabs(min_y) + fabs(max_y) +
                                   fabs(min_z) + fabs(max_z));
  floatv enter;
  return bvh_box(min_x - margin, min_y - margin, min_z - margin, max_x + margin, max_y + margin,
                 max_z + margin, rays, inverse, &enter);
}

// Mask of the rays that meet the triangle in (t_min, best->t); `best` takes the hits of those
// lanes.
BVH_INLINE intv bvh_triangle(const Tree* tree, int index, const Rays* rays, const floatv* inverse,
                             Hits* best) {
  const Corners corners = corners_of(tree, index), *t = &corners;
  const floatv side_a = bvh_side(t->b, t->c, rays);
  const floatv side_b = bvh_side(t->c, t->a, rays);
  const floatv side_c = bvh_side(t->a, t->b, rays);
  const floatv volume = side_a + side_b + side_c;

  // Rounding error of a side: |error| <= 8 * 2^-24 |d|_max |q - p|_1 (|p'|_1 + |q'|_1) to first
  // order; 10 leaves room for the rest. No corner is farther from the origin than corner a plus the
  // perimeter.
  const float length_a = bvh_norm1(t->b, t->c), length_b = bvh_norm1(t->c, t->a),
              length_c = bvh_norm1(t->a, t->b);
  const floatv reach = fabs(t->a[0] - rays->ox) + fabs(t->a[1] - rays->oy) +
                       fabs(t->a[2] - rays->oz) + (length_a + length_b + length_c);
  const floatv d_max = bvh_max(bvh_max(fabs(rays->dx), fabs(rays->dy)), fabs(rays->dz));
  const floatv bound = 2.0f * 0xap-24f * d_max * reach;
  const floatv bound_a = bound * length_a, bound_b = bound * length_b, bound_c = bound * length_c;
  const intv front = (side_a >= -bound_a) & (side_b >= -bound_b) & (side_c >= -bound_c);
  const intv back = (side_a <= bound_a) & (side_b <= bound_b) & (side_c <= bound_c);
  intv hit = rays->active & (front | back) & (volume != 0.0f);
  if (!LANES_ANY(hit)) return hit;

  // On slivers, and on triangles seen edge-on, rounding alone decides. The weights may then be
  // anything, so they are clamped to keep the point on the triangle. The widened sides also reach
  // far beyond a sharp corner, so the ray must meet the triangle's box.
  const intv clear = ((side_a > bound_a) & (side_b > bound_b) & (side_c > bound_c)) |
                     ((side_a < -bound_a) & (side_b < -bound_b) & (side_c < -bound_c));
  if (LANES_ANY(hit & !clear)) hit &= clear | bvh_box_of(t, rays, inverse);
  const floatv zero = 0.0f, one = 1.0f;
  const floatv u = bvh_min(bvh_max(side_b / volume, zero), one);
  const floatv v = bvh_min(bvh_max(side_c / volume, zero), 1.0f - u);
  // Distance of the point along the ray, plus the distance of the remaining difference between the
  // point and the ray there. The first term carries the rounding of sums and quotient; the second
  // one corrects it.
  const floatv x = bvh_blend(t->a[0], t->b[0], t->c[0], u, v, rays->ox);
  const floatv y = bvh_blend(t->a[1], t->b[1], t->c[1], u, v, rays->oy);
  const floatv z = bvh_blend(t->a[2], t->b[2], t->c[2], u, v, rays->oz);
  const floatv squared = rays->dx * rays->dx + rays->dy * rays->dy + rays->dz * rays->dz;
  const floatv rough = (x * rays->dx + y * rays->dy + z * rays->dz) / squared;
  const floatv rest_x = fma(-rough, rays->dx, x), rest_y = fma(-rough, rays->dy, y),
               rest_z = fma(-rough, rays->dz, z);
  const floatv distance =
      rough + (rest_x * rays->dx + rest_y * rays->dy + rest_z * rays->dz) / squared;
  hit &= (distance > rays->t_min) & (distance < best->t);
#if RAYWAVE_ALPHA
  if (LANES_ANY(hit)) hit = is_there(tree, index, u, v, hit);
#endif
  best->t = LANES_SELECT(best->t, distance, hit);
  best->triangle = LANES_SELECT(best->triangle, (intv)(index), hit);
  best->u = LANES_SELECT(best->u, u, hit);
  best->v = LANES_SELECT(best->v, v, hit);
  return hit;
}

BVH_INLINE intv bvh_leaf(const Tree* tree, int first, int count, const Rays* rays,
                         const floatv* inverse, Hits* best) {
  intv hit = 0;
  for (int i = first; i < first + count; ++i) hit |= bvh_triangle(tree, i, rays, inverse, best);
  return hit;
}

// Sorts the hits of one triangle into the layers; the farthest hits beyond BVH_LAYERS are dropped.
BVH_INLINE void bvh_insert(Layers* layers, const Hits* hits, intv hit) {
  floatv t = hits->t, u = hits->u, v = hits->v;
  intv triangle = hits->triangle;
  for (int i = 0; i < BVH_LAYERS; ++i) {
    const intv nearer = hit & (t < layers->t[i]);
    const floatv old_t = layers->t[i], old_u = layers->u[i], old_v = layers->v[i];
    const intv old_triangle = layers->triangle[i];
    layers->t[i] = LANES_SELECT(old_t, t, nearer);
    layers->triangle[i] = LANES_SELECT(old_triangle, triangle, nearer);
    layers->u[i] = LANES_SELECT(old_u, u, nearer);
    layers->v[i] = LANES_SELECT(old_v, v, nearer);
    hit &= !nearer | (old_triangle >= 0);
    if (!LANES_ANY(hit)) return;  // all places behind are empty
    t = LANES_SELECT(t, old_t, nearer);
    triangle = LANES_SELECT(triangle, old_triangle, nearer);
    u = LANES_SELECT(u, old_u, nearer);
    v = LANES_SELECT(v, old_v, nearer);
  }
}

BVH_INLINE intv bvh_leaf_layers(const Tree* tree, int first, int count, const Rays* rays,
                                const floatv* inverse, Hits* farthest, Layers* layers) {
  for (int i = first; i < first + count; ++i) {
    Hits one = *farthest;
    const intv hit = bvh_triangle(tree, i, rays, inverse, &one);
    if (LANES_ANY(hit)) bvh_insert(layers, &one, hit);
    farthest->t = layers->t[BVH_LAYERS - 1];
  }
  return 0;
}

// Normal-cone culling: true when every triangle in this cone faces away from the hologram's centre,
// wherever it lies in the instance.
BVH_INLINE bool bvh_turns_away(int normal_cone, __global const Instance* instance) {
  const int spread = normal_cone_spread(normal_cone);
  const int along = normal_cone_axis(normal_cone, 0) * instance->view[0] +
                    normal_cone_axis(normal_cone, 1) * instance->view[1] +
                    normal_cone_axis(normal_cone, 2) * instance->view[2];
  return spread > 0 && 2 * along > VIEW_STEPS * spread + instance->view_margin;
}

// Mask of the rays that meet a child's box before `farthest`; with `culls`, empty where the child
// is culled by its normal cone.
BVH_INLINE intv bvh_child(__global const float* box_min, __global const float* box_max,
                          int normal_cone, const Rays* rays, const floatv* inverse, floatv farthest,
                          __global const Instance* instance, bool culls, floatv* enter) {
  if (culls && bvh_turns_away(normal_cone, instance)) return 0;
  const intv meets = bvh_box(box_min[0], box_min[1], box_min[2], box_max[0], box_max[1], box_max[2],
                             rays, inverse, enter);
  return rays->active & meets & (*enter < farthest);
}

// Nearest hits of all rays with an instance, in its frame. any_hit: rays that have met something
// stop. layers: receives the nearest BVH_LAYERS hits of each ray. culls: subtrees that face away
// from the hologram's centre are skipped.
BVH_INLINE void bvh_traverse_instance(const Tree* tree, __global const Instance* instance,
                                      Rays* rays, bool any_hit, bool culls, Hits* best,
                                      Layers* layers) {
  const floatv inverse[3] = {bvh_reciprocal(rays->dx), bvh_reciprocal(rays->dy),
                             bvh_reciprocal(rays->dz)};
  // Children still to be visited. Only a node with two inner children pushes, and it pushes one of
  // them. The stack therefore holds at most one child of each node on the path from the root: fewer
  // than Bvh::depth.
  int waiting_node[RAYWAVE_BVH_DEPTH];
  floatv waiting_enter[RAYWAVE_BVH_DEPTH];
  int waiting = 0;
  int place = instance->root;
  for (;;) {
    __global const BvhNode* node = tree->nodes + place;
    floatv enter_left = 0.0f, enter_right = 0.0f;
    const intv in_left = bvh_child(node->left_min, node->left_max, node->left_count, rays, inverse,
                                   best->t, instance, culls, &enter_left);
    bool left = LANES_ANY(in_left);
    if (left && BVH_COUNT(node->left_count) > 0) {
      const intv hit = layers ? bvh_leaf_layers(tree, node->left_child, BVH_COUNT(node->left_count),
                                                rays, inverse, best, layers)
                              : bvh_leaf(tree, node->left_child, BVH_COUNT(node->left_count), rays,
                                         inverse, best);
      if (any_hit) rays->active &= !hit;
      left = false;
    }
    const intv in_right = bvh_child(node->right_min, node->right_max, node->right_count, rays,
                                    inverse, best->t, instance, culls, &enter_right);
    bool right = LANES_ANY(in_right);
    if (right && BVH_COUNT(node->right_count) > 0) {
      const intv hit = layers
                           ? bvh_leaf_layers(tree, node->right_child, BVH_COUNT(node->right_count),
                                             rays, inverse, best, layers)
                           : bvh_leaf(tree, node->right_child, BVH_COUNT(node->right_count), rays,
                                      inverse, best);
      if (any_hit) rays->active &= !hit;
      right = false;
    }
    if (left && right) {
      // Nearest first. The rays of a packet rarely disagree; where they do, the order costs time
      // only.
      const bool left_first = LANES_ANY(in_left & in_right & (enter_left < enter_right));
      waiting_node[waiting] = left_first ? node->right_child : node->left_child;
      waiting_enter[waiting] = left_first ? enter_right : enter_left;
      ++waiting;
      place = left_first ? node->left_child : node->right_child;
    } else if (left || right) {
      place = left ? node->left_child : node->right_child;
    } else {
      do {
        if (waiting == 0) return;
        --waiting;
      } while (!LANES_ANY(rays->active & (waiting_enter[waiting] < best->t)));
      place = waiting_node[waiting];
    }
  }
}

// The tree over instances is balanced: it has at most 31 nodes from the root to a leaf, of which
// each leaves one child waiting, and the last one two.
#define BVH_TOP_STACK 32

// Nearest hits with all instances, in the scene frame; any_hit, culls and layers as above.
BVH_INLINE Hits bvh_traverse(const Tree* tree, const Rays* rays, bool any_hit, bool culls,
                             Layers* layers) {
  Hits best;
  best.t = rays->t_max;
  best.triangle = -1;
  best.u = 0.0f;
  best.v = 0.0f;
  Rays left = *rays;  // its mask: rays that go on
  const floatv inverse[3] = {bvh_reciprocal(rays->dx), bvh_reciprocal(rays->dy),
                             bvh_reciprocal(rays->dz)};
  // Waiting nodes of the tree over instances, and ~i for instance i
  int waiting_place[BVH_TOP_STACK];
  floatv waiting_enter[BVH_TOP_STACK];
  int waiting = 0;
  const int top = tree->instances->top;
  int place = top < 0 ? ~0 : top;
  for (;;) {
    if (place < 0) {
      __global const Instance* instance = tree->instances + ~place;
      Rays turned = rays_of_instance(instance, &left, !any_hit);
      bvh_traverse_instance(tree, instance, &turned, any_hit, culls, &best, layers);
      left.active = turned.active;
    } else {
      __global const BvhNode* node = tree->nodes + place;
      floatv enter[2];
      intv in[2];
      in[0] = bvh_child(node->left_min, node->left_max, 0, &left, inverse, best.t, 0, false, enter);
      in[1] = bvh_child(node->right_min, node->right_max, 0, &left, inverse, best.t, 0, false,
                        enter + 1);
      // The nearer child comes off the stack first
      const int nearer = !LANES_ANY(in[0] & in[1] & (enter[0] < enter[1]));
      for (int i = 0; i < 2; ++i) {
        const int side = i ? nearer : !nearer;
        if (!LANES_ANY(in[side])) continue;
        const int child = side ? node->right_child : node->left_child;
        waiting_place[waiting] = (side ? node->right_count : node->left_count) > 0 ? ~child : child;
        waiting_enter[waiting] = enter[side];
        ++waiting;
      }
    }
    do {
      if (waiting == 0) return best;
      --waiting;
    } while (!LANES_ANY(left.active & (waiting_enter[waiting] < best.t)));
    place = waiting_place[waiting];
  }
}

// The nearest hits in (t_min, t_max); with any_hit, any. Drivers compile the search once for both.
CALLED Hits bvh_search(const Tree* tree, const Rays* rays, bool any_hit) {
  return bvh_traverse(tree, rays, any_hit, false, 0);
}

// The nearest hits in (t_min, t_max).
static inline Hits bvh_nearest(const Tree* tree, const Rays* rays) {
  return bvh_search(tree, rays, false);
}

static inline void bvh_clear(const Rays* rays, Layers* layers) {
  for (int i = 0; i < BVH_LAYERS; ++i) {
    layers->t[i] = rays->t_max;
    layers->triangle[i] = -1;
    layers->u[i] = layers->v[i] = 0.0f;
  }
}

// The nearest BVH_LAYERS hits in (t_min, t_max). culls: rays come from the hologram's centre, and
// subtrees that face away from it are skipped: inner sides of closed meshes are no sources of
// light.
CALLED void bvh_layers(const Tree* tree, const Rays* rays, bool culls, Layers* layers) {
  bvh_clear(rays, layers);
  bvh_traverse(tree, rays, false, culls, layers);
}

#if RAYWAVE_LANES > 1
// Mask of the rays that meet anything in (t_min, t_max). The triangles that stopped a similar
// packet are tried first: known[lane] is the triangle that stopped that ray, or -1; it is updated.
CALLED intv bvh_occluded_again(const Tree* tree, const Rays* rays, int* known) {
  Rays left = *rays, turned = *rays;
  floatv inverse[3];
  int instance = -1;
  intv stopped_by = -1, untried = LANES_LOAD(known);
  int candidates[RAYWAVE_LANES];
  LANES_STORE(untried, candidates);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    const int triangle = candidates[lane];
    if (triangle < 0) continue;
    if (tree->triangles[triangle].instance != instance) {
      instance = tree->triangles[triangle].instance;
      turned = rays_of_instance(tree->instances + instance, rays, false);
      inverse[0] = bvh_reciprocal(turned.dx);
      inverse[1] = bvh_reciprocal(turned.dy);
      inverse[2] = bvh_reciprocal(turned.dz);
    }
    turned.active = left.active;
    Hits any = {left.t_max, (intv)(-1), (floatv)(0.0f), (floatv)(0.0f)};
    const intv hit = bvh_triangle(tree, triangle, &turned, inverse, &any);
    left.active &= !hit;
    stopped_by = LANES_SELECT(stopped_by, (intv)(triangle), hit);
    untried = LANES_SELECT(untried, (intv)(-1), (untried == triangle) | !left.active);
    LANES_STORE(untried, candidates);
  }
  if (LANES_ANY(left.active)) {
    const intv triangle = bvh_search(tree, &left, true).triangle;
    stopped_by = LANES_SELECT(stopped_by, triangle, left.active);
  }
  LANES_STORE(stopped_by, known);
  return stopped_by >= 0;
}
#endif

// Mask of the rays that meet anything in (t_min, t_max).
static inline intv bvh_occluded(const Tree* tree, const Rays* rays) {
  return bvh_search(tree, rays, true).triangle >= 0;
}

#endif
