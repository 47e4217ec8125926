// SPDX-License-Identifier: Apache-2.0
// Samples that the hologram sees in mirrors and through glass (docs/pipeline.md#mirrors-and-glass).
// A ray of the lattice goes on from mirrors and clear surfaces; where it meets a surface that
// shines, that light is one sample. Its wave is that of a virtual point, on the ray's line and at
// the mean radius of curvature that the wavefront has at the window's centre, with the light of the
// ray's cell. With RAYWAVE_PATHS, the rest of the path over the window is a polynomial, and so is
// the amplitude (path_layout.h).
//
// find_paths  samples of the cells cells[i].x of the lattice, each with room for `slots`.
//             cells[i].y is the number of sources that find_samples has met in the cell.
//             counts[i]: number of samples, and how many of the first `slots` are hidden from some
//             part. The samples, their visibility masks and their paths begin at i * slots
// pack_paths  the same samples without gaps: from packed[first[i].x] on, after first[i].y hidden
//             ones; their paths from packed_paths[first[i].z] on
//
// All rays of a cell that meet the same sequence of surfaces are followed together, a packet of
// RAYWAVE_LANES rays at a time. fit: path_layout.h. nearest_image, farthest_before,
// farthest_beyond: depths between which virtual points are kept, negative before the hologram; 0:
// none are on that side. Rays start before the whole scene. folded_image: the depth of those near
// caustics. OpenCL C 1.2.
#include "kernels/common/hash.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/samples/chief_path.h"
#include "kernels/samples/fit_path.h"
#include "kernels/samples/lattice_rays.h"
#include "kernels/samples/options.h"
#include "kernels/samples/path_layout.h"
#include "kernels/samples/ray_bundles.h"
#include "kernels/samples/specular_path.h"
#include "kernels/samples/visibility.h"
#include "kernels/scene/bvh.h"

#if RAYWAVE_BOUNCES > 0
#define LIT_WORDS (RAYWAVE_LIGHTS > 32 ? (RAYWAVE_LIGHTS + 31) / 32 : 1)

// A path that carries less of the light ends.
#define LEAST_SHARE 1e-3f

// Bundles that wait to be followed, at most; those beyond are left out. The last one is followed
// first and adds two for each surface layer that it meets
#define MOST_WAITING (RAYWAVE_BOUNCES + 6)

// Tangents of the rays through a packet's parts.
static inline void part_tangents(const Lattice* lattice, int column, int row, int packet,
                                 floatv* tangent_x, floatv* tangent_y, intv* active) {
#if RAYWAVE_ANTIALIAS
  floatv right, upwards;
  part_places(packet, &right, &upwards);
  *active = packet * RAYWAVE_LANES + LANES_INDEX < PARTS;
#else
  const floatv right = 0.5f, upwards = 0.5f;
  (void)packet;
  *active = LANES_INDEX == 0;
#endif
  *tangent_x = (LANES_TO_FLOAT((intv)(lattice->first_x + column)) + right) * lattice->step;
  *tangent_y = (LANES_TO_FLOAT((intv)(lattice->first_y + row)) + upwards) * lattice->step;
}

// The sample of a path: its virtual point.
static inline Sample sample_of_path(const Lattice* lattice, const ChiefPath* chief, float radiance,
                                    uint key, int parts_seen) {
  const float depth = chief->distance / sqrt(1.0f + chief->tangent_x * chief->tangent_x +
                                             chief->tangent_y * chief->tangent_y);
  Sample sample;
  sample.x = lattice->centre_x + chief->tangent_x * depth;
  sample.y = lattice->centre_y + chief->tangent_y * depth;
  sample.z = lattice->centre_z + depth;
  sample.nx = chief->face.x;
  sample.ny = chief->face.y;
  sample.nz = chief->face.z;
  sample.weight = fabs(depth) / lattice->full_z;
  sample.radiance = radiance;
  sample.specular = 0.0f;
  sample.shininess = 0.0f;
  sample.tilt_x = chief->slope_x * depth;
  sample.tilt_y = chief->slope_y * depth;
  sample.tilt_z = -(sample.tilt_x * chief->tangent_x + sample.tilt_y * chief->tangent_y) - 1.0f;
  sample.key = key;
  sample.triangle = LANES_FIRST(chief->hits.triangle);
  sample.hidden = parts_seen < VISIBILITY_ALL;
  sample.profile = 0;
  sample.path = -1;
  return sample;
}

#if RAYWAVE_PATHS
// Puts the virtual point of a path at a depth.
static inline void shine_from(ChiefPath* chief, float depth) {
  chief->distance = depth * sqrt(1.0f + chief->tangent_x * chief->tangent_x +
                                 chief->tangent_y * chief->tangent_y);
  chief->turn[0] = chief->turn[3] = -1.0f / depth;
  chief->turn[1] = chief->turn[2] = 0.0f;
}

// Light of a path's source towards the path, highlights included; 0 where the material has none.
static inline float own_light_of(const SceneArrays* scene, const Lattice* lattice,
                                 const BundleLayer* surface_layer, const ChiefPath* chief,
                                 uint key) {
  __global const Material* material = scene->materials + surface_layer->material;
  bool shines = false;
#if RAYWAVE_HIGHLIGHTS > 0
  shines = (material->kind & MATERIAL_METALLIC) != 0;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) shines |= material->specular[k] > 0.0f;
#endif
  (void)material;
  if (!shines) return 0.0f;
  const float3 first = vector_first(chief->toward);
  const Vector toward = vector_of((floatv)(first.x), (floatv)(first.y), (floatv)(first.z));
  return LANES_FIRST(light_of_source(scene, lattice, chief, toward, LANES_INDEX >= 0, key));
}
#endif

#define NODES_TELL (RAYWAVE_PATHS && RAYWAVE_VISIBILITY_PARTS > 0 && SIXTEEN_TELL)

// Tangents of the ray which has found a surface layer.
static inline void finder_tangents(const Lattice* lattice, const BundleLayer* surface_layer,
                                   const PathCell* cell, float* tangent_x, float* tangent_y) {
  floatv xs, ys;
  intv active;
  part_tangents(lattice, cell->column, cell->row, surface_layer->ray / RAYWAVE_LANES, &xs, &ys,
                &active);
  float x[RAYWAVE_LANES], y[RAYWAVE_LANES];
  LANES_STORE(xs, x);
  LANES_STORE(ys, y);
  *tangent_x = x[surface_layer->ray % RAYWAVE_LANES];
  *tangent_y = y[surface_layer->ray % RAYWAVE_LANES];
}

// Sums over all rays, and over those that nothing stops: rays, light, moments. Rays that something
// else stops on their way count only where it stops the path of the sample itself, since the
// visibility mask tells that then.
static inline void sum_light(const SceneArrays* scene, const Lattice* lattice, const Bundle* bundle,
                             const Met* met, const Hits* claimed, const PathCell* cell,
                             float (*sums)[4]) {
  for (int k = 0; k < 4; ++k) sums[0][k] = sums[1][k] = 0.0f;
  for (int packet = 0; packet < PACKETS; ++packet) {
    const Followed* f = bundle->rays + packet;
    const Hits* hits = claimed + packet;
    const intv found = hits->triangle >= 0;
    if (!LANES_ANY(found)) continue;
    floatv tangent_x, tangent_y;
    intv active;
    part_tangents(lattice, cell->column, cell->row, packet, &tangent_x, &tangent_y, &active);
    const Rays rays = rays_of_followed(f, lattice->reach, found);
    const floatv lights =
        LANES_SELECT((floatv)(0.0f),
                     light_of_hits(scene, lattice, &rays, hits, PLACE_OF_PART(packet, cell)) *
                         f->share * attenuated_share(f->attenuation, hits->t),
                     found);
    const intv free = found & f->first & (hits->t <= met->nearest[packet]);
    for (int kind = 0; kind < 2; ++kind) {
      const intv counts = kind == 0 ? found : free;
      const floatv light = LANES_SELECT((floatv)(0.0f), lights, counts);
      sums[kind][0] += (float)lanes_sum(LANES_SELECT((intv)(0), (intv)(1), counts));
      sums[kind][1] += lanes_float_sum(light);
      sums[kind][2] += lanes_float_sum(light * tangent_x);
      sums[kind][3] += lanes_float_sum(light * tangent_y);
    }
  }
}

// Adds the sample of a surface layer that shines.
CALLED void add_path(const SceneArrays* scene, const Lattice* lattice,
                     const BundleLayer* surface_layer, const Bundle* bundle, const Met* met,
                     const Hits* claimed, PathCell* cell) {
  const Sequence* sequence = &bundle->sequence;
  uint keys[RAYWAVE_LANES];
  LANES_STORE(cell_key((intv)(lattice->first_x + cell->column),
                       (intv)(lattice->first_y + cell->row), (intv)(cell->rank)),
              keys);
  ++cell->rank;

  float sums[2][4];
  sum_light(scene, lattice, bundle, met, claimed, cell, sums);
  // The path through the centroid; where it misses the surface layer, that of the ray which has
  // found it
  ChiefPath chief;
  const int free = sums[1][1] > 0.0f;
  if (!(sums[0][1] > 0.0f)) return;
  bool is_found = find_chief(scene, lattice, cell, sequence, surface_layer,
                             sums[free][2] / sums[free][1], sums[free][3] / sums[free][1], &chief);
  if (!is_found) {
    float x, y;
    finder_tangents(lattice, surface_layer, cell, &x, &y);
    is_found = find_chief(scene, lattice, cell, sequence, surface_layer, x, y, &chief);
  }
  if (!is_found) return;
  const int kind = chief.first && free;
  // Nodes of a fitted path that all see the source stand for all parts of the window.
  const bool nodes_tell = NODES_TELL ? chief.first : false;
  bool clear = nodes_tell;
  uint visibility[VISIBILITY_WORDS];
  int parts_seen = 0;
  if (!nodes_tell) {
    parts_seen = look_along(scene, lattice, sequence, &chief, false, 0, visibility);
    if (parts_seen == 0 && !(RAYWAVE_PATHS && chief.first)) return;
  }

  SamplePath path;
  path.source[0] = chief.source.x;
  path.source[1] = chief.source.y;
  path.source[2] = chief.source.z;
  for (int term = 0; term < PATH_TERMS; ++term) path.rest[term] = 0.0f;
  for (int term = 0; term < PATH_AMPLITUDE_TERMS; ++term) path.amplitude[term] = term == 0;
#if RAYWAVE_PATHS
  const float light = own_light_of(scene, lattice, surface_layer, &chief, keys[0]);
  const bool shines = light > 0.0f;
  const int fit = fit_path(scene, lattice, cell, sequence, &chief, keys[0], shines ? light : 1.0f,
                           shines, &path, &clear);
  if (clear && fit != PATH_FOLDED)
    parts_seen = see_all(visibility);
  else if (nodes_tell && fit != PATH_FOLDED)
    parts_seen = look_along(scene, lattice, sequence, &chief, true, 0, visibility);
  if (fit == PATH_FOLDED) {
    // A picture of what the window's centre sees, bright wherever a place of the window sees the
    // surface layer at all. Places see its points as densely as the centre, so it is as bright
    shine_from(&chief, cell->folded_image);
    parts_seen = look_along(scene, lattice, sequence, &chief, false, surface_layer, visibility);
  }
#endif
  if (parts_seen == 0) return;

  Sample sample =
      sample_of_path(lattice, &chief, sums[kind][1] / (float)PARTS, keys[0], parts_seen);
#if RAYWAVE_PATHS
  // The polynomial of the amplitude holds how the source turns.
  if (fit != PATH_MISSED) {
    sample.tilt_x = sample.tilt_y = 0.0f;
    sample.tilt_z = -1.0f;
  }
#endif
  const int slot = cell->count++;
  if (slot >= cell->slots) return;
  cell->hidden += sample.hidden;
  for (int w = 0; w < VISIBILITY_WORDS; ++w)
    cell->visibility_masks[slot * VISIBILITY_WORDS + w] = visibility[w];
  cell->samples[slot] = sample;
  cell->paths[slot] = path;
}

// Whether any part of the window sees a surface layer along the sequence. Whatever lies behind one
// that none sees is hidden too.
CALLED bool is_seen(const SceneArrays* scene, const Lattice* lattice,
                    const BundleLayer* surface_layer, const Bundle* bundle, const Met* met,
                    const Hits* claimed, const PathCell* cell) {
  for (int packet = 0; packet < PACKETS; ++packet)
    if (LANES_ANY((claimed[packet].triangle >= 0) & bundle->rays[packet].first &
                  (claimed[packet].t <= met->nearest[packet])))
      return true;
  float x, y;
  finder_tangents(lattice, surface_layer, cell, &x, &y);
  ChiefPath chief;
  uint visibility[VISIBILITY_WORDS];
  return find_chief(scene, lattice, cell, &bundle->sequence, surface_layer, x, y, &chief) &&
         look_along(scene, lattice, &bundle->sequence, &chief, false, 0, visibility) > 0;
}

// Adds the bundles that go on from a surface layer to those that wait.
CALLED void add_bundles(const SceneArrays* scene, const Lattice* lattice,
                        const BundleLayer* surface_layer, const Bundle* bundle, const Hits* claimed,
                        Bundle* waiting, int* count) {
  for (int refracts = 0; refracts < 2; ++refracts) {
    if (*count >= MOST_WAITING) return;
    Bundle* next = waiting + *count;
    float share = 0.0f;  // mean over the cell's rays
    for (int packet = 0; packet < PACKETS; ++packet) {
      Followed* f = next->rays + packet;
      *f = bundle->rays[packet];
      f->first &= claimed[packet].triangle >= 0;
      f->found &= claimed[packet].triangle >= 0;
      if (!LANES_ANY(f->found)) continue;
      SpecularSurface surface;
      specular_surface(scene, f, claimed + packet, &surface);
      turn_at(&surface, claimed + packet, refracts != 0, lattice->bias, f, 0);
      share += lanes_float_sum(LANES_SELECT((floatv)(0.0f), f->share, f->found));
    }
    if (!(share >= LEAST_SHARE * (float)PARTS)) continue;
    next->sequence = bundle->sequence;
    next->sequence.material[next->sequence.length] = surface_layer->material;
    next->sequence.refracts |= (uint)refracts << next->sequence.length;
    ++next->sequence.length;
    ++*count;
  }
}

__kernel void find_paths(SCENE_PARAMETERS, Lattice lattice, float nearest_image,
                         float farthest_before, float farthest_beyond, float folded_image,
                         __global const float* fit, __global const int2* cells, int cell_count,
                         int slots, __global int2* counts, __global Sample* samples,
                         __global uint* visibility_masks, __global SamplePath* paths) {
  const int number = (int)get_global_id(0);
  if (number >= cell_count) return;
  const SceneArrays scene = SCENE_OF_PARAMETERS;
  const size_t first = (size_t)number * (size_t)slots;
  PathCell cell = {samples + first,
                   visibility_masks + first * VISIBILITY_WORDS,
                   paths + first,
                   fit,
                   slots,
                   0,
                   0,
                   cells[number].x % lattice.nx,
                   cells[number].x / lattice.nx,
                   cells[number].y,
                   nearest_image,
                   farthest_before,
                   farthest_beyond,
                   folded_image};
  Bundle waiting[MOST_WAITING];
  waiting[0].sequence.length = 0;
  waiting[0].sequence.refracts = 0u;
  for (int packet = 0; packet < PACKETS; ++packet) {
    floatv tangent_x, tangent_y;
    intv active;
    part_tangents(&lattice, cell.column, cell.row, packet, &tangent_x, &tangent_y, &active);
    start_rays(&lattice, (floatv)(0.0f), (floatv)(0.0f), tangent_x, tangent_y, active,
               waiting[0].rays + packet, 0);
  }
  for (int count = 1; count > 0;) {
    const Bundle bundle = waiting[--count];
    Met met;
    meet(&scene, &lattice, &bundle, &met);
    // Rays that something stops before a surface layer are no longer the first to meet it.
    BundleLayer surface_layer;
    while (next_layer(&scene, &bundle, &met, &surface_layer)) {
      Hits claimed[PACKETS];
      claim_layer(&scene, &lattice, &surface_layer, &bundle, &met, claimed);
      if (!is_seen(&scene, &lattice, &surface_layer, &bundle, &met, claimed, &cell)) continue;
      __global const Material* material = scene.materials + surface_layer.material;
      const float specular = material->reflectivity + material->transparency;
      const int length = bundle.sequence.length;
      if (length > 0 && specular < 1.0f)
        add_path(&scene, &lattice, &surface_layer, &bundle, &met, claimed, &cell);
      if (length < RAYWAVE_BOUNCES && specular > 0.0f) {
        Bundle stopped = bundle;
        for (int packet = 0; packet < PACKETS; ++packet)
          stopped.rays[packet].first &= claimed[packet].t <= met.nearest[packet];
        add_bundles(&scene, &lattice, &surface_layer, &stopped, claimed, waiting, &count);
      }
    }
  }
  counts[number] = (int2)(cell.count, cell.hidden);
}

// One work-item per cell.
__kernel void pack_paths(__global const int2* counts, __global const int4* first, int cell_count,
                         int slots, __global const Sample* samples,
                         __global const uint* visibility_masks, __global const SamplePath* paths,
                         __global Sample* packed, __global uint* packed_visibility,
                         __global uint* packed_lit, __global SamplePath* packed_paths) {
  const int cell = (int)get_global_id(0);
  if (cell >= cell_count) return;
  const size_t from = (size_t)cell * (size_t)slots, to = (size_t)first[cell].x;
  int profile = first[cell].x + (PLANE_WAVE_PARTS - 1) * first[cell].y;
  for (size_t i = 0; i < (size_t)counts[cell].x; ++i) {
    Sample sample = samples[from + i];
    sample.profile = profile;
    profile += sample.hidden ? PLANE_WAVE_PARTS : 1;
    sample.path = first[cell].z + (int)i;
    packed[to + i] = sample;
    packed_paths[(size_t)first[cell].z + i] = paths[from + i];
    for (int w = 0; w < VISIBILITY_WORDS; ++w)
      packed_visibility[(to + i) * VISIBILITY_WORDS + w] =
          visibility_masks[(from + i) * VISIBILITY_WORDS + w];
    for (int w = 0; w < LIT_WORDS; ++w) packed_lit[(to + i) * LIT_WORDS + w] = 0u;
  }
}
#endif
