// SPDX-License-Identifier: Apache-2.0
// Aimed gathering: every pixel of a plane receives one wave from each surface sample whose light
// passes through it on its way into the hologram's window,
//   sqrt(radiance) weight / r * exp(2 pi i (r / wavelength + phase(sample, frame))),
// converging waves (samples in front of the plane) with the opposite sign of both r: a wave that
// passes its focus turns by half a period. Of a sample that something hides, the parts of the
// hologram's window that see it count (view.h); highlights are shaded with the true direction. A
// plane at the hologram itself gathers every sample at every pixel: the point-based method.
//
// Where that footprint is no wider than a few diffraction spots, the wave is a sum of plane waves
// instead (near.h).
//
// aim          aims[i]: sample i as the pixels of this plane see it; boxes[i], boxes[stride + i],
//              ...: first and last column, first and
// last
//              row of the pixels that may receive it, none where the last is before the first
// profile      what the pixels' columns and rows receive of samples near the plane
// draw_phases  phasors[frame * sample_count + i]: exp(i phase) of sample i in that frame
// gather       field: RAYWAVE_FRAMES planes of plane.ny rows of plane.nx complex samples, row 0 on
//              top, written whole, or added to, with the samples of the lattice's rows first_row to
//              last_row, whose profiles begin with first_sample
//
// gather's work-item fills a tile of RAYWAVE_LANES x RAYWAVE_TILE_ROWS pixels: global size (tiles
// across a strip, ceil(ny / rows), strips). Rays, visibility and shading are done once for all
// frames. OpenCL C 1.2.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/double_single.h"
#include "kernels/common/hash.h"
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/common/shared.h"
#include "kernels/gather/footprint.h"
#include "kernels/gather/plane_waves.h"
#include "kernels/samples/visibility.h"
#include "kernels/scene/shade.h"

#ifndef RAYWAVE_TILE_ROWS
#define RAYWAVE_TILE_ROWS 1  // rows of a tile; host/trace/gatherer.cpp
#endif
#ifndef RAYWAVE_FRAMES
#define RAYWAVE_FRAMES 1  // frames gathered together; host/trace/gatherer.cpp
#endif
#ifndef RAYWAVE_SINE_LIMIT
// Some light would be steeper than the SLM's pixels can show; host/trace/gatherer.cpp
#define RAYWAVE_SINE_LIMIT 1
#endif

__kernel void draw_phases(__global const Sample* samples, int sample_count, int frames, uint seed,
                          __global float2* phasors) {
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

// What is seen from a box of the hologram's window, in half sides of the window that the view
// speaks of.
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

// Share of part (i, j) of NEAR_PARTS x NEAR_PARTS of the window that sees the sample.
static inline float view_share(__global const uint* view, int i, int j) {
#if RAYWAVE_VIEW_PARTS > 0
  const int side = RAYWAVE_VIEW_PARTS / NEAR_PARTS;
  int seen = 0;
  for (int row = j * side; row < (j + 1) * side; ++row)
    seen += (int)popcount(view_row(view, row) >> (i * side) & ((1u << side) - 1u));
  return (float)seen / (float)(side * side);
#else
  (void)view, (void)i, (void)j;
  return 1.0f;
#endif
}

#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
// A direction towards the hologram: exact, of any length, or a unit vector.
#if RAYWAVE_SHARP
typedef Wide3 Towards;
#else
typedef struct {
  floatv x, y, z;
} Towards;
#endif

// What highlights need of a sample, but for where it is seen from.
static inline Surface sample_surface(__global const Sample* sample) {
  Surface s;
  s.x = sample->x;
  s.y = sample->y;
  s.z = sample->z;
  s.nx = sample->nx;
  s.ny = sample->ny;
  s.nz = sample->nz;
#if RAYWAVE_SHARP
  s.place = wide3((floatv)(sample->x), (floatv)(sample->y), (floatv)(sample->z));
  s.normal = wide3((floatv)(sample->nx), (floatv)(sample->ny), (floatv)(sample->nz));
#endif
  s.specular = sample->specular;
  s.shininess = sample->shininess;
  return s;
}

static inline bool is_lit(__global const uint* lit, int light) {
  return lit[light / 32] >> (light % 32) & 1u;
}

// Amplitude with the highlights that the sample shows in a direction.
static inline floatv shaded_amplitude(__global const Light* lights, __global const uint* lit,
                                      __global const Sample* sample, Towards towards) {
  Surface s = sample_surface(sample);
#if RAYWAVE_SHARP
  s.towards = towards;
#else
  s.vx = towards.x;
  s.vy = towards.y;
  s.vz = towards.z;
#endif
  floatv radiance = sample->radiance;
  for (int i = 0; i < RAYWAVE_LIGHTS; ++i) {
    if (!is_lit(lit, i)) continue;
    const Incident in = incident(lights, i, &s, 0.0f);
    radiance += highlight(lights + i, &in, &s) * in.intensity;
  }
  return sqrt(radiance) * sample->weight;
}

// Directions (tangents) in which highlights of lights `first` and on are brightest, of all that the
// fan holds; the chief ray's where there is none.
static inline void highlight_directions(__global const Light* lights, __global const uint* lit,
                                        __global const Sample* sample, const Aim* a, int first,
                                        const GatherPlane* plane, floatv* tx, floatv* ty) {
  const Surface s = sample_surface(sample);
  float txs[RAYWAVE_LANES], tys[RAYWAVE_LANES];
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    const int light = first + lane;
    txs[lane] = a->tangent_x;
    tys[lane] = a->tangent_y;
    if (light >= RAYWAVE_LIGHTS || !is_lit(lit, light)) continue;
    const Incident in = incident(lights, light, &s, 0.0f);
    if (!(in.intensity > 0.0f)) continue;
    const float twice = 2.0f * LANES_FIRST(in.facing);
    const float x = twice * sample->nx - LANES_FIRST(in.x),
                y = twice * sample->ny - LANES_FIRST(in.y);
    const float down = fmax(LANES_FIRST(in.z) - twice * sample->nz, 1e-6f);
    txs[lane] = clamp(x / down, a->tangent_x - plane->cone_x * a->half_tangent_x,
                      a->tangent_x + plane->cone_x * a->half_tangent_x);
    tys[lane] = clamp(y / down, a->tangent_y - plane->cone_y * a->half_tangent_y,
                      a->tangent_y + plane->cone_y * a->half_tangent_y);
  }
  *tx = LANES_LOAD(txs);
  *ty = LANES_LOAD(tys);
}
#endif

// Light closer to a pixel than this is taken to come from there.
static inline float nearest_to(const GatherPlane* plane) {
  return 0x1p-10f * fmin(plane->pitch_x, plane->pitch_y);
}

static inline void put(Wide value, float* hi, float* lo) {
  *hi = LANES_FIRST(wide_high(value));
  *lo = LANES_FIRST(wide_low(value));
}

// A whole place of an axis of `count` pixels, 0 to count.
static inline int pixel_near(float place, int count) {
  return (int)clamp(place, 0.0f, (float)count);
}

__kernel void aim(__global const Sample* samples, int sample_count, Lattice lattice,
                  GatherPlane plane, __global Aim* aims, int stride, __global int* boxes) {
  const int index = (int)get_global_id(0);
  if (index >= sample_count) return;
  const Sample s = samples[index];
  if (!(plane.begin_z <= s.z && s.z < plane.end_z)) {  // it shines on another layer's planes
    aims[index].near = aims[index].columns = 0;
    boxes[index] = boxes[2 * stride + index] = 0;
    boxes[stride + index] = boxes[3 * stride + index] = -1;
    return;
  }
  Aim a;
  const Wide sample_x = wide(s.x, 0.0f), sample_y = wide(s.y, 0.0f), sample_z = wide(s.z, 0.0f);
  const Wide x = wide_minus(sample_x, wide(plane.left, plane.left_low)),
             y = wide_minus(sample_y, wide(plane.top, plane.top_low));
  const Wide depth = wide_minus(sample_z, wide(plane.z, plane.z_low));
  const Wide away = wide_minus(sample_z, wide(plane.hologram_z, plane.hologram_z_low));
  const Wide tangent_x =
      wide_over(wide_minus(wide(plane.hologram_x, plane.hologram_x_low), sample_x), away);
  const Wide tangent_y =
      wide_over(wide_minus(wide(plane.hologram_y, plane.hologram_y_low), sample_y), away);
  const Wide centre_x = wide_plus(x, wide_times(tangent_x, depth)),
             centre_y = wide_plus(y, wide_times(tangent_y, depth));
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
  a.amplitude = sqrt(s.radiance) * s.weight;
  a.tilt_x = s.tilt_x * a.inverse_depth;
  a.tilt_y = s.tilt_y * a.inverse_depth;
  a.tilt_z = s.tilt_z;
  a.turns = a.chief_x = a.chief_x_low = a.chief_y = a.chief_y_low = 0.0f;
  a.specular = s.specular > 0.0f;
  a.hidden = s.hidden;
  a.profile = s.profile;
  a.tangent_x = LANES_FIRST(wide_high(tangent_x));
  a.tangent_y = LANES_FIRST(wide_high(tangent_y));
  a.half_tangent_x = lattice.half_width / from_hologram;
  a.half_tangent_y = lattice.half_height / from_hologram;
  const FootprintAxis across_x = footprint_axis(plane.cone_x, lattice.half_width, narrowed,
                                                a.half_tangent_x, plane.turns_hi, plane.near_tail),
                      across_y = footprint_axis(plane.cone_y, lattice.half_height, narrowed,
                                                a.half_tangent_y, plane.turns_hi, plane.near_tail);
  a.near = is_plane_wave_sample(across_x, across_y, plane.near_spots);
  a.half_x = a.near ? across_x.extent : across_x.half_width;
  a.half_y = a.near ? across_y.extent : across_y.half_width;
  if (a.near) {
    const Wide rate = wide(plane.turns_hi, plane.turns_lo);
    const Wide over_x = near_slant(tangent_x), over_y = near_slant(tangent_y);
    a.turns = LANES_FIRST(wide_turns(wide_times(
        wide_times(depth, rate), wide_plus(wide_plus(over_x, over_y), wide(1.0f, 0.0f)))));
    put(wide_times(wide_over(tangent_x, wide_plus(over_x, wide(1.0f, 0.0f))), rate), &a.chief_x,
        &a.chief_x_low);
    put(wide_times(wide_over(tangent_y, wide_plus(over_y, wide(1.0f, 0.0f))), rate), &a.chief_y,
        &a.chief_y_low);
  }
  const float across = 1.0f / plane.pitch_x, down = -1.0f / plane.pitch_y;
  // Whole pixels within the footprint, and within a sixteenth of one beside it against rounding.
  a.left = pixel_near((a.centre_x - a.half_x) * across + 0.9375f, plane.nx);
  a.columns = pixel_near((a.centre_x + a.half_x) * across + 1.0625f, plane.nx) - a.left;
  a.top = pixel_near((a.centre_y + a.half_y) * down + 0.9375f, plane.ny);
  a.rows = pixel_near((a.centre_y - a.half_y) * down + 1.0625f, plane.ny) - a.top;
  aims[index] = a;
  boxes[index] = a.left;
  boxes[stride + index] = a.columns > 0 && a.rows > 0 ? a.left + a.columns - 1 : -1;
  boxes[2 * stride + index] = a.top;
  boxes[3 * stride + index] = a.top + a.rows - 1;
}

// A surface turned away from a direction shows less of itself there; at grazing angles a sample
// stands for no more than four of its areas.
static inline floatv projected_area(float tilt_z, floatv along_x, floatv along_y) {
  return clamp(along_x + along_y - tilt_z, (floatv)(0.0f), (floatv)(4.0f));
}

#if RAYWAVE_PRECISION == PRECISION_FLOAT
// Turns by which a path is longer than the one that ends `step` below it in y, dy from the sample:
// r - r0 = (r^2 - r0^2) / (r + r0), the few turns that lie between neighbours, so that their
// rounding stays below 10^-6.
static inline floatv turns_beyond(float dy, float step, floatv sum_of_lengths,
                                  float turns_per_metre) {
  return (2.0f * dy + step) * step * turns_per_metre / sum_of_lengths;
}
#endif

// Amplitude that a sample shows in directions (tangents).
static inline floatv amplitude_towards(__global const Light* lights, __global const uint* lit,
                                       __global const Sample* sample, const Aim* a, floatv tx,
                                       floatv ty) {
  floatv amplitude = a->amplitude;
#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
  if (a->specular) {
#if RAYWAVE_SHARP
    const floatv down = -1.0f;
    const Towards towards = wide3(tx, ty, down);
#else
    const floatv cosine = 1.0f / sqrt(1.0f + tx * tx + ty * ty);
    const Towards towards = {tx * cosine, ty * cosine, -cosine};
#endif
    amplitude = shaded_amplitude(lights, lit, sample, towards);
  }
#else
  (void)lights, (void)lit;
#endif
  return amplitude * sqrt(projected_area(a->tilt_z, sample->tilt_x * tx, sample->tilt_y * ty));
}

// The waves of both axes of a sample near the plane. Its amplitude in a direction is taken for the
// product of what it is along the two axes through its brightest direction: right to first order
// for surfaces that turn away, and for highlights that fall off like a Gaussian.
static inline void near_axes(__global const Light* lights, __global const uint* lit,
                             __global const Sample* sample, const Aim* a, const GatherPlane* plane,
                             NearWaves* x, NearWaves* y) {
  near_waves(x, a->hidden, a->tangent_x, a->half_tangent_x, a->half_x, a->depth, gathered_x(plane),
             plane->turns_hi);
  near_waves(y, a->hidden, a->tangent_y, a->half_tangent_y, a->half_y, a->depth, gathered_y(plane),
             plane->turns_hi);
  float best_x = a->tangent_x, best_y = a->tangent_y;
  float best =
      LANES_FIRST(amplitude_towards(lights, lit, sample, a, (floatv)(best_x), (floatv)(best_y)));
#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
  for (int first = 0; first < RAYWAVE_LIGHTS && a->specular; first += RAYWAVE_LANES) {
    floatv tx, ty;
    highlight_directions(lights, lit, sample, a, first, plane, &tx, &ty);
    float amplitudes[RAYWAVE_LANES], txs[RAYWAVE_LANES], tys[RAYWAVE_LANES];
    LANES_STORE(amplitude_towards(lights, lit, sample, a, tx, ty), amplitudes);
    LANES_STORE(tx, txs);
    LANES_STORE(ty, tys);
    for (int i = 0; i < RAYWAVE_LANES; ++i) {
      if (!(amplitudes[i] > 1.01f * best)) continue;  // or rounding would choose among equals
      best = amplitudes[i];
      best_x = txs[i];
      best_y = tys[i];
    }
  }
#endif
  const float scale = best > 0.0f ? plane->turns_hi / best : 0.0f;
  for (int n = 0; n < x->count; n += RAYWAVE_LANES) {
    const floatv amplitude =
        amplitude_towards(lights, lit, sample, a, LANES_LOAD(x->tangent + n), (floatv)(best_y)) *
        scale;
    LANES_STORE(LANES_LOAD(x->re + n) * amplitude, x->re + n);
    LANES_STORE(LANES_LOAD(x->im + n) * amplitude, x->im + n);
  }
  for (int n = 0; n < y->count; n += RAYWAVE_LANES) {
    const floatv amplitude =
        amplitude_towards(lights, lit, sample, a, (floatv)(best_x), LANES_LOAD(y->tangent + n));
    LANES_STORE(LANES_LOAD(y->re + n) * amplitude, y->re + n);
    LANES_STORE(LANES_LOAD(y->im + n) * amplitude, y->im + n);
  }
}

// What waves `from` to before `to` add to g along x at pixels of columns first to first +
// RAYWAVE_LANES - 1; zero beyond the footprint.
static inline void near_across(const NearWaves* waves, int from, int to, const Aim* a,
                               const GatherPlane* plane, int first, floatv* re, floatv* im) {
  const Wide offset =
      wide_minus(wide_steps(first + LANES_INDEX, plane->pitch_x, plane->pitch_x_low),
                 wide(a->centre_x, a->centre_x_low));
  const floatv turns =
      wide_turns(wide_times(offset, wide(a->chief_x, a->chief_x_low))) + (a->turns + 0.25f);
  near_sum(waves, from, to, wide_high(offset), turns, re, im);
  const intv inside = fabs(wide_high(offset)) <= a->half_x;
  *re = LANES_SELECT((floatv)(0.0f), *re, inside);
  *im = LANES_SELECT((floatv)(0.0f), *im, inside);
}

// The same along y at pixels of rows first to first + RAYWAVE_LANES - 1.
static inline void near_up(const NearWaves* waves, int from, int to, const Aim* a,
                           const GatherPlane* plane, int first, floatv* re, floatv* im) {
  const Wide offset =
      wide_minus(wide_steps(-(first + LANES_INDEX), plane->pitch_y, plane->pitch_y_low),
                 wide(a->centre_y, a->centre_y_low));
  near_sum(waves, from, to, wide_high(offset),
           wide_turns(wide_times(offset, wide(a->chief_y, a->chief_y_low))), re, im);
  const intv inside = fabs(wide_high(offset)) <= a->half_y;
  *re = LANES_SELECT((floatv)(0.0f), *re, inside);
  *im = LANES_SELECT((floatv)(0.0f), *im, inside);
}

// Floats of a profile.
static inline size_t profile_size(const GatherPlane* plane) {
  return (size_t)(2 * (plane->room_x + plane->room_y));
}

// Profiles of samples near the plane, whose wave is a product of one along x and one along y; of
// those that something hides, one for each part of the window's sides. Profile number `profile`
// begins profile - first_profile times profile_size into profiles: real parts of RAYWAVE_LANES
// zeros, its columns, and zeros up to room_x; imaginary parts likewise; real parts of its rows, in
// room_y; imaginary parts.
__kernel void profile(__global const Light* lights, __global const Sample* samples,
                      __global const uint* lit, __global const Aim* aims, int first_sample,
                      int first_profile, int sample_count, GatherPlane plane,
                      __global float* profiles) {
  const int number = (int)get_global_id(0);
  if (number >= sample_count) return;
  const int index = first_sample + number;
  const Aim a = aims[index];
  if (!a.near || a.columns <= 0 || a.rows <= 0) return;
  NearWaves waves_x, waves_y;
  near_axes(lights, lit + (size_t)index * (size_t)((RAYWAVE_LIGHTS + 31) / 32), samples + index, &a,
            &plane, &waves_x, &waves_y);
  const floatv zero = 0.0f;
  for (int part = 0; part < (a.hidden ? NEAR_PARTS : 1); ++part) {
    const int from_x = waves_x.begin[part],
              to_x = a.hidden ? waves_x.begin[part + 1] : waves_x.count;
    const int from_y = waves_y.begin[part],
              to_y = a.hidden ? waves_y.begin[part + 1] : waves_y.count;
    __global float* across =
        profiles + (size_t)(a.profile + part - first_profile) * profile_size(&plane);
    __global float* up = across + 2 * plane.room_x;
    floatv re, im;
    LANES_STORE(zero, across);
    LANES_STORE(zero, across + plane.room_x);
    int column = 0;
    for (; column < a.columns; column += RAYWAVE_LANES) {
      near_across(&waves_x, from_x, to_x, &a, &plane, a.left + column, &re, &im);
      LANES_STORE(re, across + RAYWAVE_LANES + column);
      LANES_STORE(im, across + plane.room_x + RAYWAVE_LANES + column);
    }
    LANES_STORE(zero, across + RAYWAVE_LANES + column);
    LANES_STORE(zero, across + plane.room_x + RAYWAVE_LANES + column);
    for (int row = 0; row < a.rows; row += RAYWAVE_LANES) {
      near_up(&waves_y, from_y, to_y, &a, &plane, a.top + row, &re, &im);
      LANES_STORE(re, up + row);
      LANES_STORE(im, up + plane.room_y + row);
    }
  }
}

// The pixels of a work-item, and their sums.
typedef struct {
  int first;  // column
  int top;    // row
  int bottom;
  floatv re[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
  floatv im[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
} Tile;

// Adds what a sample sends along the columns times what it sends along the rows, `up`.
static inline void add_product(floatv across_re, floatv across_im, __global const float* up,
                               const Aim* a, __global const float2* phasors, int sample_count,
                               const GatherPlane* plane, Tile* tile) {
  const int from = max(tile->top, a->top), to = min(tile->bottom, a->top + a->rows - 1);
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    const float2 phasor = phasors[(size_t)frame * (size_t)sample_count];
    const floatv turned_re = across_re * phasor.x - across_im * phasor.y,
                 turned_im = across_re * phasor.y + across_im * phasor.x;
    for (int row = from; row <= to; ++row) {
      const float up_re = up[row - a->top], up_im = up[plane->room_y + row - a->top];
      tile->re[frame][row - tile->top] += turned_re * up_re - turned_im * up_im;
      tile->im[frame][row - tile->top] += turned_re * up_im + turned_im * up_re;
    }
  }
}

// Adds the wave of a sample near the plane, from its profiles.
static inline void gather_near(__global const float* profiles, __global const uint* view,
                               const Aim* a, __global const float2* phasors, int sample_count,
                               const GatherPlane* plane, Tile* tile) {
  const size_t size = profile_size(plane);
  __global const float* column = profiles + (tile->first - a->left + RAYWAVE_LANES);
  __global const float* up = profiles + 2 * plane->room_x;
  if (!a->hidden) {
    add_product(LANES_LOAD(column), LANES_LOAD(column + plane->room_x), up, a, phasors,
                sample_count, plane, tile);
    return;
  }
  for (int j = 0; j < NEAR_PARTS; ++j) {
    floatv re = 0.0f, im = 0.0f;
    bool any = false;
    for (int i = 0; i < NEAR_PARTS; ++i) {
      const float share = view_share(view, i, j);
      if (share <= 0.0f) continue;
      re += share * LANES_LOAD(column + (size_t)i * size);
      im += share * LANES_LOAD(column + (size_t)i * size + plane->room_x);
      any = true;
    }
    if (any) add_product(re, im, up + (size_t)j * size, a, phasors, sample_count, plane, tile);
  }
}

// Adds the wave of a sample away from the plane, ray by ray.
static inline void gather_far(__global const Light* lights, __global const uint* lit,
                              __global const Sample* sample, __global const uint* view,
                              const Aim* a, __global const float2* phasors, int sample_count,
                              const GatherPlane* plane, Tile* tile) {
  const int top = tile->top, bottom = tile->bottom;
  const intv column = tile->first + LANES_INDEX;
  const Wide x = wide_steps(column, plane->pitch_x, plane->pitch_x_low),
             rate = wide(plane->turns_hi, plane->turns_lo);
#if RAYWAVE_VIEW_PARTS > 0
  const float left_x = plane->pitch_x * (float)tile->first,
              right_x = left_x + plane->pitch_x * (float)(RAYWAVE_LANES - 1);
  const float top_y = -plane->pitch_y * (float)top, bottom_y = -plane->pitch_y * (float)bottom;
#endif
  const Wide from_x = wide_minus(x, wide(a->x, a->x_low)), depth = wide(a->depth, a->depth_low);
  const floatv dx = wide_high(from_x);
  const floatv off_chief = wide_high(wide_minus(x, wide(a->centre_x, a->centre_x_low)));
  // Where the pixel's light meets the hologram, in half windows
  const floatv across = fabs(off_chief * a->scale_x);
  intv inside_x = (across <= plane->cone_x) & (column < plane->nx);
  const floatv edge_x = apodization_weights(across, plane->cone_x, plane->apodization_rate_x);
  const float sign = a->depth < 0.0f ? -1.0f : 1.0f;
#if RAYWAVE_VIEW_PARTS > 0
  int state = VIEW_CLEAR;
  const float to_view_x = sign * a->scale_x * plane->view_scale_x;
  const float to_view_y = sign * a->scale_y * plane->view_scale_y;
  intv part = 0;
  if (a->hidden) {
    const float u0 =
        (fmax(left_x, a->centre_x - a->half_x) - a->centre_x) * to_view_x + plane->view_shift_x;
    const float u1 =
        (fmin(right_x, a->centre_x + a->half_x) - a->centre_x) * to_view_x + plane->view_shift_x;
    const float v0 =
        (fmax(bottom_y, a->centre_y - a->half_y) - a->centre_y) * to_view_y + plane->view_shift_y;
    const float v1 =
        (fmin(top_y, a->centre_y + a->half_y) - a->centre_y) * to_view_y + plane->view_shift_y;
    state = view_state(view, fmin(u0, u1), fmax(u0, u1), fmin(v0, v1), fmax(v0, v1));
    if (state == VIEW_CLOSED) return;
    part = clamp(LANES_TO_INT((off_chief * to_view_x + plane->view_shift_x + 1.0f) *
                              (0.5f * RAYWAVE_VIEW_PARTS)),
                 (intv)(0), (intv)(RAYWAVE_VIEW_PARTS - 1));
  }
#endif
  const floatv squared_x = dx * dx + a->depth * a->depth;
#if RAYWAVE_PRECISION == PRECISION_FLOAT
  // Each lane counts its phase from its pixel in the tile's middle row.
  const int middle = (top + bottom) / 2;
  const Wide middle_y = wide_steps((intv)(-middle), plane->pitch_y, plane->pitch_y_low);
  const Wide from_y = wide_minus(middle_y, wide(a->y, a->y_low));
  floatv middle_length;
  const floatv middle_turns = path_turns(from_x, from_y, depth, rate, &middle_length) * sign;
  const float middle_dy = LANES_FIRST(wide_high(from_y));
  const float middle_off_chief =
      LANES_FIRST(wide_high(wide_minus(middle_y, wide(a->centre_y, a->centre_y_low))));
#endif

  for (int row = top; row <= bottom; ++row) {
#if RAYWAVE_PRECISION == PRECISION_FLOAT
    const float step_y = plane->pitch_y * (float)(middle - row);
    const float dy = middle_dy + step_y, off_chief_y = middle_off_chief + step_y;
#else
    const Wide y = wide_steps((intv)(-row), plane->pitch_y, plane->pitch_y_low),
               from_y = wide_minus(y, wide(a->y, a->y_low));
    const float dy = LANES_FIRST(wide_high(from_y));
    const float off_chief_y =
        LANES_FIRST(wide_high(wide_minus(y, wide(a->centre_y, a->centre_y_low))));
#endif
    const float up = fabs(off_chief_y * a->scale_y);
    if (up > plane->cone_y) continue;
    const float edge_y = apodization_weight(up, plane->cone_y, plane->apodization_rate_y);
    const floatv length = sqrt(squared_x + dy * dy);
    const floatv inverse_length = 1.0f / fmax(length, nearest_to(plane));
    intv counts = inside_x;
#if RAYWAVE_SINE_LIMIT
    counts &= (fabs(dx) * inverse_length <= plane->sine_limit_x) &
              (fabs(dy) * inverse_length <= plane->sine_limit_y);
#endif
#if RAYWAVE_VIEW_PARTS > 0
    if (state == VIEW_MIXED) {
      const uint seen = view_row(view, view_part(off_chief_y * to_view_y + plane->view_shift_y));
      counts &= ((intv)((int)seen) >> part & 1) != 0;
      if (!LANES_ANY(counts)) continue;
    }
#endif
    floatv amplitude = a->amplitude;
#if RAYWAVE_SPECULAR && RAYWAVE_LIGHTS > 0
    // Through the pixel, or away from it where the sample stands in front of the plane.
    if (a->specular) {
#if RAYWAVE_SHARP
#if RAYWAVE_PRECISION == PRECISION_FLOAT
      const Wide from_row = wide_plus(from_y, wide((floatv)(step_y), 0.0f));
#else
      const Wide from_row = from_y;
#endif
      const Wide3 from_sample = {from_x, from_row, wide_minus(wide(0.0f, 0.0f), depth)};
      const Towards towards = wide3_scaled(from_sample, wide((floatv)(sign), 0.0f));
#else
      const floatv unit = sign * inverse_length;
      const Towards towards = {dx * unit, dy * unit, -a->depth * unit};
#endif
      amplitude = shaded_amplitude(lights, lit, sample, towards);
    }
#endif
    const floatv area = projected_area(a->tilt_z, a->tilt_x * dx, (floatv)(a->tilt_y * dy));
    amplitude = LANES_SELECT(
        (floatv)(0.0f), amplitude * sqrt(area) * edge_x * edge_y * sign * inverse_length, counts);
#if RAYWAVE_PRECISION == PRECISION_FLOAT
    const floatv turns = middle_turns + turns_beyond(middle_dy, step_y, length + middle_length,
                                                     plane->turns_hi * sign);
#else
    floatv path_length;
    const floatv turns = path_turns(from_x, from_y, depth, rate, &path_length) * sign;
#endif
    floatv c, s;
    cos_sin_turns(turns, &c, &s);
    c *= amplitude;
    s *= amplitude;
    for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
      const float2 phasor = phasors[(size_t)frame * (size_t)sample_count];
      tile->re[frame][row - top] += c * phasor.x - s * phasor.y;
      tile->im[frame][row - top] += c * phasor.y + s * phasor.x;
    }
  }
}

__kernel void gather(__global const Light* lights, __global const Sample* samples,
                     __global const uint* views, __global const uint* lit, __global const Aim* aims,
                     int stride, __global const int* boxes, __global const float* profiles,
                     int first_profile, __global const float2* phasors,
                     __global const int* first_of_cell, int sample_count, int first_row,
                     int last_row, int accumulate, Lattice lattice, GatherPlane plane,
                     __global float2* field) {
  const int first = (int)(get_global_id(2) * get_global_size(0) + get_global_id(0)) * RAYWAVE_LANES;
  const int top = (int)get_global_id(1) * RAYWAVE_TILE_ROWS;
  if (first >= plane.nx || top >= plane.ny) return;
  const int bottom = min(top + RAYWAVE_TILE_ROWS, plane.ny) - 1;
  Tile tile;
  tile.first = first;
  tile.top = top;
  tile.bottom = bottom;
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row)
      tile.re[frame][row] = tile.im[frame][row] = 0.0f;
  }

  // Cells whose samples' footprints can touch the tile, one more on each side against rounding.
  const float cells = 1.0f / lattice.step;
  const float low_x = plane.tangent_x + plane.tangent_step_x * (float)first - plane.window_x;
  const float high_x =
      plane.tangent_x + plane.tangent_step_x * (float)(first + RAYWAVE_LANES - 1) + plane.window_x;
  const float low_y = plane.tangent_y - plane.tangent_step_y * (float)bottom - plane.window_y;
  const float high_y = plane.tangent_y - plane.tangent_step_y * (float)top + plane.window_y;
  const int cell_left = max((int)clamp(low_x * cells - (float)lattice.first_x, -2.0f, 1e9f) - 1, 0);
  const int cell_right =
      min((int)clamp(high_x * cells - (float)lattice.first_x, -2.0f, 1e9f) + 1, lattice.nx - 1);
  const int cell_low =
      max((int)clamp(low_y * cells - (float)lattice.first_y, -2.0f, 1e9f) - 1, first_row);
  const int cell_high =
      min((int)clamp(high_y * cells - (float)lattice.first_y, -2.0f, 1e9f) + 1, last_row);

  for (int cell_row = cell_low; cell_row <= cell_high && cell_left <= cell_right; ++cell_row) {
    const int last = first_of_cell[cell_row * lattice.nx + cell_right + 1];
    for (int begin = first_of_cell[cell_row * lattice.nx + cell_left]; begin < last;
         begin += RAYWAVE_LANES) {
      __global const int* box = boxes + begin;
      const intv touches = (LANES_LOAD(box) < first + RAYWAVE_LANES) &
                           (LANES_LOAD(box + stride) >= first) &
                           (LANES_LOAD(box + 2 * stride) <= bottom) &
                           (LANES_LOAD(box + 3 * stride) >= top) & (begin + LANES_INDEX < last);
      if (!LANES_ANY(touches)) continue;
      int touching[RAYWAVE_LANES];
      LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), touches), touching);
      for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
        if (!touching[lane]) continue;
        const size_t index = (size_t)(begin + lane);
        const Aim a = aims[index];
        __global const uint* view = views + index * VIEW_WORDS;
        if (a.near) {
          gather_near(profiles + (size_t)(a.profile - first_profile) * profile_size(&plane), view,
                      &a, phasors + index, sample_count, &plane, &tile);
        } else {
          gather_far(lights, lit + index * (size_t)((RAYWAVE_LIGHTS + 31) / 32), samples + index,
                     view, &a, phasors + index, sample_count, &plane, &tile);
        }
      }
    }
  }

  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = top; row <= bottom; ++row) {
      const floatv re = tile.re[frame][row - top], im = tile.im[frame][row - top];
      __global float2* out = field +
                             ((size_t)frame * (size_t)plane.ny + (size_t)row) * (size_t)plane.nx +
                             (size_t)first;
      if (first + RAYWAVE_LANES <= plane.nx && !accumulate) {
        store_complex(re, im, out);
        continue;
      }
      float res[RAYWAVE_LANES], ims[RAYWAVE_LANES];
      LANES_STORE(re, res);
      LANES_STORE(im, ims);
      for (int i = 0; i < min(RAYWAVE_LANES, plane.nx - first); ++i)
        out[i] = (float2)(res[i], ims[i]) + (accumulate ? out[i] : (float2)(0.0f, 0.0f));
    }
  }
}
