// SPDX-License-Identifier: Apache-2.0
// Aimed gathering: every pixel of a plane receives one wave from each surface sample whose light passes through it on its way into the
// hologram's window,
//   sqrt(radiance) weight / r * exp(2 pi i (r / wavelength + phase(sample, frame))),
// converging waves (samples in front of the plane) with the opposite sign of both r: a wave that passes its focus turns by half a period.
// Of a sample that something hides, the parts of the hologram's window that see it count (view.h); highlights are shaded with the true
// direction. A plane at the hologram itself gathers every sample at every pixel: the point-based method.
//
// Where that footprint is no wider than a few diffraction spots, the wave is a sum of plane waves instead (near.h).
//
// aim          aims[i]: sample i as the pixels of this plane see it
// draw_phases  phasors[frame * sample_count + i]: exp(i phase) of sample i in that frame
// gather       field: RAYWAVE_FRAMES planes of plane.ny rows of plane.nx complex samples, row 0 on top, written whole
//
// gather's work-item fills a tile of RAYWAVE_LANES x RAYWAVE_TILE_ROWS pixels: global size (ceil(nx / lanes), ceil(ny / rows)). Rays,
// visibility and shading are done once for all frames. OpenCL C 1.2.
#include "hash.h"
#include "lanes.h"
#include "near.h"
#include "phase.h"
#include "shade.h"
#include "shared.h"
#include "view.h"

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

#define VIEW_CLEAR 0
#define VIEW_MIXED 1
#define VIEW_CLOSED 2

// Bits of row j of a view.
static inline uint view_row(__global const uint* view, int j) {
  const int bit = j * RAYWAVE_VIEW_PARTS;
  return view[bit / 32] >> (bit % 32) & ((1u << RAYWAVE_VIEW_PARTS) - 1u);
}

// What is seen from a box of the hologram's window, in half windows of the view.
static inline int view_state(__global const uint* view, float x0, float x1, float y0, float y1) {
  const int left = view_part(x0), right = view_part(x1);
  const uint columns = (2u << right) - (1u << left);
  uint all = columns, any = 0;
  for (int j = view_part(y0); j <= view_part(y1); ++j) {
    const uint row = view_row(view, j) & columns;
    all &= row;
    any |= row;
  }
  return all == columns ? VIEW_CLEAR : any ? VIEW_MIXED : VIEW_CLOSED;
}

// Share of part (i, j) of 4 x 4 of the window that sees the sample.
static inline float view_share(__global const uint* view, int i, int j) {
  const int side = RAYWAVE_VIEW_PARTS / 4;
  int seen = 0;
  for (int row = j * side; row < (j + 1) * side; ++row) seen += (int)popcount(view_row(view, row) >> (i * side) & ((1u << side) - 1u));
  return (float)seen / (float)(side * side);
}

#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
// Amplitude with the highlights that the sample shows in the direction of the pixels.
static inline floatv shaded_amplitude(__global const Light* lights, __global const uint* lit, __global const Sample* sample, const Aim* a,
                                      floatv dx, floatv dy, floatv inverse_length) {
  Surface s;
  s.x = sample->x;
  s.y = sample->y;
  s.z = sample->z;
  s.nx = sample->nx;
  s.ny = sample->ny;
  s.nz = sample->nz;
  s.specular = sample->specular;
  s.shininess = sample->shininess;
  // Towards the hologram: through the pixel, or away from it where the sample stands in front of the plane.
  const floatv vx = dx * a->inverse_depth * inverse_length, vy = dy * a->inverse_depth * inverse_length, vz = -inverse_length;
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

__kernel void aim(__global const Sample* samples, int sample_count, Lattice lattice, GatherPlane plane, __global Aim* aims) {
  const int index = (int)get_global_id(0);
  if (index >= sample_count) return;
  const Sample s = samples[index];
  Aim a;
  a.x = s.x - plane.left;
  a.y = s.y - plane.top;
  a.depth = s.z - plane.z;
  const float distance = fmax(fabs(a.depth), 0.25f * fmin(plane.pitch_x, plane.pitch_y));
  a.inverse_depth = copysign(1.0f / distance, a.depth);
  const float from_hologram = s.z - lattice.centre_z;
  const float share = (plane.z - lattice.centre_z) / from_hologram;  // of the way from the hologram's centre to the sample
  a.centre_x = (s.x - lattice.centre_x) * share + lattice.centre_x - plane.left;
  a.centre_y = (s.y - lattice.centre_y) * share + lattice.centre_y - plane.top;
  const float narrowed = distance / from_hologram;
  a.scale_x = 1.0f / (lattice.half_width * narrowed);
  a.scale_y = 1.0f / (lattice.half_height * narrowed);
  a.half_x = plane.fan * lattice.half_width * narrowed;
  a.half_y = plane.fan * lattice.half_height * narrowed;
  a.amplitude = sqrt(s.radiance) * s.weight;
  a.tilt_x = s.tilt_x * a.inverse_depth;
  a.tilt_y = s.tilt_y * a.inverse_depth;
  a.tilt_z = s.tilt_z;
  // Not of a.depth: a float is too coarse for it where the plane stands far from the scene.
  const floatv turns = turns_of_length((floatv)(s.z), plane.turns_hi, plane.turns_lo) - plane.turns_z;
  float first[RAYWAVE_LANES];
  LANES_STORE(turns, first);
  a.turns = first[0];
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
  }
  aims[index] = a;
}

// A surface turned away from a direction shows less of itself there; at grazing angles a sample stands for no more than four of its areas.
static inline floatv projected_area(float tilt_z, floatv along_x, floatv along_y) {
  return clamp(along_x + along_y - tilt_z, (floatv)(0.0f), (floatv)(4.0f));
}

// Adds the wave of a sample near the plane to the sums of a tile.
static inline void gather_near(__global const Light* lights, __global const uint* lit, __global const Sample* sample,
                               __global const uint* view, const Aim* a, __global const float2* phasors, int sample_count,
                               const Lattice* lattice, const GatherPlane* plane, floatv x, int top, int bottom,
                               floatv (*re)[RAYWAVE_TILE_ROWS], floatv (*im)[RAYWAVE_TILE_ROWS]) {
  float amplitudes[16];  // towards the parts of the window
  for (int first = 0; first < 16; first += RAYWAVE_LANES) {
    floatv tx, ty, amplitude = a->amplitude;
    part_directions(sample, first, lattice, plane, &tx, &ty);
#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
    if (a->specular) {
      amplitude =
          shaded_amplitude(lights, lit, sample, a, tx / a->inverse_depth, ty / a->inverse_depth, 1.0f / sqrt(1.0f + tx * tx + ty * ty));
    }
#endif
    amplitude *= sqrt(projected_area(a->tilt_z, sample->tilt_x * tx, sample->tilt_y * ty));
    LANES_STORE(amplitude * plane->turns_hi, amplitudes + first);
  }
#if RAYWAVE_VIEW_PARTS > 0
  for (int part = 0; part < 16 && a->hidden; ++part) amplitudes[part] *= view_share(view, part % 4, part / 4);
#endif

  const float rate = 1.0f / (sample->z - lattice->centre_z);
  NearWaves waves;
  near_waves(&waves, (lattice->centre_x - sample->x) * rate, lattice->half_width * rate, a->half_x, a->depth, plane->sine_limit_x, plane);
  floatv across_re[4], across_im[4];
  near_sums(&waves, x - a->x, a->turns + 0.25f, across_re, across_im);
  const intv inside = fabs(x - a->centre_x) <= a->half_x;
  near_waves(&waves, (lattice->centre_y - sample->y) * rate, lattice->half_height * rate, a->half_y, a->depth, plane->sine_limit_y, plane);

  for (int block = top; block <= bottom; block += RAYWAVE_LANES) {
    floatv up_re[4], up_im[4];
    near_sums(&waves, -plane->pitch_y * LANES_TO_FLOAT(block + LANES_INDEX) - a->y, 0.0f, up_re, up_im);
    float ups_re[4][RAYWAVE_LANES], ups_im[4][RAYWAVE_LANES];
    for (int j = 0; j < 4; ++j) {
      LANES_STORE(up_re[j], ups_re[j]);
      LANES_STORE(up_im[j], ups_im[j]);
    }
    for (int row = block; row <= min(bottom, block + RAYWAVE_LANES - 1); ++row) {
      if (fabs(-plane->pitch_y * (float)row - a->centre_y) > a->half_y) continue;
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

__kernel void gather(__global const Light* lights, __global const Sample* samples, __global const uint* views, __global const uint* lit,
                     __global const Aim* aims, __global const float2* phasors, __global const int* first_of_cell, int sample_count,
                     Lattice lattice, GatherPlane plane, __global float2* field) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int top = (int)get_global_id(1) * RAYWAVE_TILE_ROWS;
  if (first >= plane.nx || top >= plane.ny) return;
  const int bottom = min(top + RAYWAVE_TILE_ROWS, plane.ny) - 1;
  const intv column = first + LANES_INDEX;
  const floatv x = plane.pitch_x * LANES_TO_FLOAT(column);
  const float left_x = plane.pitch_x * (float)first, right_x = plane.pitch_x * (float)(first + RAYWAVE_LANES - 1);
  const float top_y = -plane.pitch_y * (float)top, bottom_y = -plane.pitch_y * (float)bottom;

  floatv re[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS], im[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row) re[frame][row] = im[frame][row] = 0.0f;
  }

  // Cells whose samples' footprints can touch the tile, one more on each side against rounding.
  const float rate = 1.0f / lattice.step;
  const float low_x = plane.tangent_x + plane.tangent_step_x * (float)first - plane.window_x;
  const float high_x = plane.tangent_x + plane.tangent_step_x * (float)(first + RAYWAVE_LANES - 1) + plane.window_x;
  const float low_y = plane.tangent_y - plane.tangent_step_y * (float)bottom - plane.window_y;
  const float high_y = plane.tangent_y - plane.tangent_step_y * (float)top + plane.window_y;
  const int cell_left = max((int)clamp(low_x * rate - (float)lattice.first_x, -2.0f, 1e9f) - 1, 0);
  const int cell_right = min((int)clamp(high_x * rate - (float)lattice.first_x, -2.0f, 1e9f) + 1, lattice.nx - 1);
  const int cell_low = max((int)clamp(low_y * rate - (float)lattice.first_y, -2.0f, 1e9f) - 1, 0);
  const int cell_high = min((int)clamp(high_y * rate - (float)lattice.first_y, -2.0f, 1e9f) + 1, lattice.ny - 1);

  for (int cell_row = cell_low; cell_row <= cell_high && cell_left <= cell_right; ++cell_row) {
    const int last = first_of_cell[cell_row * lattice.nx + cell_right + 1];
    for (int index = first_of_cell[cell_row * lattice.nx + cell_left]; index < last; ++index) {
      const Aim a = aims[index];
      if (a.centre_x - a.half_x > right_x || a.centre_x + a.half_x < left_x || a.centre_y - a.half_y > top_y ||
          a.centre_y + a.half_y < bottom_y)
        continue;
      __global const uint* view = views + (size_t)index * VIEW_WORDS;
      if (a.near) {
        gather_near(lights, lit + (size_t)index * (size_t)((RAYWAVE_LIGHTS + 31) / 32), samples + index, view, &a, phasors + index,
                    sample_count, &lattice, &plane, x, top, bottom, re, im);
        continue;
      }
      const floatv across = fabs((x - a.centre_x) * a.scale_x);  // where the pixel's light meets the hologram, in half windows
      intv inside_x = (across <= plane.fan) & (column < plane.nx);
      floatv edge_x = 1.0f;
      if (plane.edge_rate > 0.0f) {
        const floatv e = clamp((plane.fan - across) * plane.edge_rate, (floatv)(0.0f), (floatv)(1.0f));
        edge_x = e * e * (3.0f - 2.0f * e);
      }
      int state = VIEW_CLEAR;
      const float to_window_x = copysign(a.scale_x, a.depth) / plane.view_half;
      const float to_window_y = copysign(a.scale_y, a.depth) / plane.view_half;
      intv part = 0;
#if RAYWAVE_VIEW_PARTS > 0
      if (a.hidden) {
        const float u0 = (fmax(left_x, a.centre_x - a.half_x) - a.centre_x) * to_window_x;
        const float u1 = (fmin(right_x, a.centre_x + a.half_x) - a.centre_x) * to_window_x;
        const float v0 = (fmax(bottom_y, a.centre_y - a.half_y) - a.centre_y) * to_window_y;
        const float v1 = (fmin(top_y, a.centre_y + a.half_y) - a.centre_y) * to_window_y;
        state = view_state(view, fmin(u0, u1), fmax(u0, u1), fmin(v0, v1), fmax(v0, v1));
        if (state == VIEW_CLOSED) continue;
        part = clamp(LANES_TO_INT(((x - a.centre_x) * to_window_x + 1.0f) * (0.5f * RAYWAVE_VIEW_PARTS)), (intv)(0),
                     (intv)(RAYWAVE_VIEW_PARTS - 1));
      }
#endif
      const floatv dx = x - a.x;
      const float distance = fabs(a.depth);
      const float inverse_squared = a.inverse_depth * a.inverse_depth;
      const float excess_turns = distance * plane.turns_hi * (a.depth < 0.0f ? -1.0f : 1.0f);

      for (int row = top; row <= bottom; ++row) {
        const float y = -plane.pitch_y * (float)row;
        const float up = fabs((y - a.centre_y) * a.scale_y);
        if (up > plane.fan) continue;
        float edge_y = 1.0f;
        if (plane.edge_rate > 0.0f) {
          const float e = clamp((plane.fan - up) * plane.edge_rate, 0.0f, 1.0f);
          edge_y = e * e * (3.0f - 2.0f * e);
        }
        const float dy = y - a.y;
        const floatv squared = (dx * dx + dy * dy) * inverse_squared;
        const floatv length = sqrt(1.0f + squared);  // over the depth
        const floatv inverse_length = 1.0f / length;
        intv counts = inside_x;
#if RAYWAVE_SINE_LIMIT
        counts &= (fabs(dx * a.inverse_depth) * inverse_length <= plane.sine_limit_x) &
                  (fabs(dy * a.inverse_depth) * inverse_length <= plane.sine_limit_y);
#endif
#if RAYWAVE_VIEW_PARTS > 0
        if (state == VIEW_MIXED) {
          const uint seen = view_row(view, view_part((y - a.centre_y) * to_window_y));
          counts &= ((intv)((int)seen) >> part & 1) != 0;
          if (!LANES_ANY(counts)) continue;
        }
#endif
        floatv amplitude = a.amplitude;
#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
        if (a.specular)
          amplitude = shaded_amplitude(lights, lit + (size_t)index * (size_t)((RAYWAVE_LIGHTS + 31) / 32), samples + index, &a, dx,
                                       (floatv)(dy), inverse_length);
#endif
        const floatv area = projected_area(a.tilt_z, a.tilt_x * dx, (floatv)(a.tilt_y * dy));
        amplitude = LANES_SELECT((floatv)(0.0f), amplitude * sqrt(area) * edge_x * edge_y * a.inverse_depth * inverse_length, counts);
        // sqrt(1 + s) - 1 without cancellation.
        const floatv turns = a.turns + excess_turns * (squared / (1.0f + length));
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
