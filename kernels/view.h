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
#define NEAR_PARTS (RAYWAVE_VIEW_PARTS > 8 ? 8 : RAYWAVE_VIEW_PARTS > 0 ? RAYWAVE_VIEW_PARTS : 1)  // of near.h; host/samples.hpp

#if RAYWAVE_VIEW_PARTS > 0
// Lanes whose part (i, j) is hidden from the sample.
static inline intv hidden_from(const SceneArrays* scene, const Lattice* lattice, const Sample* s, intv i, intv j) {
  const float rate = 1.0f / (s->z - lattice->centre_z);
  const floatv across = (2.0f * LANES_TO_FLOAT(i) + 1.0f) / (float)RAYWAVE_VIEW_PARTS - 1.0f;
  const floatv up = (2.0f * LANES_TO_FLOAT(j) + 1.0f) / (float)RAYWAVE_VIEW_PARTS - 1.0f;
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
  return bvh_occluded(scene->nodes, scene->triangles, &ray);
}
#endif

// Looks at the parts; returns how many are seen. Sixteen of them, spread evenly, speak for all when they agree: what hides, or shows,
// less than a quarter of the window's width and height may be missed.
static inline int look_around(const SceneArrays* scene, const Lattice* lattice, const Sample* s, uint* view) {
  for (int w = 0; w < VIEW_WORDS; ++w) view[w] = 0;
#if RAYWAVE_VIEW_PARTS == 0
  (void)scene, (void)lattice, (void)s;
  return VIEW_ALL;
#else
  const int stride = RAYWAVE_VIEW_PARTS / 4;
  int hidden_of_16 = 0;
  for (int first = 0; first < 16; first += RAYWAVE_LANES) {
    const intv a = (first + LANES_INDEX) % 4, b = (first + LANES_INDEX) / 4;
    const intv hidden = hidden_from(scene, lattice, s, stride * a + b % stride, stride * b + a % stride);
    hidden_of_16 += lanes_sum(LANES_SELECT((intv)(0), (intv)(1), hidden));
  }
  if (hidden_of_16 == 16) return 0;
  if (hidden_of_16 == 0) {
    for (int part = 0; part < VIEW_ALL; ++part) view[part / 32] |= 1u << (part % 32);
    return VIEW_ALL;
  }
  int seen = 0;
  for (int first = 0; first < VIEW_ALL; first += RAYWAVE_LANES) {
    const intv part = first + LANES_INDEX;
    const intv hidden = hidden_from(scene, lattice, s, part % RAYWAVE_VIEW_PARTS, part / RAYWAVE_VIEW_PARTS);
    seen += lanes_sum(LANES_SELECT((intv)(1), (intv)(0), hidden));
    view[first / 32] |= (uint)lanes_sum(LANES_SELECT((intv)(1) << (part % 32), (intv)(0), hidden));
  }
  return seen;
#endif
}

// Parts of one axis between places from and to, given in half windows of the view.
static inline int view_part(float place) { return clamp((int)((place + 1.0f) * (0.5f * RAYWAVE_VIEW_PARTS)), 0, RAYWAVE_VIEW_PARTS - 1); }

#endif
