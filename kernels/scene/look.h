// SPDX-License-Identifier: Apache-2.0
// A material at a place of a triangle, and whether the surface is there: pictures, colours
// of vertices, metalness and roughness (docs/materials.md). One place at a time: neighbouring
// rays may meet different materials.
#ifndef RAYWAVE_LOOK_H
#define RAYWAVE_LOOK_H

#include "kernels/common/hash.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/arrays.h"
#include "kernels/scene/options.h"

// 1: pictures have places and ends of their own
#define MAPS_ARE_PLACED (RAYWAVE_TEXTURES > TEXTURES_PLAIN || RAYWAVE_ALPHA)

// Floats of a vertex's colour: its colours and alpha.
#define COLOUR_FLOATS (RAYWAVE_COLOURS + 1)

// A material at a place, without light.
typedef struct {
  float ambient[RAYWAVE_COLOURS], diffuse[RAYWAVE_COLOURS], specular[RAYWAVE_COLOURS],
      emission[RAYWAVE_COLOURS];
  float shininess;
} Look;

#if RAYWAVE_TEXTURES || RAYWAVE_ALPHA
// The place of a picture that (u, v) shows. Plain pictures lie as the mesh's
// coordinates say, and repeat.
static inline float2 place_on_map(__global const TextureMap* map, float2 uv) {
#if MAPS_ARE_PLACED
  return (float2)(map->across[0] * uv.x + map->across[1] * uv.y + map->across[2],
                  map->up[0] * uv.x + map->up[1] * uv.y + map->up[2]);
#else
  (void)map;
  return uv;
#endif
}

// Texels from the middle of the first one to the place t of a picture that is n texels wide.
static inline float texel_place(float t, int n, int wrap) {
#if MAPS_ARE_PLACED
  if (wrap == WRAP_CLAMP) return clamp(t, 0.0f, 1.0f) * (float)n - 0.5f;
  if (wrap == WRAP_MIRROR) return (t - 2.0f * floor(0.5f * t)) * (float)n - 0.5f;
#else
  (void)wrap;
#endif
  return (t - floor(t)) * (float)n - 0.5f;
}

// The texel at place i, from -1 on, beside such a place.
static inline int texel_index(int i, int n, int wrap) {
#if MAPS_ARE_PLACED
  if (wrap == WRAP_CLAMP) return clamp(i, 0, n - 1);
  if (wrap == WRAP_MIRROR) return clamp(i < n ? i : 2 * n - 1 - i, 0, n - 1);
#else
  (void)wrap;
#endif
  return (i + n) % n;
}

// Bilinear interpolation of a picture's texels, which begin at `first`, at a place of the picture.
static inline float texture_at(__global const float* texels, __global const TextureMap* map,
                               int first, float2 place) {
  const int width = map->width, height = map->height;
  const int wrap_x = map->wrap & 3, wrap_y = map->wrap >> 2;
  const float x = texel_place(place.x, width, wrap_x),
              y = texel_place(1.0f - place.y, height, wrap_y);
  const float fx = floor(x), fy = floor(y);
  const int x0 = texel_index((int)fx, width, wrap_x), x1 = texel_index((int)fx + 1, width, wrap_x);
  const int y0 = texel_index((int)fy, height, wrap_y),
            y1 = texel_index((int)fy + 1, height, wrap_y);
  __global const float* t = texels + first;
  const float top = mix(t[y0 * width + x0], t[y0 * width + x1], x - fx);
  const float bottom = mix(t[y1 * width + x0], t[y1 * width + x1], x - fx);
  return mix(top, bottom, y - fy);
}

// The same of a colour of a picture.
static inline float colour_at(__global const float* texels, __global const TextureMap* map,
                              int colour, float2 place) {
  return texture_at(texels, map, map->first + colour * map->width * map->height, place);
}

// The value of two floats of each vertex at the place with weights a, b and c.
static inline float2 at_place(__global const float* of_vertices, __global const Triangle* triangle,
                              float a, float b, float c) {
  return a * vload2((size_t)triangle->corner_a, of_vertices) +
         b * vload2((size_t)triangle->corner_b, of_vertices) +
         c * vload2((size_t)triangle->corner_c, of_vertices);
}

// Number i of the floats of the vertices' colours there.
static inline float vertex_colour_at(__global const float* colours,
                                     __global const Triangle* triangle, float a, float b, float c,
                                     int i) {
#if RAYWAVE_COLOURS == 1
  const float2 colour = at_place(colours, triangle, a, b, c);
  return i == 0 ? colour.x : colour.y;
#else
  return a * colours[(size_t)triangle->corner_a * COLOUR_FLOATS + (size_t)i] +
         b * colours[(size_t)triangle->corner_b * COLOUR_FLOATS + (size_t)i] +
         c * colours[(size_t)triangle->corner_c * COLOUR_FLOATS + (size_t)i];
#endif
}
#endif

#if RAYWAVE_TEXTURES > TEXTURES_PLAIN
// Phong's exponent of a roughness (host/scene/mesh_materials.hpp).
static inline float shininess_of(float roughness) {
  const float squared = roughness * roughness, fourth = squared * squared;
  return fourth * 20001.0f <= 1.0f ? 1e4f : 0.5f * (1.0f / fourth - 1.0f);
}
#endif

// The look of a triangle at the place with weights a, b and c of its corners.
static inline Look look_at(const SceneArrays* scene, __global const Triangle* triangle, float a,
                           float b, float c) {
  __global const Material* m = scene->materials + triangle->material;
  Look look;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    look.ambient[k] = m->ambient[k];
    look.diffuse[k] = m->diffuse[k];
    look.specular[k] = m->specular[k];
    look.emission[k] = 0.0f;
  }
  look.shininess = m->shininess;
#if RAYWAVE_TEXTURES
  const float2 uv = at_place(scene->uvs, triangle, a, b, c);
  float tint[RAYWAVE_COLOURS];
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) tint[k] = 1.0f;
  if (m->colour.first >= 0) {
    const float2 place = place_on_map(&m->colour, uv);
    for (int k = 0; k < RAYWAVE_COLOURS; ++k)
      tint[k] = colour_at(scene->texels, &m->colour, k, place);
  }
#if RAYWAVE_TEXTURES > TEXTURES_PLAIN
  if (m->kind & MATERIAL_VERTEX_COLOURS) {
    for (int k = 0; k < RAYWAVE_COLOURS; ++k)
      tint[k] *= vertex_colour_at(scene->colours, triangle, a, b, c, k);
  }
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) look.emission[k] = m->emission[k];
  if (m->emission_map.first >= 0) {
    const float2 place = place_on_map(&m->emission_map, uv);
    for (int k = 0; k < RAYWAVE_COLOURS; ++k)
      look.emission[k] *= colour_at(scene->texels, &m->emission_map, k, place);
  }
  if (m->kind & MATERIAL_UNLIT) {
    for (int k = 0; k < RAYWAVE_COLOURS; ++k) look.emission[k] *= tint[k];
  }
  if (m->kind & MATERIAL_METALLIC) {
    float metallic = m->metallic, roughness = m->roughness;
    if (m->roughness_map.first >= 0) {
      const float2 place = place_on_map(&m->roughness_map, uv);
      roughness *= texture_at(scene->texels, &m->roughness_map, m->roughness_map.first, place);
      metallic *= texture_at(scene->texels, &m->roughness_map, m->metallic_texels, place);
    }
    look.shininess = shininess_of(roughness);
    for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
      const float base = m->base[k] * tint[k];
      look.ambient[k] = m->ambient_share * base;
      look.diffuse[k] = (1.0f - metallic) * base;
      const float reflectance = mix(m->reflectance, base, metallic);
      look.specular[k] = reflectance * (0.5f * look.shininess + 1.0f);
      if (look.shininess < 1.0f) {  // a highlight as wide as this is diffuse light
        look.diffuse[k] += reflectance;
        look.specular[k] = 0.0f;
      }
    }
    return look;
  }
#endif
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    look.ambient[k] *= tint[k];
    look.diffuse[k] *= tint[k];
  }
#else
  (void)a, (void)b, (void)c;
#endif
  return look;
}

#if RAYWAVE_ALPHA
// Alpha of a material at the place with weights a, b and c of a triangle's corners.
static inline float alpha_at(const Tree* tree, __global const Triangle* triangle,
                             __global const Material* m, float a, float b, float c) {
  float alpha = m->alpha;
  const float2 uv = at_place(tree->uvs, triangle, a, b, c);
  if (m->alpha_texels >= 0)
    alpha *= texture_at(tree->texels, &m->colour, m->alpha_texels, place_on_map(&m->colour, uv));
  if (m->opacity_map.first >= 0)
    alpha *= texture_at(tree->texels, &m->opacity_map, m->opacity_map.first,
                        place_on_map(&m->opacity_map, uv));
  if (m->kind & MATERIAL_VERTEX_COLOURS)
    alpha *= vertex_colour_at(tree->colours, triangle, a, b, c, RAYWAVE_COLOURS);
  return alpha;
}

// The largest whole number <= x, for |x| < 2^31.
static inline intv whole_below(floatv x) {
  const intv truncated = LANES_TO_INT(x);
  return truncated - LANES_SELECT((intv)(0), (intv)(1), LANES_TO_FLOAT(truncated) > x);
}

// Mask of the hits of a triangle, at the weights u and v of its corners b and c, at which its
// surface is there. All rays agree: what decides is the place in the frame of the instance.
static inline intv is_there(const Tree* tree, int index, floatv u, floatv v, intv hit) {
  __global const Triangle* triangle = tree->triangles + index;
  __global const Material* m = tree->materials + triangle->material;
  if (m->alpha_mode == ALPHA_OPAQUE) return hit;
  floatv least = m->alpha_cutoff;
  if (m->alpha_mode == ALPHA_BLEND) {
    __global const float *p = tree->positions + 3 * (size_t)triangle->corner_a,
                         *q = tree->positions + 3 * (size_t)triangle->corner_b,
                         *r = tree->positions + 3 * (size_t)triangle->corner_c;
    const floatv x = p[0] + (u * (q[0] - p[0]) + v * (r[0] - p[0])),
                 y = p[1] + (u * (q[1] - p[1]) + v * (r[1] - p[1])),
                 z = p[2] + (u * (q[2] - p[2]) + v * (r[2] - p[2]));
    // The offsets keep flat surfaces through the scene's middle off the cells' limits
    least = phase_turns(
        cell_key(whole_below(x * m->blend_rate + 0.37f), whole_below(y * m->blend_rate + 0.43f),
                 whole_below(z * m->blend_rate + 0.31f)),
        m->blend_seed);
  }
  float us[RAYWAVE_LANES], vs[RAYWAVE_LANES], leasts[RAYWAVE_LANES];
  int there[RAYWAVE_LANES];
  LANES_STORE(u, us);
  LANES_STORE(v, vs);
  LANES_STORE(least, leasts);
  LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), hit), there);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    if (!there[lane]) continue;
    const float alpha = alpha_at(tree, triangle, m, 1.0f - us[lane] - vs[lane], us[lane], vs[lane]);
    // The numbers that blending draws are 0 to 1, without 1: where alpha is 0 nothing is there
    there[lane] = alpha >= leasts[lane] && (alpha > 0.0f || m->alpha_mode != ALPHA_BLEND);
  }
  return hit & (LANES_LOAD(there) != 0);
}
#endif

#if RAYWAVE_NORMAL_MAPS
// The normal that a normal map gives, of unit length, in the mesh's sense; `smooth`, where the
// material has none or the texture coordinates say nothing.
//
// b, c      weights of the place
// smooth    interpolated normal of any length, scene frame
// ab, ac    edges of the triangle, scene frame
static inline float3 mapped_normal(const SceneArrays* scene, __global const Triangle* triangle,
                                   float b, float c, float3 smooth, float3 ab, float3 ac) {
  __global const Material* m = scene->materials + triangle->material;
  __global const TextureMap* map = &m->normal_map;
  if (map->first < 0) return smooth;
  const float2 at_a = vload2((size_t)triangle->corner_a, scene->uvs),
               uv_b = vload2((size_t)triangle->corner_b, scene->uvs) - at_a,
               uv_c = vload2((size_t)triangle->corner_c, scene->uvs) - at_a;
  const float area = uv_b.x * uv_c.y - uv_c.x * uv_b.y;
  if (!(fabs(area) > 1e-30f)) return smooth;

  // The directions on the surface in which u and v grow
  const float3 n = normalize(smooth), along_u = (ab * uv_c.y - ac * uv_b.y) / area,
               along_v = (ac * uv_b.x - ab * uv_c.x) / area;
  float3 tangent = along_u - n * dot(n, along_u);
  const float length_squared = dot(tangent, tangent);
  if (!(length_squared > 0.0f)) return smooth;
  tangent *= rsqrt(length_squared);
  float3 across = cross(n, tangent);
  if (dot(across, along_v) < 0.0f) across = -across;
  const float2 place = place_on_map(map, at_a + b * uv_b + c * uv_c);
  const float along = 2.0f * texture_at(scene->texels, map, map->first, place) - 1.0f,
              upwards = 2.0f * texture_at(scene->texels, map, m->normal_up_texels, place) - 1.0f,
              out = 2.0f * texture_at(scene->texels, map, m->normal_out_texels, place) - 1.0f;
  const float3 turned =
      m->normal_scale * (along * tangent + upwards * across) + fmax(out, 1e-3f) * n;
  return normalize(turned);
}
#endif

#endif
