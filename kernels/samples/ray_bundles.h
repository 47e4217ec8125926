// SPDX-License-Identifier: Apache-2.0
// Bundles of rays through the parts of a cell of the lattice, after the same mirrors and clear
// surfaces, and the surface layers that they meet next.
#ifndef RAYWAVE_RAY_BUNDLES_H
#define RAYWAVE_RAY_BUNDLES_H

#include "kernels/common/shared.h"
#include "kernels/samples/lattice_rays.h"
#include "kernels/samples/specular_path.h"
#include "kernels/scene/bvh.h"

#if RAYWAVE_BOUNCES > 0
// Hits are of one surface layer when the second lies within this slope of the plane of the first,
// and its normal agrees.
#define LAYER_SLOPE 0.5f
#define LAYER_ALIKE 0.5f

// From so many surfaces on, rays stop at the first hit, and all that they meet of one material is
// one surface layer: curved mirrors have spread them, and few carry much.
#define FIRST_HITS_FROM 2

// Rays of all parts of a cell after the surfaces of a sequence.
typedef struct {
  Sequence sequence;
  Followed rays[PACKETS];
} Bundle;

// Surfaces that the rays of a bundle meet.
typedef struct {
  Layers layers[PACKETS];
  floatv nearest[PACKETS];  // distance of the first hit
} Met;

// Leaves only hits of mirrors and glass.
static inline void keep_specular(const SceneArrays* scene, Layers* layers) {
  for (int i = 0; i < BVH_LAYERS && LANES_ANY(layers->triangle[i] >= 0); ++i) {
    int triangle[RAYWAVE_LANES];
    LANES_STORE(layers->triangle[i], triangle);
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
      if (triangle[lane] < 0) continue;
      __global const Material* m =
          scene->materials + scene->tree.triangles[triangle[lane]].material;
      if (!(m->reflectivity + m->transparency > 0.0f)) triangle[lane] = -1;
    }
    layers->triangle[i] = LANES_LOAD(triangle);
  }
}

// Finds the surfaces that the rays of a bundle meet: all outer sides of surfaces in air, since
// other parts of the window may see behind the first; within glass and after some surfaces the
// first only. What rays meet directly is for find_samples, but for mirrors and glass.
CALLED void meet(const SceneArrays* scene, const Lattice* lattice, const Bundle* bundle, Met* met) {
  for (int packet = 0; packet < PACKETS; ++packet) {
    const Followed* f = bundle->rays + packet;
    Layers* layers = met->layers + packet;
    const Rays rays = rays_of_followed(f, lattice->reach, f->found);
    if (bundle->sequence.length >= FIRST_HITS_FROM || LANES_ANY(f->found & f->inside)) {
      const Hits hits = bvh_nearest(&scene->tree, &rays);
      for (int i = 0; i < BVH_LAYERS; ++i) {
        layers->t[i] = i == 0 ? hits.t : (floatv)(lattice->reach);
        layers->triangle[i] = i == 0 ? hits.triangle : (intv)(-1);
        layers->u[i] = hits.u;
        layers->v[i] = hits.v;
      }
    } else {
      bvh_layers(&scene->tree, &rays, bundle->sequence.length == 0, layers);
      keep_sources(layers, scene, &rays, lattice->layer_gap);
    }
    met->nearest[packet] = lattice->reach;
    for (int i = 0; i < BVH_LAYERS; ++i)
      met->nearest[packet] = LANES_SELECT(
          met->nearest[packet], fmin(met->nearest[packet], layers->t[i]), layers->triangle[i] >= 0);
    if (bundle->sequence.length == 0) keep_specular(scene, layers);
  }
}

// A surface layer that rays of a bundle meet, as one of them does.
typedef struct {
  int material;
  float3 place;
  float3 normal;
  int ray;     // the part that it goes through
  float from;  // > 0: that ray meets another layer before; midway to it
  bool whole;  // all that has the material
} BundleLayer;

// The first hit that no surface layer has claimed: nearer layers first. False where there is none.
static inline bool next_layer(const SceneArrays* scene, const Bundle* bundle, const Met* met,
                              BundleLayer* surface_layer) {
  for (int i = 0; i < BVH_LAYERS; ++i) {
    for (int packet = 0; packet < PACKETS; ++packet) {
      const Layers* layers = met->layers + packet;
      if (!LANES_ANY(layers->triangle[i] >= 0)) continue;
      const Followed* f = bundle->rays + packet;
      const Vector at = vector_along(f->place, f->direction, layers->t[i]);
      int triangle[RAYWAVE_LANES];
      float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES], t[RAYWAVE_LANES],
          nearest[RAYWAVE_LANES];
      LANES_STORE(layers->triangle[i], triangle);
      LANES_STORE(at.x, x);
      LANES_STORE(at.y, y);
      LANES_STORE(at.z, z);
      LANES_STORE(layers->t[i], t);
      LANES_STORE(met->nearest[packet], nearest);
      for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
        if (triangle[lane] < 0) continue;
        surface_layer->from = t[lane] > nearest[lane] ? 0.5f * (t[lane] + nearest[lane]) : 0.0f;
        surface_layer->material = scene->tree.triangles[triangle[lane]].material;
        surface_layer->place = (float3)(x[lane], y[lane], z[lane]);
        surface_layer->normal = normalize(triangle_cross(&scene->tree, triangle[lane]));
        surface_layer->ray = packet * RAYWAVE_LANES + lane;
        surface_layer->whole = bundle->sequence.length >= FIRST_HITS_FROM;
        return true;
      }
    }
  }
  return false;
}

// Mask of hits that lie on a surface layer.
static inline intv lies_on(const SceneArrays* scene, const BundleLayer* surface_layer, Vector at,
                           intv triangle, float gap) {
  if (surface_layer->whole) return hits_material(scene, triangle, surface_layer->material);
  float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES];
  int triangles[RAYWAVE_LANES], lies[RAYWAVE_LANES];
  LANES_STORE(triangle, triangles);
  LANES_STORE(at.x, x);
  LANES_STORE(at.y, y);
  LANES_STORE(at.z, z);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    lies[lane] = 0;
    if (triangles[lane] < 0 ||
        scene->tree.triangles[triangles[lane]].material != surface_layer->material)
      continue;
    const float3 normal = normalize(triangle_cross(&scene->tree, triangles[lane])),
                 off = (float3)(x[lane], y[lane], z[lane]) - surface_layer->place;
    lies[lane] = fabs(dot(normal, surface_layer->normal)) > LAYER_ALIKE &&
                 fabs(dot(off, surface_layer->normal)) <= LAYER_SLOPE * length(off) + gap;
  }
  return LANES_LOAD(lies) != 0;
}

// Removes a surface layer's hits from those of a bundle, and gives the first of each ray. Where a
// surface turns away, a ray meets it again in nearly the same plane: that is no other layer.
CALLED void claim_layer(const SceneArrays* scene, const Lattice* lattice,
                        const BundleLayer* surface_layer, const Bundle* bundle, Met* met,
                        Hits* claimed) {
  for (int packet = 0; packet < PACKETS; ++packet) {
    const Followed* f = bundle->rays + packet;
    Layers* layers = met->layers + packet;
    Hits hits;
    hits.t = hits.u = hits.v = 0.0f;
    hits.triangle = -1;
    for (int i = 0; i < BVH_LAYERS; ++i) {
      const intv open = layers->triangle[i] >= 0;
      if (!LANES_ANY(open)) continue;
      const intv lies =
          open & lies_on(scene, surface_layer, vector_along(f->place, f->direction, layers->t[i]),
                         LANES_SELECT((intv)(-1), layers->triangle[i], open), lattice->layer_gap);
      const intv take = lies & (hits.triangle < 0);
      hits.t = LANES_SELECT(hits.t, layers->t[i], take);
      hits.triangle = LANES_SELECT(hits.triangle, layers->triangle[i], take);
      hits.u = LANES_SELECT(hits.u, layers->u[i], take);
      hits.v = LANES_SELECT(hits.v, layers->v[i], take);
      layers->triangle[i] = LANES_SELECT(layers->triangle[i], (intv)(-1), lies);
    }
    claimed[packet] = hits;
  }
}

#endif

#endif
