// SPDX-License-Identifier: Apache-2.0
// Surface layers of a cell of the lattice: what its rays meet, sorted into layers by distance and,
// where a layer is seen nearly edge-on, by its plane.
#ifndef RAYWAVE_SURFACE_LAYERS_H
#define RAYWAVE_SURFACE_LAYERS_H

#include "kernels/common/shared.h"
#include "kernels/samples/lattice_rays.h"
#include "kernels/samples/options.h"
#include "kernels/scene/bvh.h"

// One hit of one ray.
typedef struct {
  float t;
  int triangle;
  float u, v;
} Hit;

static inline Hit hit_of_hits(floatv ts, intv triangles, floatv us, floatv vs, int lane) {
  float t[RAYWAVE_LANES], u[RAYWAVE_LANES], v[RAYWAVE_LANES];
  int triangle[RAYWAVE_LANES];
  LANES_STORE(ts, t);
  LANES_STORE(triangles, triangle);
  LANES_STORE(us, u);
  LANES_STORE(vs, v);
  const Hit hit = {t[lane], triangle[lane], u[lane], v[lane]};
  return hit;
}

static inline Hit hit_of_lane(const Layers* layers, int layer, int lane) {
  return hit_of_hits(layers->t[layer], layers->triangle[layer], layers->u[layer], layers->v[layer],
                     lane);
}

// What the rays through the parts of a cell meet. Without lanes each ray is a work-item's of its
// own (trace_parts), which leaves it in global memory.
#if RAYWAVE_LANES == 1
#define PART_LAYERS __global Layers
#else
#define PART_LAYERS Layers
#endif

// Distance within which hits belong to the same layer: what a slope of 80 degrees spans in a cell.
static inline float layer_reach(const Lattice* lattice, float t) {
  return 4.0f * lattice->step * fabs(t + (lattice->near_z - lattice->eye_z));
}

// Cosine to the ray below which a layer is steep, and cosine between normals above which two hits
// of a steep layer belong together.
#define STEEP 0.25f
#define ALIKE 0.9f

#if RAYWAVE_ANTIALIAS
// A layer as one ray of its cell meets it. Hits of the parts' rays are compared with it.
typedef struct {
  float t;
  float reach;
  bool steep;              // seen so nearly edge-on that a cell spans more than `reach` of it
  float3 at, normal;       // for steep layers only
  int packet_column, row;  // cell of the parts' rays
} SurfaceLayer;

// hit: of the ray with tangents (dx, dy)
static inline SurfaceLayer surface_layer_of(const SceneArrays* scene, const Lattice* lattice,
                                            const Hit* hit, float dx, float dy, int packet_column,
                                            int row) {
  SurfaceLayer surface_layer;
  surface_layer.t = hit->t;
  surface_layer.reach = layer_reach(lattice, hit->t);
  surface_layer.normal = normalize(triangle_cross(&scene->tree, hit->triangle));
  surface_layer.steep = fabs(surface_layer.normal.x * dx + surface_layer.normal.y * dy +
                             surface_layer.normal.z) < STEEP;
  const float depth = hit->t + (lattice->near_z - lattice->eye_z);
  surface_layer.at =
      (float3)(lattice->eye_x + depth * dx, lattice->eye_y + depth * dy, lattice->eye_z + depth);
  surface_layer.packet_column = packet_column;
  surface_layer.row = row;
  return surface_layer;
}

// Mask of the hits of a packet's rays that belong to a layer: those at about the same distance and,
// for a steep layer, those in the same plane.
static inline intv belongs(const SceneArrays* scene, const Lattice* lattice,
                           const SurfaceLayer* surface_layer, int packet, floatv t, intv triangle) {
  const intv near = fabs(t - surface_layer->t) < surface_layer->reach,
             far = (triangle >= 0) & !near;
  if (!surface_layer->steep || !LANES_ANY(far)) return near;
  const Rays rays = part_rays(lattice, surface_layer->packet_column, surface_layer->row, packet,
                              LANES_INDEX >= 0);
  float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES];
  int candidate[RAYWAVE_LANES], same[RAYWAVE_LANES];
  LANES_STORE(rays.ox + t * rays.dx, x);
  LANES_STORE(rays.oy + t * rays.dy, y);
  LANES_STORE(rays.oz + t, z);
  LANES_STORE(LANES_SELECT((intv)(-1), triangle, far), candidate);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    same[lane] = 0;
    if (candidate[lane] < 0) continue;
    const float3 normal = normalize(triangle_cross(&scene->tree, candidate[lane]));
    const float off =
        dot(surface_layer->normal, (float3)(x[lane], y[lane], z[lane]) - surface_layer->at);
    same[lane] = fabs(dot(surface_layer->normal, normal)) > ALIKE &&
                 fabs(off) < 0.25f * surface_layer->reach;
  }
  return near | (LANES_LOAD(same) != 0);
}

#if RAYWAVE_ALPHA == ALPHA_BLEND
// Mask of the hits of surfaces that are there with a probability. They are no edges: whether they
// hide something is for the rays to the hologram to find out, which are many.
static inline intv is_blended(const SceneArrays* scene, intv triangle) {
  int number[RAYWAVE_LANES], blended[RAYWAVE_LANES];
  LANES_STORE(triangle, number);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    blended[lane] = 0;
    if (number[lane] < 0) continue;
    const int material = scene->tree.triangles[number[lane]].material;
    blended[lane] = scene->materials[material].alpha_mode == ALPHA_BLEND;
  }
  return LANES_LOAD(blended) != 0;
}
#endif

// Nearest hits of the parts' rays that belong to no layer of the centre ray: the edge of an object
// that the centre ray misses. It hides what lies behind it in those parts, which the sample of the
// layer behind cannot know from the centre ray.
CALLED void find_edges(const SceneArrays* scene, const Lattice* lattice, const PART_LAYERS* parts,
                       const Layers* centre, int lane, int column, int row, int packet_column,
                       floatv* edges) {
  SurfaceLayer surface_layers[BVH_LAYERS];
  int count = 0;
  const float dx = ((float)(lattice->first_x + column) + 0.5f) * lattice->step,
              dy = ((float)(lattice->first_y + row) + 0.5f) * lattice->step;
  for (int j = 0; j < BVH_LAYERS; ++j) {
    const Hit hit = hit_of_lane(centre, j, lane);
    if (hit.triangle >= 0)
      surface_layers[count++] = surface_layer_of(scene, lattice, &hit, dx, dy, packet_column, row);
  }
  for (int packet = 0; packet < PACKETS; ++packet) edges[packet] = lattice->reach;
  for (int i = 0; i < BVH_LAYERS; ++i) {
    for (int packet = 0; packet < PACKETS; ++packet) {
      const floatv t = parts[packet].t[i];
      intv edge = (parts[packet].triangle[i] >= 0) & (t < edges[packet]);
#if RAYWAVE_ALPHA == ALPHA_BLEND
      edge &= !is_blended(scene, parts[packet].triangle[i]);
#endif
      for (int j = 0; j < count && LANES_ANY(edge); ++j)
        edge &= !belongs(scene, lattice, surface_layers + j, packet, t,
                         LANES_SELECT((intv)(-1), parts[packet].triangle[i], edge));
      edges[packet] = LANES_SELECT(edges[packet], t, edge);
    }
  }
}

// Removes the hits of a layer from the parts' hits, one for each ray. Returns how many of them lie
// behind no edge.
CALLED int claim(const SceneArrays* scene, const Lattice* lattice, PART_LAYERS* parts,
                 const floatv* edges, const SurfaceLayer* surface_layer, Hits* claimed) {
  intv count = 0;
  for (int packet = 0; packet < PACKETS; ++packet) {
    PART_LAYERS* layers = parts + packet;
    Hits hits = {(floatv)(surface_layer->t), (intv)(-1), (floatv)(0.0f), (floatv)(0.0f)};
    for (int i = 0; i < BVH_LAYERS; ++i) {
      const intv open = (layers->triangle[i] >= 0) & (hits.triangle < 0);
      if (!LANES_ANY(open)) continue;
      const intv take = open & belongs(scene, lattice, surface_layer, packet, layers->t[i],
                                       LANES_SELECT((intv)(-1), layers->triangle[i], open));
      hits.t = LANES_SELECT(hits.t, layers->t[i], take);
      hits.triangle = LANES_SELECT(hits.triangle, layers->triangle[i], take);
      hits.u = LANES_SELECT(hits.u, layers->u[i], take);
      hits.v = LANES_SELECT(hits.v, layers->v[i], take);
      layers->triangle[i] = LANES_SELECT(layers->triangle[i], (intv)(-1), take);
    }
    hits.triangle = LANES_SELECT(hits.triangle, (intv)(-1), hits.t > edges[packet]);
    count += LANES_SELECT((intv)(0), (intv)(1), hits.triangle >= 0);
    claimed[packet] = hits;
  }
  return lanes_sum(count);
}

// The first ray with a hit that no layer has claimed, or -1; *hit receives that hit.
static inline int unclaimed(const PART_LAYERS* parts, Hit* hit) {
  for (int packet = 0; packet < PACKETS; ++packet) {
    intv any = 0;
    for (int i = 0; i < BVH_LAYERS; ++i) any |= parts[packet].triangle[i] >= 0;
    if (!LANES_ANY(any)) continue;
    int left[RAYWAVE_LANES];
    LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), any), left);
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
      for (int i = 0; i < BVH_LAYERS && left[lane]; ++i) {
        const PART_LAYERS* layers = parts + packet;
        *hit = hit_of_hits(layers->t[i], layers->triangle[i], layers->u[i], layers->v[i], lane);
        if (hit->triangle >= 0) return packet * RAYWAVE_LANES + lane;
      }
    }
  }
  return -1;
}
#endif

#endif
