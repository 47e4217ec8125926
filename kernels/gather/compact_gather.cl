// SPDX-License-Identifier: Apache-2.0
// The field on a virtual plane, as the sum of footprints W(x, y) = sum over k of X_k(x) Y_k(y)
// (compact.cl, whose `profile` has made X_k and Y_k). OpenCL C 1.2.
//
// gather_compact  field: RAYWAVE_FRAMES planes of plane.ny rows, each plane.row_stride samples in
//                 memory with plane.nx of the plane. Bins of COMPACT_BIN x COMPACT_BIN pixels list
//                 the samples that light them: those of bin b are bin_samples[first_of_bin[b]] up
//                 to that of b + 1. Only the band of strips RAYWAVE_TILE_ROWS / COMPACT_BIN rows of
//                 bins from first_row on is filled; is_fresh: whether nothing was written there
//                 before
//
// A work-item fills RAYWAVE_LANES x RAYWAVE_TILE_ROWS pixels: a packet of a strip.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/items.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/gather/compact_layout.h"
#include "kernels/gather/options.h"

// The pixels of a work-item and their sums.
typedef struct {
  int top;  // row of the plane
  floatv re[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
  floatv im[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
} Tile;

// A sample in a work-item: its profiles from some line on. X counts from the work-item's first
// column, where it is `inside` the footprint, Y from its first row.
typedef struct {
  __global const float* across;
  __global const float* up;
  intv inside;
  int room_x;
  int room_y;
  int stride;    // floats of a line
  int from, to;  // rows of the work-item
  __global const float2* phasors;
  int sample_count;
} Part;

// X of a line, with the sample's phase where there is one only.
static inline void load_line(const Part* p, int line, floatv* re, floatv* im) {
  __global const float* across = p->across + line * p->stride;
  *re = LANES_SELECT((floatv)(0.0f), LANES_LOAD(across), p->inside);
  *im = LANES_SELECT((floatv)(0.0f), LANES_LOAD(across + p->room_x), p->inside);
#if RAYWAVE_FRAMES == 1
  const float2 phasor = p->phasors[0];
  const floatv turned = *re * phasor.x - *im * phasor.y;
  *im = *re * phasor.y + *im * phasor.x;
  *re = turned;
#endif
}

// Adds the product of a line to a sum.
static inline void add_line(floatv line_re, floatv line_im, __global const float* up, int room,
                            floatv* re, floatv* im) {
  *re += line_re * up[0];
  *im += line_re * up[room];
  *re -= line_im * up[room];
  *im += line_im * up[0];
}

static inline void add_to_tile(const Part* p, int row, floatv re, floatv im, Tile* tile) {
#if RAYWAVE_FRAMES == 1
  (void)p;
  tile->re[0][row] += re;
  tile->im[0][row] += im;
#else
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    const float2 phasor = p->phasors[(size_t)frame * (size_t)p->sample_count];
    tile->re[frame][row] += re * phasor.x - im * phasor.y;
    tile->im[frame][row] += re * phasor.y + im * phasor.x;
  }
#endif
}

// Adds `lines` lines, 1 to 4 of them and a constant, to the work-item.
static inline __attribute__((always_inline)) void add_lines(const Part* p, const int lines,
                                                            Tile* tile) {
  floatv re0, im0, re1 = 0.0f, im1 = 0.0f, re2 = 0.0f, im2 = 0.0f, re3 = 0.0f, im3 = 0.0f;
  load_line(p, 0, &re0, &im0);
  if (lines > 1) load_line(p, 1, &re1, &im1);
  if (lines > 2) load_line(p, 2, &re2, &im2);
  if (lines > 3) load_line(p, 3, &re3, &im3);
  for (int row = p->from; row < p->to; ++row) {
    __global const float* up = p->up + row;
    floatv re = 0.0f, im = 0.0f;
    add_line(re0, im0, up, p->room_y, &re, &im);
    if (lines > 1) add_line(re1, im1, up + p->stride, p->room_y, &re, &im);
    if (lines > 2) add_line(re2, im2, up + 2 * p->stride, p->room_y, &re, &im);
    if (lines > 3) add_line(re3, im3, up + 3 * p->stride, p->room_y, &re, &im);
    add_to_tile(p, row, re, im, tile);
  }
}

SINGLE_ITEM_KERNEL void gather_compact(__global const CompactFootprint* footprints,
                                       __global const int* offsets, __global const float* profiles,
                                       __global const float2* phasors, int sample_count,
                                       __global const int* first_of_bin,
                                       __global const int* bin_samples,
                                       __global const int* is_fresh, int first_fresh, int first_bin,
                                       int first_row, int strips, CompactPlane plane,
                                       __global float2* field) {
  FOR_ITEMS(turn, strips, get_global_id(1))
  FOR_ITEMS(packet, plane.nx / RAYWAVE_LANES, get_global_id(0)) {
    const int first = packet * RAYWAVE_LANES, strip = row_in_turn(turn, strips) * RAYWAVE_TILE_ROWS,
              bin_row = strip / COMPACT_BIN;
    Tile tile;
    tile.top = (first_row * COMPACT_BIN + strip) % plane.ny;
    for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
      for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row)
        tile.re[frame][row] = tile.im[frame][row] = 0.0f;
    }
    const int bin = first_bin + bin_row * (plane.nx / COMPACT_BIN) + first / COMPACT_BIN;
    for (int entry = first_of_bin[bin]; entry < first_of_bin[bin + 1]; ++entry) {
      const int index = bin_samples[entry];
      const CompactFootprint footprint = footprints[index];
      const int room_x = COMPACT_ROOM(footprint.columns), room_y = COMPACT_ROOM(footprint.rows);
      const int stride = 2 * (room_x + room_y);
      __global const float* middle_across = profiles + offsets[index] + room_x / 2;
      __global const float* middle_up = profiles + offsets[index] + 2 * room_x + room_y / 2;
      // The footprint may begin right of the work-item's columns or below its rows, or reach them
      // from the period before.
      int column = (first - footprint.left) % plane.nx, top = (tile.top - footprint.top) % plane.ny;
      column += column < 0 ? plane.nx : 0;
      top += top < 0 ? plane.ny : 0;
      for (int left = column; left > -RAYWAVE_LANES; left -= plane.nx) {
        if (left >= footprint.columns) continue;
        Part part;
        part.inside = (left + LANES_INDEX >= 0) & (left + LANES_INDEX < footprint.columns);
        part.room_x = room_x;
        part.room_y = room_y;
        part.stride = stride;
        part.phasors = phasors + index;
        part.sample_count = sample_count;
        for (int above = top; above > -RAYWAVE_TILE_ROWS; above -= plane.ny) {
          part.from = max(0, -above);
          part.to = min(RAYWAVE_TILE_ROWS, footprint.rows - above);
          if (part.from >= part.to) continue;
          part.across = middle_across + (left - footprint.columns / 2);
          part.up = middle_up + (above - footprint.rows / 2);
          int left_over = footprint.lines;
          for (; left_over >= 4; left_over -= 4) {
            add_lines(&part, 4, &tile);
            part.across += 4 * stride;
            part.up += 4 * stride;
          }
          if (left_over == 3) add_lines(&part, 3, &tile);
          if (left_over == 2) add_lines(&part, 2, &tile);
          if (left_over == 1) add_lines(&part, 1, &tile);
        }
      }
    }
    for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
      for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row) {
        __global float2* out = field +
                               ((size_t)frame * (size_t)plane.ny + (size_t)(tile.top + row)) *
                                   (size_t)plane.row_stride +
                               (size_t)first;
        floatv re = 0.0f, im = 0.0f;
        if (!is_fresh[first_fresh + bin_row]) load_complex(out, &re, &im);
        store_complex(re + tile.re[frame][row], im + tile.im[frame][row], out);
      }
    }
  }
}
