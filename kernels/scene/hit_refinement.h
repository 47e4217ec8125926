// SPDX-License-Identifier: Apache-2.0
// Where a ray meets a surface, and the normal there, beyond floats: the tree (bvh.h) searches in
// floats, and its hit is then made exact on the triangle it has found. Sharp highlights and ways
// over mirrors need it, and phases need the distance.
#ifndef RAYWAVE_EXACT_H
#define RAYWAVE_EXACT_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/bvh.h"

// Points origin + t direction, scene frame.
typedef struct {
  Wide3 origin, direction;
} Line;

// A triangle in each lane: first corner, the edges from it, and their cross product.
typedef struct {
  Wide3 a, ab, ac, across;
} AreaSamples;

// What vertices have 3 floats of, at the three corners of a triangle in each lane, turned from its
// instance's frame to the scene's; `places` are moved as well. Lanes without a triangle (index < 0)
// receive those of the first one.
static inline void at_corners(const Tree* tree, __global const float* of_vertices, intv index,
                              bool places, Wide3* at) {
  int triangle[RAYWAVE_LANES];
  float values[9][RAYWAVE_LANES];
  bool moved = false;
  LANES_STORE(index, triangle);
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    triangle[i] = max(triangle[i], 0);
    __global const Triangle* t = tree->triangles + triangle[i];
    for (int axis = 0; axis < 3; ++axis) {
      values[axis][i] = of_vertices[3 * (size_t)t->corner_a + (size_t)axis];
      values[3 + axis][i] = of_vertices[3 * (size_t)t->corner_b + (size_t)axis];
      values[6 + axis][i] = of_vertices[3 * (size_t)t->corner_c + (size_t)axis];
    }
    moved |= tree->instances[t->instance].moved;
  }
  for (int c = 0; c < 3; ++c)
    at[c] = wide3(LANES_LOAD(values[3 * c]), LANES_LOAD(values[3 * c + 1]),
                  LANES_LOAD(values[3 * c + 2]));
  if (!moved) return;

  float high[12][RAYWAVE_LANES], low[12][RAYWAVE_LANES];  // outward, then centre
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    __global const Instance* instance = tree->instances + tree->triangles[triangle[i]].instance;
    for (int k = 0; k < 12; ++k) {
      high[k][i] = k < 9 ? instance->outward[k] : instance->centre[k - 9];
      low[k][i] = k < 9 ? instance->outward_low[k] : instance->centre_low[k - 9];
    }
  }
  Wide m[12];
  for (int k = 0; k < 12; ++k) m[k] = wide(LANES_LOAD(high[k]), LANES_LOAD(low[k]));
  const Wide zero = wide((floatv)(0.0f), (floatv)(0.0f));
  const Wide3 centre = {places ? m[9] : zero, places ? m[10] : zero, places ? m[11] : zero};
  const Wide3 columns[3] = {{m[0], m[3], m[6]}, {m[1], m[4], m[7]}, {m[2], m[5], m[8]}};
  for (int c = 0; c < 3; ++c)
    at[c] = wide3_along(wide3_along(wide3_along(centre, columns[0], at[c].x), columns[1], at[c].y),
                        columns[2], at[c].z);
}

static inline AreaSamples area_samples_of(const Tree* tree, intv index) {
  Wide3 corners[3];
  at_corners(tree, tree->positions, index, true, corners);
  AreaSamples f;
  f.a = corners[0];
  f.ab = wide3_minus(corners[1], f.a);
  f.ac = wide3_minus(corners[2], f.a);
  f.across = wide3_cross(f.ab, f.ac);
  return f;
}

// Distance along lines, whose directions are about 1 long, to the planes of area_samples that they have
// met at t, to floats. Where rounding alone decided the hit, or the plane is seen edge-on, t stays.
static inline Wide exact_distance(const AreaSamples* f, const Line* line, floatv t) {
  const Wide away = wide3_dot(f->across, wide3_minus(f->a, line->origin)),
             along = wide3_dot(f->across, line->direction);
  const floatv divisor = wide_high(along);
  const Wide distance = wide_over(
      away, wide(LANES_SELECT(divisor, (floatv)(1.0f), divisor == 0.0f), wide_low(along)));
  const floatv size = t + fabs(wide_high(line->origin.x)) + fabs(wide_high(line->origin.y)) +
                      fabs(wide_high(line->origin.z));
  return wide_select(wide(t, 0.0f), distance, fabs(wide_high(distance) - t) <= 0x1p-18f * size);
}

// Normals of unit length at places on area_samples, as the mesh says. (u, v): the places' weights to
// floats, which stay where the area_sample is so narrow that they are all there is.
static inline Wide3 exact_normal(const Tree* tree, __global const float* vertex_normals, intv index,
                                 const AreaSamples* f, Wide3 place, floatv u, floatv v) {
  Wide3 normals[3];
  at_corners(tree, vertex_normals, index, false, normals);
  // The square of a small area would leave no room for the lower halves.
  const floatv nx = wide_high(f->across.x), ny = wide_high(f->across.y),
               nz = wide_high(f->across.z);
  const Wide3 facing = wide3_scaled(
      f->across, wide(rsqrt(fmax(nx * nx + ny * ny + nz * nz, (floatv)(1e-37f))), 0.0f));
  const Wide area = wide3_dot(f->across, facing);
  const Wide safe = wide_select(area, wide(1.0f, 0.0f), wide_high(area) <= 0.0f);
  const Wide3 from_a = wide3_minus(place, f->a);
  const Wide at_b = wide_over(wide3_dot(wide3_cross(from_a, f->ac), facing), safe);
  const Wide at_c = wide_over(wide3_dot(wide3_cross(f->ab, from_a), facing), safe);
  const floatv off = fmax(fabs(wide_high(at_b) - u), fabs(wide_high(at_c) - v));
  const intv agree = off <= 0x1p-6f;
  const Wide weight_b = wide_select(wide(u, 0.0f), at_b, agree),
             weight_c = wide_select(wide(v, 0.0f), at_c, agree);
  const Wide3 normal =
      wide3_along(wide3_along(normals[0], wide3_minus(normals[1], normals[0]), weight_b),
                  wide3_minus(normals[2], normals[0]), weight_c);
  const Wide squared = wide3_dot(normal, normal);
  const Wide length =
      wide_sqrt(wide_select(squared, wide(1.0f, 0.0f), wide_high(squared) <= 1e-30f));
  return wide3_scaled(normal, wide_over(wide(1.0f, 0.0f), length));
}

#endif
