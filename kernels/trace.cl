// SPDX-License-Identifier: Apache-2.0
// Backward ray tracing onto a wavefront recording plane (WRP), after Sun, Yuan, Bi et al., Opt. Express 28(23) 34994 (2020), Eq. 1-7.
//
// trace_fan: from every pixel of the plane starts the same fan of rays, away from the hologram. Each nearest hit at optical distance r adds
//   sqrt(radiance) / r * exp(2 pi i (r / wavelength + phase(cell)))
// to the pixel; the random phase belongs to the cubic cell of side p that the hit lies in. A miss adds nothing. Mirrors and glass are
// followed to RAYWAVE_BOUNCES further hits, each a source at the length of its whole optical path.
//
// Arrays: the scene's (shared.h); rays: ray_count; field: plane.ny rows of plane.nx complex samples, row 0 on top, written whole.
// A work-item fills RAYWAVE_LANES neighbouring pixels of one row: global size (ceil(nx / lanes), ny). OpenCL C 1.2.
#include "bvh.h"
#include "hash.h"
#include "lanes.h"
#include "phase.h"
#include "shade.h"
#include "shared.h"

#ifndef RAYWAVE_BOUNCES
#define RAYWAVE_BOUNCES 0  // mirror and refraction bounces; host/tracer.cpp
#endif

// Whole part of x towards minus infinity, for |x| < 2^31.
static inline intv whole(floatv x) {
  const intv truncated = LANES_TO_INT(x);
  return truncated - LANES_SELECT((intv)(0), (intv)(1), LANES_TO_FLOAT(truncated) > x);
}

#if RAYWAVE_BOUNCES > 0
typedef struct {
  Rays rays;
  floatv weight;  // share of the light that this way carries
  floatv length;  // optical, in metres
  floatv turns;   // the same, reduced
  floatv index;   // of refraction along the ray
  int bounces_left;
} Way;

static inline Way bounced(const Way* way, const Surface* s, floatv dx, floatv dy, floatv dz, float side, float bias, float reach,
                          floatv share, floatv index) {
  Way next = *way;
  next.rays.ox = s->x + side * bias * s->nx;
  next.rays.oy = s->y + side * bias * s->ny;
  next.rays.oz = s->z + side * bias * s->nz;
  next.rays.dx = dx;
  next.rays.dy = dy;
  next.rays.dz = dz;
  next.rays.t_min = 0.0f;
  next.rays.t_max = reach;
  next.weight = way->weight * share;
  next.index = index;
  next.rays.active = way->rays.active & (next.weight > 0.0f);
  next.bounces_left = way->bounces_left - 1;
  return next;
}
#endif

__kernel void trace_fan(__global const BvhNode* nodes, __global const Triangle* triangles, __global const TriangleShading* shading,
                        __global const Material* materials, __global const Light* lights, __global const float* texels, float ambient_light,
                        __global const FanRay* fan, int fan_size, TracePlane plane, __global float2* field) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int row = (int)get_global_id(1);
  if (first >= plane.nx || row >= plane.ny) return;
  const SceneArrays scene = {nodes, triangles, shading, materials, lights, texels};
  const intv column = first + LANES_INDEX;
  const floatv x = plane.left + plane.pitch_x * LANES_TO_FLOAT(column);
  const floatv y = plane.top - plane.pitch_y * (float)row;

  floatv re = 0.0f, im = 0.0f;
  for (int ray = 0; ray < fan_size; ++ray) {
    const FanRay direction = fan[ray];
    Rays rays = {x,
                 y,
                 (floatv)(plane.z),
                 (floatv)(direction.x),
                 (floatv)(direction.y),
                 (floatv)(1.0f),
                 (floatv)(0.0f),
                 (floatv)(plane.reach),
                 column < plane.nx};
#if RAYWAVE_BOUNCES > 0
    // Ways still to follow, deepest last: each hit leaves at most one more than it takes, so depth + 1 places hold them all.
    Way ways[RAYWAVE_BOUNCES + 1];
    int pending = 1;
    ways[0].rays = rays;
    ways[0].weight = ways[0].index = 1.0f;
    ways[0].length = ways[0].turns = 0.0f;
    ways[0].bounces_left = RAYWAVE_BOUNCES;
    while (pending > 0) {
      Way way = ways[--pending];
      rays = way.rays;
#endif
      const Hits hits = bvh_nearest(nodes, triangles, &rays);
      const intv hit = hits.triangle >= 0;
      if (!LANES_ANY(hit)) continue;
      const Surface surface = surface_at(&scene, &rays, &hits);
      floatv radiance = phong(&scene, &rays, &surface, ambient_light, plane.bias, plane.reach, hit);
#if RAYWAVE_BOUNCES > 0
      way.rays.active = hit;
      const floatv speed = sqrt(rays.dx * rays.dx + rays.dy * rays.dy + rays.dz * rays.dz);
      const floatv segment = hits.t * speed * way.index;
      way.length += segment;
      way.turns = turns_reduced(way.turns + turns_of_length(segment, plane.turns_hi, plane.turns_lo));
      radiance *= way.weight * (1.0f - surface.reflectivity - surface.transparency);
      const floatv length = way.length;
      floatv turns = way.turns;
      if (way.bounces_left > 0) {
        const floatv dx = rays.dx / speed, dy = rays.dy / speed, dz = rays.dz / speed;
        const floatv along = -(dx * surface.nx + dy * surface.ny + dz * surface.nz);
        // Total reflection sends the refracted share along the mirrored ray.
        const floatv ratio = LANES_SELECT(surface.ior, 1.0f / surface.ior, surface.entering);
        const floatv k = 1.0f - ratio * ratio * (1.0f - along * along);
        const floatv refracted = LANES_SELECT((floatv)(0.0f), surface.transparency, k > 0.0f);
        const floatv mirrored = surface.reflectivity + surface.transparency - refracted;
        if (LANES_ANY(hit & (mirrored > 0.0f))) {
          ways[pending++] = bounced(&way, &surface, dx + 2.0f * along * surface.nx, dy + 2.0f * along * surface.ny,
                                    dz + 2.0f * along * surface.nz, 1.0f, plane.bias, plane.reach, mirrored, way.index);
        }
        if (LANES_ANY(hit & (refracted > 0.0f))) {
          const floatv inward = ratio * along - sqrt(fmax(k, (floatv)(0.0f)));
          ways[pending++] =
              bounced(&way, &surface, ratio * dx + inward * surface.nx, ratio * dy + inward * surface.ny, ratio * dz + inward * surface.nz,
                      -1.0f, plane.bias, plane.reach, refracted, LANES_SELECT((floatv)(1.0f), surface.ior, surface.entering));
        }
      }
#else
    const floatv length = hits.t * direction.length;
    floatv turns = turns_of_length(hits.t, direction.turns_hi, direction.turns_lo);
#endif
      turns += phase_turns(
          cell_key(whole(surface.x * plane.sampling_rate), whole(surface.y * plane.sampling_rate), whole(surface.z * plane.sampling_rate)),
          plane.seed);
      floatv c, s;
      cos_sin_turns(turns, &c, &s);
      const floatv amplitude = LANES_SELECT((floatv)(0.0f), sqrt(fmax(radiance, (floatv)(0.0f))) / fmax(length, (floatv)(1e-12f)), hit);
      re += amplitude * c;
      im += amplitude * s;
#if RAYWAVE_BOUNCES > 0
    }
#endif
  }

  float res[RAYWAVE_LANES], ims[RAYWAVE_LANES];
  LANES_STORE(re, res);
  LANES_STORE(im, ims);
  __global float2* out = field + (size_t)row * (size_t)plane.nx;
  for (int i = 0; i < RAYWAVE_LANES && first + i < plane.nx; ++i) out[first + i] = (float2)(res[i], ims[i]);
}
