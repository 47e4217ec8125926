// SPDX-License-Identifier: Apache-2.0
// What a sample sees of the hologram's window: RAYWAVE_VIEW_PARTS x RAYWAVE_VIEW_PARTS parts, one bit each, set where a ray to the part's
// middle meets nothing. Bit j * RAYWAVE_VIEW_PARTS + i belongs to part (i, j), counted from the bottom left.
#ifndef RAYWAVE_VIEW_H
#define RAYWAVE_VIEW_H

#include "bvh.h"
#include "lanes.h"
#include "shade.h"
#include "shared.h"

#ifndef RAYWAVE_VIEW_PARTS
#define RAYWAVE_VIEW_PARTS 8  // 4, 8 or 16 to a side; 0: nothing hides anything; host/samples.cpp
#endif
#define VIEW_ALL (RAYWAVE_VIEW_PARTS > 0 ? RAYWAVE_VIEW_PARTS * RAYWAVE_VIEW_PARTS : 1)
#define VIEW_WORDS ((VIEW_ALL + 31) / 32)

// Looks at all parts; returns how many are seen.
static inline int look_around(const SceneArrays* scene, const Lattice* lattice, const Sample* s, uint* view) {
  for (int w = 0; w < VIEW_WORDS; ++w) view[w] = 0;
#if RAYWAVE_VIEW_PARTS == 0
  (void)scene, (void)lattice, (void)s;
  return VIEW_ALL;
#else
  const float rate = 1.0f / (s->z - lattice->centre_z);
  int seen = 0;
  for (int first = 0; first < VIEW_ALL; first += RAYWAVE_LANES) {
    const intv part = first + LANES_INDEX;
    const floatv across = LANES_TO_FLOAT(2 * (part % RAYWAVE_VIEW_PARTS) + 1) / (float)RAYWAVE_VIEW_PARTS - 1.0f;
    const floatv up = LANES_TO_FLOAT(2 * (part / RAYWAVE_VIEW_PARTS) + 1) / (float)RAYWAVE_VIEW_PARTS - 1.0f;
    Rays ray;
    ray.ox = s->x + lattice->bias * s->nx;
    ray.oy = s->y + lattice->bias * s->ny;
    ray.oz = s->z + lattice->bias * s->nz;
    ray.dx = (lattice->centre_x - s->x + across * lattice->half_width) * rate;
    ray.dy = (lattice->centre_y - s->y + up * lattice->half_height) * rate;
    ray.dz = -1.0f;
    ray.t_min = 0.0f;
    ray.t_max = fmax(s->z - lattice->near_z, 0.0f);
    ray.active = LANES_INDEX >= 0;
    const intv hidden = bvh_occluded(scene->nodes, scene->triangles, &ray);
    seen += lanes_sum(LANES_SELECT((intv)(1), (intv)(0), hidden));
    view[first / 32] |= (uint)lanes_sum(LANES_SELECT((intv)(1) << (part % 32), (intv)(0), hidden));
  }
  return seen;
#endif
}

// Parts of one axis between places from and to, given in half windows of the view.
static inline int view_part(float place) { return clamp((int)((place + 1.0f) * (0.5f * RAYWAVE_VIEW_PARTS)), 0, RAYWAVE_VIEW_PARTS - 1); }

#endif
