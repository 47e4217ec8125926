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
#include "kernels/common/items.h"
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/common/shared.h"
#include "kernels/gather/footprint.h"
#include "kernels/gather/options.h"
#include "kernels/gather/path_terms.h"
#include "kernels/gather/phases.h"
#include "kernels/gather/plane_wave_samples.h"
#include "kernels/gather/plane_waves.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/gather/spherical_wave.h"
#include "kernels/gather/tile.h"
#include "kernels/samples/visibility.h"

// A position on an axis of `count` pixels, rounded down and clamped to 0 to count.
static inline int pixel_near(float place, int count) {
  return (int)clamp(place, 0.0f, (float)count);
}

// How far beside a sample its light is no steeper than pixels can show, per axis: no pixel beyond
// receives its spherical wave.
static inline float2 shown_beside(const GatherPlane* plane, const ProjectedSample* p) {
  float2 reach = (float2)(INFINITY);
#if RAYWAVE_SINE_LIMIT
  const float most_x = plane->sine_limit_x + fabs(plane->reference_x) +
                       fabs(plane->reference_fall_x) * plane->cone_x,
              most_y = plane->sine_limit_y + fabs(plane->reference_y) +
                       fabs(plane->reference_fall_y) * plane->cone_y;
  const float squared = 1.0f - most_x * most_x - most_y * most_y;
  if (!p->plane_waves && squared > 0.01f)
    reach = (float2)(most_x, most_y) * (1.001f * fabs(p->depth) / sqrt(squared));
#else
  (void)plane, (void)p;
#endif
  return reach;
}

// Pixels whose centre lies in the footprint, and within a sixteenth of a pixel beside it against
// rounding.
static inline void find_pixels(const GatherPlane* plane, ProjectedSample* p) {
  const float2 shown = shown_beside(plane, p);
  const float across = 1.0f / plane->pitch_x, down = -1.0f / plane->pitch_y;
  const float left = fmax(p->centre_x - p->half_x, p->x - shown.x),
              right = fmin(p->centre_x + p->half_x, p->x + shown.x),
              top = fmin(p->centre_y + p->half_y, p->y + shown.y),
              bottom = fmax(p->centre_y - p->half_y, p->y - shown.y);
  p->left = pixel_near(left * across + 0.9375f, plane->nx);
  p->columns = pixel_near(right * across + 1.0625f, plane->nx) - p->left;
  p->top = pixel_near(top * down + 0.9375f, plane->ny);
  p->rows = pixel_near(bottom * down + 1.0625f, plane->ny) - p->top;
}

// The chief ray's phase and direction, for a plane-wave sample. depth: from the plane.
static inline void set_chief_wave(const GatherPlane* plane, DoubleSingle depth,
                                  DoubleSingle tangent_x, DoubleSingle tangent_y,
                                  ProjectedSample* p) {
  const DoubleSingle rate = ds(plane->turns_hi, plane->turns_lo);
  const DoubleSingle over_x = plane_wave_slant(tangent_x), over_y = plane_wave_slant(tangent_y);
  p->turns = LANES_FIRST(
      ds_turns(ds_times(ds_times(depth, rate), ds_plus(ds_plus(over_x, over_y), ds(1.0f, 0.0f)))));
  put(ds_times(ds_over(tangent_x, ds_plus(over_x, ds(1.0f, 0.0f))), rate), &p->chief_x,
      &p->chief_x_low);
  put(ds_times(ds_over(tangent_y, ds_plus(over_y, ds(1.0f, 0.0f))), rate), &p->chief_y,
      &p->chief_y_low);
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
  DoubleSingle depth = ds_minus(sample_z, ds(plane.z, plane.z_low));
  DoubleSingle away = ds_minus(sample_z, ds(plane.hologram_z, plane.hologram_z_low));
#if RAYWAVE_NEAR_HOLOGRAM
  // A sample in the hologram's plane counts as one just beside it.
  if (fabs(LANES_FIRST(ds_high(away))) < nearest_to(&plane))
    depth = away = ds(copysign(nearest_to(&plane), LANES_FIRST(ds_high(away))), 0.0f);
  // Its middle ray is that of the light on the SLM there.
  const float sine_x = plane.reference_x -
                       (s.x - plane.hologram_x) / plane.half_window_x * plane.reference_fall_x,
              sine_y = plane.reference_y -
                       (s.y - plane.hologram_y) / plane.half_window_y * plane.reference_fall_y;
  const float cosine = sqrt(fmax(1.0f - sine_x * sine_x - sine_y * sine_y, 0.01f));
  const DoubleSingle tangent_x = ds(sine_x / cosine, 0.0f), tangent_y = ds(sine_y / cosine, 0.0f);
#else
  const DoubleSingle tangent_x =
      ds_over(ds_minus(ds(plane.hologram_x, plane.hologram_x_low), sample_x), away);
  const DoubleSingle tangent_y =
      ds_over(ds_minus(ds(plane.hologram_y, plane.hologram_y_low), sample_y), away);
#endif
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
#if RAYWAVE_NEAR_HOLOGRAM
  const float2 steepest = steepest_beside(sine_x, sine_y, &plane);
  lattice.half_width = steepest.x * fabs(from_hologram);
  lattice.half_height = steepest.y * fabs(from_hologram);
#endif
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

  // Its footprint
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
  if (p.plane_waves) set_chief_wave(&plane, depth, tangent_x, tangent_y, &p);
  find_pixels(&plane, &p);
  projected[index] = p;
  footprints[index] = p.left;
  footprints[stride + index] = p.columns > 0 && p.rows > 0 ? p.left + p.columns - 1 : -1;
  footprints[2 * stride + index] = p.top;
  footprints[3 * stride + index] = p.top + p.rows - 1;
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

SINGLE_ITEM_KERNEL void gather(__global const Light* lights, __global const Sample* samples,
                               __global const uint* visibility_masks, __global const uint* lit,
                               __global const SamplePath* paths,
                               __global const ProjectedSample* projected, int stride,
                               __global const int* footprints, __global const float* profiles,
                               int first_profile, __global const float2* phasors,
                               __global const int* first_of_cell, int sample_count, int first_row,
                               int last_row, int accumulate, Lattice lattice, GatherPlane plane,
                               __global float2* field) {
  FOR_ITEMS(tile_row, TO_COVER(plane.ny, RAYWAVE_TILE_ROWS), get_global_id(1))
  FOR_ITEMS(tile_column, TO_COVER(plane.nx, RAYWAVE_LANES),
            get_global_id(2) * get_global_size(0) + get_global_id(0)) {
    const int first = tile_column * RAYWAVE_LANES, top = tile_row * RAYWAVE_TILE_ROWS;
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
    const float right_x =
        plane.tangent_x + plane.tangent_step_x * (float)(first + RAYWAVE_LANES - 1);
    const float bottom_y = plane.tangent_y - plane.tangent_step_y * (float)bottom;
    const float top_y = plane.tangent_y - plane.tangent_step_y * (float)top;
    const float low_x = fmin(left_x, right_x) - plane.window_x,
                high_x = fmax(left_x, right_x) + plane.window_x,
                low_y = fmin(bottom_y, top_y) - plane.window_y,
                high_y = fmax(bottom_y, top_y) + plane.window_y;
    const int cell_left =
        max((int)clamp(low_x * cells - (float)lattice.first_x, -2.0f, 1e9f) - 1, 0);
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
            gather_plane_waves(
                profiles + (size_t)(p.profile - first_profile) * profile_size(&plane), visibility,
                &p, phasors + index, sample_count, &plane, &tile);
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
}
