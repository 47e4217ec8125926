// SPDX-License-Identifier: Apache-2.0
// Backward ray tracing onto a wavefront recording plane (WRP), after Sun, Yuan, Bi et al., Opt.
// Express 28(23) 34994 (2020), Eq. 1-7.
//
// trace_fan: the same fan of rays starts at every pixel of the plane, away from the hologram. Each
// nearest hit at optical distance r adds
//   sqrt(radiance) / r * exp(2 pi i (r / wavelength + phase(cell)))
// to the pixel. The random phase belongs to the cubic cell of side p that the hit lies in. A miss
// adds nothing. Mirrors and glass are followed to RAYWAVE_BOUNCES further hits; each is a source at
// the length of its whole optical path. RAYWAVE_SOURCE chooses sources on the lattice instead of
// the hits.
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

// A point that light comes from, and the mask of lanes that have one.
typedef struct {
  DoubleSingle3 place;
  uintv key;
  floatv weight;
  intv found;
} Source;

// Largest whole number <= x, for |x| < 2^31.
static inline intv whole(floatv x) {
  const intv truncated = LANES_TO_INT(x);
  return truncated - LANES_SELECT((intv)(0), (intv)(1), LANES_TO_FLOAT(truncated) > x);
}

#if RAYWAVE_SOURCE == SOURCE_SURFACE
// The sample nearest to the hit among those of the hit's lattice cell.
static inline Source table_source(__global const Sample* samples, __global const int* first_of_cell,
                                  const Lattice* lattice, const Surface* s, intv hit) {
  const floatv away = s->z - lattice->centre_z;
  const intv i = whole((s->x - lattice->centre_x) / (away * lattice->step)) - lattice->first_x;
  const intv j = whole((s->y - lattice->centre_y) / (away * lattice->step)) - lattice->first_y;
  const intv inside = hit & (i >= 0) & (i < lattice->nx) & (j >= 0) & (j < lattice->ny);
  int cells[RAYWAVE_LANES], wanted[RAYWAVE_LANES], found[RAYWAVE_LANES];
  float zs[RAYWAVE_LANES], xs[RAYWAVE_LANES], ys[RAYWAVE_LANES], weights[RAYWAVE_LANES];
  uint keys[RAYWAVE_LANES];
  LANES_STORE(j * lattice->nx + i, cells);
  LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), inside), wanted);
  LANES_STORE(s->z, zs);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    const float z = zs[lane];
    // Hits farther off belong to a layer that the lattice missed.
    float nearest = 4.0f * lattice->step * (z - lattice->centre_z);
    found[lane] = 0;
    xs[lane] = ys[lane] = weights[lane] = 0.0f;
    keys[lane] = 0;
    if (!wanted[lane]) continue;
    for (int index = first_of_cell[cells[lane]]; index < first_of_cell[cells[lane] + 1]; ++index) {
      __global const Sample* sample = samples + index;
      if (fabs(sample->z - z) >= nearest) continue;
      nearest = fabs(sample->z - z);
      found[lane] = 1;
      xs[lane] = sample->x;
      ys[lane] = sample->y;
      zs[lane] = sample->z;
      keys[lane] = sample->key;
      weights[lane] = 1.0f / sample->weight;  // lattice cells widen with depth
    }
  }
  const Source source = {ds3(LANES_LOAD(xs), LANES_LOAD(ys), LANES_LOAD(zs)), LANES_LOAD(keys),
                         LANES_LOAD(weights), LANES_LOAD(found) != 0};
  return source;
}
#endif

#if RAYWAVE_SOURCE != SOURCE_HIT && RAYWAVE_BOUNCES > 0
// The point near the hit where the surface meets a lattice line: the line of the lattice of side p,
// along the ray's dominant axis, through the hit's cell.
static inline Source axis_source(const SceneArrays* scene, const Rays* rays, const Surface* s,
                                 float rate, intv hit) {
  const floatv ax = fabs(rays->dx), ay = fabs(rays->dy), az = fabs(rays->dz);
  const intv along_x = (ax > ay) & (ax > az), along_y = (!along_x) & (ay > az);
  const intv i = whole(s->x * rate), j = whole(s->y * rate), k = whole(s->z * rate);
  const floatv p = 1.0f / rate, zero = 0.0f;
  const intv along_z = (!along_x) & (!along_y);
  Rays line;
  line.dx =
      LANES_SELECT(zero, LANES_SELECT((floatv)(1.0f), (floatv)(-1.0f), rays->dx < 0.0f), along_x);
  line.dy =
      LANES_SELECT(zero, LANES_SELECT((floatv)(1.0f), (floatv)(-1.0f), rays->dy < 0.0f), along_y);
  line.dz =
      LANES_SELECT(zero, LANES_SELECT((floatv)(1.0f), (floatv)(-1.0f), rays->dz < 0.0f), along_z);
  line.ox = LANES_SELECT((LANES_TO_FLOAT(i) + 0.5f) * p, s->x, along_x) - 2.0f * p * line.dx;
  line.oy = LANES_SELECT((LANES_TO_FLOAT(j) + 0.5f) * p, s->y, along_y) - 2.0f * p * line.dy;
  line.oz = LANES_SELECT((LANES_TO_FLOAT(k) + 0.5f) * p, s->z, along_z) - 2.0f * p * line.dz;
  line.t_min = 0.0f;
  line.t_max = 4.0f * p;
  line.active = hit;
  const Hits meets = bvh_nearest(&scene->tree, &line);
  Source source;
  const Line exact = {ds3(line.ox, line.oy, line.oz), ds3(line.dx, line.dy, line.dz)};
  const TrianglePlanes planes = triangle_planes_of(&scene->tree, meets.triangle);
  source.place =
      ds3_along(exact.origin, exact.direction, refined_distance(&planes, &exact, meets.t));
  // The key contains the line and the material: the third cell index of a flat surface would depend
  // on rounding.
  int third[RAYWAVE_LANES];
  LANES_STORE(meets.triangle, third);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane)
    third[lane] = third[lane] < 0 ? 0 : 3 * scene->tree.triangles[third[lane]].material;
  source.key =
      cell_key(LANES_SELECT(i, j, along_x), LANES_SELECT(j, k, !along_z),
               LANES_LOAD(third) +
                   LANES_SELECT(LANES_SELECT((intv)(0), (intv)(1), along_y), (intv)(2), along_x));
  source.weight = 1.0f;
  source.found = meets.triangle >= 0;
  return source;
}
#endif

__kernel void trace_fan(SCENE_PARAMETERS, __global const float2* fan, int fan_size,
                        TracePlane plane, __global const Sample* samples,
                        __global const int* first_of_cell, Lattice lattice,
                        __global float2* field) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int row = (int)get_global_id(1);
  if (first >= plane.nx || row >= plane.ny) return;
#if RAYWAVE_SOURCE != SOURCE_SURFACE
  (void)samples, (void)first_of_cell, (void)lattice;
#endif
  const SceneArrays scene = SCENE_OF_PARAMETERS;
  const intv column = first + LANES_INDEX;
  const DoubleSingle rate = ds(plane.turns_hi, plane.turns_lo), plane_z = ds(plane.z, plane.z_low);
  const DoubleSingle pixel_x =
      ds_plus(ds(plane.left, plane.left_low), ds_steps(column, plane.pitch_x, plane.pitch_x_low));
  const DoubleSingle pixel_y = ds_plus(ds(plane.top, plane.top_low),
                                       ds_steps((intv)(-row), plane.pitch_y, plane.pitch_y_low));
  const floatv x = ds_high(pixel_x), y = ds_high(pixel_y);
  const DoubleSingle convergence = ds(plane.convergence, plane.convergence_low);
  const DoubleSingle turned_x =
      ds_times(convergence, ds_minus(pixel_x, ds(plane.axis_x, plane.axis_x_low)));
  const DoubleSingle turned_y =
      ds_times(convergence, ds_minus(pixel_y, ds(plane.axis_y, plane.axis_y_low)));

  // A pixel receives from what touches it the mean of 1 / r over a disc of its own width.
  const float nearest = 0.25f * fmin(plane.pitch_x, plane.pitch_y);

  floatv re = 0.0f, im = 0.0f;
  for (int ray = 0; ray < fan_size; ++ray) {
    const DoubleSingle tangent_x = ds_plus(ds(fan[ray].x, 0.0f), turned_x),
                       tangent_y = ds_plus(ds(fan[ray].y, 0.0f), turned_y);
    const floatv tx = ds_high(tangent_x), ty = ds_high(tangent_y);
    // The SLM's pixels cannot show light that arrives at steeper angles.
    const floatv slope = sqrt(1.0f + tx * tx + ty * ty);
    const intv shown = (column < plane.nx) & (fabs(tx) <= plane.sine_limit_x * slope) &
                       (fabs(ty) <= plane.sine_limit_y * slope);
    Line line = {{pixel_x, pixel_y, plane_z}, {tangent_x, tangent_y, ds(1.0f, 0.0f)}};
    Rays rays = {
        x,    y, (floatv)(plane.z), tx, ty, (floatv)(1.0f), (floatv)(0.0f), (floatv)(plane.reach),
        shown};
    // Paths still to be followed: the ray's own, and those that mirrors and glass add
    int pending = 1;
#if RAYWAVE_BOUNCES > 0
    Path paths[BOUNCE_PATHS];
    paths[0] = path_from(&line, shown);
#endif
    while (pending > 0) {
      --pending;
#if RAYWAVE_BOUNCES > 0
      Path path = paths[pending];
      line = path.line;
      rays = rays_of(&path, plane.reach);
#if RAYWAVE_SOURCE != SOURCE_HIT
      const bool bounced_before = path.bounces_left < RAYWAVE_BOUNCES;
#endif
#elif RAYWAVE_SOURCE == SOURCE_SURFACE
      const bool bounced_before = false;
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
      floatv radiance = phong(&scene, &surface, plane.bias, plane.reach, hit);
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
      floatv length;
      floatv turns = path_turns(ds_times(distance, tangent_x), ds_times(distance, tangent_y),
                                distance, rate, &length);
#endif
#if RAYWAVE_SOURCE == SOURCE_BOUNCED
      if (!bounced_before) continue;
#endif

      // The source that the hit stands for, and the optical path to it.
      Source source;
#if RAYWAVE_SOURCE == SOURCE_HIT
      // The offset keeps cell limits off z = 0, the scene's middle, where a flat surface would
      // alternate between two cells.
      source.key =
          cell_key(whole(surface.x * plane.sampling_rate), whole(surface.y * plane.sampling_rate),
                   whole(surface.z * plane.sampling_rate + 0.31f));
      source.weight = 1.0f;
      source.found = hit;
#else
#if RAYWAVE_SOURCE == SOURCE_SURFACE
      if (!bounced_before) {
        source = table_source(samples, first_of_cell, &lattice, &surface, hit);
        // The path leads to the sample itself: all pixels that see it must agree on its position.
        const DoubleSingle3 path_there = ds3_minus(source.place, line.origin);
        turns = path_turns(path_there.x, path_there.y, path_there.z, rate, &length);
      }
#endif
#if RAYWAVE_BOUNCES > 0
      if (bounced_before) {
        source = axis_source(&scene, &rays, &surface, plane.sampling_rate, hit);
        // From the hit to the source: along the ray, and across it by the curvature of a wave of
        // this length.
        const DoubleSingle3 off = ds3_minus(source.place, surface.place);
        const DoubleSingle along = ds3_dot(off, line.direction);
        const floatv across_squared = ds_high(ds_minus(ds3_dot(off, off), ds_times(along, along)));
        const floatv curved =
            fmax(across_squared, (floatv)(0.0f)) / (2.0f * fmax(length, (floatv)(1e-12f)));
        length += ds_high(along) / ds_high(path.index);
        turns += ds_turns(ds_times(ds_plus(ds_times(along, path.index), ds(curved, 0.0f)), rate));
      }
#endif
      source.weight *=
          length * length * plane.step_x * plane.step_y * plane.sampling_rate * plane.sampling_rate;
#endif

      turns = turns_reduced(turns) + phase_turns(source.key, plane.seed);
      floatv c, s;
      cos_sin_turns(turns, &c, &s);
      const floatv amplitude = LANES_SELECT(
          (floatv)(0.0f),
          source.weight * sqrt(fmax(radiance, (floatv)(0.0f))) / fmax(length, (floatv)(nearest)),
          hit & source.found);
      re += amplitude * c;
      im += amplitude * s;
    }
  }

  float res[RAYWAVE_LANES], ims[RAYWAVE_LANES];
  LANES_STORE(re, res);
  LANES_STORE(im, ims);
  __global float2* out = field + (size_t)row * (size_t)plane.nx;
  for (int i = 0; i < RAYWAVE_LANES && first + i < plane.nx; ++i) {
    const float2 sum = (float2)(res[i], ims[i]);
    out[first + i] = RAYWAVE_SOURCE == SOURCE_BOUNCED ? out[first + i] + sum : sum;
  }
}
