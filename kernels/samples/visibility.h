// SPDX-License-Identifier: Apache-2.0
// Visibility mask: the parts of the hologram's window that a sample sees. The window has
// RAYWAVE_VISIBILITY_PARTS x RAYWAVE_VISIBILITY_PARTS parts with one bit each, set where a ray to
// the part's middle meets nothing. Bit j * RAYWAVE_VISIBILITY_PARTS + i belongs to part (i, j),
// counted from the bottom left. Near the hologram the window is one of directions, from which the
// pixels can show light (Lattice's steepest tangents): parts of the hologram would be too coarse.
#ifndef RAYWAVE_VISIBILITY_H
#define RAYWAVE_VISIBILITY_H

#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/samples/options.h"
#include "kernels/scene/bvh.h"

#define VISIBILITY_ALL \
  (RAYWAVE_VISIBILITY_PARTS > 0 ? RAYWAVE_VISIBILITY_PARTS * RAYWAVE_VISIBILITY_PARTS : 1)
#define VISIBILITY_WORDS ((VISIBILITY_ALL + 31) / 32)
// Parts per side for which plane-wave samples have profiles of their own (plane_waves.h;
// host/trace/samples.hpp)
#define PLANE_WAVE_PARTS \
  (RAYWAVE_VISIBILITY_PARTS > 8 ? 8 : RAYWAVE_VISIBILITY_PARTS > 0 ? RAYWAVE_VISIBILITY_PARTS : 1)

// Sets all bits of a visibility mask; returns their number.
static inline int see_all(uint* visibility) {
  for (int w = 0; w < VISIBILITY_WORDS; ++w) visibility[w] = 0u;
  for (int part = 0; part < VISIBILITY_ALL; ++part) visibility[part / 32] |= 1u << (part % 32);
  return VISIBILITY_ALL;
}

// Bits of row j of a visibility mask.
static inline uint visibility_row(__global const uint* visibility, int j) {
  const int bit = j * RAYWAVE_VISIBILITY_PARTS;
  return visibility[bit / 32] >> (bit % 32) & ((1u << RAYWAVE_VISIBILITY_PARTS) - 1u);
}

// Occluder cache: the triangles that hid a neighbour from sixteen parts, or -1. Most likely they
// hide the sample too. Used with more than one lane only.
typedef struct {
  int triangle[16];
} OccluderCache;

#if RAYWAVE_VISIBILITY_PARTS > 0
// Rays to the middles of parts (i, j), from points on surfaces with unit normals (nx, ny, nz).
static inline Rays rays_to_parts(const Lattice* lattice, floatv x, floatv y, floatv z, floatv nx,
                                 floatv ny, floatv nz, intv i, intv j) {
  const bool is_near = lattice->steepest_x < FLT_MAX;
  const floatv rate = 1.0f / (z - lattice->centre_z);
  const floatv across = (2.0f * LANES_TO_FLOAT(i) + 1.0f) / (float)RAYWAVE_VISIBILITY_PARTS - 1.0f;
  const floatv up = (2.0f * LANES_TO_FLOAT(j) + 1.0f) / (float)RAYWAVE_VISIBILITY_PARTS - 1.0f;
  Rays ray;
  ray.ox = x + lattice->bias * nx;
  ray.oy = y + lattice->bias * ny;
  ray.oz = z + lattice->bias * nz;
  ray.dx = is_near ? across * lattice->steepest_x
                   : (lattice->centre_x - x + across * lattice->half_width) * rate;
  ray.dy = is_near ? up * lattice->steepest_y
                   : (lattice->centre_y - y + up * lattice->half_height) * rate;
  ray.dz = -1.0f;
  ray.t_min = 0.0f;
  ray.t_max = fmax(z - lattice->near_z, (floatv)(0.0f));
  ray.active = LANES_INDEX >= 0;
  return ray;
}

// Number of hidden rays among RAYWAVE_LANES rays, which are `first` and the following of the
// sixteen.
static inline int hidden_of(const SceneArrays* scene, const Rays* rays,
                            OccluderCache* occluder_cache, int first) {
#if RAYWAVE_LANES > 1
  const intv hidden = bvh_occluded_again(&scene->tree, rays, occluder_cache->triangle + first);
#else
  (void)occluder_cache, (void)first;
  const intv hidden = bvh_occluded(&scene->tree, rays);
#endif
  return lanes_sum(LANES_SELECT((intv)(0), (intv)(1), hidden));
}

// The part of the window that represents block (a, b) of 4 x 4 blocks. No two of four neighbouring
// blocks are represented by parts in one row or column.
static inline intv part_of_16(intv a, intv b) {
  return RAYWAVE_VISIBILITY_PARTS / 4 * a + b % (RAYWAVE_VISIBILITY_PARTS / 4);
}
#endif

// 1: sixteen parts that agree stand for all. Behind a surface that is there with a probability,
// each part is a matter of its own.
#define SIXTEEN_TELL (RAYWAVE_ALPHA != ALPHA_BLEND)

#define SEEN_UNKNOWN (-1)
#define SEEN_UNBROKEN (-2)  // everything, as no break lies in the way (breaks.h)

#if RAYWAVE_LANES > 1 && RAYWAVE_VISIBILITY_PARTS > 0
#if RAYWAVE_LANES == 16
#define FOUR_REPEATED(p) ((float16)(vload4(0, p), vload4(0, p), vload4(0, p), vload4(0, p)))
#elif RAYWAVE_LANES == 8
#define FOUR_REPEATED(p) ((float8)(vload4(0, p), vload4(0, p)))
#else
#define FOUR_REPEATED(p) vload4(0, p)
#endif

// Tests sixteen parts from four neighbouring samples on one surface, four parts from each, in
// different rows and columns. Returns 0 when all are hidden, VISIBILITY_ALL when none is, else
// SEEN_UNKNOWN. Positions and normals of the four samples begin at x, y, ...
static inline int look_around_four(const SceneArrays* scene, const Lattice* lattice, const float* x,
                                   const float* y, const float* z, const float* nx, const float* ny,
                                   const float* nz, OccluderCache* occluder_cache) {
  if (!SIXTEEN_TELL) return SEEN_UNKNOWN;
  int hidden = 0;
  for (int first = 0; first < 16; first += RAYWAVE_LANES) {
    const intv a = (first + LANES_INDEX) / 4, b = (first + LANES_INDEX + a) % 4;
    const Rays rays = rays_to_parts(lattice, FOUR_REPEATED(x), FOUR_REPEATED(y), FOUR_REPEATED(z),
                                    FOUR_REPEATED(nx), FOUR_REPEATED(ny), FOUR_REPEATED(nz),
                                    part_of_16(a, b), part_of_16(b, a));
    hidden += hidden_of(scene, &rays, occluder_cache, first);
    if (hidden != 0 && hidden != first + RAYWAVE_LANES) return SEEN_UNKNOWN;
  }
  return hidden == 0 ? VISIBILITY_ALL : 0;
}
#endif

// Fills the visibility mask of a sample; returns how many parts it sees. Sixteen parts, spread
// evenly, represent all parts when they agree. A hidden or visible region narrower and lower than a
// quarter of the window may be missed. Without lanes, samples that only rays can tell of see
// everything until look_around.cl has asked.
//
// seen  result of look_around_four
static inline int look_around(const SceneArrays* scene, const Lattice* lattice, const Sample* s,
                              OccluderCache* occluder_cache, int seen, uint* visibility) {
  for (int w = 0; w < VISIBILITY_WORDS; ++w) visibility[w] = 0;
#if RAYWAVE_VISIBILITY_PARTS == 0
  (void)scene, (void)lattice, (void)s, (void)occluder_cache, (void)seen;
  return VISIBILITY_ALL;
#else
#if RAYWAVE_LANES > 1
  if (seen == SEEN_UNKNOWN && SIXTEEN_TELL) {
    int hidden = 0;
    for (int first = 0; first < 16; first += RAYWAVE_LANES) {
      const intv a = (first + LANES_INDEX) / 4, b = (first + LANES_INDEX + a) % 4;
      const Rays rays =
          rays_to_parts(lattice, (floatv)(s->x), (floatv)(s->y), (floatv)(s->z), (floatv)(s->nx),
                        (floatv)(s->ny), (floatv)(s->nz), part_of_16(a, b), part_of_16(b, a));
      hidden += hidden_of(scene, &rays, occluder_cache, first);
    }
    if (hidden == 0) seen = VISIBILITY_ALL;
    if (hidden == 16) seen = 0;
  }
#else
  (void)scene, (void)lattice, (void)s, (void)occluder_cache;
  if (seen == SEEN_UNKNOWN) seen = VISIBILITY_ALL;
#endif
  if (seen == 0) return 0;
  if (seen == VISIBILITY_ALL) return see_all(visibility);
#if RAYWAVE_LANES > 1
  seen = 0;
  for (int first = 0; first < VISIBILITY_ALL; first += RAYWAVE_LANES) {
    const intv part = first + LANES_INDEX;
    const Rays rays = rays_to_parts(
        lattice, (floatv)(s->x), (floatv)(s->y), (floatv)(s->z), (floatv)(s->nx), (floatv)(s->ny),
        (floatv)(s->nz), part % RAYWAVE_VISIBILITY_PARTS, part / RAYWAVE_VISIBILITY_PARTS);
    const intv hidden = bvh_occluded(&scene->tree, &rays);
    seen += lanes_sum(LANES_SELECT((intv)(1), (intv)(0), hidden));
    visibility[first / 32] |=
        (uint)lanes_sum(LANES_SELECT((intv)(1) << (part % 32), (intv)(0), hidden));
  }
#endif
  return seen;
#endif
}

// The part, along one axis, that a position in half windows belongs to.
static inline int visibility_part(float place) {
  return clamp((int)((place + 1.0f) * (0.5f * RAYWAVE_VISIBILITY_PARTS)), 0,
               RAYWAVE_VISIBILITY_PARTS - 1);
}

#endif
