// SPDX-License-Identifier: Apache-2.0
// Breaks: places where a surface, seen from the hologram's centre, ends, folds or is too steep.
// Between them, every surface is a surface layer: each ray from the centre meets it once, and each
// ray from a point before it to the hologram moves away from it. Two things follow without any ray:
//
// - all rays through a cell without breaks meet the same surface layers as the ray through its
//   middle;
// - where no break lies in the way, the front one of the surface layers is seen from the whole
//   hologram, and what lies behind it from nowhere.
//
// In the way: with tangents x and y from the centre and the nearness q = 1 / depth, lines are
// straight, and the rays from a sample to the window's places w are (x, y) + w (q - q_sample). A
// break at nearness q may lie on one of them when it is within half the window times q - q_sample.
//
// breaks  nearness of the nearest break in each cell of the lattice, row by row, each row
//         BREAK_TILE * break_tiles_along(nx) cells long; 0: none
// tiles   the same of tiles of BREAK_TILE x BREAK_TILE cells
#ifndef RAYWAVE_BREAKS_H
#define RAYWAVE_BREAKS_H

#include "kernels/common/shared.h"

#define BREAK_TILE 8  // host/trace/samples.cpp

// Breaks are marked in cells that are wider by this on all sides. It covers the rounding of rays,
// and the distance of rays from the surface on which they start.
#define BREAK_MARGIN 0.05f

typedef struct {
  __global const float* cells;
  __global const float* tiles;
  int known;  // 0: there may be breaks everywhere
} Breaks;

static inline int break_tiles_along(int cells) { return (cells + BREAK_TILE - 1) / BREAK_TILE; }

// Places in the lattice, in cells, and the nearness of the farthest.
typedef struct {
  float left, right, bottom, top;
  float nearness;
} Places;

// Distance between two intervals; 0 when they overlap.
static inline float break_gap(float low, float high, float from, float to) {
  return fmax(fmax(from - high, low - to), 0.0f);
}

// True when a break in the cells [x, x + width) x [y, y + width) may lie in the way.
static inline bool break_in_way(const Lattice* lattice, const Places* at, float nearness, int x,
                                int y, int width) {
  const float rise = nearness - at->nearness, per_cell = 1.0f / lattice->step;
  return nearness > at->nearness &&
         break_gap(at->left, at->right, (float)x, (float)(x + width)) <=
             rise * (lattice->half_width * per_cell) + BREAK_MARGIN &&
         break_gap(at->bottom, at->top, (float)y, (float)(y + width)) <=
             rise * (lattice->half_height * per_cell) + BREAK_MARGIN;
}

// The same for a row of BREAK_TILE cells from (x, y) on.
static inline bool break_in_way_of_row(const Lattice* lattice, const Places* at,
                                       __global const float* row, int x, int y) {
  const float8 nearness = vload8(0, row + x), rise = nearness - at->nearness;
  const float8 low = (float)x + (float8)(0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f);
  const float8 gap = fmax(fmax(low - at->right, at->left - (low + 1.0f)), 0.0f);
  const float per_cell = 1.0f / lattice->step;
  return any((nearness > at->nearness) &
             (gap <= rise * (lattice->half_width * per_cell) + BREAK_MARGIN) &
             (break_gap(at->bottom, at->top, (float)y, (float)(y + 1)) <=
              rise * (lattice->half_height * per_cell) + BREAK_MARGIN));
}

// True when no break lies in the way from any of these places to the window. `closely`: cells are
// asked and not only tiles.
static inline bool unbroken(const Lattice* lattice, const Breaks* breaks, const Places* at,
                            bool closely) {
  if (!breaks->known) return false;
  const int tiles_x = break_tiles_along(lattice->nx), tiles_y = break_tiles_along(lattice->ny);
  // Nothing is nearer than near_z.
  const float rise =
      fmax(1.0f / (lattice->near_z - lattice->centre_z) - at->nearness, 0.0f) / lattice->step;
  const float reach_x = rise * lattice->half_width + 1.0f,
              reach_y = rise * lattice->half_height + 1.0f;
  const float width = 1.0f / (float)BREAK_TILE;
  const int left = max((int)((at->left - reach_x) * width), 0),
            right = (int)fmin((at->right + reach_x) * width, (float)(tiles_x - 1)),
            bottom = max((int)((at->bottom - reach_y) * width), 0),
            top = (int)fmin((at->top + reach_y) * width, (float)(tiles_y - 1));
  for (int j = bottom; j <= top; ++j) {
    for (int i = left; i <= right; ++i) {
      if (!break_in_way(lattice, at, breaks->tiles[j * tiles_x + i], BREAK_TILE * i, BREAK_TILE * j,
                        BREAK_TILE))
        continue;
      if (!closely) return false;
      for (int y = BREAK_TILE * j; y < BREAK_TILE * (j + 1); ++y) {
        __global const float* row = breaks->cells + (size_t)y * (size_t)(BREAK_TILE * tiles_x);
        if (break_in_way_of_row(lattice, at, row, BREAK_TILE * i, y)) return false;
      }
    }
  }
  return true;
}

// True when there is no break in a cell.
static inline bool unbroken_cell(const Lattice* lattice, const Breaks* breaks, int column,
                                 int row) {
  return breaks->known &&
         breaks->cells[(size_t)row * (size_t)(BREAK_TILE * break_tiles_along(lattice->nx)) +
                       (size_t)column] == 0.0f;
}

#endif
