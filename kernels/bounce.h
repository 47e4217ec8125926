// SPDX-License-Identifier: Apache-2.0
// Mirrors and glass: the ways that light took to a pixel, followed backwards from hit to hit, for packets of lanes.
#ifndef RAYWAVE_BOUNCE_H
#define RAYWAVE_BOUNCE_H

#include "lanes.h"
#include "shade.h"

#ifndef RAYWAVE_BOUNCES
#define RAYWAVE_BOUNCES 0  // mirror and refraction bounces; host/device_scene.cpp
#endif

#if RAYWAVE_BOUNCES > 0
typedef struct {
  Rays rays;
  floatv weight;  // share of the light that this way carries
  floatv length;  // metres of air that spread light as much: sum of segments over their index
  floatv turns;   // of the optical path, reduced
  floatv index;   // of refraction along the ray
  int bounces_left;
} Way;

// Ways still to follow, deepest last: each hit leaves at most one more than it takes, so these places hold them all.
#define BOUNCE_WAYS (RAYWAVE_BOUNCES + 1)

static inline Way way_from(const Rays* rays) {
  Way way;
  way.rays = *rays;
  way.weight = way.index = 1.0f;
  way.length = way.turns = 0.0f;
  way.bounces_left = RAYWAVE_BOUNCES;
  return way;
}

// Share of the light seen along the way that the surface itself sends out.
static inline floatv own_share(const Way* way, const Surface* s) { return way->weight * (1.0f - s->reflectivity - s->transparency); }

// The way onwards from a surface in a unit direction. It starts on the surface itself, so that its length is exact, and meets nothing
// within `bias` of it.
static inline Way bounced(const Way* way, const Surface* s, floatv dx, floatv dy, floatv dz, float bias, float reach, floatv share,
                          floatv index) {
  Way next = *way;
  next.rays.ox = s->x;
  next.rays.oy = s->y;
  next.rays.oz = s->z;
  next.rays.dx = dx;
  next.rays.dy = dy;
  next.rays.dz = dz;
  next.rays.t_min = bias / fmax(fabs(dx * s->nx + dy * s->ny + dz * s->nz), (floatv)(0x1p-6f));
  next.rays.t_max = reach;
  next.weight = way->weight * share;
  next.index = index;
  next.rays.active = way->rays.active & (next.weight > 0.0f);
  next.bounces_left = way->bounces_left - 1;
  return next;
}

// Adds the ways that go on from where `way` hits the surface (lanes of way->rays.active) to the pending ones; their new number.
static inline int bounce(const Way* way, const Surface* surface, float bias, float reach, Way* ways, int pending) {
  if (way->bounces_left <= 0) return pending;
  const Rays* rays = &way->rays;
  const intv hit = rays->active;
  const floatv speed = sqrt(rays->dx * rays->dx + rays->dy * rays->dy + rays->dz * rays->dz);
  const floatv dx = rays->dx / speed, dy = rays->dy / speed, dz = rays->dz / speed;
  const floatv along = -(dx * surface->nx + dy * surface->ny + dz * surface->nz);
  // Total reflection sends the refracted share along the mirrored ray.
  const floatv ratio = LANES_SELECT(surface->ior, 1.0f / surface->ior, surface->entering);
  const floatv k = 1.0f - ratio * ratio * (1.0f - along * along);
  const floatv refracted = LANES_SELECT((floatv)(0.0f), surface->transparency, k > 0.0f);
  const floatv mirrored = surface->reflectivity + surface->transparency - refracted;
  if (LANES_ANY(hit & (mirrored > 0.0f))) {
    ways[pending++] = bounced(way, surface, dx + 2.0f * along * surface->nx, dy + 2.0f * along * surface->ny,
                              dz + 2.0f * along * surface->nz, bias, reach, mirrored, way->index);
  }
  if (LANES_ANY(hit & (refracted > 0.0f))) {
    const floatv inward = ratio * along - sqrt(fmax(k, (floatv)(0.0f)));
    ways[pending++] =
        bounced(way, surface, ratio * dx + inward * surface->nx, ratio * dy + inward * surface->ny, ratio * dz + inward * surface->nz, bias,
                reach, refracted, LANES_SELECT((floatv)(1.0f), surface->ior, surface->entering));
  }
  return pending;
}
#endif

#endif
