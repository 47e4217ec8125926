// SPDX-License-Identifier: Apache-2.0
// Mirrors and glass: optical paths that end in a pixel, followed backwards from hit to hit, for
// packets of lanes.
#ifndef RAYWAVE_BOUNCE_H
#define RAYWAVE_BOUNCE_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/scene/fresnel.h"
#include "kernels/scene/hit_refinement.h"
#include "kernels/scene/options.h"
#include "kernels/scene/surface.h"

#if RAYWAVE_BOUNCES > 0
typedef struct {
  Line line;       // its direction has unit length
  floatv nearest;  // hits closer than this along the line are ignored
  floatv weight;   // share of the light that this path carries
  // Sum of the segments' lengths over their refractive indices, metres: decides the amplitude
  floatv length;
  floatv turns;        // optical path, reduced
  DoubleSingle index;  // refractive index along the line
  floatv attenuation;  // in the medium along the line, per metre
  intv active;
  int bounces_left;
} Path;

// A path that carries less of the light ends.
#define LEAST_PATH_WEIGHT 1e-3f

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
  path.nearest = path.length = path.turns = path.attenuation = 0.0f;
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

// Takes from the path's light what its medium absorbs on the way to a surface.
static inline void reach_surface(Path* path, DoubleSingle distance) {
  path->weight *= attenuated_share(path->attenuation, ds_high(distance));
}

// Share of the light seen along the path that the surface itself emits.
static inline floatv own_share(const Path* path, const Surface* s) {
  return path->weight * (1.0f - s->reflectivity - s->transparency);
}

// The path onwards from a surface in a unit direction. It starts on the surface itself, so that its
// length is exact, and ignores hits within `bias` of the surface.
static inline Path bounced(const Path* path, const Surface* s, DoubleSingle3 direction, float bias,
                           floatv share, DoubleSingle index, floatv attenuation) {
  const floatv slope =
      ds_high(direction.x) * s->nx + ds_high(direction.y) * s->ny + ds_high(direction.z) * s->nz;
  Path next = *path;
  next.line.origin = s->place;
  next.line.direction = direction;
  next.nearest = bias / fmax(fabs(slope), (floatv)(0x1p-6f));
  next.weight = path->weight * share;
  next.index = index;
  next.attenuation = attenuation;
  next.active = path->active & (next.weight >= LEAST_PATH_WEIGHT);
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
  // A clear surface mirrors what it does not let through: all of it at total internal reflection.
  const DoubleSingle ratio = ds_select(ior, ds_over(one, ior), surface->entering);
  const DoubleSingle k =
      ds_minus(one, ds_times(ds_times(ratio, ratio), ds_minus(one, ds_times(slope, slope))));
  const intv passes = ds_high(k) > 0.0f;
  const floatv refracted =
      surface->transparency * (1.0f - fresnel_share(ds_high(ratio), -ds_high(slope), ds_high(k)));
  const floatv mirrored = surface->reflectivity + surface->transparency - refracted;
  if (LANES_ANY(path->active & (mirrored > 0.0f))) {
    const DoubleSingle3 onwards =
        ds3_along(direction, surface->normal, ds_times(slope, ds(-2.0f, 0.0f)));
    paths[pending++] =
        bounced(path, surface, onwards, bias, mirrored, path->index, path->attenuation);
  }
  if (LANES_ANY(path->active & (refracted > 0.0f))) {
    const DoubleSingle inward = ds_plus(ds_times(ratio, slope), ds_sqrt(ds_select(one, k, passes)));
    const DoubleSingle3 onwards =
        ds3_along(ds3_scaled(direction, ratio), surface->normal, ds_times(inward, ds(-1.0f, 0.0f)));
    paths[pending++] =
        bounced(path, surface, onwards, bias, refracted, ds_select(one, ior, surface->entering),
                LANES_SELECT((floatv)(0.0f), surface->attenuation, surface->entering));
  }
  return pending;
}
#endif

#endif
