// SPDX-License-Identifier: Apache-2.0
// The sample table: every place where a ray of the lattice (shared.h) pierces a surface is one source of light. Pixels that see it all use
// the same position and phase; that makes their sum a spherical wave (docs/pipeline.md).
//
// count_layers   layers[cell] = number of samples of each cell (nx * ny cells, row by row)
// write_samples  the samples of cell c to samples[first[c]] and on; first: nx * ny + 1 sums of the counts
// write_samples  also sets lit[i * words + l / 32], bit l % 32: light l falls on sample i; words = (RAYWAVE_LIGHTS + 31) / 32, at least 1
// find_hidden    samples[i].hidden = 0 where nothing can stand between the sample and any part of the hologram
//
// The first two handle RAYWAVE_LANES cells of one row per work-item: global size (ceil(nx / lanes), ny). OpenCL C 1.2.
#include "bvh.h"
#include "hash.h"
#include "lanes.h"
#include "shade.h"
#include "shared.h"

#define LIT_WORDS (RAYWAVE_LIGHTS > 32 ? (RAYWAVE_LIGHTS + 31) / 32 : 1)

static inline Rays lattice_rays(const Lattice* lattice, int first, int row) {
  const intv column = first + LANES_INDEX;
  Rays rays;
  rays.ox = lattice->centre_x;
  rays.oy = lattice->centre_y;
  rays.oz = lattice->centre_z;
  rays.dx = (LANES_TO_FLOAT(lattice->first_x + column) + 0.5f) * lattice->step;
  rays.dy = ((float)(lattice->first_y + row) + 0.5f) * lattice->step;
  rays.dz = 1.0f;
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

__kernel void count_layers(__global const BvhNode* nodes, __global const Triangle* triangles, __global const TriangleShading* shading,
                           Lattice lattice, __global int* layers) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int row = (int)get_global_id(1);
  if (first >= lattice.nx || row >= lattice.ny) return;
  const SceneArrays scene = {nodes, triangles, shading, 0, 0, 0};
  Rays rays = lattice_rays(&lattice, first, row);
  intv count = 0;
  while (LANES_ANY(rays.active)) {
    const Hits hits = bvh_nearest(nodes, triangles, &rays);
    count += LANES_SELECT((intv)(0), (intv)(1), is_source(&scene, &rays, &hits));
    beyond(&rays, &hits, lattice.layer_gap);
  }
  int counts[RAYWAVE_LANES];
  LANES_STORE(count, counts);
  for (int i = 0; i < RAYWAVE_LANES && first + i < lattice.nx; ++i) layers[row * lattice.nx + first + i] = counts[i];
}

__kernel void write_samples(__global const BvhNode* nodes, __global const Triangle* triangles, __global const TriangleShading* shading,
                            __global const Material* materials, __global const Light* lights, __global const float* texels,
                            float ambient_light, Lattice lattice, __global const int* first_of_cell, __global Sample* samples,
                            __global uint* lit_lights) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int row = (int)get_global_id(1);
  if (first >= lattice.nx || row >= lattice.ny) return;
  const SceneArrays scene = {nodes, triangles, shading, materials, lights, texels};
  Rays rays = lattice_rays(&lattice, first, row);
  int written[RAYWAVE_LANES];
  for (int i = 0; i < RAYWAVE_LANES; ++i) written[i] = 0;

  while (LANES_ANY(rays.active)) {
    const Hits hits = bvh_nearest(nodes, triangles, &rays);
    const intv source = is_source(&scene, &rays, &hits);
    if (LANES_ANY(source)) {
      const Surface s = surface_at(&scene, &rays, &hits);
      floatv radiance = s.ambient * ambient_light;
      uintv words[LIT_WORDS];
      for (int w = 0; w < LIT_WORDS; ++w) words[w] = 0;
#if RAYWAVE_LIGHTS > 0
      for (int l = 0; l < RAYWAVE_LIGHTS; ++l) {
        const Incident in = incident(lights, l, &s, lattice.reach);
        const intv lit = lit_by(&scene, &in, &s, lattice.bias, source);
        radiance += LANES_SELECT((floatv)(0.0f), s.diffuse * in.facing * in.intensity, lit);
        words[l / 32] |= LANES_AS_UINT(LANES_SELECT((intv)(0), (intv)(1), lit)) << (l % 32);
      }
#endif
      const floatv own = 1.0f - s.reflectivity - s.transparency;
      int use[RAYWAVE_LANES], triangle[RAYWAVE_LANES];
      LANES_STORE(hits.triangle, triangle);
      float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES], nx[RAYWAVE_LANES], ny[RAYWAVE_LANES], nz[RAYWAVE_LANES];
      float light[RAYWAVE_LANES], specular[RAYWAVE_LANES], shininess[RAYWAVE_LANES];
      LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), source), use);
      LANES_STORE(s.x, x);
      LANES_STORE(s.y, y);
      LANES_STORE(s.z, z);
      LANES_STORE(s.nx, nx);
      LANES_STORE(s.ny, ny);
      LANES_STORE(s.nz, nz);
      LANES_STORE(radiance * own, light);
      LANES_STORE(s.specular * own, specular);
      LANES_STORE(s.shininess, shininess);
      for (int i = 0; i < RAYWAVE_LANES; ++i) {
        if (!use[i]) continue;
        const int cell = row * lattice.nx + first + i;
        Sample sample = {x[i],     y[i],        z[i],         nx[i], ny[i],       nz[i], (z[i] - lattice.centre_z) / lattice.full_z,
                         light[i], specular[i], shininess[i], 0,     triangle[i], 1};
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

// True when the plane through the sample with this normal leaves the whole triangle on its outer side.
static inline bool outside(__global const Triangle* t, float3 p, float3 normal, float slack) {
  const float a = normal.x * (t->a[0] - p.x) + normal.y * (t->a[1] - p.y) + normal.z * (t->a[2] - p.z);
  const float b = normal.x * (t->b[0] - p.x) + normal.y * (t->b[1] - p.y) + normal.z * (t->b[2] - p.z);
  const float c = normal.x * (t->c[0] - p.x) + normal.y * (t->c[1] - p.y) + normal.z * (t->c[2] - p.z);
  return fmin(fmin(a, b), c) >= -slack;
}

// The same for a box: its corner farthest inwards decides.
static inline bool box_outside(__global const float* lo, __global const float* hi, float3 p, float3 normal, float slack) {
  const float x = (normal.x > 0.0f ? lo[0] : hi[0]) - p.x, y = (normal.y > 0.0f ? lo[1] : hi[1]) - p.y,
              z = (normal.z > 0.0f ? lo[2] : hi[2]) - p.z;
  return normal.x * x + normal.y * y + normal.z * z >= -slack;
}

// Conservative: the pyramid from the sample to the hologram's window is compared with boxes and triangles by separating planes only, so a
// sample may be called hidden that is not, never the other way round (within `slack`, far below the wavelength's effect on visibility).
// One work-item per sample.
__kernel void find_hidden(__global const BvhNode* nodes, __global const Triangle* triangles, Lattice lattice, float slack, int sample_count,
                          __global Sample* samples) {
  const int index = (int)get_global_id(0);
  if (index >= sample_count) return;
  const Sample sample = samples[index];
  const float3 p = (float3)(sample.x, sample.y, sample.z);
  const float depth = p.z - lattice.centre_z;
  const float right = lattice.centre_x + lattice.half_width - p.x, left = lattice.centre_x - lattice.half_width - p.x;
  const float upper = lattice.centre_y + lattice.half_height - p.y, lower = lattice.centre_y - lattice.half_height - p.y;
  // Normal of the sample's own triangle, towards the hologram.
  __global const Triangle* own = triangles + sample.triangle;
  const float3 corner = (float3)(own->a[0], own->a[1], own->a[2]);
  float3 normal = normalize(cross((float3)(own->b[0], own->b[1], own->b[2]) - corner, (float3)(own->c[0], own->c[1], own->c[2]) - corner));
  if (dot(normal, (float3)(lattice.centre_x, lattice.centre_y, lattice.centre_z) - p) < 0.0f) normal = -normal;
  // Outward normals of the pyramid's sides, its apex plane, and the surface's own plane where the whole pyramid stands before it.
  const float3 planes[6] = {normalize((float3)(depth, 0.0f, right)),
                            normalize((float3)(-depth, 0.0f, -left)),
                            normalize((float3)(0.0f, depth, upper)),
                            normalize((float3)(0.0f, -depth, -lower)),
                            (float3)(0.0f, 0.0f, 1.0f),
                            -normal};
  const float lowest = fmin(normal.x * right, normal.x * left) + fmin(normal.y * upper, normal.y * lower) - normal.z * depth;
  const int plane_count = lowest > 0.0f ? 6 : 5;

  int stack[RAYWAVE_BVH_DEPTH];
  int waiting = 0, node_index = 0;
  int hidden = 0;
  while (!hidden) {
    __global const BvhNode* node = nodes + node_index;
    int next = -1;
    for (int side = 0; side < 2 && !hidden; ++side) {
      __global const float* lo = side ? node->right_min : node->left_min;
      __global const float* hi = side ? node->right_max : node->left_max;
      const int child = side ? node->right_child : node->left_child;
      const int count = side ? node->right_count : node->left_count;
      bool apart = lo[0] > hi[0];  // an empty child
      for (int i = 0; i < plane_count && !apart; ++i) apart = box_outside(lo, hi, p, planes[i], slack);
      if (apart) continue;
      if (count == 0) {
        if (next >= 0) stack[waiting++] = next;
        next = child;
        continue;
      }
      for (int t = child; t < child + count && !hidden; ++t) {
        bool clear = false;
        for (int i = 0; i < plane_count && !clear; ++i) clear = outside(triangles + t, p, planes[i], slack);
        hidden = !clear;
      }
    }
    if (next < 0) {
      if (waiting == 0) break;
      next = stack[--waiting];
    }
    node_index = next;
  }
  samples[index].hidden = hidden;
}
