// SPDX-License-Identifier: Apache-2.0
// Mirrors and glass: the ways that light took to a pixel, followed backwards from hit to hit, for
// packets of lanes.
#ifndef RAYWAVE_BOUNCE_H
#define RAYWAVE_BOUNCE_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/scene/hit_refinement.h"
#include "kernels/scene/options.h"
#include "kernels/scene/shade.h"

#if RAYWAVE_BOUNCES > 0
typedef struct {
  Line line;       // its direction has unit length
  floatv nearest;  // distance before which it meets nothing
  floatv weight;   // share of the light that this way carries
  floatv length;   // metres of air that spread light as much: sum of segments over their index
  floatv turns;    // of the optical path, reduced
  Wide index;      // of refraction along the line
  intv active;
  int bounces_left;
} Way;

// Ways still to follow, deepest last: each hit leaves at most one more than it takes, so these
// places hold them all.
#define BOUNCE_WAYS (RAYWAVE_BOUNCES + 1)

static inline Way way_from(const Line* line, intv active) {
  const Wide one = wide(1.0f, 0.0f);
  Way way;
  way.line.origin = line->origin;
  way.line.direction = wide3_scaled(
      line->direction, wide_over(one, wide_sqrt(wide3_dot(line->direction, line->direction))));
  way.index = one;
  way.weight = 1.0f;
  way.nearest = way.length = way.turns = 0.0f;
  way.active = active;
  way.bounces_left = RAYWAVE_BOUNCES;
  return way;
}

// What the tree is searched with.
static inline Rays rays_of(const Way* way, float reach) {
  const Wide3 o = way->line.origin, d = way->line.direction;
  const Rays rays = {wide_high(o.x), wide_high(o.y),  wide_high(o.z),
                     wide_high(d.x), wide_high(d.y),  wide_high(d.z),
                     way->nearest,   (floatv)(reach), way->active};
  return rays;
}

// Share of the light seen along the way that the surface itself sends out.
static inline floatv own_share(const Way* way, const Surface* s) {
  return way->weight * (1.0f - s->reflectivity - s->transparency);
}

// The way onwards from a surface in a unit direction. It starts on the surface itself, so that its
// length is exact, and meets nothing within `bias` of it.
static inline Way bounced(const Way* way, const Surface* s, Wide3 direction, float bias,
                          floatv share, Wide index) {
  const floatv slope = wide_high(direction.x) * s->nx + wide_high(direction.y) * s->ny +
                       wide_high(direction.z) * s->nz;
  Way next = *way;
  next.line.origin = s->place;
  next.line.direction = direction;
  next.nearest = bias / fmax(fabs(slope), (floatv)(0x1p-6f));
  next.weight = way->weight * share;
  next.index = index;
  next.active = way->active & (next.weight > 0.0f);
  next.bounces_left = way->bounces_left - 1;
  return next;
}

// Adds the ways that go on from where `way` hits the surface (lanes of way->active) to the pending
// ones; their new number.
static inline int bounce(const Way* way, const Surface* surface, float bias, Way* ways,
                         int pending) {
  if (way->bounces_left <= 0) return pending;
  const Wide one = wide(1.0f, 0.0f), ior = wide(surface->ior, surface->ior_low);
  const Wide3 direction = way->line.direction;
  const Wide slope = wide3_dot(direction, surface->normal);  // negative
  // Total reflection sends the refracted share along the mirrored ray.
  const Wide ratio = wide_select(ior, wide_over(one, ior), surface->entering);
  const Wide k = wide_minus(
      one, wide_times(wide_times(ratio, ratio), wide_minus(one, wide_times(slope, slope))));
  const intv passes = wide_high(k) > 0.0f;
  const floatv refracted = LANES_SELECT((floatv)(0.0f), surface->transparency, passes);
  const floatv mirrored = surface->reflectivity + surface->transparency - refracted;
  if (LANES_ANY(way->active & (mirrored > 0.0f))) {
    const Wide3 onwards =
        wide3_along(direction, surface->normal, wide_times(slope, wide(-2.0f, 0.0f)));
    ways[pending++] = bounced(way, surface, onwards, bias, mirrored, way->index);
  }
  if (LANES_ANY(way->active & (refracted > 0.0f))) {
    const Wide inward = wide_plus(wide_times(ratio, slope), wide_sqrt(wide_select(one, k, passes)));
    const Wide3 onwards = wide3_along(wide3_scaled(direction, ratio), surface->normal,
                                      wide_times(inward, wide(-1.0f, 0.0f)));
    ways[pending++] =
        bounced(way, surface, onwards, bias, refracted, wide_select(one, ior, surface->entering));
  }
  return pending;
}
#endif

#endif
