// SPDX-License-Identifier: Apache-2.0
// Aimed gathering: each pixel of a plane receives one wave from each surface sample whose light
// crosses it on the way into the hologram's window,
//   sqrt(radiance) weight / r * exp(2 pi i (r / wavelength + phase(sample, frame))).
// Samples in front of the plane send converging waves: both r have the opposite sign, since a wave
// turns by half a period in its focus. Phases of samples before the hologram are drawn with the
// opposite sign, and all of their waves have it (phases.h): where they meet the hologram they are
//   sqrt(radiance) weight / |r| * exp(-2 pi i (|r| / wavelength + phase)).
// For a partly hidden sample, only the parts of the window
// count that its visibility mask contains (visibility.h). Highlights are shaded for the true
// direction of each pixel. A plane at the hologram itself gathers every sample at every pixel: the
// point-based method.
//
// Where the footprint is no wider than a few diffraction spots (footprint.h), the wave is a sum of
// plane waves instead (plane_waves.h).
//
// project_samples  projected[i]: sample i as the pixels of this plane see it. footprints[i],
//                  footprints[stride + i], ...: first and last column, first and last row of the
//                  pixels that may receive it; none where the last one is before the first one
// profile          what the pixels' columns and rows receive from plane-wave samples
// draw_phases      phasors[frame * sample_count + i]: exp(i phase) of sample i in that frame
// gather           field: RAYWAVE_FRAMES planes of plane.ny rows of plane.nx complex samples, row 0
//                  on top. The samples of the lattice's rows first_row to last_row, whose profiles
//                  begin with first_profile, are written, or added with `accumulate`
//
// A work-item of `gather` fills a tile of RAYWAVE_LANES x RAYWAVE_TILE_ROWS pixels. Global size:
// (tiles across a strip, ceil(ny / rows), strips). Paths, visibility and shading are computed once
// for all frames. OpenCL C 1.2.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/common/shared.h"
#include "kernels/gather/footprint.h"
#include "kernels/gather/options.h"
#include "kernels/gather/path_terms.h"
#include "kernels/gather/phases.h"
#include "kernels/gather/plane_waves.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/samples/visibility.h"
#include "kernels/scene/shade.h"

#define VISIBILITY_CLEAR 0
#define VISIBILITY_MIXED 1
#define VISIBILITY_NONE 2

#if !RAYWAVE_SMOOTH_PARTS
// Visibility of a sample from a box of the hologram's window, in half sides of the window that the
// mask divides: VISIBILITY_CLEAR, _MIXED or _NONE.
static inline int visibility_state(__global const uint* visibility, float x0, float x1, float y0,
                                   float y1) {
  const int left = visibility_part(x0), right = visibility_part(x1);
  const uint columns = (2u << right) - (1u << left);
  uint all = columns, any = 0;
  for (int j = visibility_part(y0); j <= visibility_part(y1); ++j) {
    const uint row = visibility_row(visibility, j) & columns;
    all &= row;
    any |= row;
  }
  return all == columns ? VISIBILITY_CLEAR : any ? VISIBILITY_MIXED : VISIBILITY_NONE;
}
#endif

#if RAYWAVE_SMOOTH_PARTS && RAYWAVE_VISIBILITY_PARTS > 0
// Cubic B-splines of four parts at `place`, in parts from the middle of the first part of a side:
// their weights. Returns the first of the four, which may lie beyond the side.
static inline intv splines_at(floatv place, floatv* weights) {
  const intv before = LANES_TO_INT(clamp(place, -1.0f, (float)RAYWAVE_VISIBILITY_PARTS) + 2.0f) - 2;
  const floatv t = place - LANES_TO_FLOAT(before), rest = 1.0f - t;
  weights[0] = rest * rest * rest / 6.0f;
  weights[1] = 2.0f / 3.0f - t * t + 0.5f * t * t * t;
  weights[2] = 2.0f / 3.0f - rest * rest + 0.5f * rest * rest * rest;
  weights[3] = t * t * t / 6.0f;
  return before - 1;
}

// Share of the light that pixels see, at places across the window and on one row of it, in parts
// from the middle of the first. Parts beyond the window see what the outermost see.
static inline floatv smooth_share(__global const uint* visibility, floatv across, float up) {
  floatv columns[4], rows[4];
  const intv column = splines_at(across, columns), row = splines_at((floatv)(up), rows);
  floatv share = 0.0f;
  for (int j = 0; j < 4; ++j) {
    const int part = clamp(LANES_FIRST(row) + j, 0, RAYWAVE_VISIBILITY_PARTS - 1);
    const intv seen = (intv)((int)visibility_row(visibility, part));
    floatv of_row = 0.0f;
    for (int i = 0; i < 4; ++i) {
      const intv bit =
          seen >> clamp(column + i, (intv)(0), (intv)(RAYWAVE_VISIBILITY_PARTS - 1)) & 1;
      of_row += LANES_SELECT((floatv)(0.0f), columns[i], bit != 0);
    }
    share += rows[j] * of_row;
  }
  return share;
}
#endif

// Share of part (i, j) of PLANE_WAVE_PARTS x PLANE_WAVE_PARTS parts of the window that sees the
// sample.
static inline float visible_share(__global const uint* visibility, int i, int j) {
#if RAYWAVE_VISIBILITY_PARTS > 0
  const int side = RAYWAVE_VISIBILITY_PARTS / PLANE_WAVE_PARTS;
  int seen = 0;
  for (int row = j * side; row < (j + 1) * side; ++row)
    seen += (int)popcount(visibility_row(visibility, row) >> (i * side) & ((1u << side) - 1u));
  return (float)seen / (float)(side * side);
#else
  (void)visibility, (void)i, (void)j;
  return 1.0f;
#endif
}

// True for samples before the hologram, z < 0: light from them on to the eye comes from the other
// side of the hologram's middle.
static inline bool is_before_hologram(const ProjectedSample* p) { return p->scale_x < 0.0f; }

// Distances between light and a pixel are at least this long.
static inline float nearest_to(const GatherPlane* plane) {
  return 0x1p-10f * fmin(plane->pitch_x, plane->pitch_y);
}

static inline void put(DoubleSingle value, float* hi, float* lo) {
  *hi = LANES_FIRST(ds_high(value));
  *lo = LANES_FIRST(ds_low(value));
}

// A position on an axis of `count` pixels, rounded down and clamped to 0 to count.
static inline int pixel_near(float place, int count) {
  return (int)clamp(place, 0.0f, (float)count);
}

__kernel void project_samples(__global const Sample* samples, int sample_count, Lattice lattice,
                              GatherPlane plane, __global ProjectedSample* projected, int stride,
                              __global int* footprints) {
  const int index = (int)get_global_id(0);
  if (index >= sample_count) return;
  const Sample s = samples[index];
  // The light of samples at other depths belongs to another layer's planes.
  if (!(plane.begin_z <= s.z && s.z < plane.end_z)) {
    projected[index].plane_waves = projected[index].columns = 0;
    footprints[index] = footprints[2 * stride + index] = 0;
    footprints[stride + index] = footprints[3 * stride + index] = -1;
    return;
  }

  // The chief ray, from the sample to the window's centre, and where it meets the plane.
  ProjectedSample p;
  const DoubleSingle sample_x = ds(s.x, 0.0f), sample_y = ds(s.y, 0.0f), sample_z = ds(s.z, 0.0f);
  const DoubleSingle x = ds_minus(sample_x, ds(plane.left, plane.left_low)),
                     y = ds_minus(sample_y, ds(plane.top, plane.top_low));
  const DoubleSingle depth = ds_minus(sample_z, ds(plane.z, plane.z_low));
  const DoubleSingle away = ds_minus(sample_z, ds(plane.hologram_z, plane.hologram_z_low));
  const DoubleSingle tangent_x =
      ds_over(ds_minus(ds(plane.hologram_x, plane.hologram_x_low), sample_x), away);
  const DoubleSingle tangent_y =
      ds_over(ds_minus(ds(plane.hologram_y, plane.hologram_y_low), sample_y), away);
  const DoubleSingle centre_x = ds_plus(x, ds_times(tangent_x, depth)),
                     centre_y = ds_plus(y, ds_times(tangent_y, depth));
  put(x, &p.x, &p.x_low);
  put(y, &p.y, &p.y_low);
  put(depth, &p.depth, &p.depth_low);
  put(centre_x, &p.centre_x, &p.centre_x_low);
  put(centre_y, &p.centre_y, &p.centre_y_low);

  // The window as the plane shows it, and the surface as the window sees it.
  const float distance = fmax(fabs(p.depth), nearest_to(&plane));
  p.inverse_depth = copysign(1.0f / distance, p.depth);
  const float from_hologram = LANES_FIRST(ds_high(away));
  const float narrowed = distance / fabs(from_hologram);
  const float side = from_hologram < 0.0f ? -1.0f : 1.0f;
  p.scale_x = side / (lattice.half_width * narrowed);
  p.scale_y = side / (lattice.half_height * narrowed);
  p.amplitude = sqrt(s.radiance) * s.weight;
  p.tilt_x = s.tilt_x * p.inverse_depth;
  p.tilt_y = s.tilt_y * p.inverse_depth;
  p.tilt_z = s.tilt_z;
  p.turns = p.chief_x = p.chief_x_low = p.chief_y = p.chief_y_low = 0.0f;
  p.specular = s.specular > 0.0f;
  p.hidden = s.hidden;
  p.profile = s.profile;
  p.tangent_x = LANES_FIRST(ds_high(tangent_x));
  p.tangent_y = LANES_FIRST(ds_high(tangent_y));
  p.half_tangent_x = lattice.half_width / fabs(from_hologram);
  p.half_tangent_y = lattice.half_height / fabs(from_hologram);

  // Its footprint, and the chief ray's phase and direction for plane-wave samples.
  const FootprintAxis axis_x =
      footprint_axis(plane.cone_x, lattice.half_width, narrowed, p.half_tangent_x, plane.turns_hi,
                     plane.plane_wave_tail);
  const FootprintAxis axis_y =
      footprint_axis(plane.cone_y, lattice.half_height, narrowed, p.half_tangent_y, plane.turns_hi,
                     plane.plane_wave_tail);
  // The waves of a fitted path are no product of one along x and one along y.
  p.path = RAYWAVE_PATHS ? s.path : -1;
  p.plane_waves = p.path < 0 && is_plane_wave_sample(axis_x, axis_y, plane.plane_wave_spots);
  p.half_x = p.plane_waves ? axis_x.extent : axis_x.half_width;
  p.half_y = p.plane_waves ? axis_y.extent : axis_y.half_width;
  if (p.plane_waves) {
    const DoubleSingle rate = ds(plane.turns_hi, plane.turns_lo);
    const DoubleSingle over_x = plane_wave_slant(tangent_x), over_y = plane_wave_slant(tangent_y);
    p.turns = LANES_FIRST(ds_turns(
        ds_times(ds_times(depth, rate), ds_plus(ds_plus(over_x, over_y), ds(1.0f, 0.0f)))));
    put(ds_times(ds_over(tangent_x, ds_plus(over_x, ds(1.0f, 0.0f))), rate), &p.chief_x,
        &p.chief_x_low);
    put(ds_times(ds_over(tangent_y, ds_plus(over_y, ds(1.0f, 0.0f))), rate), &p.chief_y,
        &p.chief_y_low);
  }

  // Pixels whose centre lies in the footprint, and within a sixteenth of a pixel beside it against
  // rounding.
  const float across = 1.0f / plane.pitch_x, down = -1.0f / plane.pitch_y;
  p.left = pixel_near((p.centre_x - p.half_x) * across + 0.9375f, plane.nx);
  p.columns = pixel_near((p.centre_x + p.half_x) * across + 1.0625f, plane.nx) - p.left;
  p.top = pixel_near((p.centre_y + p.half_y) * down + 0.9375f, plane.ny);
  p.rows = pixel_near((p.centre_y - p.half_y) * down + 1.0625f, plane.ny) - p.top;
  projected[index] = p;
  footprints[index] = p.left;
  footprints[stride + index] = p.columns > 0 && p.rows > 0 ? p.left + p.columns - 1 : -1;
  footprints[2 * stride + index] = p.top;
  footprints[3 * stride + index] = p.top + p.rows - 1;
}

#if RAYWAVE_PRECISION == PRECISION_FLOAT
// Turns by which a path is longer than the path that ends `step` below it in y, where dy is the
// latter's offset from the sample: r - r0 = (r^2 - r0^2) / (r + r0). Only a few turns lie between
// neighbours, so that their rounding error stays below 10^-6.
static inline floatv turns_beyond(float dy, float step, floatv sum_of_lengths,
                                  float turns_per_metre) {
  return (2.0f * dy + step) * step * turns_per_metre / sum_of_lengths;
}
#endif

// The plane waves of both axes of a sample. Its amplitude in a direction is approximated by the
// product of its amplitudes along the two axes through its brightest direction. This is right to
// first order for surfaces that turn away, and for highlights that fall off like a Gaussian.
static inline void plane_wave_axes(__global const Light* lights, __global const uint* lit,
                                   __global const Sample* sample, const ProjectedSample* p,
                                   const GatherPlane* plane, PlaneWaves* x, PlaneWaves* y) {
  plane_waves_of(x, p->hidden, p->tangent_x, p->half_tangent_x, p->half_x, p->depth,
                 gathered_x(plane, is_before_hologram(p)), plane->turns_hi);
  plane_waves_of(y, p->hidden, p->tangent_y, p->half_tangent_y, p->half_y, p->depth,
                 gathered_y(plane, is_before_hologram(p)), plane->turns_hi);
  float best_x = p->tangent_x, best_y = p->tangent_y;
  float best = LANES_FIRST(amplitude_towards(lights, lit, sample, p->amplitude, p->specular,
                                             (floatv)(best_x), (floatv)(best_y)));
#if RAYWAVE_SPECULAR && RAYWAVE_HIGHLIGHTS > 0
  for (int first = 0; first < RAYWAVE_HIGHLIGHTS && p->specular; first += RAYWAVE_LANES) {
    floatv tx, ty;
    highlight_directions(lights, lit, sample, first, p->tangent_x,
                         plane->cone_x * p->half_tangent_x, p->tangent_y,
                         plane->cone_y * p->half_tangent_y, &tx, &ty);
    float amplitudes[RAYWAVE_LANES], txs[RAYWAVE_LANES], tys[RAYWAVE_LANES];
    LANES_STORE(amplitude_towards(lights, lit, sample, p->amplitude, p->specular, tx, ty),
                amplitudes);
    LANES_STORE(tx, txs);
    LANES_STORE(ty, tys);
    for (int i = 0; i < RAYWAVE_LANES; ++i) {
      if (!(amplitudes[i] > 1.01f * best)) continue;  // else rounding would choose among equals
      best = amplitudes[i];
      best_x = txs[i];
      best_y = tys[i];
    }
  }
#endif
  const float scale = best > 0.0f ? plane->turns_hi / best : 0.0f;
  for (int n = 0; n < x->count; n += RAYWAVE_LANES) {
    const floatv amplitude = amplitude_towards(lights, lit, sample, p->amplitude, p->specular,
                                               LANES_LOAD(x->tangent + n), (floatv)(best_y)) *
                             scale;
    LANES_STORE(LANES_LOAD(x->re + n) * amplitude, x->re + n);
    LANES_STORE(LANES_LOAD(x->im + n) * amplitude, x->im + n);
  }
  for (int n = 0; n < y->count; n += RAYWAVE_LANES) {
    const floatv amplitude = amplitude_towards(lights, lit, sample, p->amplitude, p->specular,
                                               (floatv)(best_x), LANES_LOAD(y->tangent + n));
    LANES_STORE(LANES_LOAD(y->re + n) * amplitude, y->re + n);
    LANES_STORE(LANES_LOAD(y->im + n) * amplitude, y->im + n);
  }
}

// Sum of waves `from` to before `to` along x, at pixels of columns first to first + RAYWAVE_LANES -
// 1; zero outside the footprint.
static inline void plane_wave_columns(const PlaneWaves* waves, int from, int to,
                                      const ProjectedSample* p, const GatherPlane* plane, int first,
                                      floatv* re, floatv* im) {
  const DoubleSingle offset =
      ds_minus(ds_steps(first + LANES_INDEX, plane->pitch_x, plane->pitch_x_low),
               ds(p->centre_x, p->centre_x_low));
  const floatv turns =
      ds_turns(ds_times(offset, ds(p->chief_x, p->chief_x_low))) + (p->turns + 0.25f);
  plane_wave_sum(waves, from, to, ds_high(offset), turns, re, im);
  const intv inside = fabs(ds_high(offset)) <= p->half_x;
  *re = LANES_SELECT((floatv)(0.0f), *re, inside);
  *im = LANES_SELECT((floatv)(0.0f), *im, inside);
}

// The same along y, at pixels of rows first to first + RAYWAVE_LANES - 1.
static inline void plane_wave_rows(const PlaneWaves* waves, int from, int to,
                                   const ProjectedSample* p, const GatherPlane* plane, int first,
                                   floatv* re, floatv* im) {
  const DoubleSingle offset =
      ds_minus(ds_steps(-(first + LANES_INDEX), plane->pitch_y, plane->pitch_y_low),
               ds(p->centre_y, p->centre_y_low));
  plane_wave_sum(waves, from, to, ds_high(offset),
                 ds_turns(ds_times(offset, ds(p->chief_y, p->chief_y_low))), re, im);
  const intv inside = fabs(ds_high(offset)) <= p->half_y;
  *re = LANES_SELECT((floatv)(0.0f), *re, inside);
  *im = LANES_SELECT((floatv)(0.0f), *im, inside);
}

// Number of floats of a profile.
static inline size_t profile_size(const GatherPlane* plane) {
  return (size_t)(2 * (plane->room_x + plane->room_y));
}

// Profiles of plane-wave samples, whose wave is the product of one along x and one along y. A
// hidden sample has one profile for each part of the window's sides. Profile number `profile`
// begins (profile - first_profile) profile_size floats into `profiles` and holds: real parts of
// RAYWAVE_LANES zeros, of its columns, and zeros up to room_x; the imaginary parts likewise; real
// parts of its rows, in room_y; the imaginary parts.
__kernel void profile(__global const Light* lights, __global const Sample* samples,
                      __global const uint* lit, __global const ProjectedSample* projected,
                      int first_sample, int first_profile, int sample_count, GatherPlane plane,
                      __global float* profiles) {
  const int number = (int)get_global_id(0);
  if (number >= sample_count) return;
  const int index = first_sample + number;
  const ProjectedSample p = projected[index];
  if (!p.plane_waves || p.columns <= 0 || p.rows <= 0) return;
  PlaneWaves waves_x, waves_y;
  plane_wave_axes(lights, lit + (size_t)index * (size_t)((RAYWAVE_LIGHTS + 31) / 32),
                  samples + index, &p, &plane, &waves_x, &waves_y);
  const floatv zero = 0.0f;
  for (int part = 0; part < (p.hidden ? PLANE_WAVE_PARTS : 1); ++part) {
    const int from_x = waves_x.begin[part],
              to_x = p.hidden ? waves_x.begin[part + 1] : waves_x.count;
    const int from_y = waves_y.begin[part],
              to_y = p.hidden ? waves_y.begin[part + 1] : waves_y.count;
    __global float* across =
        profiles + (size_t)(p.profile + part - first_profile) * profile_size(&plane);
    __global float* up = across + 2 * plane.room_x;
    floatv re, im;
    LANES_STORE(zero, across);
    LANES_STORE(zero, across + plane.room_x);
    int column = 0;
    for (; column < p.columns; column += RAYWAVE_LANES) {
      plane_wave_columns(&waves_x, from_x, to_x, &p, &plane, p.left + column, &re, &im);
      LANES_STORE(re, across + RAYWAVE_LANES + column);
      LANES_STORE(im, across + plane.room_x + RAYWAVE_LANES + column);
    }
    LANES_STORE(zero, across + RAYWAVE_LANES + column);
    LANES_STORE(zero, across + plane.room_x + RAYWAVE_LANES + column);
    for (int row = 0; row < p.rows; row += RAYWAVE_LANES) {
      plane_wave_rows(&waves_y, from_y, to_y, &p, &plane, p.top + row, &re, &im);
      LANES_STORE(re, up + row);
      LANES_STORE(im, up + plane.room_y + row);
    }
  }
}

// The pixels of a work-item and their sums.
typedef struct {
  int first;  // column
  int top;    // row
  int bottom;
  floatv re[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
  floatv im[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
} Tile;

// Adds the product of a sample's profile along the columns and along the rows, `up`.
static inline void add_product(floatv across_re, floatv across_im, __global const float* up,
                               const ProjectedSample* p, __global const float2* phasors,
                               int sample_count, const GatherPlane* plane, Tile* tile) {
  const int from = max(tile->top, p->top), to = min(tile->bottom, p->top + p->rows - 1);
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    const float2 phasor = phasors[(size_t)frame * (size_t)sample_count];
    const floatv turned_re = across_re * phasor.x - across_im * phasor.y,
                 turned_im = across_re * phasor.y + across_im * phasor.x;
    for (int row = from; row <= to; ++row) {
      const float up_re = up[row - p->top], up_im = up[plane->room_y + row - p->top];
      tile->re[frame][row - tile->top] += turned_re * up_re - turned_im * up_im;
      tile->im[frame][row - tile->top] += turned_re * up_im + turned_im * up_re;
    }
  }
}

// Adds the wave of a plane-wave sample, from its profiles.
static inline void gather_plane_waves(__global const float* profiles,
                                      __global const uint* visibility, const ProjectedSample* p,
                                      __global const float2* phasors, int sample_count,
                                      const GatherPlane* plane, Tile* tile) {
  const size_t size = profile_size(plane);
  __global const float* column = profiles + (tile->first - p->left + RAYWAVE_LANES);
  __global const float* up = profiles + 2 * plane->room_x;
  if (!p->hidden) {
    add_product(LANES_LOAD(column), LANES_LOAD(column + plane->room_x), up, p, phasors,
                sample_count, plane, tile);
    return;
  }
  for (int j = 0; j < PLANE_WAVE_PARTS; ++j) {
    floatv re = 0.0f, im = 0.0f;
    bool any = false;
    for (int i = 0; i < PLANE_WAVE_PARTS; ++i) {
      const float share =
          is_before_hologram(p)
              ? visible_share(visibility, PLANE_WAVE_PARTS - 1 - i, PLANE_WAVE_PARTS - 1 - j)
              : visible_share(visibility, i, j);
      if (share <= 0.0f) continue;
      re += share * LANES_LOAD(column + (size_t)i * size);
      im += share * LANES_LOAD(column + (size_t)i * size + plane->room_x);
      any = true;
    }
    if (any) add_product(re, im, up + (size_t)j * size, p, phasors, sample_count, plane, tile);
  }
}

// Adds the spherical wave of a sample, one path per pixel.
static inline void gather_spherical_wave(__global const Light* lights, __global const uint* lit,
                                         __global const Sample* sample,
                                         __global const SamplePath* paths,
                                         __global const uint* visibility, const ProjectedSample* p,
                                         __global const float2* phasors, int sample_count,
                                         const GatherPlane* plane, Tile* tile) {
#if !RAYWAVE_PATHS
  (void)paths;
#endif
  const int top = tile->top, bottom = tile->bottom;
  const intv column = tile->first + LANES_INDEX;
  const DoubleSingle x = ds_steps(column, plane->pitch_x, plane->pitch_x_low),
                     rate = ds(plane->turns_hi, plane->turns_lo);
#if RAYWAVE_VISIBILITY_PARTS > 0 && !RAYWAVE_SMOOTH_PARTS
  const float left_x = plane->pitch_x * (float)tile->first,
              right_x = left_x + plane->pitch_x * (float)(RAYWAVE_LANES - 1);
  const float top_y = -plane->pitch_y * (float)top, bottom_y = -plane->pitch_y * (float)bottom;
#endif
  const DoubleSingle from_x = ds_minus(x, ds(p->x, p->x_low)), depth = ds(p->depth, p->depth_low);
  const floatv dx = ds_high(from_x);
  const floatv off_chief = ds_high(ds_minus(x, ds(p->centre_x, p->centre_x_low)));
  // Where the light of a pixel meets the hologram, in half windows from its centre
  const floatv across = fabs(off_chief * p->scale_x);
  intv inside_x = (across <= plane->cone_x) & (column < plane->nx);
  const floatv edge_x = apodization_weights(across, plane->cone_x, plane->apodization_rate_x);
  const float sign = p->depth < 0.0f ? -1.0f : 1.0f;
#if RAYWAVE_SINE_LIMIT
  // Of the light that the SLM is lit with, where this light meets it
  const floatv reference_x =
      plane->reference_x - off_chief * (sign * p->scale_x * plane->reference_fall_x);
  const float reference_rate_y = sign * p->scale_y * plane->reference_fall_y;
#endif
#if RAYWAVE_PATHS
  // Where the light meets the window, in half sides
  const float to_window_y = sign * p->scale_y * plane->visibility_scale_y;
  const floatv window_x =
      off_chief * (sign * p->scale_x * plane->visibility_scale_x) + plane->visibility_shift_x;
#endif
#if RAYWAVE_VISIBILITY_PARTS > 0
  // Visibility of the tile's pixels: all, none, or by the bit of each pixel's part of the window.
  int state = VISIBILITY_CLEAR;
  const float to_mask_x = sign * p->scale_x * plane->visibility_scale_x;
  const float to_mask_y = sign * p->scale_y * plane->visibility_scale_y;
#if RAYWAVE_SMOOTH_PARTS
  const floatv parts_across = (off_chief * to_mask_x + plane->visibility_shift_x + 1.0f) *
                                  (0.5f * RAYWAVE_VISIBILITY_PARTS) -
                              0.5f;
  if (p->hidden) state = VISIBILITY_MIXED;
#else
  intv part = 0;
  if (p->hidden) {
    const float u0 = (fmax(left_x, p->centre_x - p->half_x) - p->centre_x) * to_mask_x +
                     plane->visibility_shift_x;
    const float u1 = (fmin(right_x, p->centre_x + p->half_x) - p->centre_x) * to_mask_x +
                     plane->visibility_shift_x;
    const float v0 = (fmax(bottom_y, p->centre_y - p->half_y) - p->centre_y) * to_mask_y +
                     plane->visibility_shift_y;
    const float v1 = (fmin(top_y, p->centre_y + p->half_y) - p->centre_y) * to_mask_y +
                     plane->visibility_shift_y;
    state = visibility_state(visibility, fmin(u0, u1), fmax(u0, u1), fmin(v0, v1), fmax(v0, v1));
    if (state == VISIBILITY_NONE) return;
    part = clamp(LANES_TO_INT((off_chief * to_mask_x + plane->visibility_shift_x + 1.0f) *
                              (0.5f * RAYWAVE_VISIBILITY_PARTS)),
                 (intv)(0), (intv)(RAYWAVE_VISIBILITY_PARTS - 1));
  }
#endif
#endif
  const floatv squared_x = dx * dx + p->depth * p->depth;
#if RAYWAVE_PRECISION == PRECISION_FLOAT
  // The phase of each lane counts from its pixel in the tile's middle row.
  const int middle = (top + bottom) / 2;
  const DoubleSingle middle_y = ds_steps((intv)(-middle), plane->pitch_y, plane->pitch_y_low);
  const DoubleSingle from_y = ds_minus(middle_y, ds(p->y, p->y_low));
  floatv middle_length;
  const floatv middle_turns = path_turns(from_x, from_y, depth, rate, &middle_length) * sign;
  const float middle_dy = LANES_FIRST(ds_high(from_y));
  const float middle_off_chief =
      LANES_FIRST(ds_high(ds_minus(middle_y, ds(p->centre_y, p->centre_y_low))));
#endif

  for (int row = top; row <= bottom; ++row) {
#if RAYWAVE_PRECISION == PRECISION_FLOAT
    const float step_y = plane->pitch_y * (float)(middle - row);
    const float dy = middle_dy + step_y, off_chief_y = middle_off_chief + step_y;
#else
    const DoubleSingle y = ds_steps((intv)(-row), plane->pitch_y, plane->pitch_y_low),
                       from_y = ds_minus(y, ds(p->y, p->y_low));
    const float dy = LANES_FIRST(ds_high(from_y));
    const float off_chief_y = LANES_FIRST(ds_high(ds_minus(y, ds(p->centre_y, p->centre_y_low))));
#endif
    const float up = fabs(off_chief_y * p->scale_y);
    if (up > plane->cone_y) continue;
    const float edge_y = apodization_weight(up, plane->cone_y, plane->apodization_rate_y);
    const floatv length = sqrt(squared_x + dy * dy);
    const floatv inverse_length = 1.0f / fmax(length, nearest_to(plane));
    intv counts = inside_x;
#if RAYWAVE_SINE_LIMIT
    const float reference_y = plane->reference_y - off_chief_y * reference_rate_y;
    counts &= (fabs(sign * dx * inverse_length - reference_x) <= plane->sine_limit_x) &
              (fabs(sign * dy * inverse_length - reference_y) <= plane->sine_limit_y);
#endif
    floatv share = edge_x * edge_y;
#if RAYWAVE_VISIBILITY_PARTS > 0
    if (state == VISIBILITY_MIXED) {
      const float at = off_chief_y * to_mask_y + plane->visibility_shift_y;
#if RAYWAVE_SMOOTH_PARTS
      share *= smooth_share(visibility, parts_across,
                            (at + 1.0f) * (0.5f * RAYWAVE_VISIBILITY_PARTS) - 0.5f);
#else
      const uint seen = visibility_row(visibility, visibility_part(at));
      counts &= ((intv)((int)seen) >> part & 1) != 0;
      if (!LANES_ANY(counts)) continue;
#endif
    }
#endif
    floatv amplitude = p->amplitude;
#if RAYWAVE_SPECULAR && RAYWAVE_HIGHLIGHTS > 0
    // The direction through the pixel, or away from it where the sample is in front of the plane.
    if (p->specular) {
#if RAYWAVE_SHARP
#if RAYWAVE_PRECISION == PRECISION_FLOAT
      const DoubleSingle from_row = ds_plus(from_y, ds((floatv)(step_y), 0.0f));
#else
      const DoubleSingle from_row = from_y;
#endif
      const DoubleSingle3 from_sample = {from_x, from_row, ds_minus(ds(0.0f, 0.0f), depth)};
      const Towards towards = ds3_scaled(from_sample, ds((floatv)(sign), 0.0f));
#else
      const floatv unit = sign * inverse_length;
      const Towards towards = {dx * unit, dy * unit, -p->depth * unit};
#endif
      amplitude = shaded_amplitude(lights, lit, sample, towards);
    }
#endif
    const floatv area = projected_area(p->tilt_z, p->tilt_x * dx, (floatv)(p->tilt_y * dy));
    amplitude = LANES_SELECT((floatv)(0.0f), amplitude * sqrt(area) * share * sign * inverse_length,
                             counts);
#if RAYWAVE_PRECISION == PRECISION_FLOAT
    const floatv turns = middle_turns + turns_beyond(middle_dy, step_y, length + middle_length,
                                                     plane->turns_hi * sign);
#else
    floatv path_length;
    const floatv turns = path_turns(from_x, from_y, depth, rate, &path_length) * sign;
#endif
    floatv rest = 0.0f;
#if RAYWAVE_PATHS
    if (p->path >= 0) {
      const floatv window_y = off_chief_y * to_window_y + plane->visibility_shift_y;
      rest = path_rest(paths + p->path, window_x, window_y) * plane->turns_hi;
      amplitude *= path_amplitude(paths + p->path, window_x, window_y);
    }
#endif
    floatv c, s;
    cos_sin_turns(turns + rest, &c, &s);
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
                     __global const uint* visibility_masks, __global const uint* lit,
                     __global const SamplePath* paths, __global const ProjectedSample* projected,
                     int stride, __global const int* footprints, __global const float* profiles,
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

  // Cells whose samples' footprints can touch the tile, with one more on each side against
  // rounding.
  const float cells = 1.0f / lattice.step;
  const float left_x = plane.tangent_x + plane.tangent_step_x * (float)first;
  const float right_x = plane.tangent_x + plane.tangent_step_x * (float)(first + RAYWAVE_LANES - 1);
  const float bottom_y = plane.tangent_y - plane.tangent_step_y * (float)bottom;
  const float top_y = plane.tangent_y - plane.tangent_step_y * (float)top;
  const float low_x = fmin(left_x, right_x) - plane.window_x,
              high_x = fmax(left_x, right_x) + plane.window_x,
              low_y = fmin(bottom_y, top_y) - plane.window_y,
              high_y = fmax(bottom_y, top_y) + plane.window_y;
  const int cell_left = max((int)clamp(low_x * cells - (float)lattice.first_x, -2.0f, 1e9f) - 1, 0);
  const int cell_right =
      min((int)clamp(high_x * cells - (float)lattice.first_x, -2.0f, 1e9f) + 1, lattice.nx - 1);
  const int cell_low =
      max((int)clamp(low_y * cells - (float)lattice.first_y, -2.0f, 1e9f) - 1, first_row);
  const int cell_high =
      min((int)clamp(high_y * cells - (float)lattice.first_y, -2.0f, 1e9f) + 1, last_row);

  // Samples whose footprints touch the tile, a packet of samples at a time.
  for (int cell_row = cell_low; cell_row <= cell_high && cell_left <= cell_right; ++cell_row) {
    const int last = first_of_cell[cell_row * lattice.nx + cell_right + 1];
    for (int begin = first_of_cell[cell_row * lattice.nx + cell_left]; begin < last;
         begin += RAYWAVE_LANES) {
      __global const int* footprint = footprints + begin;
      const intv touches = (LANES_LOAD(footprint) < first + RAYWAVE_LANES) &
                           (LANES_LOAD(footprint + stride) >= first) &
                           (LANES_LOAD(footprint + 2 * stride) <= bottom) &
                           (LANES_LOAD(footprint + 3 * stride) >= top) &
                           (begin + LANES_INDEX < last);
      if (!LANES_ANY(touches)) continue;
      int touching[RAYWAVE_LANES];
      LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), touches), touching);
      for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
        if (!touching[lane]) continue;
        const size_t index = (size_t)(begin + lane);
        const ProjectedSample p = projected[index];
        __global const uint* visibility = visibility_masks + index * VISIBILITY_WORDS;
        if (p.plane_waves) {
          gather_plane_waves(profiles + (size_t)(p.profile - first_profile) * profile_size(&plane),
                             visibility, &p, phasors + index, sample_count, &plane, &tile);
        } else {
          gather_spherical_wave(lights, lit + index * (size_t)((RAYWAVE_LIGHTS + 31) / 32),
                                samples + index, paths, visibility, &p, phasors + index,
                                sample_count, &plane, &tile);
        }
      }
    }
  }

  // The tile's sums go to the field.
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
