// SPDX-License-Identifier: Apache-2.0
// Lights as surfaces see them: their shadows and highlights (paper, Eq. 3), for packets of lanes.
#ifndef RAYWAVE_LIGHTS_H
#define RAYWAVE_LIGHTS_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/arrays.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/options.h"
#include "kernels/scene/surface.h"

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

#endif
