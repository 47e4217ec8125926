// SPDX-License-Identifier: Apache-2.0
// Aimed gathering: every pixel of a plane receives one wave from each surface sample whose light passes through it on its way into the
// hologram's window,
//   sqrt(radiance) weight / r * exp(2 pi i (r / wavelength + phase(sample, frame))),
// converging waves (samples in front of the plane) with the opposite sign of both r: a wave that passes its focus turns by half a period. A
// sample that something may hide is asked for with a ray from it towards the hologram; highlights are shaded with the true direction. A
// plane at the hologram itself gathers every sample at every pixel: the point-based method.
//
// Where that footprint is no wider than a few diffraction spots, the wave is a sum of plane waves instead (near.h).
//
// aim          aims[i]: sample i as the pixels of this plane see it
// draw_phases  phasors[frame * sample_count + i]: exp(i phase) of sample i in that frame
// gather       field: RAYWAVE_FRAMES planes of plane.ny rows of plane.nx complex samples, row 0 on top, written whole
//
// gather's work-item fills a tile of RAYWAVE_LANES x RAYWAVE_TILE_ROWS pixels: global size (ceil(nx / lanes), ceil(ny / rows)). Rays,
// visibility and shading are done once for all frames. OpenCL C 1.2.
#include "bvh.h"
#include "hash.h"
#include "lanes.h"
#include "near.h"
#include "phase.h"
#include "pyramid.h"
#include "shade.h"
#include "shared.h"
#include "wide.h"

#ifndef RAYWAVE_TILE_ROWS
#define RAYWAVE_TILE_ROWS 1  // rows of a tile; host/gatherer.cpp
#endif
#ifndef RAYWAVE_FRAMES
#define RAYWAVE_FRAMES 1  // frames gathered together; host/gatherer.cpp
#endif
#ifndef RAYWAVE_SINE_LIMIT
#define RAYWAVE_SINE_LIMIT 1  // some light would be steeper than the SLM's pixels can show; host/gatherer.cpp
#endif

__kernel void draw_phases(__global const Sample* samples, int sample_count, int frames, uint seed, __global float2* phasors) {
  const int index = (int)get_global_id(0);
  if (index >= sample_count) return;
  for (int frame = 0; frame < frames; ++frame) {
    floatv c, s;
    cos_sin_turns(phase_turns((uintv)(samples[index].key), seed + (uint)frame), &c, &s);
    float cs[RAYWAVE_LANES], ss[RAYWAVE_LANES];
    LANES_STORE(c, cs);
    LANES_STORE(s, ss);
    phasors[(size_t)frame * (size_t)sample_count + (size_t)index] = (float2)(cs[0], ss[0]);
  }
}

// PYRAMID_... of a sample's view of the hologram from (x0, y0) to (x1, y1), in half windows.
static inline int view_state(uint hidden, float x0, float x1, float y0, float y1, float half_side) {
  const float rate = 2.0f / half_side;
  const int left = clamp((int)((x0 + half_side) * rate), 0, 3), right = clamp((int)((x1 + half_side) * rate), 0, 3);
  const int lower = clamp((int)((y0 + half_side) * rate), 0, 3), upper = clamp((int)((y1 + half_side) * rate), 0, 3);
  const int state = (int)(hidden >> (2 * (4 * lower + left)) & 3u);
  for (int j = lower; j <= upper; ++j) {
    for (int i = left; i <= right; ++i) {
      if ((int)(hidden >> (2 * (4 * j + i)) & 3u) != state) return PYRAMID_MIXED;
    }
  }
  return state;
}

// Lanes to whose pixels, or behind them, the sample's light comes without meeting anything before it has left the scene.
static inline intv reaches(__global const BvhNode* nodes, __global const Triangle* triangles, __global const Sample* s, const Aim* a,
                           const Obstacles* obstacles, floatv dx, floatv dy, const GatherPlane* plane, intv active) {
  Rays ray;
  ray.ox = s->x + plane->bias * s->nx;
  ray.oy = s->y + plane->bias * s->ny;
  ray.oz = s->z + plane->bias * s->nz;
  ray.dx = dx * a->inverse_depth;
  ray.dy = dy * a->inverse_depth;
  ray.dz = -1.0f;
  ray.t_min = 0.0f;
  ray.t_max = fmax(s->z - plane->near_z, 0.0f);
  ray.active = active;
  if (obstacles->count > OBSTACLES) return active & !bvh_occluded(nodes, triangles, &ray);
  const floatv inverse[3] = {bvh_reciprocal(ray.dx), bvh_reciprocal(ray.dy), bvh_reciprocal(ray.dz)};
  Hits hits = {ray.t_max, (intv)(-1), (floatv)(0.0f), (floatv)(0.0f)};
  for (int i = 0; i < obstacles->count && LANES_ANY(ray.active); ++i)
    ray.active &= !bvh_triangle(triangles, obstacles->triangles[i], &ray, inverse, &hits);
  return ray.active;
}

// What stands between the sample and all pixels of a box of the plane (relative like Aim's x and y).
static inline Obstacles between(__global const BvhNode* nodes, __global const Triangle* triangles, __global const Sample* s, const Aim* a,
                                float left, float right, float lower, float upper, const GatherPlane* plane) {
  const float u0 = (left - a->x) * a->inverse_depth, u1 = (right - a->x) * a->inverse_depth;
  const float v0 = (lower - a->y) * a->inverse_depth, v1 = (upper - a->y) * a->inverse_depth;
  const float3 normal = (float3)(s->nx, s->ny, s->nz);
  Pyramid pyramid = {(float3)(s->x, s->y, s->z) + plane->bias * normal, fmin(u0, u1), fmax(u0, u1), fmin(v0, v1), fmax(v0, v1),
                     triangle_normal(triangles + s->triangle)};
  if (dot(pyramid.surface, normal) < 0.0f) pyramid.surface = -pyramid.surface;
  return obstacles_in(nodes, triangles, &pyramid, 0.0f);
}

#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
// Amplitude with the highlights that the sample shows in a direction (unit vector) towards the hologram.
static inline floatv shaded_amplitude(__global const Light* lights, __global const uint* lit, __global const Sample* sample, floatv vx,
                                      floatv vy, floatv vz) {
  Surface s;
  s.x = sample->x;
  s.y = sample->y;
  s.z = sample->z;
  s.nx = sample->nx;
  s.ny = sample->ny;
  s.nz = sample->nz;
  s.specular = sample->specular;
  s.shininess = sample->shininess;
  floatv radiance = sample->radiance;
  for (int i = 0; i < RAYWAVE_LIGHTS; ++i) {
    if (!(lit[i / 32] >> (i % 32) & 1u)) continue;
    const Incident in = incident(lights, i, &s, 0.0f);
    radiance += highlight(&in, &s, vx, vy, vz) * in.intensity;
  }
  return sqrt(radiance) * sample->weight;
}
#endif

// Middle of part 0 to 3 of a side of the view, in half hologram windows. Of the outer parts only what lies inside the window counts: light
// beyond it is lost.
static inline floatv part_middle(intv part, float half_side) {
  const float inner = 0.25f * half_side, outer = half_side < 2.0f ? 0.25f * half_side + 0.5f : 0.75f * half_side;
  const floatv away = LANES_SELECT((floatv)(inner), (floatv)(outer), (part == 0) | (part == 3));
  return LANES_SELECT(away, -away, part < 2);
}

// Directions (tangents) from a sample towards the middles of RAYWAVE_LANES of the 4 x 4 parts of its view of the hologram.
static inline void part_directions(__global const Sample* s, int first_part, const Lattice* lattice, const GatherPlane* plane, floatv* tx,
                                   floatv* ty) {
  const float rate = 1.0f / (s->z - lattice->centre_z);
  const intv part = first_part + LANES_INDEX;
  const floatv across = part_middle(part & 3, plane->view_half), up = part_middle(part >> 2, plane->view_half);
  *tx = (lattice->centre_x - s->x + across * lattice->half_width) * rate;
  *ty = (lattice->centre_y - s->y + up * lattice->half_height) * rate;
}

// Sample::hidden with one ray towards the middle of each MIXED part: it is CLEAR or CLOSED then.
static inline uint decided(__global const BvhNode* nodes, __global const Triangle* triangles, __global const Sample* s, const Aim* a,
                           const Lattice* lattice, const GatherPlane* plane) {
  uint hidden = s->hidden;
  if (hidden == 0) return 0;
  Obstacles unknown;
  unknown.state = PYRAMID_MIXED;
  unknown.count = OBSTACLES + 1;
  for (int first = 0; first < 16; first += RAYWAVE_LANES) {
    floatv tx, ty;
    part_directions(s, first, lattice, plane, &tx, &ty);
    int free[RAYWAVE_LANES];
    const intv reached = reaches(nodes, triangles, s, a, &unknown, tx / a->inverse_depth, ty / a->inverse_depth, plane, LANES_INDEX >= 0);
    LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), reached), free);
    for (int i = 0; i < RAYWAVE_LANES; ++i) {
      const int shift = 2 * (first + i);
      if ((hidden >> shift & 3u) != PYRAMID_MIXED) continue;
      hidden = (hidden & ~(3u << shift)) | (uint)(free[i] ? PYRAMID_CLEAR : PYRAMID_CLOSED) << shift;
    }
  }
  return hidden;
}

// Light closer to a pixel than this is taken to come from there.
static inline float nearest_to(const GatherPlane* plane) { return 0x1p-10f * fmin(plane->pitch_x, plane->pitch_y); }

static inline void put(Wide value, float* hi, float* lo) {
  *hi = LANES_FIRST(wide_high(value));
  *lo = LANES_FIRST(wide_low(value));
}

__kernel void aim(__global const BvhNode* nodes, __global const Triangle* triangles, __global const Sample* samples, int sample_count,
                  Lattice lattice, GatherPlane plane, __global Aim* aims) {
  const int index = (int)get_global_id(0);
  if (index >= sample_count) return;
  const Sample s = samples[index];
  Aim a;
  const Wide sample_x = wide(s.x, 0.0f), sample_y = wide(s.y, 0.0f), sample_z = wide(s.z, 0.0f);
  const Wide x = wide_minus(sample_x, wide(plane.left, plane.left_low)), y = wide_minus(sample_y, wide(plane.top, plane.top_low));
  const Wide depth = wide_minus(sample_z, wide(plane.z, plane.z_low));
  const Wide away = wide_minus(sample_z, wide(plane.hologram_z, plane.hologram_z_low));
  const Wide tangent_x = wide_over(wide_minus(wide(plane.hologram_x, plane.hologram_x_low), sample_x), away);
  const Wide tangent_y = wide_over(wide_minus(wide(plane.hologram_y, plane.hologram_y_low), sample_y), away);
  const Wide centre_x = wide_plus(x, wide_times(tangent_x, depth)), centre_y = wide_plus(y, wide_times(tangent_y, depth));
  put(x, &a.x, &a.x_low);
  put(y, &a.y, &a.y_low);
  put(depth, &a.depth, &a.depth_low);
  put(centre_x, &a.centre_x, &a.centre_x_low);
  put(centre_y, &a.centre_y, &a.centre_y_low);
  const float distance = fmax(fabs(a.depth), nearest_to(&plane));
  a.inverse_depth = copysign(1.0f / distance, a.depth);
  const float from_hologram = LANES_FIRST(wide_high(away));
  const float narrowed = distance / from_hologram;
  a.scale_x = 1.0f / (lattice.half_width * narrowed);
  a.scale_y = 1.0f / (lattice.half_height * narrowed);
  a.half_x = plane.fan * lattice.half_width * narrowed;
  a.half_y = plane.fan * lattice.half_height * narrowed;
  a.amplitude = sqrt(s.radiance) * s.weight;
  a.tilt_x = s.tilt_x * a.inverse_depth;
  a.tilt_y = s.tilt_y * a.inverse_depth;
  a.tilt_z = s.tilt_z;
  a.turns = a.chief_x = a.chief_x_low = a.chief_y = a.chief_y_low = 0.0f;
  a.specular = s.specular > 0.0f;
  a.hidden = s.hidden;
  const float half_tangent_x = lattice.half_width / from_hologram, half_tangent_y = lattice.half_height / from_hologram;
  const float spot_x = near_spot(half_tangent_x, &plane), spot_y = near_spot(half_tangent_y, &plane);
  const float extent_x = a.half_x + plane.near_tail * spot_x, extent_y = a.half_y + plane.near_tail * spot_y;
  a.near = (a.half_x < plane.near_spots * spot_x || a.half_y < plane.near_spots * spot_y) && near_count(extent_x, spot_x) <= NEAR_WAVES &&
           near_count(extent_y, spot_y) <= NEAR_WAVES;
  if (a.near) {
    a.half_x = extent_x;
    a.half_y = extent_y;
    const Wide rate = wide(plane.turns_hi, plane.turns_lo);
    const Wide over_x = near_slant(tangent_x), over_y = near_slant(tangent_y);
    a.turns = LANES_FIRST(wide_turns(wide_times(wide_times(depth, rate), wide_plus(wide_plus(over_x, over_y), wide(1.0f, 0.0f)))));
    put(wide_times(wide_over(tangent_x, wide_plus(over_x, wide(1.0f, 0.0f))), rate), &a.chief_x, &a.chief_x_low);
    put(wide_times(wide_over(tangent_y, wide_plus(over_y, wide(1.0f, 0.0f))), rate), &a.chief_y, &a.chief_y_low);
    a.hidden = decided(nodes, triangles, samples + index, &a, &lattice, &plane);
  }
  aims[index] = a;
}

// A surface turned away from a direction shows less of itself there; at grazing angles a sample stands for no more than four of its areas.
static inline floatv projected_area(float tilt_z, floatv along_x, floatv along_y) {
  return clamp(along_x + along_y - tilt_z, (floatv)(0.0f), (floatv)(4.0f));
}

#if RAYWAVE_PRECISION == PRECISION_FLOAT
// Turns by which a path is longer than the one that ends `step` below it in y, dy from the sample: r - r0 = (r^2 - r0^2) / (r + r0), the
// few turns that lie between neighbours, so that their rounding stays below 10^-6.
static inline floatv turns_beyond(float dy, float step, floatv sum_of_lengths, float turns_per_metre) {
  return (2.0f * dy + step) * step * turns_per_metre / sum_of_lengths;
}
#endif

// Adds the wave of a sample near the plane to the sums of a tile.
static inline void gather_near(__global const Light* lights, __global const uint* lit, __global const Sample* sample, const Aim* a,
                               __global const float2* phasors, int sample_count, const Lattice* lattice, const GatherPlane* plane, Wide x,
                               int top, int bottom, floatv (*re)[RAYWAVE_TILE_ROWS], floatv (*im)[RAYWAVE_TILE_ROWS]) {
  float amplitudes[16];  // towards the parts of the window
  for (int first = 0; first < 16; first += RAYWAVE_LANES) {
    floatv tx, ty, amplitude = a->amplitude;
    part_directions(sample, first, lattice, plane, &tx, &ty);
#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
    if (a->specular) {
      const floatv cosine = 1.0f / sqrt(1.0f + tx * tx + ty * ty);
      amplitude = shaded_amplitude(lights, lit, sample, tx * cosine, ty * cosine, -cosine);
    }
#endif
    amplitude *= sqrt(projected_area(a->tilt_z, sample->tilt_x * tx, sample->tilt_y * ty));
    LANES_STORE(amplitude * plane->turns_hi, amplitudes + first);
  }
  for (int part = 0; part < 16; ++part) {
    if ((a->hidden >> (2 * part) & 3u) == PYRAMID_CLOSED) amplitudes[part] = 0.0f;
  }

  const float rate = 1.0f / (sample->z - lattice->centre_z);
  NearWaves waves;
  near_waves(&waves, (lattice->centre_x - sample->x) * rate, lattice->half_width * rate, a->half_x, a->depth, plane->sine_limit_x, plane);
  const Wide offset_x = wide_minus(x, wide(a->centre_x, a->centre_x_low));
  floatv across_re[4], across_im[4];
  near_sums(&waves, wide_high(offset_x), wide_turns(wide_times(offset_x, wide(a->chief_x, a->chief_x_low))) + (a->turns + 0.25f), across_re,
            across_im);
  const intv inside = fabs(wide_high(offset_x)) <= a->half_x;
  near_waves(&waves, (lattice->centre_y - sample->y) * rate, lattice->half_height * rate, a->half_y, a->depth, plane->sine_limit_y, plane);

  for (int block = top; block <= bottom; block += RAYWAVE_LANES) {
    floatv up_re[4], up_im[4];
    const Wide offset_y =
        wide_minus(wide_steps(-(block + LANES_INDEX), plane->pitch_y, plane->pitch_y_low), wide(a->centre_y, a->centre_y_low));
    near_sums(&waves, wide_high(offset_y), wide_turns(wide_times(offset_y, wide(a->chief_y, a->chief_y_low))), up_re, up_im);
    float offsets[RAYWAVE_LANES];
    LANES_STORE(wide_high(offset_y), offsets);
    float ups_re[4][RAYWAVE_LANES], ups_im[4][RAYWAVE_LANES];
    for (int j = 0; j < 4; ++j) {
      LANES_STORE(up_re[j], ups_re[j]);
      LANES_STORE(up_im[j], ups_im[j]);
    }
    for (int row = block; row <= min(bottom, block + RAYWAVE_LANES - 1); ++row) {
      if (fabs(offsets[row - block]) > a->half_y) continue;
      floatv c = 0.0f, s = 0.0f;
      for (int i = 0; i < 4; ++i) {
        float part_re = 0.0f, part_im = 0.0f;
        for (int j = 0; j < 4; ++j) {
          part_re += amplitudes[4 * j + i] * ups_re[j][row - block];
          part_im += amplitudes[4 * j + i] * ups_im[j][row - block];
        }
        c += across_re[i] * part_re - across_im[i] * part_im;
        s += across_re[i] * part_im + across_im[i] * part_re;
      }
      c = LANES_SELECT((floatv)(0.0f), c, inside);
      s = LANES_SELECT((floatv)(0.0f), s, inside);
      for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
        const float2 phasor = phasors[(size_t)frame * (size_t)sample_count];
        re[frame][row - top] += c * phasor.x - s * phasor.y;
        im[frame][row - top] += c * phasor.y + s * phasor.x;
      }
    }
  }
}

__kernel void gather(__global const BvhNode* nodes, __global const Triangle* triangles, __global const Light* lights,
                     __global const Sample* samples, __global const uint* lit, __global const Aim* aims, __global const float2* phasors,
                     __global const int* first_of_cell, int sample_count, Lattice lattice, GatherPlane plane, __global float2* field) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int top = (int)get_global_id(1) * RAYWAVE_TILE_ROWS;
  if (first >= plane.nx || top >= plane.ny) return;
  const int bottom = min(top + RAYWAVE_TILE_ROWS, plane.ny) - 1;
  const intv column = first + LANES_INDEX;
  const Wide x = wide_steps(column, plane.pitch_x, plane.pitch_x_low), rate = wide(plane.turns_hi, plane.turns_lo);
  const float left_x = plane.pitch_x * (float)first, right_x = plane.pitch_x * (float)(first + RAYWAVE_LANES - 1);
  const float top_y = -plane.pitch_y * (float)top, bottom_y = -plane.pitch_y * (float)bottom;

  floatv re[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS], im[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row) re[frame][row] = im[frame][row] = 0.0f;
  }

  // Cells whose samples' footprints can touch the tile, one more on each side against rounding.
  const float cells = 1.0f / lattice.step;
  const float low_x = plane.tangent_x + plane.tangent_step_x * (float)first - plane.window_x;
  const float high_x = plane.tangent_x + plane.tangent_step_x * (float)(first + RAYWAVE_LANES - 1) + plane.window_x;
  const float low_y = plane.tangent_y - plane.tangent_step_y * (float)bottom - plane.window_y;
  const float high_y = plane.tangent_y - plane.tangent_step_y * (float)top + plane.window_y;
  const int cell_left = max((int)clamp(low_x * cells - (float)lattice.first_x, -2.0f, 1e9f) - 1, 0);
  const int cell_right = min((int)clamp(high_x * cells - (float)lattice.first_x, -2.0f, 1e9f) + 1, lattice.nx - 1);
  const int cell_low = max((int)clamp(low_y * cells - (float)lattice.first_y, -2.0f, 1e9f) - 1, 0);
  const int cell_high = min((int)clamp(high_y * cells - (float)lattice.first_y, -2.0f, 1e9f) + 1, lattice.ny - 1);

  for (int cell_row = cell_low; cell_row <= cell_high && cell_left <= cell_right; ++cell_row) {
    const int last = first_of_cell[cell_row * lattice.nx + cell_right + 1];
    for (int index = first_of_cell[cell_row * lattice.nx + cell_left]; index < last; ++index) {
      const Aim a = aims[index];
      if (a.centre_x - a.half_x > right_x || a.centre_x + a.half_x < left_x || a.centre_y - a.half_y > top_y ||
          a.centre_y + a.half_y < bottom_y)
        continue;
      if (a.near) {
        gather_near(lights, lit + (size_t)index * (size_t)((RAYWAVE_LIGHTS + 31) / 32), samples + index, &a, phasors + index, sample_count,
                    &lattice, &plane, x, top, bottom, re, im);
        continue;
      }
      const Wide from_x = wide_minus(x, wide(a.x, a.x_low)), depth = wide(a.depth, a.depth_low);
      const floatv dx = wide_high(from_x);
      const floatv off_chief = wide_high(wide_minus(x, wide(a.centre_x, a.centre_x_low)));
      const floatv across = fabs(off_chief * a.scale_x);  // where the pixel's light meets the hologram, in half windows
      intv inside_x = (across <= plane.fan) & (column < plane.nx);
      floatv edge_x = 1.0f;
      if (plane.edge_rate > 0.0f) {
        const floatv e = clamp((plane.fan - across) * plane.edge_rate, (floatv)(0.0f), (floatv)(1.0f));
        edge_x = e * e * (3.0f - 2.0f * e);
      }
      const float sign = a.depth < 0.0f ? -1.0f : 1.0f;
      // Most samples that something may hide are seen by all of a tile, or by none of it.
      Obstacles obstacles;
      obstacles.state = PYRAMID_CLEAR;
      if (a.hidden) {
        const float x0 = fmax(left_x, a.centre_x - a.half_x), x1 = fmin(right_x, a.centre_x + a.half_x);
        const float y0 = fmax(bottom_y, a.centre_y - a.half_y), y1 = fmin(top_y, a.centre_y + a.half_y);
        const float u0 = (x0 - a.centre_x) * a.scale_x * sign, u1 = (x1 - a.centre_x) * a.scale_x * sign;
        const float v0 = (y0 - a.centre_y) * a.scale_y * sign, v1 = (y1 - a.centre_y) * a.scale_y * sign;
        obstacles.state = view_state(a.hidden, fmin(u0, u1), fmax(u0, u1), fmin(v0, v1), fmax(v0, v1), plane.view_half);
        if (obstacles.state == PYRAMID_MIXED) obstacles = between(nodes, triangles, samples + index, &a, x0, x1, y0, y1, &plane);
        if (obstacles.state == PYRAMID_CLOSED) continue;
      }
      const floatv squared_x = dx * dx + a.depth * a.depth;
#if RAYWAVE_PRECISION == PRECISION_FLOAT
      // Each lane counts its phase from its pixel in the tile's middle row.
      const int middle = (top + bottom) / 2;
      const Wide middle_y = wide_steps((intv)(-middle), plane.pitch_y, plane.pitch_y_low);
      const Wide from_y = wide_minus(middle_y, wide(a.y, a.y_low));
      floatv middle_length;
      const floatv middle_turns = path_turns(from_x, from_y, depth, rate, &middle_length) * sign;
      const float middle_dy = LANES_FIRST(wide_high(from_y));
      const float middle_off_chief = LANES_FIRST(wide_high(wide_minus(middle_y, wide(a.centre_y, a.centre_y_low))));
#endif

      for (int row = top; row <= bottom; ++row) {
#if RAYWAVE_PRECISION == PRECISION_FLOAT
        const float step_y = plane.pitch_y * (float)(middle - row);
        const float dy = middle_dy + step_y, up = fabs((middle_off_chief + step_y) * a.scale_y);
#else
        const Wide y = wide_steps((intv)(-row), plane.pitch_y, plane.pitch_y_low), from_y = wide_minus(y, wide(a.y, a.y_low));
        const float dy = LANES_FIRST(wide_high(from_y));
        const float up = fabs(LANES_FIRST(wide_high(wide_minus(y, wide(a.centre_y, a.centre_y_low)))) * a.scale_y);
#endif
        if (up > plane.fan) continue;
        float edge_y = 1.0f;
        if (plane.edge_rate > 0.0f) {
          const float e = clamp((plane.fan - up) * plane.edge_rate, 0.0f, 1.0f);
          edge_y = e * e * (3.0f - 2.0f * e);
        }
        const floatv length = sqrt(squared_x + dy * dy);
        const floatv inverse_length = 1.0f / fmax(length, nearest_to(&plane));
        intv counts = inside_x;
#if RAYWAVE_SINE_LIMIT
        counts &= (fabs(dx) * inverse_length <= plane.sine_limit_x) & (fabs(dy) * inverse_length <= plane.sine_limit_y);
#endif
        if (obstacles.state != PYRAMID_CLEAR) {
          counts = reaches(nodes, triangles, samples + index, &a, &obstacles, dx, (floatv)(dy), &plane, counts);
          if (!LANES_ANY(counts)) continue;
        }
        floatv amplitude = a.amplitude;
#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
        // Through the pixel, or away from it where the sample stands in front of the plane.
        if (a.specular)
          amplitude = shaded_amplitude(lights, lit + (size_t)index * (size_t)((RAYWAVE_LIGHTS + 31) / 32), samples + index,
                                       dx * sign * inverse_length, dy * sign * inverse_length, -fabs(a.depth) * inverse_length);
#endif
        const floatv area = projected_area(a.tilt_z, a.tilt_x * dx, (floatv)(a.tilt_y * dy));
        amplitude = LANES_SELECT((floatv)(0.0f), amplitude * sqrt(area) * edge_x * edge_y * sign * inverse_length, counts);
#if RAYWAVE_PRECISION == PRECISION_FLOAT
        const floatv turns = middle_turns + turns_beyond(middle_dy, step_y, length + middle_length, plane.turns_hi * sign);
#else
        floatv path_length;
        const floatv turns = path_turns(from_x, from_y, depth, rate, &path_length) * sign;
#endif
        floatv c, s;
        cos_sin_turns(turns, &c, &s);
        c *= amplitude;
        s *= amplitude;
        for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
          const float2 phasor = phasors[(size_t)frame * (size_t)sample_count + (size_t)index];
          re[frame][row - top] += c * phasor.x - s * phasor.y;
          im[frame][row - top] += c * phasor.y + s * phasor.x;
        }
      }
    }
  }

  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = top; row <= bottom; ++row) {
      float res[RAYWAVE_LANES], ims[RAYWAVE_LANES];
      LANES_STORE(re[frame][row - top], res);
      LANES_STORE(im[frame][row - top], ims);
      __global float2* out = field + ((size_t)frame * (size_t)plane.ny + (size_t)row) * (size_t)plane.nx;
      for (int i = 0; i < RAYWAVE_LANES && first + i < plane.nx; ++i) out[first + i] = (float2)(res[i], ims[i]);
    }
  }
}
