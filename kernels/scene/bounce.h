// SPDX-License-Identifier: Apache-2.0
// Mirrors and glass: optical paths that end in a pixel, followed backwards from hit to hit, for
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
  floatv nearest;  // hits closer than this along the line are ignored
  floatv weight;   // share of the light that this path carries
  // Sum of the segments' lengths over their refractive indices, metres: decides the amplitude
  floatv length;
  floatv turns;        // of the optical path, reduced
  DoubleSingle index;  // refractive index along the line
  intv active;
  int bounces_left;
} Path;

// Capacity for the paths that are still to be followed. Each hit adds at most one path more than it
// takes, so that these hold all of them.
#define BOUNCE_PATHS (RAYWAVE_BOUNCES + 1)

static inline Path path_from(const Line* line, intv active) {
  const DoubleSingle one = ds(1.0f, 0.0f);
  Path path;
  path.line.origin = line->origin;
  path.line.direction =
      ds3_scaled(line->direction, ds_over(one, ds_sqrt(ds3_dot(line->direction, line->direction))));
  path.index = one;
  path.weight = 1.0f;
  path.nearest = path.length = path.turns = 0.0f;
  path.active = active;
  path.bounces_left = RAYWAVE_BOUNCES;
  return path;
}

// The rays with which the tree is searched.
static inline Rays rays_of(const Path* path, float reach) {
  const DoubleSingle3 o = path->line.origin, d = path->line.direction;
  const Rays rays = {ds_high(o.x), ds_high(o.y),  ds_high(o.z),    ds_high(d.x), ds_high(d.y),
                     ds_high(d.z), path->nearest, (floatv)(reach), path->active};
  return rays;
}

// Share of the light seen along the path that the surface itself emits.
static inline floatv own_share(const Path* path, const Surface* s) {
  return path->weight * (1.0f - s->reflectivity - s->transparency);
}

// The path onwards from a surface in a unit direction. It starts on the surface itself, so that its
// length is exact, and ignores hits within `bias` of the surface.
static inline Path bounced(const Path* path, const Surface* s, DoubleSingle3 direction, float bias,
                           floatv share, DoubleSingle index) {
  const floatv slope =
      ds_high(direction.x) * s->nx + ds_high(direction.y) * s->ny + ds_high(direction.z) * s->nz;
  Path next = *path;
  next.line.origin = s->place;
  next.line.direction = direction;
  next.nearest = bias / fmax(fabs(slope), (floatv)(0x1p-6f));
  next.weight = path->weight * share;
  next.index = index;
  next.active = path->active & (next.weight > 0.0f);
  next.bounces_left = path->bounces_left - 1;
  return next;
}

// Adds the paths that continue from the surface that `path` hits (lanes of path->active) to
// `paths`; returns the new number of pending ones.
static inline int bounce(const Path* path, const Surface* surface, float bias, Path* paths,
                         int pending) {
  if (path->bounces_left <= 0) return pending;
  const DoubleSingle one = ds(1.0f, 0.0f), ior = ds(surface->ior, surface->ior_low);
  const DoubleSingle3 direction = path->line.direction;
  const DoubleSingle slope = ds3_dot(direction, surface->normal);  // negative
  // Total internal reflection: the refracted share follows the mirrored ray.
  const DoubleSingle ratio = ds_select(ior, ds_over(one, ior), surface->entering);
  const DoubleSingle k =
      ds_minus(one, ds_times(ds_times(ratio, ratio), ds_minus(one, ds_times(slope, slope))));
  const intv passes = ds_high(k) > 0.0f;
  const floatv refracted = LANES_SELECT((floatv)(0.0f), surface->transparency, passes);
  const floatv mirrored = surface->reflectivity + surface->transparency - refracted;
  if (LANES_ANY(path->active & (mirrored > 0.0f))) {
    const DoubleSingle3 onwards =
        ds3_along(direction, surface->normal, ds_times(slope, ds(-2.0f, 0.0f)));
    paths[pending++] = bounced(path, surface, onwards, bias, mirrored, path->index);
  }
  if (LANES_ANY(path->active & (refracted > 0.0f))) {
    const DoubleSingle inward = ds_plus(ds_times(ratio, slope), ds_sqrt(ds_select(one, k, passes)));
    const DoubleSingle3 onwards =
        ds3_along(ds3_scaled(direction, ratio), surface->normal, ds_times(inward, ds(-1.0f, 0.0f)));
    paths[pending++] =
        bounced(path, surface, onwards, bias, refracted, ds_select(one, ior, surface->entering));
  }
  return pending;
}
#endif

#endif
