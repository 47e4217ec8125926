// SPDX-License-Identifier: Apache-2.0
// The sample table: each point where a ray of the lattice (shared.h) pierces a surface is one
// source of light. All pixels that see a sample use the same position and phase, so that their sum
// is a spherical wave (docs/pipeline.md). With antialiasing, a sample shines from the centroid of
// the light that the rays through the parts of its cell meet.
//
// find_samples  samples of the cells of a band of `rows` rows from first_row on. counts[cell]:
//               number of samples of the cell (row by row), and how many of its first `slots`
//               samples are hidden from some part. mirrors[cell]: 0 where it has neither mirrors
//               nor glass, else 1 and the number of sources that it has met.
//               samples[cell * slots] and on: the samples; visibility_masks, lit: their masks of
//               VISIBILITY_WORDS and LIT_WORDS words
//               In colour, sample_colours: SAMPLE_COLOURS numbers of each, radiance and specular
//               in red, green and blue
//               Without lanes, lookouts: what look_around.cl needs to find out what samples see.
//               part_layers, part_from: what trace_parts has met
// trace_parts   without lanes, before find_samples: the layers that the rays through the parts of
//               cells meet, where these need rays of their own, and where the rays must go on
// pack_samples  the same samples without gaps: those of cell c go to packed[first_of_cell[c].x] and
//               on, after first_of_cell[c].y hidden ones
//
// show_laser    in colour: radiance and specular of samples for the hologram's laser, from their
//               colours; samples in mirrors and glass have theirs already
//
// visibility_masks  bit j * RAYWAVE_VISIBILITY_PARTS + i: the sample sees the middle of part (i, j)
//                   of the hologram's window, counted from the bottom left
// lit               bit l: light l falls on the sample
//
// find_samples handles RAYWAVE_LANES cells of one row per work-item. Global size: (ceil(nx /
// lanes), rows). OpenCL C 1.2.
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/samples/add_sample.h"
#include "kernels/samples/breaks.h"
#include "kernels/samples/lattice_rays.h"
#include "kernels/samples/options.h"
#include "kernels/samples/shade_samples.h"
#include "kernels/samples/surface_layers.h"
#include "kernels/samples/visibility.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/surface.h"

// How far a layer lies behind another, in biases of rays, to be behind it for certain.
#define BEHIND 16.0f

#if RAYWAVE_ANTIALIAS
// Hits of the rays through a packet's parts from the distances *from on. *from becomes the distance
// where rays that met as many layers as one traversal keeps must go on, and lattice->reach for all
// others.
CALLED void look_at_parts(const SceneArrays* scene, const Lattice* lattice, int column, int row,
                          int packet, floatv* from, PART_LAYERS* part_layers) {
#if RAYWAVE_LANES == 1
  Layers own_layers, *layers = &own_layers;
#else
  Layers* layers = part_layers;
#endif
  Rays rays = part_rays(lattice, column, row, packet, *from < lattice->reach);
  rays.t_min = *from;
  bvh_layers(&scene->tree, &rays, true, layers);
  const intv full = layers->triangle[BVH_LAYERS - 1] >= 0;
  *from =
      LANES_SELECT((floatv)(lattice->reach), layers->t[BVH_LAYERS - 1] + lattice->layer_gap, full);
  keep_sources(layers, scene, &rays, lattice->layer_gap);
#if RAYWAVE_LANES == 1
  *part_layers = own_layers;
#endif
}

#if RAYWAVE_LANES == 1
// Whether trace_parts traces the rays through the parts of a cell.
static inline bool traced_ahead(const Lattice* lattice, const Breaks* breaks, int column, int row) {
#if RAYWAVE_PARTS_DIFFER
  (void)lattice, (void)breaks, (void)column, (void)row;
  return true;
#else
  return !unbroken_cell(lattice, breaks, column, row);
#endif
}
#endif
#endif

#if RAYWAVE_ANTIALIAS
// Marks cells in which the rays through all parts meet the same layers as the centre ray: those
// without breaks and, where the centre ray and half of the parts' rays meet the same layers, those
// in which the other half would too. That half has rays in all four rows and columns, to find thin
// objects, and in the corners, to find edges. No cell is whole when parts differ in more than
// coverage.
CALLED void find_whole_cells(const SceneArrays* scene, const Lattice* lattice, const Breaks* breaks,
                             int first, int row, const Layers* centres, int* whole) {
  // A ray through an edge may meet both triangles of a surface layer: rays through the parts tell.
  intv twice = 0;
  for (int i = 0; i + 1 < BVH_LAYERS; ++i)
    twice |= (centres->triangle[i + 1] >= 0) &
             (centres->t[i + 1] - centres->t[i] < BEHIND * lattice->bias);
  int doubtful[RAYWAVE_LANES];
  LANES_STORE(twice, doubtful);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    whole[lane] = 0;
#if !RAYWAVE_PARTS_DIFFER
    whole[lane] =
        !doubtful[lane] && unbroken_cell(lattice, breaks, min(first + lane, lattice->nx - 1), row);
#endif
  }
#if RAYWAVE_ANTIALIAS == 4 && RAYWAVE_LANES >= 8 && !RAYWAVE_PARTS_DIFFER
  const float across[16] = {0, 3, 0, 3, 1, 2, 1, 2, 0, 3, 0, 3, 1, 2, 1, 2};
  const float up[16] = {0, 0, 3, 3, 2, 1, 0, 3, 0, 0, 3, 3, 2, 1, 0, 3};
  const floatv right = (0.5f + LANES_LOAD(across)) * 0.25f,
               upwards = (0.5f + LANES_LOAD(up)) * 0.25f;
  float t[BVH_LAYERS][RAYWAVE_LANES];
  int triangle[BVH_LAYERS][RAYWAVE_LANES];
  for (int i = 0; i < BVH_LAYERS; ++i) {
    LANES_STORE(centres->t[i], t[i]);
    LANES_STORE(centres->triangle[i], triangle[i]);
  }
  for (int lane = 0; lane < RAYWAVE_LANES; lane += RAYWAVE_LANES / 8) {
    if (whole[lane] && whole[lane + RAYWAVE_LANES / 8 - 1]) continue;
    const intv of_lane = LANES_INDEX / 8;  // cells from `lane` on
    const Rays rays = lattice_rays(
        lattice,
        (LANES_TO_FLOAT(lattice->first_x + first + lane + of_lane) + right) * lattice->step,
        ((float)(lattice->first_y + row) + upwards) * lattice->step, LANES_INDEX >= 0);
    Layers parts;
    bvh_layers(&scene->tree, &rays, true, &parts);
    intv differ = parts.triangle[BVH_LAYERS - 1] >= 0;
    for (int i = 0; i < BVH_LAYERS; ++i) {
      const floatv at = LANES_SELECT((floatv)(t[i][lane]),
                                     (floatv)(t[i][lane + RAYWAVE_LANES / 8 - 1]), of_lane == 1);
      const intv hit =
          LANES_SELECT((intv)(triangle[i][lane]), (intv)(triangle[i][lane + RAYWAVE_LANES / 8 - 1]),
                       of_lane == 1) >= 0;
      const intv met = parts.triangle[i] >= 0;
      if (!LANES_ANY(hit | met)) break;
      const floatv reach = 4.0f * lattice->step * fabs(at + (lattice->near_z - lattice->eye_z));
      differ |= (hit != met) | (hit & (fabs(parts.t[i] - at) >= reach));
    }
    int differs[RAYWAVE_LANES];
    LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), differ), differs);
    for (int cell = 0; cell < RAYWAVE_LANES / 8; ++cell) {
      int differing = 0;
      for (int i = 8 * cell; i < 8 * (cell + 1); ++i) differing |= differs[i];
      whole[lane + cell] |= !differing;
    }
  }
#else
  (void)scene, (void)lattice, (void)breaks, (void)first, (void)row, (void)centres;
#endif
}
#endif

// The place of a sample of a centre ray, t from where the ray starts.
static inline Places place_of(const Lattice* lattice, int column, int row, float t) {
  Places place;
  place.left = place.right = (float)column + 0.5f;
  place.bottom = place.top = (float)row + 0.5f;
  place.nearness = 1.0f / (t + (lattice->near_z - lattice->eye_z) + 0.5f * BEHIND * lattice->bias);
  return place;
}

// Visibility of the samples of the centre rays, by layer and lane: SEEN_UNBROKEN or 0 where no
// breaks lie in their way, else the results of look_around_four.
CALLED void look_around_centres(const SceneArrays* scene, const Lattice* lattice,
                                const Breaks* breaks, int first, int row, const Rays* centres,
                                const Layers* layers, OccluderCache* occluder_cache,
                                int (*seen)[RAYWAVE_LANES]) {
  for (int i = 0; i < BVH_LAYERS; ++i) {
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane) seen[i][lane] = SEEN_UNKNOWN;
  }
#if RAYWAVE_VISIBILITY_PARTS > 0
  float front[RAYWAVE_LANES];  // distances of the nearest layers
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) front[lane] = lattice->reach;
  int rank = 0;
  for (int i = 0; i < BVH_LAYERS; ++i) {
    const Hits hits = {layers->t[i], layers->triangle[i], layers->u[i], layers->v[i]};
    if (!LANES_ANY(hits.triangle >= 0)) continue;
    float t[RAYWAVE_LANES];
    int triangle[RAYWAVE_LANES];
    LANES_STORE(hits.t, t);
    LANES_STORE(hits.triangle, triangle);

    // All lanes together, then each
    float farthest = 0.0f;
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane)
      farthest = triangle[lane] >= 0 ? fmax(farthest, t[lane]) : farthest;
    Places all = place_of(lattice, first, row, farthest);
    all.right += (float)(RAYWAVE_LANES - 1);
    const bool open = RAYWAVE_LANES > 1 && unbroken(lattice, breaks, &all, false);
    bool asks_rays = false;
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
      if (triangle[lane] < 0) continue;
      const bool in_front = front[lane] == lattice->reach;
      front[lane] = fmin(front[lane], t[lane]);
      const Places place = place_of(lattice, first + lane, row, t[lane]);
      if ((in_front || t[lane] - front[lane] > BEHIND * lattice->bias) &&
          (open || unbroken(lattice, breaks, &place, true)))
        seen[i][lane] = in_front ? SEEN_UNBROKEN : 0;
      else
        asks_rays = true;
    }
#if RAYWAVE_LANES > 1
    if (asks_rays) {
      const Surface s = surface_at(scene, centres, &hits);
      float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES], nx[RAYWAVE_LANES],
          ny[RAYWAVE_LANES], nz[RAYWAVE_LANES];
      LANES_STORE(s.x, x);
      LANES_STORE(s.y, y);
      LANES_STORE(s.z, z);
      LANES_STORE(SIDE_X(&s), nx);
      LANES_STORE(SIDE_Y(&s), ny);
      LANES_STORE(SIDE_Z(&s), nz);
      for (int four = 0; four < RAYWAVE_LANES; four += 4) {
        bool together = true, unknown = false;
        for (int lane = four; lane < four + 4; ++lane) {
          together &=
              triangle[lane] >= 0 && fabs(t[lane] - t[four]) < layer_reach(lattice, t[four]);
          unknown |= seen[i][lane] == SEEN_UNKNOWN;
        }
        if (!together || !unknown) continue;
        const int all_four =
            look_around_four(scene, lattice, x + four, y + four, z + four, nx + four, ny + four,
                             nz + four, occluder_cache + min(rank, OCCLUDER_CACHES - 1));
        for (int lane = four; lane < four + 4; ++lane) {
          if (seen[i][lane] == SEEN_UNKNOWN) seen[i][lane] = all_four;
        }
      }
    }
#else
    (void)asks_rays;
#endif
    ++rank;
  }
#if RAYWAVE_LANES == 1
  (void)scene, (void)centres, (void)occluder_cache;
#endif
#else
  (void)scene, (void)lattice, (void)breaks, (void)first, (void)row, (void)centres, (void)layers,
      (void)occluder_cache;
#endif
}

// Rays through the middles of a packet's cells, and what they meet.
typedef struct {
  Rays rays;
  Layers layers;                        // all that they meet
  Layers sources;                       // those that may be samples
  int seen[BVH_LAYERS][RAYWAVE_LANES];  // of the sources: look_around_centres
#if RAYWAVE_LANES > 1
  Shaded shaded[BVH_LAYERS];  // likewise
#endif
} Centres;

// Visibility and radiance of the sources of all lanes together, where they agree.
static inline void shade_centres(const SceneArrays* scene, const Lattice* lattice,
                                 const Breaks* breaks, int first, int row, int keeps_unseen,
                                 OccluderCache* occluder_cache, Centres* centres) {
  look_around_centres(scene, lattice, breaks, first, row, &centres->rays, &centres->sources,
                      occluder_cache, centres->seen);
#if RAYWAVE_LANES > 1
  const Layers* sources = &centres->sources;
  for (int i = 0; i < BVH_LAYERS; ++i) {
    intv wanted = sources->triangle[i] >= 0;
    if (!keeps_unseen) wanted &= LANES_LOAD(centres->seen[i]) != 0;
    if (!LANES_ANY(wanted)) continue;
    const Hits hits = {sources->t[i], LANES_SELECT((intv)(-1), sources->triangle[i], wanted),
                       sources->u[i], sources->v[i]};
    shade(scene, lattice, &centres->rays, &hits, first + LANES_INDEX, row, centres->shaded + i);
  }
#else
  (void)keeps_unseen;
#endif
}

// Rays through the parts of cells.
typedef struct {
  int whole[RAYWAVE_LANES];  // cells whose parts need no rays of their own
#if RAYWAVE_ANTIALIAS
#if RAYWAVE_LANES == 1
  PART_LAYERS* layers;  // that no sample has claimed
  bool traced;          // traced_ahead
#else
  Layers layers[PACKETS];
#endif
  floatv from[PACKETS];   // where the rays go on
  floatv edges[PACKETS];  // find_edges
#if CELLS_OF_PACKET > 1
  Layers shared_layers;  // of all cells of the only packet
  floatv shared_from;
#endif
#endif
} CellParts;

#if RAYWAVE_ANTIALIAS
// Traces the rays through a cell's parts, those of `again` from where they have to go on.
static inline void look_at_cell(const SceneArrays* scene, const Lattice* lattice, int lane,
                                int packet_column, int row, bool again, CellParts* parts) {
  bool all_whole = true;  // of the cells that share packets with this one, from it on
  for (int cell = lane; cell == lane || cell % CELLS_OF_PACKET != 0; ++cell)
    all_whole &= parts->whole[cell];
#if RAYWAVE_LANES == 1
  if (!again && parts->traced) return;
#endif
  for (int packet = 0; packet < PACKETS; ++packet) {
    const bool traces = again
                            ? !parts->whole[lane] && LANES_ANY(parts->from[packet] < lattice->reach)
                            : !all_whole && lane % CELLS_OF_PACKET == 0;
    if (!again) parts->from[packet] = 0.0f;
    if (traces)
      look_at_parts(scene, lattice, packet_column, row, packet, parts->from + packet,
                    parts->layers + packet);
#if CELLS_OF_PACKET > 1
    // Each cell takes its own parts of the only packet.
    if (again) continue;
    if (traces) {
      parts->shared_layers = parts->layers[0];
      parts->shared_from = parts->from[0];
    }
    const intv mine = LANES_INDEX / PARTS == lane % CELLS_OF_PACKET;
    parts->layers[0] = parts->shared_layers;
    for (int i = 0; i < BVH_LAYERS; ++i)
      parts->layers[0].triangle[i] = LANES_SELECT((intv)(-1), parts->layers[0].triangle[i], mine);
    parts->from[0] = LANES_SELECT((floatv)(lattice->reach), parts->shared_from, mine);
#endif
  }
}
#endif

// Hit `number` of a cell, with its ray's tangents: those of the centre ray's layers, some of which
// have none, then those of parts that belong to none of these. False after the last.
static inline bool hit_of_cell(const Lattice* lattice, const Layers* centre, const CellParts* parts,
                               int number, int lane, int column, int row, int packet_column,
                               Hit* hit, float* dx, float* dy) {
  *dx = ((float)(lattice->first_x + column) + 0.5f) * lattice->step;
  *dy = ((float)(lattice->first_y + row) + 0.5f) * lattice->step;
  if (number < BVH_LAYERS) {
    *hit = hit_of_lane(centre, number, lane);
    return true;
  }
#if RAYWAVE_ANTIALIAS
  const int ray = parts->whole[lane] ? -1 : unclaimed(parts->layers, hit);
  if (ray < 0) return false;
  const Rays rays = part_rays(lattice, packet_column, row, ray / RAYWAVE_LANES, LANES_INDEX >= 0);
  float all_dx[RAYWAVE_LANES], all_dy[RAYWAVE_LANES];
  LANES_STORE(rays.dx, all_dx);
  LANES_STORE(rays.dy, all_dy);
  *dx = all_dx[ray % RAYWAVE_LANES];
  *dy = all_dy[ray % RAYWAVE_LANES];
  return true;
#else
  (void)parts, (void)packet_column;
  return false;
#endif
}

// Adds the samples of the cell of a lane: one for each layer of its centre ray, then one for each
// layer that only its parts show. Rays that have met as many layers as one traversal keeps are
// traced again behind them. Kernels are inlined whole: what takes long to compile stands here once.
static inline void add_samples(const SceneArrays* scene, const Lattice* lattice, int first, int row,
                               int lane, const Centres* centres, CellParts* parts, Cell* cell) {
  const int column = first + lane;
  const Layers* layers = &centres->sources;
  Hit last = hit_of_lane(&centres->layers, BVH_LAYERS - 1, lane);
  Hits claimed[PACKETS];
  Shaded shaded_one;
  Layers further_layers;
  bool more = true;
  for (bool again = false; more; again = true) {
    more = false;
#if RAYWAVE_ANTIALIAS
    look_at_cell(scene, lattice, lane, cell->packet_column, row, again, parts);
    const bool whole = parts->whole[lane];
    if (!whole)
      find_edges(scene, lattice, parts->layers, layers, lane, column, row, cell->packet_column,
                 parts->edges);
#endif
    Hit hit;
    float dx, dy;
    for (int number = 0; hit_of_cell(lattice, layers, parts, number, lane, column, row,
                                     cell->packet_column, &hit, &dx, &dy);
         ++number) {
      if (hit.triangle < 0) continue;
      int covered = PARTS;
#if RAYWAVE_ANTIALIAS
      if (!whole) {
        const SurfaceLayer surface_layer =
            surface_layer_of(scene, lattice, &hit, dx, dy, cell->packet_column, row);
        covered = claim(scene, lattice, parts->layers, parts->edges, &surface_layer, claimed);
      }
#endif
      const bool is_known = number < BVH_LAYERS && !again;
      const int seen_parts = is_known ? centres->seen[number][lane] : SEEN_UNKNOWN;
      const bool is_shaded = is_known && RAYWAVE_LANES > 1;
      const bool is_wanted = cell->keeps_unseen || seen_parts != 0;
      if (!is_shaded && is_wanted)
        shade_one(scene, lattice, &hit, dx, dy, column, row, &shaded_one);
#if RAYWAVE_LANES > 1
      const Shaded* of_hit = is_shaded ? centres->shaded + number : &shaded_one;
#else
      const Shaded* of_hit = &shaded_one;
#endif
      add_sample(scene, lattice, column, row, &hit, dx, dy, claimed, covered, seen_parts, of_hit,
                 is_shaded ? lane : 0, cell);
    }
#if RAYWAVE_ANTIALIAS
    for (int packet = 0; packet < PACKETS && !whole; ++packet)
      more |= LANES_ANY(parts->from[packet] < lattice->reach);
#endif
    if (last.triangle >= 0) {
      Rays further = centre_rays(lattice, first, row, LANES_INDEX == lane);
      further.t_min = last.t + lattice->layer_gap;
      bvh_layers(&scene->tree, &further, true, &further_layers);
      last = hit_of_lane(&further_layers, BVH_LAYERS - 1, lane);
      keep_sources(&further_layers, scene, &centres->rays, lattice->layer_gap);
      layers = &further_layers;
      more = true;
    } else if (more) {
      for (int i = 0; i < BVH_LAYERS; ++i) further_layers.triangle[i] = -1;
      layers = &further_layers;
    }
  }
}

__kernel void find_samples(SCENE_PARAMETERS, Lattice lattice, int breaks_known,
                           __global const float* break_cells, __global const float* break_tiles,
                           int first_row, int rows, int slots, int keeps_unseen,
                           __global int2* counts, __global int* mirrors, __global Sample* samples,
                           __global uint* visibility_masks, __global uint* lit,
                           __global float* sample_colours, __global Lookout* lookouts,
                           __global float* part_layers, __global const float* part_from) {
#if RAYWAVE_COLOURS == 1
  (void)sample_colours;
#endif
#if RAYWAVE_LANES > 1
  (void)lookouts;
#endif
#if RAYWAVE_LANES > 1 || !RAYWAVE_ANTIALIAS
  (void)part_layers, (void)part_from;
#endif
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  if (first >= lattice.nx || (int)get_global_id(1) >= rows) return;
  const int band_row = row_in_turn((int)get_global_id(1), rows), row = first_row + band_row;
  if (row >= lattice.ny) return;
  const SceneArrays scene = SCENE_OF_PARAMETERS;
  const Breaks breaks = {break_cells, break_tiles, breaks_known};

  Centres centres;
  centres.rays = centre_rays(&lattice, first, row, LANES_INDEX >= 0);
  bvh_layers(&scene.tree, &centres.rays, true, &centres.layers);
  CellParts parts;
#if RAYWAVE_ANTIALIAS
#if RAYWAVE_LANES == 1
  const size_t first_part = ((size_t)band_row * (size_t)lattice.nx + (size_t)first) * PARTS;
  parts.layers = (PART_LAYERS*)part_layers + first_part;
  parts.traced = traced_ahead(&lattice, &breaks, first, row);
  for (int part = 0; part < PARTS && parts.traced; ++part)
    parts.from[part] = part_from[first_part + (size_t)part];
#endif
  find_whole_cells(&scene, &lattice, &breaks, first, row, &centres.layers, parts.whole);
#if CELLS_OF_PACKET > 1
  parts.shared_from = 0.0f;
#endif
#endif
  OccluderCache occluder_cache[OCCLUDER_CACHES];
  for (int rank = 0; rank < OCCLUDER_CACHES; ++rank) {
    for (int i = 0; i < 16; ++i) occluder_cache[rank].triangle[i] = -1;
  }
  centres.sources = centres.layers;
  keep_sources(&centres.sources, &scene, &centres.rays, lattice.layer_gap);
  shade_centres(&scene, &lattice, &breaks, first, row, keeps_unseen, occluder_cache, &centres);

  for (int lane = 0; lane < RAYWAVE_LANES && first + lane < lattice.nx; ++lane) {
    const int column = first + lane;
    const size_t place = (size_t)band_row * (size_t)lattice.nx + (size_t)column;
    Cell cell = {
      samples + place * (size_t)slots,
      visibility_masks + place * (size_t)slots * VISIBILITY_WORDS,
      lit + place * (size_t)slots * LIT_WORDS,
#if RAYWAVE_COLOURS > 1
      sample_colours + place * (size_t)slots * SAMPLE_COLOURS,
#endif
#if RAYWAVE_LANES == 1
      lookouts + place * (size_t)slots,
#endif
      slots,
      keeps_unseen,
      0,
      0,
      0,
      0,
      column - lane % CELLS_OF_PACKET,
      occluder_cache
    };
    add_samples(&scene, &lattice, first, row, lane, &centres, &parts, &cell);
    counts[place] = (int2)(cell.count, cell.hidden);
    mirrors[place] = cell.mirrors ? 1 + cell.rank : 0;
  }
}

#if RAYWAVE_LANES == 1 && RAYWAVE_ANTIALIAS
// One work-item per part of a cell of a band.
__kernel void trace_parts(SCENE_PARAMETERS, Lattice lattice, int breaks_known,
                          __global const float* break_cells, __global const float* break_tiles,
                          int first_row, int rows, __global float* part_layers,
                          __global float* part_from) {
  const size_t place = get_global_id(0), cell = place / PARTS;
  const int column = (int)(cell % (size_t)lattice.nx),
            row = first_row + (int)(cell / (size_t)lattice.nx);
  if (row >= min(first_row + rows, lattice.ny)) return;
  const Breaks breaks = {break_cells, break_tiles, breaks_known};
  if (!traced_ahead(&lattice, &breaks, column, row)) return;
  const SceneArrays scene = SCENE_OF_PARAMETERS;
  float from = 0.0f;
  look_at_parts(&scene, &lattice, column, row, (int)(place % PARTS), &from,
                (PART_LAYERS*)part_layers + place);
  part_from[place] = from;
}
#endif

// One work-item per cell of a band.
__kernel void pack_samples(__global const int2* counts, __global const int2* first_of_cell,
                           int cell_count, int slots, __global const Sample* samples,
                           __global const uint* visibility_masks, __global const uint* lit,
                           __global const float* sample_colours, __global Sample* packed,
                           __global uint* packed_visibility, __global uint* packed_lit,
                           __global float* packed_colours) {
#if RAYWAVE_COLOURS == 1
  (void)sample_colours, (void)packed_colours;
#endif
  const int cell = (int)get_global_id(0);
  if (cell >= cell_count) return;
  const size_t from = (size_t)cell * (size_t)slots, to = (size_t)first_of_cell[cell].x;
  int profile = first_of_cell[cell].x + (PLANE_WAVE_PARTS - 1) * first_of_cell[cell].y;
  for (size_t i = 0; i < (size_t)counts[cell].x; ++i) {
    Sample sample = samples[from + i];
    sample.profile = profile;
    profile += sample.hidden ? PLANE_WAVE_PARTS : 1;
    packed[to + i] = sample;
    for (int w = 0; w < VISIBILITY_WORDS; ++w)
      packed_visibility[(to + i) * VISIBILITY_WORDS + w] =
          visibility_masks[(from + i) * VISIBILITY_WORDS + w];
    for (int w = 0; w < LIT_WORDS; ++w)
      packed_lit[(to + i) * LIT_WORDS + w] = lit[(from + i) * LIT_WORDS + w];
#if RAYWAVE_COLOURS > 1
    for (size_t k = 0; k < SAMPLE_COLOURS; ++k)
      packed_colours[(to + i) * SAMPLE_COLOURS + k] =
          sample_colours[(from + i) * SAMPLE_COLOURS + k];
#endif
  }
}

#if RAYWAVE_COLOURS > 1
// One work-item per sample. A laser cannot take light away: less than none is none.
__kernel void show_laser(__global const float* colours, SceneLight light, int count,
                         __global Sample* samples) {
  const int index = (int)get_global_id(0);
  if (index >= count) return;
  __global Sample* sample = samples + index;
  if (sample->path >= 0) return;
  __global const float *radiance = colours + (size_t)index * SAMPLE_COLOURS,
                       *specular = radiance + RAYWAVE_COLOURS;
  sample->radiance = fmax(
      light.laser[0] * radiance[0] + light.laser[1] * radiance[1] + light.laser[2] * radiance[2],
      0.0f);
  sample->specular = fmax(
      light.laser[0] * specular[0] + light.laser[1] * specular[1] + light.laser[2] * specular[2],
      0.0f);
}
#endif
