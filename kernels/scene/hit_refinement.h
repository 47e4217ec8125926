// SPDX-License-Identifier: Apache-2.0
// Hit refinement: hit points and normals in double-single precision. The tree (bvh.h) searches in
// floats; here its hit is computed again on the triangle that it has found. Sharp highlights,
// mirrors and glass need the normals, and phases need the distances.
#ifndef RAYWAVE_HIT_REFINEMENT_H
#define RAYWAVE_HIT_REFINEMENT_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/bvh.h"

// Points origin + t direction, scene frame.
typedef struct {
  DoubleSingle3 origin, direction;
} Line;

// One triangle per lane: first corner, the edges from it, and their cross product.
typedef struct {
  DoubleSingle3 a, ab, ac, across;
} TrianglePlanes;

// Values of 3 floats per vertex (positions or normals) at the three corners of each lane's
// triangle, turned from its instance's frame into the scene frame; with `places` they are moved as
// well. Lanes without a triangle (index < 0) receive the values of triangle 0.
static inline void at_corners(const Tree* tree, __global const float* of_vertices, intv index,
                              bool places, DoubleSingle3* at) {
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
    at[c] = ds3(LANES_LOAD(values[3 * c]), LANES_LOAD(values[3 * c + 1]),
                LANES_LOAD(values[3 * c + 2]));
  if (!moved) return;

  float high[12][RAYWAVE_LANES], low[12][RAYWAVE_LANES];  // the matrix `outward`, then `centre`
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    __global const Instance* instance = tree->instances + tree->triangles[triangle[i]].instance;
    for (int k = 0; k < 12; ++k) {
      high[k][i] = k < 9 ? instance->outward[k] : instance->centre[k - 9];
      low[k][i] = k < 9 ? instance->outward_low[k] : instance->centre_low[k - 9];
    }
  }
  DoubleSingle m[12];
  for (int k = 0; k < 12; ++k) m[k] = ds(LANES_LOAD(high[k]), LANES_LOAD(low[k]));
  const DoubleSingle zero = ds((floatv)(0.0f), (floatv)(0.0f));
  const DoubleSingle3 centre = {places ? m[9] : zero, places ? m[10] : zero, places ? m[11] : zero};
  const DoubleSingle3 columns[3] = {{m[0], m[3], m[6]}, {m[1], m[4], m[7]}, {m[2], m[5], m[8]}};
  for (int c = 0; c < 3; ++c)
    at[c] = ds3_along(ds3_along(ds3_along(centre, columns[0], at[c].x), columns[1], at[c].y),
                      columns[2], at[c].z);
}

static inline TrianglePlanes triangle_planes_of(const Tree* tree, intv index) {
  DoubleSingle3 corners[3];
  at_corners(tree, tree->positions, index, true, corners);
  TrianglePlanes f;
  f.a = corners[0];
  f.ab = ds3_minus(corners[1], f.a);
  f.ac = ds3_minus(corners[2], f.a);
  f.across = ds3_cross(f.ab, f.ac);
  return f;
}

// Distances along lines to the triangles' planes. The lines' directions have about unit length, and
// t is the distance found in floats. It is kept where rounding alone decided the hit, or where the
// plane is seen edge-on.
static inline DoubleSingle refined_distance(const TrianglePlanes* f, const Line* line, floatv t) {
  const DoubleSingle away = ds3_dot(f->across, ds3_minus(f->a, line->origin)),
                     along = ds3_dot(f->across, line->direction);
  const floatv divisor = ds_high(along);
  const DoubleSingle distance =
      ds_over(away, ds(LANES_SELECT(divisor, (floatv)(1.0f), divisor == 0.0f), ds_low(along)));
  const floatv size = t + fabs(ds_high(line->origin.x)) + fabs(ds_high(line->origin.y)) +
                      fabs(ds_high(line->origin.z));
  return ds_select(ds(t, 0.0f), distance, fabs(ds_high(distance) - t) <= 0x1p-18f * size);
}

// Normals of unit length at points of triangles, in the mesh's sense. u and v are the weights found
// in floats; they are kept where the triangle is so narrow that nothing better exists.
static inline DoubleSingle3 refined_normal(const Tree* tree, __global const float* vertex_normals,
                                           intv index, const TrianglePlanes* f, DoubleSingle3 place,
                                           floatv u, floatv v) {
  DoubleSingle3 normals[3];
  at_corners(tree, vertex_normals, index, false, normals);
  // Scaled to unit length first: the square of a small area would leave no room for the low parts.
  const floatv nx = ds_high(f->across.x), ny = ds_high(f->across.y), nz = ds_high(f->across.z);
  const DoubleSingle3 facing =
      ds3_scaled(f->across, ds(rsqrt(fmax(nx * nx + ny * ny + nz * nz, (floatv)(1e-37f))), 0.0f));
  const DoubleSingle area = ds3_dot(f->across, facing);
  const DoubleSingle safe = ds_select(area, ds(1.0f, 0.0f), ds_high(area) <= 0.0f);
  const DoubleSingle3 from_a = ds3_minus(place, f->a);
  const DoubleSingle at_b = ds_over(ds3_dot(ds3_cross(from_a, f->ac), facing), safe);
  const DoubleSingle at_c = ds_over(ds3_dot(ds3_cross(f->ab, from_a), facing), safe);
  const floatv off = fmax(fabs(ds_high(at_b) - u), fabs(ds_high(at_c) - v));
  const intv agree = off <= 0x1p-6f;
  const DoubleSingle weight_b = ds_select(ds(u, 0.0f), at_b, agree),
                     weight_c = ds_select(ds(v, 0.0f), at_c, agree);
  const DoubleSingle3 normal =
      ds3_along(ds3_along(normals[0], ds3_minus(normals[1], normals[0]), weight_b),
                ds3_minus(normals[2], normals[0]), weight_c);
  const DoubleSingle squared = ds3_dot(normal, normal);
  const DoubleSingle length =
      ds_sqrt(ds_select(squared, ds(1.0f, 0.0f), ds_high(squared) <= 1e-30f));
  return ds3_scaled(normal, ds_over(ds(1.0f, 0.0f), length));
}

#endif
