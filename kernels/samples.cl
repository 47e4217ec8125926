// SPDX-License-Identifier: Apache-2.0
// The sample table: every place where a ray of the lattice (shared.h) pierces a surface is one source of light. Pixels that see it all use
// the same position and phase; that makes their sum a spherical wave (docs/pipeline.md).
//
// count_layers   layers[cell] = number of samples of each cell (nx * ny cells, row by row)
// write_samples  the samples of cell c to samples[first[c]] and on; first: nx * ny + 1 sums of the counts
// write_samples  also sets lit[i * words + l / 32], bit l % 32: light l falls on sample i; words = (RAYWAVE_LIGHTS + 31) / 32, at least 1
// find_hidden    samples[i].hidden and tilt: what can stand between the sample and the parts of the hologram, and its projected area
//
// The first two handle RAYWAVE_LANES cells of one row per work-item: global size (ceil(nx / lanes), ny). OpenCL C 1.2.
#pragma OPENCL FP_CONTRACT OFF  // both passes must find the same layers
#include "bvh.h"
#include "hash.h"
#include "lanes.h"
#include "pyramid.h"
#include "shade.h"
#include "shared.h"

#define LIT_WORDS (RAYWAVE_LIGHTS > 32 ? (RAYWAVE_LIGHTS + 31) / 32 : 1)

#ifndef RAYWAVE_ANTIALIAS
#define RAYWAVE_ANTIALIAS 1  // cells are looked at with 4 x 4 rays besides the one through their centre; host/samples.cpp
#endif
#define CELL_RAYS (RAYWAVE_ANTIALIAS ? 17 : 1)

// Ray `which` through the cells (first + lane, row): 0 through the centre, 1 to 16 through the centres of 4 x 4 parts, the inner ones
// first.
static inline Rays lattice_rays(const Lattice* lattice, int first, int row, int which) {
  const int order[16] = {5, 6, 9, 10, 1, 2, 4, 7, 8, 11, 13, 14, 0, 3, 12, 15};
  const int part = which > 0 ? order[which - 1] : 0;
  const float right = which > 0 ? 0.125f + 0.25f * (float)(part % 4) : 0.5f, up = which > 0 ? 0.125f + 0.25f * (float)(part / 4) : 0.5f;
  const intv column = first + LANES_INDEX;
  Rays rays;
  rays.dx = (LANES_TO_FLOAT(lattice->first_x + column) + right) * lattice->step;
  rays.dy = ((float)(lattice->first_y + row) + up) * lattice->step;
  rays.dz = 1.0f;
  rays.ox = lattice->centre_x + (lattice->near_z - lattice->centre_z) * rays.dx;
  rays.oy = lattice->centre_y + (lattice->near_z - lattice->centre_z) * rays.dy;
  rays.oz = lattice->near_z;
  rays.t_min = 0.0f;
  rays.t_max = lattice->reach;
  rays.active = column < lattice->nx;
  return rays;
}

// Hits that become samples: both sides of open meshes, outsides of closed ones.
static inline intv is_source(const SceneArrays* scene, const Rays* rays, const Hits* hits) {
  int triangle[RAYWAVE_LANES], keep[RAYWAVE_LANES];
  float dx[RAYWAVE_LANES], dy[RAYWAVE_LANES];
  LANES_STORE(hits->triangle, triangle);
  LANES_STORE(rays->dx, dx);
  LANES_STORE(rays->dy, dy);
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    keep[i] = 0;
    if (triangle[i] < 0) continue;
    const int side = scene->shading[triangle[i]].side;
    __global const Triangle* t = scene->triangles + triangle[i];
    const float3 ab = (float3)(t->b[0] - t->a[0], t->b[1] - t->a[1], t->b[2] - t->a[2]);
    const float3 ac = (float3)(t->c[0] - t->a[0], t->c[1] - t->a[1], t->c[2] - t->a[2]);
    const float along = (ab.y * ac.z - ab.z * ac.y) * dx[i] + (ab.z * ac.x - ab.x * ac.z) * dy[i] + (ab.x * ac.y - ab.y * ac.x);
    keep[i] = side == 0 || along * (float)side < 0.0f;
  }
  return LANES_LOAD(keep) != 0;
}

// Steps to the next layer behind the last hits; lanes without one fall out.
static inline void beyond(Rays* rays, const Hits* hits, float gap) {
  rays->active &= hits->triangle >= 0;
  rays->t_min = LANES_SELECT(rays->t_min, hits->t + gap, hits->triangle >= 0);
}

// The same layer: within what a slope of 80 degrees spans in a cell.
static inline floatv layer_reach(const Lattice* lattice, floatv t) {
  return 4.0f * lattice->step * (t + (lattice->near_z - lattice->centre_z));
}

// The hit of ray `which` on the layer at distance t; a miss where it has none.
static inline Hits layer_hit(const SceneArrays* scene, const Lattice* lattice, int first, int row, int which, floatv t, intv active,
                             Rays* ray) {
  *ray = lattice_rays(lattice, first, row, which);
  const floatv reach = layer_reach(lattice, t);
  ray->t_min = fmax(t - reach, (floatv)(0.0f));
  ray->t_max = t + reach;
  ray->active &= active;
  Hits found = {ray->t_max, (intv)(-1), (floatv)(0.0f), (floatv)(0.0f)};
  while (LANES_ANY(ray->active)) {
    const Hits hits = bvh_nearest(scene->nodes, scene->triangles, ray);
    const intv source = is_source(scene, ray, &hits);
    found.t = LANES_SELECT(found.t, hits.t, source);
    found.triangle = LANES_SELECT(found.triangle, hits.triangle, source);
    found.u = LANES_SELECT(found.u, hits.u, source);
    found.v = LANES_SELECT(found.v, hits.v, source);
    ray->active &= !source;
    beyond(ray, &hits, lattice->layer_gap);
  }
  return found;
}

// Of a ray's hits, those on layers that no ray before it has met: each becomes a sample.
static inline intv is_new(const SceneArrays* scene, const Lattice* lattice, int first, int row, int which, const Rays* rays,
                          const Hits* hits) {
  intv fresh = is_source(scene, rays, hits);
  for (int before = 0; before < which && LANES_ANY(fresh); ++before) {
    Rays ray;
    fresh &= layer_hit(scene, lattice, first, row, before, hits->t, fresh, &ray).triangle < 0;
  }
  return fresh;
}

__kernel void count_layers(__global const BvhNode* nodes, __global const Triangle* triangles, __global const TriangleShading* shading,
                           Lattice lattice, __global int* layers) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int row = (int)get_global_id(1);
  if (first >= lattice.nx || row >= lattice.ny) return;
  const SceneArrays scene = {nodes, triangles, shading, 0, 0, 0};
  intv count = 0;
  for (int which = 0; which < CELL_RAYS; ++which) {
    Rays rays = lattice_rays(&lattice, first, row, which);
    while (LANES_ANY(rays.active)) {
      const Hits hits = bvh_nearest(nodes, triangles, &rays);
      count += LANES_SELECT((intv)(0), (intv)(1), is_new(&scene, &lattice, first, row, which, &rays, &hits));
      beyond(&rays, &hits, lattice.layer_gap);
    }
  }
  int counts[RAYWAVE_LANES];
  LANES_STORE(count, counts);
  for (int i = 0; i < RAYWAVE_LANES && first + i < lattice.nx; ++i) layers[row * lattice.nx + first + i] = counts[i];
}

// Radiance without highlights, and which lights it comes from.
static inline floatv scattered(const SceneArrays* scene, const Surface* s, float ambient_light, const Lattice* lattice, intv active,
                               uintv* words) {
  floatv radiance = s->ambient * ambient_light;
  for (int w = 0; w < LIT_WORDS; ++w) words[w] = 0;
#if RAYWAVE_LIGHTS > 0
  for (int l = 0; l < RAYWAVE_LIGHTS; ++l) {
    const Incident in = incident(scene->lights, l, s, lattice->reach);
    const intv lit = lit_by(scene, &in, s, lattice->bias, active);
    radiance += LANES_SELECT((floatv)(0.0f), s->diffuse * in.facing * in.intensity, lit);
    words[l / 32] |= LANES_AS_UINT(LANES_SELECT((intv)(0), (intv)(1), lit)) << (l % 32);
  }
#else
  (void)scene, (void)lattice, (void)active;
#endif
  return radiance;
}

// A sample shines for its whole cell: `coverage` becomes the share of the cell's rays that meet its layer, `radiance` the mean over them.
// Without that, edges of objects, textures and shadows move by half a cell.
static inline void average_over_cell(const SceneArrays* scene, const Lattice* lattice, int first, int row, const Hits* hits,
                                     float ambient_light, intv active, floatv* radiance, floatv* coverage) {
  floatv sum = 0.0f, count = 0.0f;
  for (int which = 1; which < CELL_RAYS; ++which) {
    Rays ray;
    const Hits near = layer_hit(scene, lattice, first, row, which, hits->t, active, &ray);
    const intv found = active & (near.triangle >= 0);
    if (!LANES_ANY(found)) continue;
    count += LANES_SELECT((floatv)(0.0f), (floatv)(1.0f), found);
#if RAYWAVE_TEXTURES || RAYWAVE_SHADOWS
    const Surface s = surface_at(scene, &ray, &near);
    uintv words[LIT_WORDS];
    sum += LANES_SELECT((floatv)(0.0f), scattered(scene, &s, ambient_light, lattice, found, words), found);
#else
    (void)ambient_light;
#endif
  }
#if RAYWAVE_TEXTURES || RAYWAVE_SHADOWS
  *radiance = LANES_SELECT(*radiance, sum / fmax(count, (floatv)(1.0f)), count > 0.0f);
#else
  (void)sum;
#endif
  *coverage = CELL_RAYS > 1 ? count * (1.0f / 16.0f) : (floatv)(1.0f);
}

// Where the centre ray meets the plane of the triangle that some ray of the cell has hit. Samples of edges then lie on the lattice too,
// whichever ray has found them.
static inline floatv through_centre(const SceneArrays* scene, const Lattice* lattice, const Rays* centre, const Rays* rays,
                                    const Hits* hits) {
  int triangle[RAYWAVE_LANES];
  float nx[RAYWAVE_LANES], ny[RAYWAVE_LANES], nz[RAYWAVE_LANES];
  LANES_STORE(hits->triangle, triangle);
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    const float3 n = triangle[i] < 0 ? (float3)(0.0f, 0.0f, 1.0f) : triangle_normal(scene->triangles + triangle[i]);
    nx[i] = n.x;
    ny[i] = n.y;
    nz[i] = n.z;
  }
  const floatv gx = LANES_LOAD(nx), gy = LANES_LOAD(ny), gz = LANES_LOAD(nz);
  // From the hit to the centre ray at the same depth, then along it to the plane.
  const floatv apart_x = centre->ox - rays->ox + hits->t * (centre->dx - rays->dx);
  const floatv apart_y = centre->oy - rays->oy + hits->t * (centre->dy - rays->dy);
  const floatv along = gx * centre->dx + gy * centre->dy + gz;
  const floatv further = -(gx * apart_x + gy * apart_y) / LANES_SELECT(along, (floatv)(1e-6f), fabs(along) < 1e-6f);
  const floatv reach = layer_reach(lattice, hits->t);
  return hits->t + clamp(further, -reach, reach);
}

__kernel void write_samples(__global const BvhNode* nodes, __global const Triangle* triangles, __global const TriangleShading* shading,
                            __global const Material* materials, __global const Light* lights, __global const float* texels,
                            float ambient_light, Lattice lattice, __global const int* first_of_cell, __global Sample* samples,
                            __global uint* lit_lights) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int row = (int)get_global_id(1);
  if (first >= lattice.nx || row >= lattice.ny) return;
  const SceneArrays scene = {nodes, triangles, shading, materials, lights, texels};
  int written[RAYWAVE_LANES];
  for (int i = 0; i < RAYWAVE_LANES; ++i) written[i] = 0;

  for (int which = 0; which < CELL_RAYS; ++which) {
    Rays rays = lattice_rays(&lattice, first, row, which);
    while (LANES_ANY(rays.active)) {
      const Hits hits = bvh_nearest(nodes, triangles, &rays);
      const intv source = is_new(&scene, &lattice, first, row, which, &rays, &hits);
      if (LANES_ANY(source)) {
        const Surface s = surface_at(&scene, &rays, &hits);
        const Rays centre = lattice_rays(&lattice, first, row, 0);
        const floatv t = through_centre(&scene, &lattice, &centre, &rays, &hits);
        uintv words[LIT_WORDS];
        floatv radiance = scattered(&scene, &s, ambient_light, &lattice, source, words);
        floatv coverage;
        average_over_cell(&scene, &lattice, first, row, &hits, ambient_light, source, &radiance, &coverage);
        const floatv own = coverage * (1.0f - s.reflectivity - s.transparency);
        int use[RAYWAVE_LANES], triangle[RAYWAVE_LANES];
        LANES_STORE(hits.triangle, triangle);
        float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES], nx[RAYWAVE_LANES], ny[RAYWAVE_LANES], nz[RAYWAVE_LANES];
        float light[RAYWAVE_LANES], specular[RAYWAVE_LANES], shininess[RAYWAVE_LANES];
        LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), source), use);
        LANES_STORE(centre.ox + t * centre.dx, x);
        LANES_STORE(centre.oy + t * centre.dy, y);
        LANES_STORE(centre.oz + t, z);
        LANES_STORE(s.nx, nx);
        LANES_STORE(s.ny, ny);
        LANES_STORE(s.nz, nz);
        LANES_STORE(radiance * own, light);
        LANES_STORE(s.specular * own, specular);
        LANES_STORE(s.shininess, shininess);
        for (int i = 0; i < RAYWAVE_LANES; ++i) {
          if (!use[i]) continue;
          const int cell = row * lattice.nx + first + i;
          Sample sample;
          sample.x = x[i];
          sample.y = y[i];
          sample.z = z[i];
          sample.nx = nx[i];
          sample.ny = ny[i];
          sample.nz = nz[i];
          sample.weight = (z[i] - lattice.centre_z) / lattice.full_z;
          sample.radiance = light[i];
          sample.specular = specular[i];
          sample.shininess = shininess[i];
          sample.tilt_x = sample.tilt_y = 0.0f;
          sample.tilt_z = -1.0f;
          sample.triangle = triangle[i];
          sample.hidden = 0;
          // Folded over lanes, the key is that of a scalar cell.
          uint keys[RAYWAVE_LANES];
          LANES_STORE(cell_key((intv)(lattice.first_x + first + i), (intv)(lattice.first_y + row), (intv)(written[i])), keys);
          sample.key = keys[0];
          const int place = first_of_cell[cell] + written[i]++;
          if (place >= first_of_cell[cell + 1]) continue;
          samples[place] = sample;
          for (int w = 0; w < LIT_WORDS; ++w) {
            uint bits[RAYWAVE_LANES];
            LANES_STORE(words[w], bits);
            lit_lights[place * LIT_WORDS + w] = bits[i];
          }
        }
      }
      beyond(&rays, &hits, lattice.layer_gap);
    }
  }
}

// One work-item per sample. A view may be called MIXED that is clear or closed, never the other way round.
__kernel void find_hidden(__global const BvhNode* nodes, __global const Triangle* triangles, Lattice lattice, float slack, int sample_count,
                          __global Sample* samples) {
  const int index = (int)get_global_id(0);
  if (index >= sample_count) return;
  const Sample sample = samples[index];
  const float rate = 1.0f / (sample.z - lattice.centre_z);
  const float x = lattice.centre_x - sample.x, y = lattice.centre_y - sample.y;
  float3 surface = triangle_normal(triangles + sample.triangle);
  if (dot(surface, (float3)(x * rate, y * rate, -1.0f)) < 0.0f) surface = -surface;
  const float towards_centre = fmax(dot(surface, (float3)(x * rate, y * rate, -1.0f)), 1e-6f);
  samples[index].tilt_x = surface.x / towards_centre;
  samples[index].tilt_y = surface.y / towards_centre;
  samples[index].tilt_z = surface.z / towards_centre;
  const float left = (x - lattice.half_width) * rate, lower = (y - lattice.half_height) * rate;
  const float width = 2.0f * lattice.half_width * rate, height = 2.0f * lattice.half_height * rate;
  const Pyramid whole_view = {(float3)(sample.x, sample.y, sample.z), left, left + width, lower, lower + height, surface};
  uint hidden = 0;
  int found;
  if (pyramid_state(nodes, triangles, &whole_view, slack, 0, 0, &found) != PYRAMID_CLEAR) {
    for (int part = 0; part < 16; ++part) {
      const float u = left + 0.25f * width * (float)(part % 4), v = lower + 0.25f * height * (float)(part / 4);
      const Pyramid view = {whole_view.apex, u, u + 0.25f * width, v, v + 0.25f * height, surface};
      const Obstacles obstacles = obstacles_in(nodes, triangles, &view, slack);
      hidden |= (uint)obstacles.state << (2 * part);
    }
  }
  samples[index].hidden = hidden;
}
