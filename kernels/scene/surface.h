// SPDX-License-Identifier: Apache-2.0
// Surface attributes at hits, for packets of lanes.
#ifndef RAYWAVE_SURFACE_H
#define RAYWAVE_SURFACE_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/arrays.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/hit_refinement.h"
#include "kernels/scene/look.h"
#include "kernels/scene/options.h"

// Normal of a triangle in the sense of its winding, scene frame. Its length is twice the triangle's
// area, unless the instance is scaled.
static inline float3 triangle_cross(const Tree* tree, int index) {
  const Corners t = corners_of(tree, index);
  const float3 a = vload3(0, t.a), ab = vload3(0, t.b) - a, ac = vload3(0, t.c) - a;
  return direction_in_scene(
      tree, index,
      (float3)(ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z, ab.x * ac.y - ab.y * ac.x));
}

// 1: rays that lie close together look in different directions
#define PLACES_DIFFER \
  (RAYWAVE_LIGHT_PLACES > 1 || RAYWAVE_DIFFUSE_RAYS > 0 || RAYWAVE_GLOSS_RAYS > 0)

#define REFINED_SURFACES (RAYWAVE_BOUNCES > 0 || (RAYWAVE_SHARP && RAYWAVE_HIGHLIGHTS > 0))

// Position and material of a hit, one per lane. The normal has unit length and points to the side
// from which the ray came.
typedef struct {
  floatv x, y, z;
  floatv nx, ny, nz;  // for shading: as a normal map turns it
#if RAYWAVE_NORMAL_MAPS
  floatv side_x, side_y, side_z;  // the same without normal maps: where rays leave the surface
#endif
  floatv vx, vy, vz;  // unit vector towards the viewer
  // Textures applied
  floatv ambient[RAYWAVE_COLOURS], diffuse[RAYWAVE_COLOURS], specular[RAYWAVE_COLOURS];
  floatv shininess;
#if RAYWAVE_TEXTURES > TEXTURES_PLAIN
  floatv emission[RAYWAVE_COLOURS];
#endif
  floatv reflectivity, transparency, ior, ior_low, attenuation;
  intv entering;  // the ray hits the outer side of the surface
#if PLACES_DIFFER
  intv light_place;  // where it looks for lights that have a size, of 16
#endif
#if REFINED_SURFACES
  // Double-single values from refine_surface; `towards` points to the viewer and has any length
  DoubleSingle3 place, normal, towards;
#endif
} Surface;

// Components of the unit normal on whose side rays leave a surface, for shadows and visibility.
#if RAYWAVE_NORMAL_MAPS
#define SIDE_X(surface) (surface)->side_x
#define SIDE_Y(surface) (surface)->side_y
#define SIDE_Z(surface) (surface)->side_z
#else
#define SIDE_X(surface) (surface)->nx
#define SIDE_Y(surface) (surface)->ny
#define SIDE_Z(surface) (surface)->nz
#endif

// Attributes of hits, a number per lane: neighbouring rays may meet different materials.
typedef struct {
  float normal[3][RAYWAVE_LANES];  // interpolated, of any length
  float face[3][RAYWAVE_LANES];    // triangle_cross
#if RAYWAVE_NORMAL_MAPS
  float mapped[3][RAYWAVE_LANES];  // the normal as a normal map turns it
#endif
  float ambient[RAYWAVE_COLOURS][RAYWAVE_LANES], diffuse[RAYWAVE_COLOURS][RAYWAVE_LANES],
      specular[RAYWAVE_COLOURS][RAYWAVE_LANES], shininess[RAYWAVE_LANES];
#if RAYWAVE_TEXTURES > TEXTURES_PLAIN
  float emission[RAYWAVE_COLOURS][RAYWAVE_LANES];
#endif
  float reflectivity[RAYWAVE_LANES], transparency[RAYWAVE_LANES], ior[RAYWAVE_LANES],
      ior_low[RAYWAVE_LANES], attenuation[RAYWAVE_LANES];
} HitAttributes;

static inline void set_vector(float3 v, int lane, float (*vectors)[RAYWAVE_LANES]) {
  vectors[0][lane] = v.x;
  vectors[1][lane] = v.y;
  vectors[2][lane] = v.z;
}

// A black surface that faces +z.
static inline void set_miss(int lane, HitAttributes* h) {
  const float3 up = (float3)(0.0f, 0.0f, 1.0f);
  set_vector(up, lane, h->normal);
  set_vector(up, lane, h->face);
#if RAYWAVE_NORMAL_MAPS
  set_vector(up, lane, h->mapped);
#endif
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    h->ambient[k][lane] = h->diffuse[k][lane] = h->specular[k][lane] = 0.0f;
#if RAYWAVE_TEXTURES > TEXTURES_PLAIN
    h->emission[k][lane] = 0.0f;
#endif
  }
  h->shininess[lane] = h->reflectivity[lane] = h->transparency[lane] = 0.0f;
  h->ior_low[lane] = h->attenuation[lane] = 0.0f;
  h->ior[lane] = 1.0f;
}

// The triangle with this number at the weights b and c of its second and third corner.
static inline void set_hit(const SceneArrays* scene, int index, float b, float c, int lane,
                           HitAttributes* h) {
  __global const Triangle* triangle = scene->tree.triangles + index;
  __global const Material* m = scene->materials + triangle->material;
  const float a = 1.0f - b - c;
  const float3 at_a = vload3((size_t)triangle->corner_a, scene->normals),
               at_b = vload3((size_t)triangle->corner_b, scene->normals);
  const float3 at_c = vload3((size_t)triangle->corner_c, scene->normals);
  const float3 smooth = direction_in_scene(&scene->tree, index, a * at_a + b * at_b + c * at_c);
  set_vector(smooth, lane, h->normal);
  set_vector(triangle_cross(&scene->tree, index), lane, h->face);
#if RAYWAVE_NORMAL_MAPS
  const Corners corners = corners_of(&scene->tree, index);
  const float3 from = vload3(0, corners.a);
  set_vector(mapped_normal(scene, triangle, b, c, smooth,
                           direction_in_scene(&scene->tree, index, vload3(0, corners.b) - from),
                           direction_in_scene(&scene->tree, index, vload3(0, corners.c) - from)),
             lane, h->mapped);
#endif
  const Look look = look_at(scene, triangle, a, b, c);
  h->shininess[lane] = look.shininess;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    h->ambient[k][lane] = look.ambient[k];
    h->diffuse[k][lane] = look.diffuse[k];
    h->specular[k][lane] = look.specular[k];
#if RAYWAVE_TEXTURES > TEXTURES_PLAIN
    h->emission[k][lane] = look.emission[k];
#endif
  }
  h->reflectivity[lane] = m->reflectivity;
  h->transparency[lane] = m->transparency;
  h->ior[lane] = m->ior;
  h->ior_low[lane] = m->ior_low;
  h->attenuation[lane] = m->attenuation;
}

// Gives the surface its shading normal, turned to the ray's side as the triangle's normal is. This
// is right for either winding, and for both sides of open meshes.
static inline void set_normals(const HitAttributes* h, const Rays* rays, Surface* surface) {
  const floatv fx = LANES_LOAD(h->face[0]), fy = LANES_LOAD(h->face[1]),
               fz = LANES_LOAD(h->face[2]);
  const floatv mx = LANES_LOAD(h->normal[0]), my = LANES_LOAD(h->normal[1]),
               mz = LANES_LOAD(h->normal[2]);
  const floatv face_along_ray = fx * rays->dx + fy * rays->dy + fz * rays->dz;
  const floatv face_along_normal = fx * mx + fy * my + fz * mz;
  const floatv inverse = rsqrt(fmax(mx * mx + my * my + mz * mz, (floatv)(1e-30f)));
  const floatv toward =
      LANES_SELECT(inverse, -inverse, (face_along_ray > 0.0f) == (face_along_normal > 0.0f));
  surface->entering = toward > 0.0f;
  surface->nx = mx * toward;
  surface->ny = my * toward;
  surface->nz = mz * toward;
#if RAYWAVE_NORMAL_MAPS
  surface->side_x = surface->nx;
  surface->side_y = surface->ny;
  surface->side_z = surface->nz;
  const floatv px = LANES_LOAD(h->mapped[0]), py = LANES_LOAD(h->mapped[1]),
               pz = LANES_LOAD(h->mapped[2]);
  const floatv side = LANES_SELECT((floatv)(-1.0f), (floatv)(1.0f), toward > 0.0f) *
                      rsqrt(fmax(px * px + py * py + pz * pz, (floatv)(1e-30f)));
  surface->nx = px * side;
  surface->ny = py * side;
  surface->nz = pz * side;
#endif
}

// The surface at each hit. Lanes that miss receive a black one.
static inline Surface surface_at(const SceneArrays* scene, const Rays* rays, const Hits* hits) {
  int triangle[RAYWAVE_LANES];
  float u[RAYWAVE_LANES], v[RAYWAVE_LANES];
  LANES_STORE(hits->triangle, triangle);
  LANES_STORE(hits->u, u);
  LANES_STORE(hits->v, v);
  HitAttributes h;
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    set_miss(lane, &h);
    if (triangle[lane] >= 0) set_hit(scene, triangle[lane], u[lane], v[lane], lane, &h);
  }
  Surface surface;
  surface.x = rays->ox + hits->t * rays->dx;
  surface.y = rays->oy + hits->t * rays->dy;
  surface.z = rays->oz + hits->t * rays->dz;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    surface.ambient[k] = LANES_LOAD(h.ambient[k]);
    surface.diffuse[k] = LANES_LOAD(h.diffuse[k]);
    surface.specular[k] = LANES_LOAD(h.specular[k]);
#if RAYWAVE_TEXTURES > TEXTURES_PLAIN
    surface.emission[k] = LANES_LOAD(h.emission[k]);
#endif
  }
  surface.shininess = LANES_LOAD(h.shininess);
  surface.reflectivity = LANES_LOAD(h.reflectivity);
  surface.transparency = LANES_LOAD(h.transparency);
  surface.ior = LANES_LOAD(h.ior);
  surface.ior_low = LANES_LOAD(h.ior_low);
  surface.attenuation = LANES_LOAD(h.attenuation);
  const floatv toward_viewer =
      -rsqrt(rays->dx * rays->dx + rays->dy * rays->dy + rays->dz * rays->dz);
  surface.vx = rays->dx * toward_viewer;
  surface.vy = rays->dy * toward_viewer;
  surface.vz = rays->dz * toward_viewer;
  set_normals(&h, rays, &surface);
#if PLACES_DIFFER
  surface.light_place = 0;
#endif
  return surface;
}

#if REFINED_SURFACES
// Refines the surface's position and normal where `line`, the ray of the hits, meets it. Returns
// the distance along the line.
static inline DoubleSingle refine_surface(const SceneArrays* scene, const Line* line,
                                          const Hits* hits, Surface* s) {
  const TrianglePlanes planes = triangle_planes_of(&scene->tree, hits->triangle);
  const DoubleSingle distance = refined_distance(&planes, line, hits->t);
  const floatv side = LANES_SELECT((floatv)(-1.0f), (floatv)(1.0f), s->entering), away = -1.0f;
  s->place = ds3_along(line->origin, line->direction, distance);
  s->normal = ds3_scaled(refined_normal(&scene->tree, scene->normals, hits->triangle, &planes,
                                        s->place, hits->u, hits->v),
                         ds(side, 0.0f));
  s->towards = ds3_scaled(line->direction, ds(away, 0.0f));
  s->x = ds_high(s->place.x);
  s->y = ds_high(s->place.y);
  s->z = ds_high(s->place.z);
#if RAYWAVE_NORMAL_MAPS
  // A map's normal stays as it is
  const intv mapped =
      fabs(s->nx - s->side_x) + fabs(s->ny - s->side_y) + fabs(s->nz - s->side_z) > 0.0f;
  s->side_x = ds_high(s->normal.x);
  s->side_y = ds_high(s->normal.y);
  s->side_z = ds_high(s->normal.z);
  s->nx = LANES_SELECT(s->side_x, s->nx, mapped);
  s->ny = LANES_SELECT(s->side_y, s->ny, mapped);
  s->nz = LANES_SELECT(s->side_z, s->nz, mapped);
#else
  s->nx = ds_high(s->normal.x);
  s->ny = ds_high(s->normal.y);
  s->nz = ds_high(s->normal.z);
#endif
  return distance;
}
#endif

#if PLACES_DIFFER
// The place of a light for the ray (i, j) of a regular set: neighbours look for different ones.
static inline intv light_place_of(intv i, intv j) { return (i & 3) | (j & 3) << 2; }
#define LOOK_FOR_LIGHTS(surface, place) ((surface)->light_place = (place))
#else
#define LOOK_FOR_LIGHTS(surface, place) ((void)0)
#endif

#endif
