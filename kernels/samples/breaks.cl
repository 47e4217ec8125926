// SPDX-License-Identifier: Apache-2.0
// Finds the breaks of the scene's surfaces (breaks.h).
//
// find_faces   how the hologram sees each triangle: FACE_AWAY, or 1 (-1: from the back), times
//              FACE_STEEP when it is steep, some part of the window sees its other side, or it is
//              not there everywhere
// mark_breaks  marks the edges at which triangles end or fold, and steep triangles.
//              neighbours[3 t] and the next two: the triangles beyond the edges ab, bc and ca of
//              triangle t; -1: none, more than one, or one of the other winding
//
// breaks, tiles: as in breaks.h; zero before. Global size: triangles. OpenCL C 1.2.
#include "kernels/common/shared.h"
#include "kernels/samples/breaks.h"
#include "kernels/scene/arrays.h"
#include "kernels/scene/options.h"

#define FACE_AWAY 0  // inner side of a closed mesh, which is no source of light
#define FACE_STEEP 2

// Cosine to the ray from the hologram's centre below which a triangle is steep: it spans less than
// the reach of a layer (samples.cl) in a cell. And the same for rays to other parts of the window.
#define FACE_LEAST_COSINE 0.2f
#define FACE_LEAST_COSINE_ASIDE 0.05f

static inline float3 in_scene(__global const Instance* instance, __global const float* p) {
  if (!instance->moved) return (float3)(p[0], p[1], p[2]);
  __global const float* m = instance->outward;
  return (float3)(instance->centre[0] + (m[0] * p[0] + m[1] * p[1] + m[2] * p[2]),
                  instance->centre[1] + (m[3] * p[0] + m[4] * p[1] + m[5] * p[2]),
                  instance->centre[2] + (m[6] * p[0] + m[7] * p[1] + m[8] * p[2]));
}

__kernel void find_faces(TREE_PARAMETERS, __global const Material* materials, Lattice lattice,
                         int triangle_count, __global int* faces) {
  const int i = (int)get_global_id(0);
  (void)nodes, (void)materials;
  if (i >= triangle_count) return;
  __global const Triangle* t = triangles + i;
  __global const Instance* instance = instances + t->instance;
  const float3 a = in_scene(instance, positions + 3 * (size_t)t->corner_a);
  const float3 ab = in_scene(instance, positions + 3 * (size_t)t->corner_b) - a;
  const float3 ac = in_scene(instance, positions + 3 * (size_t)t->corner_c) - a;
  const float3 normal =
      (float3)(ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z, ab.x * ac.y - ab.y * ac.x);
  const float3 to_centre = (float3)(lattice.centre_x, lattice.centre_y, lattice.centre_z) - a;
  const float along = dot(normal, to_centre), size = sqrt(dot(normal, normal)),
              distance = sqrt(dot(to_centre, to_centre));
  const float aside =
      fabs(along) - (fabs(normal.x) * lattice.half_width + fabs(normal.y) * lattice.half_height);
  bool steep = !(fabs(along) >= FACE_LEAST_COSINE * size * distance &&
                 aside >= FACE_LEAST_COSINE_ASIDE * size *
                              (distance + (lattice.half_width + lattice.half_height)) &&
                 size > 0.0f);
#if RAYWAVE_ALPHA
  // A surface that is not there everywhere ends anywhere
  steep |= materials[t->material].alpha_mode != ALPHA_OPAQUE;
#endif
  const int front = along > 0.0f ? 1 : -1;
  if (t->side != 0 && along * (float)t->side < -1e-4f * size * distance)
    faces[i] = FACE_AWAY;
  else
    faces[i] = steep ? front * FACE_STEEP : front;
}

// Marks the cells that a polygon of `count` corners, an edge or a triangle, overlaps.
static inline void mark(const Lattice* lattice, const float* x, const float* y, const float* q,
                        int count, __global float* breaks, __global float* tiles) {
  float bottom = y[0], top = y[0], nearness = q[0];
  for (int k = 1; k < count; ++k) {
    bottom = fmin(bottom, y[k]);
    top = fmax(top, y[k]);
    nearness = fmax(nearness, q[k]);
  }
  const int tiles_x = break_tiles_along(lattice->nx);
  const float last_x = (float)(lattice->nx - 1), last_y = (float)(lattice->ny - 1);
  const int first_row = (int)clamp(floor(bottom - BREAK_MARGIN), 0.0f, last_y),
            last_row = (int)clamp(floor(top + BREAK_MARGIN), 0.0f, last_y);
  for (int row = first_row; row <= last_row; ++row) {
    // The part of the polygon in this row; what lies beyond the lattice counts as in its edge.
    const float low = row == 0 ? -1e30f : (float)row - BREAK_MARGIN,
                high = row == lattice->ny - 1 ? 1e30f : (float)(row + 1) + BREAK_MARGIN;
    float left = 1e30f, right = -1e30f;
    for (int k = 0; k < count; ++k) {
      const int next = k + 1 == count ? 0 : k + 1;
      const float from = fmax(fmin(y[k], y[next]), low), to = fmin(fmax(y[k], y[next]), high);
      if (from > to) continue;
      const float height = y[next] - y[k];
      float at_from = x[k], at_to = x[next];
      if (fabs(height) > 1e-3f) {
        at_from = x[k] + (from - y[k]) / height * (x[next] - x[k]);
        at_to = x[k] + (to - y[k]) / height * (x[next] - x[k]);
      }
      left = fmin(left, fmin(at_from, at_to));
      right = fmax(right, fmax(at_from, at_to));
    }
    const int first = (int)clamp(floor(left - BREAK_MARGIN), 0.0f, last_x),
              last = (int)clamp(floor(right + BREAK_MARGIN), 0.0f, last_x);
    for (int column = first; column <= last; ++column) {
      // The bits of positive floats are in the order of their values.
      const size_t cell = (size_t)row * (size_t)(BREAK_TILE * tiles_x) + (size_t)column;
      const size_t tile =
          (size_t)(row / BREAK_TILE) * (size_t)tiles_x + (size_t)(column / BREAK_TILE);
      atomic_max((volatile __global int*)(breaks + cell), as_int(nearness));
      atomic_max((volatile __global int*)(tiles + tile), as_int(nearness));
    }
  }
}

__kernel void mark_breaks(TREE_PARAMETERS, Lattice lattice, int triangle_count,
                          __global const int* neighbours, __global const int* faces,
                          __global float* breaks, __global float* tiles) {
  const int i = (int)get_global_id(0);
  (void)nodes;
  if (i >= triangle_count || faces[i] == FACE_AWAY) return;
  const bool steep = abs(faces[i]) == FACE_STEEP;
  int ends[3], any = steep;
  for (int edge = 0; edge < 3; ++edge) {
    const int beyond = neighbours[3 * (size_t)i + (size_t)edge];
    ends[edge] = beyond < 0 || faces[beyond] * faces[i] <= 0;
    any |= ends[edge];
  }
  if (!any) return;

  __global const Triangle* t = triangles + i;
  __global const Instance* instance = instances + t->instance;
  const int corners[3] = {t->corner_a, t->corner_b, t->corner_c};
  float x[3], y[3], q[3];
  for (int k = 0; k < 3; ++k) {
    const float3 p = in_scene(instance, positions + 3 * (size_t)corners[k]);
    q[k] = 1.0f / (p.z - lattice.centre_z);
    x[k] = (p.x - lattice.centre_x) * q[k] / lattice.step - (float)lattice.first_x;
    y[k] = (p.y - lattice.centre_y) * q[k] / lattice.step - (float)lattice.first_y;
  }
  if (steep) {
    mark(&lattice, x, y, q, 3, breaks, tiles);
    return;
  }
  for (int edge = 0; edge < 3; ++edge) {
    if (!ends[edge]) continue;
    const int next = edge == 2 ? 0 : edge + 1;
    const float edge_x[2] = {x[edge], x[next]}, edge_y[2] = {y[edge], y[next]},
                edge_q[2] = {q[edge], q[next]};
    mark(&lattice, edge_x, edge_y, edge_q, 2, breaks, tiles);
  }
}
