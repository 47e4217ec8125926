// SPDX-License-Identifier: Apache-2.0
// Surface attributes at hits, and Phong radiance (paper, Eq. 3), for packets of lanes.
#ifndef RAYWAVE_SHADE_H
#define RAYWAVE_SHADE_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
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

// (1 - gap)^m for gap in [0, 1] and m >= 0, with 0^0 = 1. The logarithm keeps the relative accuracy
// of a small gap, so that huge exponents stay accurate.
static inline floatv pow_unit(floatv gap, floatv m) {
  const floatv x = fmax(1.0f - gap, (floatv)(1e-37f));
  const intv shifted = LANES_AS_INT(x) - 0x3f3504f3;  // bits of sqrt(1/2)
  const intv exponent = shifted >> 23;
  const floatv f =
      LANES_SELECT(LANES_AS_FLOAT((shifted & 0x007fffff) + 0x3f3504f3) - 1.0f, -gap, exponent == 0);
  floatv p = 7.0376836292e-2f;  // ln(1 + f) on [sqrt(1/2), sqrt(2)] - 1, after Cephes
  p = p * f - 1.1514610310e-1f;
  p = p * f + 1.1676998740e-1f;
  p = p * f - 1.2420140846e-1f;
  p = p * f + 1.4249322787e-1f;
  p = p * f - 1.6668057665e-1f;
  p = p * f + 2.0000714765e-1f;
  p = p * f - 2.4999993993e-1f;
  p = p * f + 3.3333331174e-1f;
  const floatv ln = f + f * f * (p * f - 0.5f);
  const floatv power = fmax((ln * 1.44269504f + LANES_TO_FLOAT(exponent)) * m, (floatv)(-126.0f));
  const floatv whole = (power + 12582912.0f) - 12582912.0f;
  const floatv g = (power - whole) * 0.693147181f;
  floatv e = 1.9875691500e-4f;
  e = e * g + 1.3981999507e-3f;
  e = e * g + 8.3334519073e-3f;
  e = e * g + 4.1665795894e-2f;
  e = e * g + 1.6666665459e-1f;
  e = e * g + 5.0000001201e-1f;
  const floatv result = (e * g * g + g + 1.0f) * LANES_AS_FLOAT((LANES_TO_INT(whole) + 127) << 23);
  return LANES_SELECT(result, (floatv)(0.0f), (gap >= 1.0f) & (m > 0.0f));
}

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

// A light as a surface sees it: unit vector towards it and the cosine of the angle of incidence (<=
// 0: behind the surface).
typedef struct {
  floatv x, y, z;
  floatv distance;
  floatv facing;
  floatv intensity;
#if RAYWAVE_COLOURS > 1
  float colour[3], of_laser;  // as in Light
#endif
#if RAYWAVE_SHARP
  DoubleSingle3 place;  // as in Light
#endif
} Incident;

// The light with this number at the place that each lane of the surface looks for.
static inline Incident light_seen_by(__global const Light* lights, int index, const Surface* s) {
  Incident in;
#if RAYWAVE_LIGHT_PLACES > 1
  int place[RAYWAVE_LANES];
  float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES];
  LANES_STORE(s->light_place, place);
#if RAYWAVE_SHARP
  float x_low[RAYWAVE_LANES], y_low[RAYWAVE_LANES], z_low[RAYWAVE_LANES];
#endif
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    __global const Light* light = lights + RAYWAVE_LIGHT_PLACES * index + place[lane];
    x[lane] = light->x;
    y[lane] = light->y;
    z[lane] = light->z;
#if RAYWAVE_SHARP
    x_low[lane] = light->x_low;
    y_low[lane] = light->y_low;
    z_low[lane] = light->z_low;
#endif
  }
  in.x = LANES_LOAD(x);
  in.y = LANES_LOAD(y);
  in.z = LANES_LOAD(z);
#if RAYWAVE_SHARP
  const DoubleSingle3 at = {ds(in.x, LANES_LOAD(x_low)), ds(in.y, LANES_LOAD(y_low)),
                            ds(in.z, LANES_LOAD(z_low))};
  in.place = at;
#endif
#else
  __global const Light* light = lights + index;
  (void)s;
  in.x = light->x;
  in.y = light->y;
  in.z = light->z;
#if RAYWAVE_SHARP
  const DoubleSingle3 at = {ds(in.x, (floatv)(light->x_low)), ds(in.y, (floatv)(light->y_low)),
                            ds(in.z, (floatv)(light->z_low))};
  in.place = at;
#endif
#endif
  return in;
}

static inline Incident incident(__global const Light* lights, int index, const Surface* s,
                                float reach) {
  const Light light = lights[RAYWAVE_LIGHT_PLACES * index];
  Incident in = light_seen_by(lights, index, s);
  in.distance = reach;
  in.intensity = light.intensity;
#if RAYWAVE_COLOURS > 1
  for (int k = 0; k < 3; ++k) in.colour[k] = light.colour[k];
  in.of_laser = light.of_laser;
#endif
  if (light.is_point) {
    in.x -= s->x;
    in.y -= s->y;
    in.z -= s->z;
    const floatv squared = fmax(in.x * in.x + in.y * in.y + in.z * in.z, (floatv)(1e-30f));
    const floatv inverse = rsqrt(squared);
    in.distance = squared * inverse;
    in.x *= inverse;
    in.y *= inverse;
    in.z *= inverse;
#if RAYWAVE_SPOTS
    const floatv cosine = -(in.x * light.axis_x + in.y * light.axis_y + in.z * light.axis_z);
    const floatv edge =
        clamp(cosine * light.edge_rate + light.edge_offset, (floatv)(0.0f), (floatv)(1.0f));
    in.intensity *= edge * edge;
    if (light.falls_off) in.intensity /= fmax(squared, (floatv)(1e-12f));
#endif
  }
  in.facing = s->nx * in.x + s->ny * in.y + s->nz * in.z;
  return in;
}

// Intensity of one of the colours.
static inline floatv intensity_of(const Incident* in, int colour) {
#if RAYWAVE_COLOURS > 1
  return in->intensity * in->colour[colour];
#else
  (void)colour;
  return in->intensity;
#endif
}

// Intensity of the hologram's laser.
static inline floatv laser_intensity(const Incident* in) {
#if RAYWAVE_COLOURS > 1
  return in->intensity * in->of_laser;
#else
  return in->intensity;
#endif
}

// Mask of the lanes that face the light.
static inline intv faced_by(const Incident* in, const Surface* s, intv active) {
  (void)s;
  intv faced = (in->facing > 0.0f) & active;
#if RAYWAVE_SPOTS
  faced &= in->intensity > 0.0f;  // beyond a spot's edge there is nothing to hide
#endif
#if RAYWAVE_NORMAL_MAPS
  faced &= in->x * s->side_x + in->y * s->side_y + in->z * s->side_z > 0.0f;
#endif
  return faced;
}

// Mask of the lanes that the light reaches: they face it and, with shadows, nothing lies between.
static inline intv lit_by(const SceneArrays* scene, const Incident* in, const Surface* s,
                          float bias, intv active) {
#if !RAYWAVE_SHADOWS
  (void)scene, (void)bias;
#endif
  intv lit = faced_by(in, s, active);
#if RAYWAVE_SHADOWS
  if (LANES_ANY(lit)) {
    const Rays shadow = {s->x + bias * SIDE_X(s),
                         s->y + bias * SIDE_Y(s),
                         s->z + bias * SIDE_Z(s),
                         in->x,
                         in->y,
                         in->z,
                         (floatv)(0.0f),
                         in->distance,
                         lit};
    lit &= !bvh_occluded(&scene->tree, &shadow);
  }
#endif
  return lit;
}

// 1: rays that lie close together ask for one direction each of a light that has a size, and where
// they disagree, for some more.
#define SHADOWS_PROBED                                                                 \
  (RAYWAVE_SHADOWS > 0 && RAYWAVE_SHADOWS < SHADOWS_ALL && RAYWAVE_LIGHT_PLACES > 1 && \
   RAYWAVE_LIGHTS > 0 && RAYWAVE_LANES > 1)

#if SHADOWS_PROBED
// Whether a light has a size: its places differ.
static inline bool is_wide(__global const Light* light) {
  __global const Light* last = light + RAYWAVE_LIGHT_PLACES - 1;
  return light->x != last->x || light->y != last->y || light->z != last->z;
}

// Shares of the lights from `first` on, one per lane, that nothing keeps from surfaces that lie
// close together. In each round every lane asks for another light, or the lanes share a few. When
// all answers of the first round agree, they hold for all; else RAYWAVE_SHADOWS rounds tell. A lane
// takes its own answer for the lights that it has asked for, and the others' mean for the rest.
CALLED void shares_of_lights(const SceneArrays* scene, const Surface* s, int first, float bias,
                             float reach, intv active, floatv* shares) {
  const int flips[8] = {0, 15, 6, 9, 3, 12, 5, 10};
  // Lanes without a surface ask from that of another one
  float of[6][RAYWAVE_LANES], way[3][RAYWAVE_LANES];
  int is_active[RAYWAVE_LANES], place[RAYWAVE_LANES], is_point[RAYWAVE_LANES],
      number[RAYWAVE_LANES], does_ask[RAYWAVE_LANES], lit[RAYWAVE_LANES], asked_of[RAYWAVE_LANES],
      lit_of[RAYWAVE_LANES];
  LANES_STORE(s->x, of[0]);
  LANES_STORE(s->y, of[1]);
  LANES_STORE(s->z, of[2]);
  LANES_STORE(SIDE_X(s), of[3]);
  LANES_STORE(SIDE_Y(s), of[4]);
  LANES_STORE(SIDE_Z(s), of[5]);
  LANES_STORE(active, is_active);
  LANES_STORE(s->light_place, place);
  int from = 0;
  while (from < RAYWAVE_LANES - 1 && !is_active[from]) ++from;
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    from = is_active[lane] ? lane : from;
    for (int k = 0; k < 6; ++k) of[k][lane] = of[k][from];
    asked_of[lane] = lit_of[lane] = 0;
  }
  int wide[RAYWAVE_LANES], wides = 0;  // numbers of the lights with a size, from `first` on
  for (int i = 0; i < RAYWAVE_LANES && first + i < RAYWAVE_LIGHTS; ++i) {
    if (is_wide(scene->lights + RAYWAVE_LIGHT_PLACES * (first + i))) wide[wides++] = i;
  }
  const floatv nx = LANES_LOAD(of[3]), ny = LANES_LOAD(of[4]), nz = LANES_LOAD(of[5]);
  Rays rays;
  rays.ox = LANES_LOAD(of[0]);
  rays.oy = LANES_LOAD(of[1]);
  rays.oz = LANES_LOAD(of[2]);
  intv known = 0, free = 0;  // bit i: light first + i
  int asked = 0, lit_in_all = 0;
  for (int round = 0; round < min(RAYWAVE_SHADOWS, RAYWAVE_LANES) && wides > 0; ++round) {
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
      number[lane] = wide[(lane ^ (flips[round] & (RAYWAVE_LANES - 1))) % wides];
      __global const Light* light = scene->lights + RAYWAVE_LIGHT_PLACES * (first + number[lane]);
      is_point[lane] = light->is_point ? -1 : 0;
      way[0][lane] = light[place[lane]].x;
      way[1][lane] = light[place[lane]].y;
      way[2][lane] = light[place[lane]].z;
    }
    const intv point = LANES_LOAD(is_point);
    const floatv zero = 0.0f;
    rays.dx = LANES_LOAD(way[0]) - LANES_SELECT(zero, rays.ox, point);
    rays.dy = LANES_LOAD(way[1]) - LANES_SELECT(zero, rays.oy, point);
    rays.dz = LANES_LOAD(way[2]) - LANES_SELECT(zero, rays.oz, point);
    const intv asks = rays.dx * nx + rays.dy * ny + rays.dz * nz > 0.0f;
    if (!LANES_ANY(asks)) continue;
    Rays shadow = rays;
    shadow.ox += bias * nx;
    shadow.oy += bias * ny;
    shadow.oz += bias * nz;
    shadow.t_min = 0.0f;
    shadow.t_max = LANES_SELECT((floatv)(reach), (floatv)(1.0f), point);
    shadow.active = asks;
    const intv passes = asks & !bvh_occluded(&scene->tree, &shadow);
    const intv bit = (intv)(1) << LANES_LOAD(number);
    known |= LANES_SELECT((intv)(0), bit, asks);
    free |= LANES_SELECT((intv)(0), bit, passes);
    LANES_STORE(asks, does_ask);
    LANES_STORE(passes, lit);
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
      asked_of[number[lane]] += does_ask[lane] != 0;
      lit_of[number[lane]] += lit[lane] != 0;
      asked += does_ask[lane] != 0;
      lit_in_all += lit[lane] != 0;
    }
    if (round == 0 && (lit_in_all == 0 || lit_in_all == asked)) break;
  }
  for (int i = 0; i < RAYWAVE_LANES && first + i < RAYWAVE_LIGHTS; ++i) {
    if (is_wide(scene->lights + RAYWAVE_LIGHT_PLACES * (first + i))) {
      const float mean = asked_of[i] > 0 ? (float)lit_of[i] / (float)asked_of[i]
                         : asked > 0     ? (float)lit_in_all / (float)asked
                                         : 1.0f;
      shares[i] = LANES_SELECT((floatv)(mean),
                               LANES_SELECT((floatv)(0.0f), (floatv)(1.0f), (free >> i & 1) != 0),
                               (known >> i & 1) != 0);
    } else {
      const Incident in = incident(scene->lights, first + i, s, reach);
      shares[i] = LANES_SELECT((floatv)(0.0f), (floatv)(1.0f), lit_by(scene, &in, s, bias, active));
    }
  }
}
#endif

// Share of light l that reaches each lane of surfaces. shares: of the lights of its group, where
// the surfaces lie together, made anew with the first of them.
static inline floatv share_of_light(const SceneArrays* scene, int l, const Incident* in,
                                    const Surface* s, float bias, float reach, bool together,
                                    intv active, floatv* shares) {
#if SHADOWS_PROBED
  if (together) {
    if (l % RAYWAVE_LANES == 0) shares_of_lights(scene, s, l, bias, reach, active, shares);
    return LANES_SELECT((floatv)(0.0f), shares[l % RAYWAVE_LANES], faced_by(in, s, active));
  }
#endif
  (void)l, (void)reach, (void)together, (void)shares;
  return LANES_SELECT((floatv)(0.0f), (floatv)(1.0f), lit_by(scene, in, s, bias, active));
}

#if RAYWAVE_HIGHLIGHTS > 0
#if RAYWAVE_SHARP && RAYWAVE_NORMAL_MAPS
// The normal for shading: that of a map is a float, any other is refined.
static inline DoubleSingle3 shading_normal(const Surface* s) {
  const floatv zero = 0.0f;
  const intv mapped = fabs(s->nx - ds_high(s->normal.x)) + fabs(s->ny - ds_high(s->normal.y)) +
                          fabs(s->nz - ds_high(s->normal.z)) >
                      0.0f;
  const DoubleSingle3 normal = {ds_select(s->normal.x, ds(s->nx, zero), mapped),
                                ds_select(s->normal.y, ds(s->ny, zero), mapped),
                                ds_select(s->normal.z, ds(s->nz, zero), mapped)};
  return normal;
}
#endif

// One minus the cosine between the mirrored light and the direction to the viewer.
static inline floatv mirror_gap(__global const Light* light, const Incident* in, const Surface* s) {
#if RAYWAVE_SHARP
  DoubleSingle3 from = in->place;
  if (light->is_point) from = ds3_minus(from, s->place);
#if RAYWAVE_NORMAL_MAPS
  const DoubleSingle3 normal = shading_normal(s);
#else
  const DoubleSingle3 normal = s->normal;
#endif
  // None of the vectors has exactly unit length. The cross product keeps small angles accurate.
  const DoubleSingle facing = ds3_dot(normal, from);
  const DoubleSingle3 mirrored = ds3_minus(ds3_scaled(normal, ds_plus(facing, facing)),
                                           ds3_scaled(from, ds3_dot(normal, normal)));
  const DoubleSingle3 across = ds3_cross(mirrored, s->towards);
  const floatv rx = ds_high(mirrored.x), ry = ds_high(mirrored.y), rz = ds_high(mirrored.z);
  const floatv vx = ds_high(s->towards.x), vy = ds_high(s->towards.y), vz = ds_high(s->towards.z);
  const floatv cx = ds_high(across.x), cy = ds_high(across.y), cz = ds_high(across.z);
  const floatv squared =
      fmax((rx * rx + ry * ry + rz * rz) * (vx * vx + vy * vy + vz * vz), (floatv)(1e-37f));
  const floatv cosine = (rx * vx + ry * vy + rz * vz) * rsqrt(squared);
  return LANES_SELECT((floatv)(1.0f), (cx * cx + cy * cy + cz * cz) / (squared * (1.0f + cosine)),
                      cosine > 0.0f);
#else
  (void)light;
  const floatv twice = 2.0f * in->facing;
  // Half the squared distance of two unit vectors is one minus their cosine, without the cosine's
  // rounding error.
  const floatv dx = twice * s->nx - in->x - s->vx, dy = twice * s->ny - in->y - s->vy,
               dz = twice * s->nz - in->z - s->vz;
  return fmin(0.5f * (dx * dx + dy * dy + dz * dz), (floatv)(1.0f));
#endif
}

// Radiance of the highlight of a light of these towards the viewer, over the light's intensity and
// the surface's specular.
static inline floatv highlight(__global const Light* lights, int index, const Incident* in,
                               const Surface* s) {
  return pow_unit(mirror_gap(lights + RAYWAVE_LIGHT_PLACES * index, in, s), s->shininess);
}
#endif

// Radiance in each of the colours.
typedef struct {
  floatv of[RAYWAVE_COLOURS];
} Radiance;

// The part of a radiance that the hologram shows: that of its channel, or the light of its laser. A
// laser cannot take light away.
static inline floatv shown_radiance(const SceneArrays* scene, const Radiance* radiance) {
#if RAYWAVE_COLOURS > 1
  const float* weights = scene->light.laser;
  return fmax(
      weights[0] * radiance->of[0] + weights[1] * radiance->of[1] + weights[2] * radiance->of[2],
      (floatv)(0.0f));
#else
  (void)scene;
  return radiance->of[0];
#endif
}

// Radiance that no light with a place or a direction makes: ambient light and emission.
static inline Radiance own_light(const SceneArrays* scene, const Surface* s) {
  Radiance own;
  int k = 0;
  do {  // once at least: no compiler can doubt that it has a value
#if RAYWAVE_TEXTURES > TEXTURES_PLAIN
    own.of[k] = s->ambient[k] * scene->light.ambient + s->emission[k];
#else
    own.of[k] = s->ambient[k] * scene->light.ambient;
#endif
  } while (++k < RAYWAVE_COLOURS);
  return own;
}

#if RAYWAVE_DIFFUSE_RAYS > 0 || RAYWAVE_GLOSS_RAYS > 0
// Unit vectors, and the light that comes from there.
typedef struct {
  floatv x, y, z;
} Direction;

// At an angle with this cosine to a unit vector, `turn` turns around it from anywhere.
static inline Direction around(Direction axis, floatv cosine, floatv turn) {
  // A frame that has no singular direction (Duff et al. 2017)
  const floatv sign = copysign((floatv)(1.0f), axis.z), a = -1.0f / (sign + axis.z),
               b = axis.x * axis.y * a, sine = sqrt(fmax(1.0f - cosine * cosine, (floatv)(0.0f)));
  floatv c, s;
  cos_sin_turns(turn, &c, &s);
  c *= sine;
  s *= sine;
  const Direction d = {c * (1.0f + sign * axis.x * axis.x * a) + s * b + cosine * axis.x,
                       c * sign * b + s * (sign + axis.y * axis.y * a) + cosine * axis.y,
                       -c * sign * axis.x - s * axis.y + cosine * axis.z};
  return d;
}

// Adds the light of other surfaces that comes from a direction: ambient light, emission, and what
// they scatter of lights. What they mirror or let through, and their highlights, are left out.
CALLED void add_light_from(const SceneArrays* scene, const Surface* s, Direction to, float bias,
                           float reach, intv active, Radiance* sum) {
  const Rays rays = {s->x + bias * SIDE_X(s),
                     s->y + bias * SIDE_Y(s),
                     s->z + bias * SIDE_Z(s),
                     to.x,
                     to.y,
                     to.z,
                     (floatv)(0.0f),
                     (floatv)(reach),
                     active & (to.x * SIDE_X(s) + to.y * SIDE_Y(s) + to.z * SIDE_Z(s) > 0.0f)};
  if (!LANES_ANY(rays.active)) return;
  const Hits hits = bvh_nearest(&scene->tree, &rays);
  const intv hit = hits.triangle >= 0;
  if (!LANES_ANY(hit)) return;
  Surface met = surface_at(scene, &rays, &hits);
  LOOK_FOR_LIGHTS(&met, s->light_place);
  Radiance radiance = own_light(scene, &met);
#if RAYWAVE_LIGHTS > 0
  for (int i = 0; i < RAYWAVE_LIGHTS; ++i) {
    const Incident in = incident(scene->lights, i, &met, reach);
    const intv lit = lit_by(scene, &in, &met, bias, hit);
    for (int k = 0; k < RAYWAVE_COLOURS; ++k)
      radiance.of[k] +=
          LANES_SELECT((floatv)(0.0f), met.diffuse[k] * in.facing * intensity_of(&in, k), lit);
  }
#endif
  const floatv own = 1.0f - met.reflectivity - met.transparency;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k)
    sum->of[k] += LANES_SELECT((floatv)(0.0f), own * radiance.of[k], hit);
}

// Direction i of `rays` of each lane of a surface around an axis, of the set that the 16 places
// share: even in what `share` gets, which lies within 0 to 1, and in the turns around the axis.
static inline floatv direction_of(const Surface* s, int i, int rays, floatv* share) {
  const floatv number = LANES_TO_FLOAT(16 * i + s->light_place);
  *share = (number + 0.5f) / (16.0f * (float)rays);
  return number * 0.6180339887f;
}

// Adds to a radiance towards the viewer what the surface scatters of the light of others.
CALLED void add_scattered(const SceneArrays* scene, const Surface* s, float bias, float reach,
                          intv active, Radiance* radiance) {
  floatv share;
#if RAYWAVE_DIFFUSE_RAYS > 0
  intv matt = 0;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) matt |= s->diffuse[k] > 0.0f;
  const Direction normal = {s->nx, s->ny, s->nz};
  Radiance diffuse;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) diffuse.of[k] = 0.0f;
  for (int i = 0; i < RAYWAVE_DIFFUSE_RAYS && LANES_ANY(active & matt); ++i) {
    const floatv turn = direction_of(s, i, RAYWAVE_DIFFUSE_RAYS, &share);
    add_light_from(scene, s, around(normal, sqrt(share), turn), bias, reach, active & matt,
                   &diffuse);
  }
  for (int k = 0; k < RAYWAVE_COLOURS; ++k)
    radiance->of[k] += s->diffuse[k] * diffuse.of[k] / (float)RAYWAVE_DIFFUSE_RAYS;
#endif
#if RAYWAVE_GLOSS_RAYS > 0
  intv glossy = 0;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) glossy |= s->specular[k] > 0.0f;
  const floatv twice = 2.0f * (s->vx * s->nx + s->vy * s->ny + s->vz * s->nz);
  const Direction mirrored = {twice * s->nx - s->vx, twice * s->ny - s->vy, twice * s->nz - s->vz};
  Radiance gloss;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) gloss.of[k] = 0.0f;
  for (int i = 0; i < RAYWAVE_GLOSS_RAYS && LANES_ANY(active & glossy); ++i) {
    const floatv turn = direction_of(s, i, RAYWAVE_GLOSS_RAYS, &share);
    const floatv cosine = pow_unit(1.0f - share, 1.0f / (s->shininess + 1.0f));
    add_light_from(scene, s, around(mirrored, cosine, turn), bias, reach, active & glossy, &gloss);
  }
  for (int k = 0; k < RAYWAVE_COLOURS; ++k)
    radiance->of[k] +=
        s->specular[k] * gloss.of[k] / ((0.5f * s->shininess + 1.0f) * (float)RAYWAVE_GLOSS_RAYS);
#endif
}
#define ADD_SCATTERED(scene, s, bias, reach, active, radiance) \
  add_scattered(scene, s, bias, reach, active, radiance)
#else
#define ADD_SCATTERED(scene, s, bias, reach, active, radiance) ((void)0)
#endif

// Radiance from the surface towards the viewer that the hologram shows, without mirrors and glass:
// ambient part plus the diffuse and specular parts of all lights, and the light of other surfaces
// that it scatters. together: share_of_light
static inline floatv phong(const SceneArrays* scene, const Surface* s, float bias, float reach,
                           bool together, intv active) {
  Radiance radiance = own_light(scene, s);
  ADD_SCATTERED(scene, s, bias, reach, active, &radiance);
#if RAYWAVE_LIGHTS > 0
  // Clear glass and plain mirrors show no light, and ask for none
  intv shows = 0;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k)
    shows |= (s->diffuse[k] > 0.0f) | (s->specular[k] > 0.0f);
  if (!LANES_ANY(active & shows)) return shown_radiance(scene, &radiance);
  if (!together) active &= shows;
  floatv shares[RAYWAVE_LANES];
  for (int i = 0; i < RAYWAVE_LIGHTS; ++i) {
    const Incident in = incident(scene->lights, i, s, reach);
    const floatv share = share_of_light(scene, i, &in, s, bias, reach, together, active, shares);
    if (!LANES_ANY(share > 0.0f)) continue;
#if RAYWAVE_HIGHLIGHTS > 0
    floatv glow = 0.0f;
    if (i < RAYWAVE_HIGHLIGHTS) glow = highlight(scene->lights, i, &in, s);
#endif
    for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
      floatv part = s->diffuse[k] * in.facing;
#if RAYWAVE_HIGHLIGHTS > 0
      if (i < RAYWAVE_HIGHLIGHTS) part += s->specular[k] * glow;
#endif
      radiance.of[k] += share * (part * intensity_of(&in, k));
    }
  }
#endif
  return shown_radiance(scene, &radiance);
}

#endif
