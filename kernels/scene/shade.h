// SPDX-License-Identifier: Apache-2.0
// Surface attributes at hits, and Phong radiance (paper, Eq. 3), for packets of lanes.
#ifndef RAYWAVE_SHADE_H
#define RAYWAVE_SHADE_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/arrays.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/hit_refinement.h"
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

#define REFINED_SURFACES \
  (RAYWAVE_BOUNCES > 0 || (RAYWAVE_SHARP && RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0))

// Position and material of a hit, one per lane. The normal has unit length and points to the side
// from which the ray came.
typedef struct {
  floatv x, y, z;
  floatv nx, ny, nz;
  floatv vx, vy, vz;                             // unit vector towards the viewer
  floatv ambient, diffuse, specular, shininess;  // textures applied
  floatv reflectivity, transparency, ior, ior_low, attenuation;
  intv entering;  // the ray hits the outer side of the surface
#if REFINED_SURFACES
  // Double-single values from refine_surface; `towards` points to the viewer and has any length
  DoubleSingle3 place, normal, towards;
#endif
} Surface;

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

#if RAYWAVE_TEXTURES
// Bilinear interpolation of a repeated texture. (0, 0) is the bottom left; row 0 of the picture is
// on top.
static inline float texture_at(__global const float* texels, __global const Material* material,
                               float u, float v) {
  const int width = material->texture_width, height = material->texture_height;
  const float x = (u - floor(u)) * (float)width - 0.5f;
  const float y = (1.0f - (v - floor(v))) * (float)height - 0.5f;
  const float fx = floor(x), fy = floor(y);
  const int x0 = ((int)fx + width) % width, y0 = ((int)fy + height) % height;
  const int x1 = (x0 + 1) % width, y1 = (y0 + 1) % height;
  __global const float* t = texels + material->texture;
  const float top = mix(t[y0 * width + x0], t[y0 * width + x1], x - fx);
  const float bottom = mix(t[y1 * width + x0], t[y1 * width + x1], x - fx);
  return mix(top, bottom, y - fy);
}
#endif

// The surface at each hit. Lanes that miss receive a black one.
static inline Surface surface_at(const SceneArrays* scene, const Rays* rays, const Hits* hits) {
  int triangle[RAYWAVE_LANES];
  float u[RAYWAVE_LANES], v[RAYWAVE_LANES];
  float nx[RAYWAVE_LANES], ny[RAYWAVE_LANES], nz[RAYWAVE_LANES], gx[RAYWAVE_LANES],
      gy[RAYWAVE_LANES], gz[RAYWAVE_LANES];
  float ambient[RAYWAVE_LANES], diffuse[RAYWAVE_LANES], specular[RAYWAVE_LANES],
      shininess[RAYWAVE_LANES];
  float reflectivity[RAYWAVE_LANES], transparency[RAYWAVE_LANES], ior[RAYWAVE_LANES],
      ior_low[RAYWAVE_LANES], attenuation[RAYWAVE_LANES];
  LANES_STORE(hits->triangle, triangle);
  LANES_STORE(hits->u, u);
  LANES_STORE(hits->v, v);
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    nx[i] = ny[i] = gx[i] = gy[i] = 0.0f;
    nz[i] = gz[i] = 1.0f;
    ambient[i] = diffuse[i] = specular[i] = shininess[i] = reflectivity[i] = transparency[i] =
        ior_low[i] = attenuation[i] = 0.0f;
    ior[i] = 1.0f;
    if (triangle[i] < 0) continue;
    __global const Triangle* s = scene->tree.triangles + triangle[i];
    __global const Material* m = scene->materials + s->material;
    const float b = u[i], c = v[i], a = 1.0f - b - c;
    const float3 at_a = vload3((size_t)s->corner_a, scene->normals),
                 at_b = vload3((size_t)s->corner_b, scene->normals);
    const float3 at_c = vload3((size_t)s->corner_c, scene->normals);
    const float3 smooth =
        direction_in_scene(&scene->tree, triangle[i], a * at_a + b * at_b + c * at_c);
    nx[i] = smooth.x;
    ny[i] = smooth.y;
    nz[i] = smooth.z;
    const float3 face = triangle_cross(&scene->tree, triangle[i]);
    gx[i] = face.x;
    gy[i] = face.y;
    gz[i] = face.z;
    ambient[i] = m->ambient;
    diffuse[i] = m->diffuse;
    specular[i] = m->specular;
    shininess[i] = m->shininess;
    reflectivity[i] = m->reflectivity;
    transparency[i] = m->transparency;
    ior[i] = m->ior;
    ior_low[i] = m->ior_low;
    attenuation[i] = m->attenuation;
#if RAYWAVE_TEXTURES
    if (m->texture >= 0) {
      const float2 uv = a * vload2((size_t)s->corner_a, scene->uvs) +
                        b * vload2((size_t)s->corner_b, scene->uvs) +
                        c * vload2((size_t)s->corner_c, scene->uvs);
      const float texel = texture_at(scene->texels, m, uv.x, uv.y);
      ambient[i] *= texel;
      diffuse[i] *= texel;
    }
#endif
  }
  Surface surface;
  surface.x = rays->ox + hits->t * rays->dx;
  surface.y = rays->oy + hits->t * rays->dy;
  surface.z = rays->oz + hits->t * rays->dz;
  surface.ambient = LANES_LOAD(ambient);
  surface.diffuse = LANES_LOAD(diffuse);
  surface.specular = LANES_LOAD(specular);
  surface.shininess = LANES_LOAD(shininess);
  surface.reflectivity = LANES_LOAD(reflectivity);
  surface.transparency = LANES_LOAD(transparency);
  surface.ior = LANES_LOAD(ior);
  surface.ior_low = LANES_LOAD(ior_low);
  surface.attenuation = LANES_LOAD(attenuation);
  const floatv toward_viewer =
      -rsqrt(rays->dx * rays->dx + rays->dy * rays->dy + rays->dz * rays->dz);
  surface.vx = rays->dx * toward_viewer;
  surface.vy = rays->dy * toward_viewer;
  surface.vz = rays->dz * toward_viewer;

  // The shading normal is turned to the ray's side as the triangle's normal is. This is right for
  // either winding, and for both sides of open meshes.
  const floatv fx = LANES_LOAD(gx), fy = LANES_LOAD(gy), fz = LANES_LOAD(gz);
  const floatv mx = LANES_LOAD(nx), my = LANES_LOAD(ny), mz = LANES_LOAD(nz);
  const floatv face_along_ray = fx * rays->dx + fy * rays->dy + fz * rays->dz;
  const floatv face_along_normal = fx * mx + fy * my + fz * mz;
  const floatv inverse = rsqrt(fmax(mx * mx + my * my + mz * mz, (floatv)(1e-30f)));
  const floatv toward =
      LANES_SELECT(inverse, -inverse, (face_along_ray > 0.0f) == (face_along_normal > 0.0f));
  surface.nx = mx * toward;
  surface.ny = my * toward;
  surface.nz = mz * toward;
  surface.entering = toward > 0.0f;
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
  s->nx = ds_high(s->normal.x);
  s->ny = ds_high(s->normal.y);
  s->nz = ds_high(s->normal.z);
  return distance;
}
#endif

// A light as a surface sees it: unit vector towards it and the cosine of the angle of incidence (<=
// 0: behind the surface).
typedef struct {
  floatv x, y, z;
  floatv distance;
  floatv facing;
  float intensity;
} Incident;

static inline Incident incident(__global const Light* lights, int index, const Surface* s,
                                float reach) {
  const Light light = lights[index];
  Incident in;
  in.x = light.x;
  in.y = light.y;
  in.z = light.z;
  in.distance = reach;
  in.intensity = light.intensity;
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
  }
  in.facing = s->nx * in.x + s->ny * in.y + s->nz * in.z;
  return in;
}

// Mask of the lanes that the light reaches: they face it and, with shadows, nothing lies between.
static inline intv lit_by(const SceneArrays* scene, const Incident* in, const Surface* s,
                          float bias, intv active) {
#if !RAYWAVE_SHADOWS
  (void)scene, (void)s, (void)bias;
#endif
  intv lit = (in->facing > 0.0f) & active;
#if RAYWAVE_SHADOWS
  if (LANES_ANY(lit)) {
    const Rays shadow = {s->x + bias * s->nx,
                         s->y + bias * s->ny,
                         s->z + bias * s->nz,
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

#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
// One minus the cosine between the mirrored light and the direction to the viewer.
static inline floatv mirror_gap(__global const Light* light, const Incident* in, const Surface* s) {
#if RAYWAVE_SHARP
  (void)in;
  DoubleSingle3 from = {ds(light->x, light->x_low), ds(light->y, light->y_low),
                        ds(light->z, light->z_low)};
  if (light->is_point) from = ds3_minus(from, s->place);
  // None of the vectors has exactly unit length. The cross product keeps small angles accurate.
  const DoubleSingle facing = ds3_dot(s->normal, from);
  const DoubleSingle3 mirrored = ds3_minus(ds3_scaled(s->normal, ds_plus(facing, facing)),
                                           ds3_scaled(from, ds3_dot(s->normal, s->normal)));
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

// Radiance of a light's highlight towards the viewer.
static inline floatv highlight(__global const Light* light, const Incident* in, const Surface* s) {
  return s->specular * pow_unit(mirror_gap(light, in, s), s->shininess);
}
#endif

// Radiance from the surface towards the viewer, without bounces: the ambient part plus the diffuse
// and specular parts of all lights.
static inline floatv phong(const SceneArrays* scene, const Surface* s, float bias, float reach,
                           intv active) {
  floatv radiance = s->ambient * scene->ambient_light;
#if RAYWAVE_LIGHTS > 0
  for (int i = 0; i < RAYWAVE_LIGHTS; ++i) {
    const Incident in = incident(scene->lights, i, s, reach);
    const intv lit = lit_by(scene, &in, s, bias, active);
    if (!LANES_ANY(lit)) continue;
    floatv part = s->diffuse * in.facing;
#if RAYWAVE_SPECULAR
    part += highlight(scene->lights + i, &in, s);
#endif
    radiance += LANES_SELECT((floatv)(0.0f), part * in.intensity, lit);
  }
#endif
  return radiance;
}

#endif
