// SPDX-License-Identifier: Apache-2.0
// Rays of the sample lattice (shared.h), and the parts of its cells that they go through.
#ifndef RAYWAVE_LATTICE_RAYS_H
#define RAYWAVE_LATTICE_RAYS_H

#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/samples/options.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/surface.h"

#define PARTS (RAYWAVE_ANTIALIAS > 0 ? RAYWAVE_ANTIALIAS * RAYWAVE_ANTIALIAS : 1)
#define PACKETS (PARTS > RAYWAVE_LANES ? PARTS / RAYWAVE_LANES : 1)
#define CELLS_OF_PACKET (RAYWAVE_LANES > PARTS ? RAYWAVE_LANES / PARTS : 1)

// Rays with these tangents, one per lane.
static inline Rays lattice_rays(const Lattice* lattice, floatv tangent_x, floatv tangent_y,
                                intv active) {
  Rays rays;
  rays.dx = tangent_x;
  rays.dy = tangent_y;
  rays.dz = 1.0f;
  rays.ox = lattice->eye_x + (lattice->near_z - lattice->eye_z) * rays.dx;
  rays.oy = lattice->eye_y + (lattice->near_z - lattice->eye_z) * rays.dy;
  rays.oz = lattice->near_z;
  rays.t_min = 0.0f;
  rays.t_max = lattice->reach;
  rays.active = active;
  return rays;
}

// Rays through the centres of the cells (first + lane, row).
static inline Rays centre_rays(const Lattice* lattice, int first, int row, intv active) {
  const intv column = first + LANES_INDEX;
  return lattice_rays(lattice, (LANES_TO_FLOAT(lattice->first_x + column) + 0.5f) * lattice->step,
                      (floatv)(((float)(lattice->first_y + row) + 0.5f) * lattice->step),
                      active & (column < lattice->nx));
}

#if PLACES_DIFFER
// Where the parts of a packet look for lights: all places, or some of them with the rest left to
// the neighbours.
static inline intv light_place_of_part(int packet, int column, int row) {
  if (PARTS == 1) return light_place_of((intv)(column), (intv)(row));
  const intv part = (packet * RAYWAVE_LANES + LANES_INDEX) % PARTS;
  return PARTS == 16 ? part : part + 4 * ((column & 1) | (row & 1) << 1);
}
#endif

#if RAYWAVE_ANTIALIAS
// Centres of RAYWAVE_LANES parts of a cell, inner parts first, in cells from its lower left corner.
static inline void part_places(int packet, floatv* right, floatv* upwards) {
  const intv part = packet * RAYWAVE_LANES + LANES_INDEX;
#if RAYWAVE_ANTIALIAS == 4
  // Two bits for each part: columns 1 2 1 2, 1 2 0 3, 0 3 1 2, 0 3 0 3 and rows 1 1 2 2, 0 0 1 1,
  // 2 2 3 3, 0 0 3 3
  const intv column = (intv)((int)0xcc9cc999u) >> (2 * part) & 3;
  const intv row = (intv)((int)0xf0fa50a5u) >> (2 * part) & 3;
#else
  const intv column = part & 1, row = part >> 1 & 1;
#endif
  const float width = 1.0f / (float)RAYWAVE_ANTIALIAS;
  *right = (0.5f + LANES_TO_FLOAT(column)) * width;
  *upwards = (0.5f + LANES_TO_FLOAT(row)) * width;
}

// Rays through the centres of RAYWAVE_LANES parts of a cell, or through all parts of
// CELLS_OF_PACKET cells, beginning with this one.
static inline Rays part_rays(const Lattice* lattice, int column, int row, int packet, intv active) {
  floatv right, upwards;
  part_places(packet, &right, &upwards);
  const intv cell = lattice->first_x + column + LANES_INDEX / PARTS;
  return lattice_rays(lattice, (LANES_TO_FLOAT(cell) + right) * lattice->step,
                      ((float)(lattice->first_y + row) + upwards) * lattice->step, active);
}
#endif

// Merges layers closer than `gap` to the one before, and removes inner sides of closed meshes,
// which are no sources. Hits that remain keep their triangle.
static inline void keep_sources(Layers* layers, const SceneArrays* scene, const Rays* rays,
                                float gap) {
  floatv last = -1e30f;
  for (int i = 0; i < BVH_LAYERS; ++i) {
    const intv hit = layers->triangle[i] >= 0;
    if (!LANES_ANY(hit)) return;
    const intv apart = hit & (layers->t[i] > last + gap);
    last = LANES_SELECT(last, layers->t[i], apart);
    int triangle[RAYWAVE_LANES], keep[RAYWAVE_LANES];
    float dx[RAYWAVE_LANES], dy[RAYWAVE_LANES], dz[RAYWAVE_LANES];
    LANES_STORE(LANES_SELECT((intv)(-1), layers->triangle[i], apart), triangle);
    LANES_STORE(rays->dx, dx);
    LANES_STORE(rays->dy, dy);
    LANES_STORE(rays->dz, dz);
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
      keep[lane] = triangle[lane];
      if (triangle[lane] < 0) continue;
      const int side = scene->tree.triangles[triangle[lane]].side;
      if (side == 0) continue;
      const float3 n = triangle_cross(&scene->tree, triangle[lane]);
      if ((n.x * dx[lane] + n.y * dy[lane] + n.z * dz[lane]) * (float)side >= 0.0f) keep[lane] = -1;
    }
    layers->triangle[i] = LANES_LOAD(keep);
  }
}

#endif
