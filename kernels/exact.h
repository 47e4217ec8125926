// SPDX-License-Identifier: Apache-2.0
// Where a ray meets a surface, and the normal there, beyond floats: the tree (bvh.h) searches in floats, and its hit is then made exact on
// the triangle it has found. Sharp highlights and ways over mirrors need it, and phases need the distance.
#ifndef RAYWAVE_EXACT_H
#define RAYWAVE_EXACT_H

#include "bvh.h"
#include "lanes.h"
#include "shared.h"
#include "wide.h"

// Points origin + t direction, scene frame.
typedef struct {
  Wide3 origin, direction;
} Line;

// A triangle in each lane: first corner, the edges from it, and their cross product.
typedef struct {
  Wide3 a, ab, ac, across;
} Facets;

// Lanes without a triangle (index < 0) receive the first one.
static inline Facets facets_of(__global const Triangle* triangles, intv index) {
  int triangle[RAYWAVE_LANES];
  float corners[9][RAYWAVE_LANES];
  LANES_STORE(index, triangle);
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    __global const Triangle* t = triangles + max(triangle[i], 0);
    for (int axis = 0; axis < 3; ++axis) {
      corners[axis][i] = t->a[axis];
      corners[3 + axis][i] = t->b[axis];
      corners[6 + axis][i] = t->c[axis];
    }
  }
  const Wide3 b = wide3(LANES_LOAD(corners[3]), LANES_LOAD(corners[4]), LANES_LOAD(corners[5]));
  const Wide3 c = wide3(LANES_LOAD(corners[6]), LANES_LOAD(corners[7]), LANES_LOAD(corners[8]));
  Facets f;
  f.a = wide3(LANES_LOAD(corners[0]), LANES_LOAD(corners[1]), LANES_LOAD(corners[2]));
  f.ab = wide3_minus(b, f.a);
  f.ac = wide3_minus(c, f.a);
  f.across = wide3_cross(f.ab, f.ac);
  return f;
}

// Distance along lines, whose directions are about 1 long, to the planes of facets that they have met at t, to floats. Where rounding alone
// decided the hit, or the plane is seen edge-on, t stays.
static inline Wide exact_distance(const Facets* f, const Line* line, floatv t) {
  const Wide away = wide3_dot(f->across, wide3_minus(f->a, line->origin)), along = wide3_dot(f->across, line->direction);
  const floatv divisor = wide_high(along);
  const Wide distance = wide_over(away, wide(LANES_SELECT(divisor, (floatv)(1.0f), divisor == 0.0f), wide_low(along)));
  const floatv size = t + fabs(wide_high(line->origin.x)) + fabs(wide_high(line->origin.y)) + fabs(wide_high(line->origin.z));
  return wide_select(wide(t, 0.0f), distance, fabs(wide_high(distance) - t) <= 0x1p-18f * size);
}

// Normals of unit length at places on facets, as the mesh says. (u, v): the places' weights to floats, which stay where the facet is so
// narrow that they are all there is.
static inline Wide3 exact_normal(__global const TriangleShading* shading, __global const float* vertex_normals, intv index, const Facets* f,
                                 Wide3 place, floatv u, floatv v) {
  int triangle[RAYWAVE_LANES];
  float normals[9][RAYWAVE_LANES];
  LANES_STORE(index, triangle);
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    __global const TriangleShading* s = shading + max(triangle[i], 0);
    for (int axis = 0; axis < 3; ++axis) {
      normals[axis][i] = vertex_normals[3 * (size_t)s->corner_a + (size_t)axis];
      normals[3 + axis][i] = vertex_normals[3 * (size_t)s->corner_b + (size_t)axis];
      normals[6 + axis][i] = vertex_normals[3 * (size_t)s->corner_c + (size_t)axis];
    }
  }
  const Wide3 a = wide3(LANES_LOAD(normals[0]), LANES_LOAD(normals[1]), LANES_LOAD(normals[2]));
  const Wide3 b = wide3(LANES_LOAD(normals[3]), LANES_LOAD(normals[4]), LANES_LOAD(normals[5]));
  const Wide3 c = wide3(LANES_LOAD(normals[6]), LANES_LOAD(normals[7]), LANES_LOAD(normals[8]));
  // The square of a small area would leave no room for the lower halves.
  const floatv nx = wide_high(f->across.x), ny = wide_high(f->across.y), nz = wide_high(f->across.z);
  const Wide3 facing = wide3_scaled(f->across, wide(rsqrt(fmax(nx * nx + ny * ny + nz * nz, (floatv)(1e-37f))), 0.0f));
  const Wide area = wide3_dot(f->across, facing);
  const Wide safe = wide_select(area, wide(1.0f, 0.0f), wide_high(area) <= 0.0f);
  const Wide3 from_a = wide3_minus(place, f->a);
  const Wide at_b = wide_over(wide3_dot(wide3_cross(from_a, f->ac), facing), safe);
  const Wide at_c = wide_over(wide3_dot(wide3_cross(f->ab, from_a), facing), safe);
  const floatv off = fmax(fabs(wide_high(at_b) - u), fabs(wide_high(at_c) - v));
  const intv agree = off <= 0x1p-6f;
  const Wide weight_b = wide_select(wide(u, 0.0f), at_b, agree), weight_c = wide_select(wide(v, 0.0f), at_c, agree);
  const Wide3 normal = wide3_along(wide3_along(a, wide3_minus(b, a), weight_b), wide3_minus(c, a), weight_c);
  const Wide squared = wide3_dot(normal, normal);
  const Wide length = wide_sqrt(wide_select(squared, wide(1.0f, 0.0f), wide_high(squared) <= 1e-30f));
  return wide3_scaled(normal, wide_over(wide(1.0f, 0.0f), length));
}

#endif
