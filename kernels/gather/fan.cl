// SPDX-License-Identifier: Apache-2.0
// Backward ray tracing onto a wavefront recording plane (WRP), after Sun, Yuan, Bi et al., Opt.
// Express 28(23) 34994 (2020), Eq. 1-7.
//
// trace_fan: the same fan of rays starts at every pixel of the plane, away from the hologram. Each
// nearest hit at optical distance r adds
//   sqrt(radiance) / r * exp(2 pi i (r / wavelength + phase(cell)))
// to the pixel. The random phase belongs to the cubic cell of side p that the hit lies in. A miss
// adds nothing. Mirrors and glass are followed to RAYWAVE_BOUNCES further hits; each is a source at
// the length of its whole optical path. Where surfaces stand on the eye's side of the plane, rays
// start before all of them, on the same lines, and r counts from the plane: negative on that side.
//
// Arrays: the scene's (kernels/scene/arrays.h); fan: fan_size tangents; field: plane.ny rows of
// plane.nx complex samples, row 0 on top, written whole. A work-item fills RAYWAVE_LANES
// neighbouring pixels of one row. Global size: (ceil(nx / lanes), ny). OpenCL C 1.2.
#include "kernels/common/double_single.h"
#include "kernels/common/hash.h"
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/common/shared.h"
#include "kernels/gather/options.h"
#include "kernels/scene/bounce.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/shade.h"

// Largest whole number <= x, for |x| < 2^31.
static inline intv whole(floatv x) {
  const intv truncated = LANES_TO_INT(x);
  return truncated - LANES_SELECT((intv)(0), (intv)(1), LANES_TO_FLOAT(truncated) > x);
}

// Adds hits to (re, im), by the lengths of their paths and their turns.
static inline void add_hits(const TracePlane* plane, const Surface* surface, floatv radiance,
                            floatv length, floatv turns, intv hit, floatv* re, floatv* im) {
  // A pixel receives from what touches it the mean of 1 / r over a disc of its own width.
  const float nearest = 0.25f * fmin(plane->pitch_x, plane->pitch_y);
  // The offset keeps cell limits off z = 0, the scene's middle: a flat surface there would
  // alternate between two cells.
  const uintv key =
      cell_key(whole(surface->x * plane->sampling_rate), whole(surface->y * plane->sampling_rate),
               whole(surface->z * plane->sampling_rate + 0.31f));
  turns = turns_reduced(turns) + phase_turns(key, plane->seed);
  floatv c, s;
  cos_sin_turns(turns, &c, &s);
  const floatv amplitude = LANES_SELECT((floatv)(0.0f),
                                        copysign(sqrt(fmax(radiance, (floatv)(0.0f))), length) /
                                            fmax(fabs(length), (floatv)(nearest)),
                                        hit);
  *re += amplitude * c;
  *im += amplitude * s;
}

__kernel void trace_fan(SCENE_PARAMETERS, __global const float2* fan, int fan_size,
                        TracePlane plane, __global float2* field) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int row = (int)get_global_id(1);
  if (first >= plane.nx || row >= plane.ny) return;
  const SceneArrays scene = SCENE_OF_PARAMETERS;
  const intv column = first + LANES_INDEX;
  const DoubleSingle rate = ds(plane.turns_hi, plane.turns_lo), plane_z = ds(plane.z, plane.z_low);
  const DoubleSingle pixel_x =
      ds_plus(ds(plane.left, plane.left_low), ds_steps(column, plane.pitch_x, plane.pitch_x_low));
  const DoubleSingle pixel_y = ds_plus(ds(plane.top, plane.top_low),
                                       ds_steps((intv)(-row), plane.pitch_y, plane.pitch_y_low));
  const floatv x = ds_high(pixel_x), y = ds_high(pixel_y);

  floatv re = 0.0f, im = 0.0f;
  for (int ray = 0; ray < fan_size; ++ray) {
    const DoubleSingle tangent_x = ds((floatv)(fan[ray].x), 0.0f),
                       tangent_y = ds((floatv)(fan[ray].y), 0.0f);
    const floatv tx = ds_high(tangent_x), ty = ds_high(tangent_y);
    // The SLM's pixels cannot show light that arrives at steeper angles.
    const floatv slope = sqrt(1.0f + tx * tx + ty * ty);
    const intv shown = (column < plane.nx) & (fabs(tx) <= plane.sine_limit_x * slope) &
                       (fabs(ty) <= plane.sine_limit_y * slope);
    const DoubleSingle ahead = ds((floatv)(plane.ahead), 0.0f), one = ds(1.0f, 0.0f);
    const DoubleSingle3 pixel = {pixel_x, pixel_y, plane_z}, way = {tangent_x, tangent_y, one};
    Line line = {ds3_along(pixel, way, ahead), way};
    Rays rays = {
        x + plane.ahead * tx, y + plane.ahead * ty, (floatv)(plane.z + plane.ahead), tx,   ty,
        (floatv)(1.0f),       (floatv)(0.0f),       (floatv)(plane.reach),           shown};
    // Paths still to be followed: the ray's own, and those that mirrors and glass add
    int pending = 1;
#if RAYWAVE_BOUNCES > 0
    Path paths[BOUNCE_PATHS];
    paths[0] = path_from(&line, shown);
    const DoubleSingle along = ds_times(ahead, ds_sqrt(ds3_dot(way, way)));
    paths[0].length = ds_high(along);
    paths[0].turns = turns_reduced(ds_turns(ds_times(along, rate)));
#endif
    while (pending > 0) {
      --pending;
#if RAYWAVE_BOUNCES > 0
      Path path = paths[pending];
      line = path.line;
      rays = rays_of(&path, plane.reach);
#endif
      const Hits hits = bvh_nearest(&scene.tree, &rays);
      const intv hit = hits.triangle >= 0;
      if (!LANES_ANY(hit)) continue;
      Surface surface = surface_at(&scene, &rays, &hits);
      LOOK_FOR_LIGHTS(&surface, light_place_of(ray + column, (intv)(ray / 4 + row)));
#if REFINED_SURFACES
      const DoubleSingle distance = refine_surface(&scene, &line, &hits, &surface);
#else
      const TrianglePlanes planes = triangle_planes_of(&scene.tree, hits.triangle);
      const DoubleSingle distance = refined_distance(&planes, &line, hits.t);
#endif
      floatv radiance = phong(&scene, &surface, plane.bias, plane.reach, false, hit);
#if RAYWAVE_BOUNCES > 0
      path.active = hit;
      reach_surface(&path, distance);
      path.length += ds_high(distance) / ds_high(path.index);
      path.turns =
          turns_reduced(path.turns + ds_turns(ds_times(ds_times(distance, path.index), rate)));
      radiance *= own_share(&path, &surface);
      floatv length = path.length;
      floatv turns = path.turns;
      pending = bounce(&path, &surface, plane.bias, paths, pending);
#else
      radiance *= 1.0f - surface.reflectivity - surface.transparency;
      const DoubleSingle from_plane = ds_plus(ahead, distance);
      floatv length;
      floatv turns = path_turns(ds_times(from_plane, tangent_x), ds_times(from_plane, tangent_y),
                                from_plane, rate, &length);
      turns *= copysign((floatv)(1.0f), ds_high(from_plane));
      length = copysign(length, ds_high(from_plane));
#endif
      add_hits(&plane, &surface, radiance, length, turns, hit, &re, &im);
    }
  }

  float res[RAYWAVE_LANES], ims[RAYWAVE_LANES];
  LANES_STORE(re, res);
  LANES_STORE(im, ims);
  __global float2* out = field + (size_t)row * (size_t)plane.nx;
  for (int i = 0; i < RAYWAVE_LANES && first + i < plane.nx; ++i) {
    out[first + i] = (float2)(res[i], ims[i]);
  }
}
