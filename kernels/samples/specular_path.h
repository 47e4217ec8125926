// SPDX-License-Identifier: Apache-2.0
// Rays from the hologram's window that follow a sequence of mirrors and clear surfaces, with their
// derivatives (ray differentials, Igehy, SIGGRAPH 1999), for packets of lanes.
#ifndef RAYWAVE_SPECULAR_PATH_H
#define RAYWAVE_SPECULAR_PATH_H

#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/fresnel.h"
#include "kernels/scene/options.h"

#define SEQUENCE_ROOM (RAYWAVE_BOUNCES > 0 ? RAYWAVE_BOUNCES : 1)

// The surfaces that a path meets, from the window on: their materials, and whether the path is
// refracted there (bit i) or mirrored.
typedef struct {
  int length;
  int material[SEQUENCE_ROOM];
  uint refracts;
} Sequence;

typedef struct {
  floatv x, y, z;
} Vector;

static inline Vector vector_of(floatv x, floatv y, floatv z) {
  const Vector v = {x, y, z};
  return v;
}
static inline floatv vector_dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Vector vector_cross(Vector a, Vector b) {
  return vector_of(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline Vector vector_scaled(Vector a, floatv s) {
  return vector_of(a.x * s, a.y * s, a.z * s);
}
// a + b s
static inline Vector vector_along(Vector a, Vector b, floatv s) {
  return vector_of(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}
static inline float3 vector_first(Vector a) {
  return (float3)(LANES_FIRST(a.x), LANES_FIRST(a.y), LANES_FIRST(a.z));
}

// Variables of a ray's derivatives: its place on the window along x and y (metres), and its
// tangents there.
#define BY_PLACE_X 0
#define BY_PLACE_Y 1
#define BY_TANGENT_X 2
#define BY_TANGENT_Y 3
#define DERIVATIVES 4

typedef struct {
  Vector place[DERIVATIVES];
  Vector direction[DERIVATIVES];
} Derivatives;

// Rays after the last surface of a sequence.
typedef struct {
  Vector place;        // on that surface, or where rays start (in front of the scene)
  Vector direction;    // unit length
  floatv nearest;      // hits closer than this are ignored
  floatv share;        // light there that reaches the window, over all
  floatv attenuation;  // in the medium, per metre
  intv inside;         // within glass
  intv found;          // the ray met all surfaces of the sequence
  intv first;          // ... and nothing before any of them
} Followed;

// Rays that start at places on the window, in metres from its centre, with these tangents. by: 0
// where derivatives are not wanted.
static inline void start_rays(const Lattice* lattice, floatv x, floatv y, floatv tangent_x,
                              floatv tangent_y, intv active, Followed* f, Derivatives* by) {
  const float ahead = lattice->near_z - lattice->centre_z;
  const floatv zero = 0.0f, one = 1.0f,
               cosine = 1.0f / sqrt(1.0f + tangent_x * tangent_x + tangent_y * tangent_y);
  f->place = vector_of(lattice->centre_x + x + ahead * tangent_x,
                       lattice->centre_y + y + ahead * tangent_y, (floatv)(lattice->near_z));
  f->direction = vector_of(tangent_x * cosine, tangent_y * cosine, cosine);
  f->nearest = f->attenuation = 0.0f;
  f->share = 1.0f;
  f->inside = LANES_INDEX < 0;
  f->found = f->first = active;
  if (!by) return;
  const Vector along_x = vector_of(one, zero, zero), along_y = vector_of(zero, one, zero);
  by->place[BY_PLACE_X] = along_x;
  by->place[BY_PLACE_Y] = along_y;
  by->place[BY_TANGENT_X] = vector_scaled(along_x, (floatv)(ahead));
  by->place[BY_TANGENT_Y] = vector_scaled(along_y, (floatv)(ahead));
  by->direction[BY_PLACE_X] = by->direction[BY_PLACE_Y] = vector_of(zero, zero, zero);
  by->direction[BY_TANGENT_X] =
      vector_scaled(vector_along(along_x, f->direction, -f->direction.x), cosine);
  by->direction[BY_TANGENT_Y] =
      vector_scaled(vector_along(along_y, f->direction, -f->direction.y), cosine);
}

static inline Rays rays_of_followed(const Followed* f, float reach, intv active) {
  const Rays rays = {f->place.x,     f->place.y, f->place.z,      f->direction.x, f->direction.y,
                     f->direction.z, f->nearest, (floatv)(reach), active};
  return rays;
}

// Mask of the hits of triangles of a material.
static inline intv hits_material(const SceneArrays* scene, intv triangle, int material) {
  int triangles[RAYWAVE_LANES], is_it[RAYWAVE_LANES];
  LANES_STORE(triangle, triangles);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane)
    is_it[lane] =
        triangles[lane] >= 0 && scene->tree.triangles[max(triangles[lane], 0)].material == material;
  return LANES_LOAD(is_it) != 0;
}

// Surfaces that a ray goes through, at most, in search of one behind them
#define MOST_PASSED 8

// The nearest hits of a material's triangles. Rays that meet something else before are no longer
// `first`; without `through`, they miss.
CALLED Hits meet_material(const SceneArrays* scene, int material, float gap, float reach,
                          bool through, Followed* f) {
  Rays rays = rays_of_followed(f, reach, f->found);
  Hits hits = bvh_nearest(&scene->tree, &rays);
  intv other = (hits.triangle >= 0) & !hits_material(scene, hits.triangle, material);
  for (int passed = 0; passed < MOST_PASSED && through && LANES_ANY(other); ++passed) {
    f->first &= !other;
    rays.active = other;
    rays.t_min = LANES_SELECT(rays.t_min, hits.t + gap, other);
    const Hits behind = bvh_nearest(&scene->tree, &rays);
    hits.t = LANES_SELECT(hits.t, behind.t, other);
    hits.triangle = LANES_SELECT(hits.triangle, behind.triangle, other);
    hits.u = LANES_SELECT(hits.u, behind.u, other);
    hits.v = LANES_SELECT(hits.v, behind.v, other);
    other &= (hits.triangle >= 0) & !hits_material(scene, hits.triangle, material);
  }
  hits.triangle = LANES_SELECT(hits.triangle, (intv)(-1), other);
  f->found &= hits.triangle >= 0;
  f->first &= f->found;
  return hits;
}

// A mirror, or the surface of glass, where rays meet it; lanes that miss receive any.
typedef struct {
  Vector normal;              // unit length, towards the rays
  Vector face;                // across the triangle
  Vector edge_b, edge_c;      // from its corner a
  Vector normal_b, normal_c;  // changes of the vertices' normal along these edges
  floatv per_normal;          // 1 / length of the interpolated normal, and its sign
  floatv metal, clear, ior, attenuation;
  intv entering;
} SpecularSurface;

CALLED void specular_surface(const SceneArrays* scene, const Followed* f, const Hits* hits,
                             SpecularSurface* s) {
  int triangle[RAYWAVE_LANES];
  float u[RAYWAVE_LANES], v[RAYWAVE_LANES], values[18][RAYWAVE_LANES], metal[RAYWAVE_LANES],
      clear[RAYWAVE_LANES], ior[RAYWAVE_LANES], attenuation[RAYWAVE_LANES];
  LANES_STORE(hits->triangle, triangle);
  LANES_STORE(hits->u, u);
  LANES_STORE(hits->v, v);
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    const int number = max(triangle[i], 0);
    __global const Triangle* t = scene->tree.triangles + number;
    __global const Material* m = scene->materials + t->material;
    const Corners corners = corners_of(&scene->tree, number);
    const float3 a = vload3(0, corners.a),
                 b = direction_in_scene(&scene->tree, number, vload3(0, corners.b) - a),
                 c = direction_in_scene(&scene->tree, number, vload3(0, corners.c) - a);
    const float3 face = cross(b, c);
    const float3 at_a = vload3((size_t)t->corner_a, scene->normals),
                 to_b = vload3((size_t)t->corner_b, scene->normals) - at_a,
                 to_c = vload3((size_t)t->corner_c, scene->normals) - at_a;
    const float3 smooth =
                     direction_in_scene(&scene->tree, number, at_a + u[i] * to_b + v[i] * to_c),
                 normal_b = direction_in_scene(&scene->tree, number, to_b),
                 normal_c = direction_in_scene(&scene->tree, number, to_c);
    const float3 all[6] = {smooth, face, b, c, normal_b, normal_c};
    for (int k = 0; k < 6; ++k) {
      values[3 * k][i] = all[k].x;
      values[3 * k + 1][i] = all[k].y;
      values[3 * k + 2][i] = all[k].z;
    }
    metal[i] = m->reflectivity;
    clear[i] = m->transparency;
    ior[i] = m->ior;
    attenuation[i] = m->attenuation;
  }
  Vector vectors[6];
  for (int k = 0; k < 6; ++k)
    vectors[k] = vector_of(LANES_LOAD(values[3 * k]), LANES_LOAD(values[3 * k + 1]),
                           LANES_LOAD(values[3 * k + 2]));
  const Vector smooth = vectors[0];
  s->face = vectors[1];
  s->edge_b = vectors[2];
  s->edge_c = vectors[3];
  s->normal_b = vectors[4];
  s->normal_c = vectors[5];
  // The normal is turned to the ray's side as the triangle's normal is (surface.h).
  const floatv inverse = rsqrt(fmax(vector_dot(smooth, smooth), (floatv)(1e-30f)));
  const intv same_side =
      (vector_dot(s->face, f->direction) > 0.0f) == (vector_dot(s->face, smooth) > 0.0f);
  s->per_normal = LANES_SELECT(inverse, -inverse, same_side);
  s->normal = vector_scaled(smooth, s->per_normal);
  s->entering = s->per_normal > 0.0f;
  s->metal = LANES_LOAD(metal);
  s->clear = LANES_LOAD(clear);
  s->ior = LANES_LOAD(ior);
  s->attenuation = LANES_LOAD(attenuation);
}

// Change of the unit normal where a hit moves by `step` along the triangle.
static inline Vector normal_change(const SpecularSurface* s, Vector step) {
  const floatv area = 1.0f / fmax(vector_dot(s->face, s->face), (floatv)(1e-37f));
  const floatv to_b = vector_dot(step, vector_cross(s->edge_c, s->face)) * area,
               to_c = vector_dot(step, vector_cross(s->face, s->edge_b)) * area;
  const Vector change = vector_scaled(
      vector_along(vector_scaled(s->normal_b, to_b), s->normal_c, to_c), s->per_normal);
  return vector_along(change, s->normal, -vector_dot(change, s->normal));
}

// Derivative of the point where rays meet a plane, `t` along them.
static inline Vector hit_change(const Followed* f, const Derivatives* by, int which, floatv t,
                                Vector face, floatv per_slope) {
  const Vector free = vector_along(by->place[which], by->direction[which], t);
  return vector_along(free, f->direction, -vector_dot(face, free) * per_slope);
}

static inline floatv per_slope_of(Vector face, Vector direction) {
  const floatv slope = vector_dot(face, direction);
  return 1.0f / LANES_SELECT(slope, (floatv)(1e-30f), slope == 0.0f);
}

// Index of refraction before a surface over that beyond it.
static inline floatv index_ratio(const SpecularSurface* s) {
  return LANES_SELECT(s->ior, 1.0f / s->ior, s->entering);
}

// Share of the light that a surface mirrors where rays meet it; it refracts the rest of `clear`.
static inline floatv mirrored_share(const SpecularSurface* s, Vector direction) {
  const floatv slope = vector_dot(direction, s->normal), ratio = index_ratio(s);
  return s->clear * fresnel_share(ratio, slope, 1.0f - ratio * ratio * (1.0f - slope * slope));
}

// The rays onwards from the surface where they meet it.
static inline void turn_at(const SpecularSurface* s, const Hits* hits, bool refracts, float bias,
                           Followed* f, Derivatives* by) {
  const Vector normal = s->normal, direction = f->direction;
  const floatv slope = vector_dot(direction, normal);  // negative
  const floatv ratio = index_ratio(s), squared = 1.0f - ratio * ratio * (1.0f - slope * slope),
               beyond = sqrt(fmax(squared, (floatv)(1e-12f)));
  const floatv inward = ratio * slope + beyond, reflected = mirrored_share(s, direction);
  const floatv per_slope = per_slope_of(s->face, direction);
  for (int which = 0; by && which < DERIVATIVES; ++which) {
    const Vector step = hit_change(f, by, which, hits->t, s->face, per_slope),
                 turned = by->direction[which], normal_by = normal_change(s, step);
    const floatv slope_by = vector_dot(turned, normal) + vector_dot(direction, normal_by);
    by->place[which] = step;
    if (refracts) {
      const floatv inward_by = ratio * slope_by + ratio * ratio * slope * slope_by / beyond;
      by->direction[which] = vector_along(
          vector_along(vector_scaled(turned, ratio), normal, -inward_by), normal_by, -inward);
    } else {
      by->direction[which] =
          vector_along(vector_along(turned, normal, -2.0f * slope_by), normal_by, -2.0f * slope);
    }
  }
  f->place = vector_along(f->place, direction, hits->t);
  f->share *= attenuated_share(f->attenuation, hits->t);
  if (refracts) {
    f->direction = vector_along(vector_scaled(direction, ratio), normal, -inward);
    f->share *= s->clear - reflected;
    f->attenuation = LANES_SELECT((floatv)(0.0f), s->attenuation, s->entering);
    f->inside = s->entering;
    f->found &= squared > 0.0f;
    f->first &= f->found;
  } else {
    f->direction = vector_along(direction, normal, -2.0f * slope);
    f->share *= s->metal + reflected;
  }
  f->nearest = bias / fmax(fabs(vector_dot(f->direction, normal)), (floatv)(0x1p-6f));
}

// Rays over the surfaces of a sequence. With `through`, they pass what lies before these; `first`
// tells which do so.
CALLED void follow(const SceneArrays* scene, const Lattice* lattice, const Sequence* sequence,
                   bool through, Followed* f, Derivatives* by) {
  for (int i = 0; i < sequence->length && LANES_ANY(f->found); ++i) {
    const Hits hits =
        meet_material(scene, sequence->material[i], lattice->layer_gap, lattice->reach, through, f);
    if (!LANES_ANY(f->found)) return;
    SpecularSurface surface;
    specular_surface(scene, f, &hits, &surface);
    turn_at(&surface, &hits, (sequence->refracts >> i & 1u) != 0, lattice->bias, f, by);
  }
}

#endif
