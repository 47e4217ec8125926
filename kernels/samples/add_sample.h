// SPDX-License-Identifier: Apache-2.0
// One sample of a cell: its place, light and visibility, written to the cell's next slot.
#ifndef RAYWAVE_ADD_SAMPLE_H
#define RAYWAVE_ADD_SAMPLE_H

#include "kernels/common/hash.h"
#include "kernels/samples/lattice_rays.h"
#include "kernels/samples/shade_samples.h"
#include "kernels/samples/visibility.h"

#if RAYWAVE_ANTIALIAS
// Means over the rays through the parts of a cell that meet one layer, weighted with their light.
typedef struct {
  float across;  // place, in cells from the cell's middle
  float up;
  float nearness;  // 1 / depth, from the hologram's centre
  float beyond;    // the same times the distance of the hit behind that of the sample
} Centroid;

// lights  of each packet's rays; a layer without light counts by its area
// t       distance of the hit that has found the sample
static inline Centroid centroid_of(const Lattice* lattice, const Hits* parts, const floatv* lights,
                                   float light, int covered, float t) {
  Centroid centroid;
  centroid.across = centroid.up = centroid.nearness = centroid.beyond = 0.0f;
  const floatv none = 0.0f, even = 1.0f / (float)covered;
  for (int packet = 0; packet < PACKETS; ++packet) {
    const Hits* hits = parts + packet;
    const floatv share = light > 0.0f ? lights[packet] / light : even;
    const floatv weight = LANES_SELECT(none, share, hits->triangle >= 0);
    const floatv nearness = weight / (hits->t + (lattice->near_z - lattice->eye_z));
    floatv right, upwards;
    part_places(packet, &right, &upwards);
    centroid.across += lanes_float_sum(weight * (right - 0.5f));
    centroid.up += lanes_float_sum(weight * (upwards - 0.5f));
    centroid.nearness += lanes_float_sum(nearness);
    centroid.beyond += lanes_float_sum(nearness * (hits->t - t));
  }
  return centroid;
}

// Moves a sample from the hit that has found it, at the distance t of the ray with tangents (dx,
// dy), to the centroid of its light. The harmonic mean of depths puts it onto a plane surface. A
// curved one bends away from it by p^2 / 12 R.
static inline void move_to_centroid(const Lattice* lattice, const Centroid* centroid,
                                    float centre_dx, float centre_dy, float dx, float dy, float t,
                                    Sample* sample) {
  const float to_x = centre_dx + clamp(centroid->across, -0.5f, 0.5f) * lattice->step,
              to_y = centre_dy + clamp(centroid->up, -0.5f, 0.5f) * lattice->step;
  if (fabs(to_x - dx) < 1e-6f * lattice->step && fabs(to_y - dy) < 1e-6f * lattice->step) return;
  const float there = t + centroid->beyond / centroid->nearness,
              start = lattice->near_z - lattice->eye_z;
  sample->x = lattice->eye_x + start * to_x + there * to_x;
  sample->y = lattice->eye_y + start * to_y + there * to_y;
  sample->z = lattice->near_z + there;
}
#endif

// The samples of one cell.
typedef struct {
  __global Sample* samples;
  __global uint* visibility_masks;
  __global uint* lit;
#if RAYWAVE_COLOURS > 1
  __global float* colours;
#endif
#if RAYWAVE_LANES == 1
  __global Lookout* lookouts;
#endif
  int slots;
  int keeps_unseen;               // 1: also samples that no part of the hologram sees
  int count;                      // of all samples, with or without a slot
  int hidden;                     // of the samples that have a slot
  int rank;                       // number of the next source
  int mirrors;                    // 1: it has mirrors or glass
  int packet_column;              // first cell whose parts share a packet with this one's
  OccluderCache* occluder_cache;  // by rank; deeper layers share the last one
} Cell;

#define OCCLUDER_CACHES 4

#if RAYWAVE_ANTIALIAS
#if RAYWAVE_HIGHLIGHTS > 0
// Sums over the parts of a cell, weighted with what they mirror. Differences from the sample's
// normal keep the spread of a flat surface's normals at 0, which sharp highlights need.
typedef struct {
  float x, y, z, squared;  // of the normals' differences
  float shininess;
  float specular[RAYWAVE_COLOURS], all;
} Gloss;

static inline void add_gloss(const Surface* part, intv found, const Sample* sample, Gloss* gloss) {
  floatv weight = 0.0f;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    const floatv specular = LANES_SELECT((floatv)(0.0f), part->specular[k], found);
    weight += specular;
    gloss->specular[k] += lanes_float_sum(specular);
  }
  const floatv x = part->nx - sample->nx, y = part->ny - sample->ny, z = part->nz - sample->nz;
  gloss->x += lanes_float_sum(weight * x);
  gloss->y += lanes_float_sum(weight * y);
  gloss->z += lanes_float_sum(weight * z);
  gloss->squared += lanes_float_sum(weight * (x * x + y * y + z * z));
  gloss->shininess += lanes_float_sum(weight * part->shininess);
  gloss->all += lanes_float_sum(weight);
}

// The highlight of all parts: about their mean normal, and wider and fainter as their normals
// spread. The spread adds to the lobe's variance, and mirrored light turns twice as far as the
// normal (Toksvig, Mipmapping normal maps, 2005).
static inline void set_highlight(const Gloss* gloss, int covered, float* specular, Sample* sample) {
  float widened = 0.0f;
  if (gloss->all > 0.0f) {
    const float x = gloss->x / gloss->all, y = gloss->y / gloss->all, z = gloss->z / gloss->all;
    const float spread = fmax(gloss->squared / gloss->all - (x * x + y * y + z * z), 0.0f);
    const float3 normal = normalize((float3)(sample->nx + x, sample->ny + y, sample->nz + z));
    sample->nx = normal.x;
    sample->ny = normal.y;
    sample->nz = normal.z;
    sample->shininess = gloss->shininess / gloss->all;
    widened = 1.0f / (1.0f + 2.0f * sample->shininess * spread);
    sample->shininess *= widened;
  }
  for (int k = 0; k < RAYWAVE_COLOURS; ++k)
    specular[k] = gloss->specular[k] / (float)covered * widened;
}
#endif

// The light of the parts of a cell that a surface layer covers, as means in `radiance` and
// `specular`, and the sample moved to its centroid.
static inline void light_of_parts(const SceneArrays* scene, const Lattice* lattice, int column,
                                  int row, const Hit* hit, float dx, float dy, const Hits* parts,
                                  int covered, const Cell* cell, float* radiance, float* specular,
                                  Sample* sample) {
  // Sums over all colours: the sample is at the same place for each laser
  floatv lights[PACKETS];
  float sums[RAYWAVE_COLOURS];
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) sums[k] = 0.0f;
#if RAYWAVE_PARTS_DIFFER && RAYWAVE_HIGHLIGHTS > 0
  Gloss gloss;
  gloss.x = gloss.y = gloss.z = gloss.squared = gloss.shininess = gloss.all = 0.0f;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) gloss.specular[k] = 0.0f;
#endif
  for (int packet = 0; packet < PACKETS; ++packet) {
    const intv found = parts[packet].triangle >= 0;
    Radiance of_parts;
    for (int k = 0; k < RAYWAVE_COLOURS; ++k) of_parts.of[k] = radiance[k];
    lights[packet] = sum_of_colours(&of_parts);
#if RAYWAVE_PARTS_DIFFER
    if (!LANES_ANY(found)) continue;
    const Rays rays = part_rays(lattice, cell->packet_column, row, packet, found);
    Surface part = surface_at(scene, &rays, parts + packet);
    LOOK_FOR_LIGHTS(&part, light_place_of_part(packet, column, row));
    uintv unused[LIT_WORDS];
    of_parts = scattered(scene, &part, lattice, RAYWAVE_ANTIALIAS == 4, found, unused);
    lights[packet] = sum_of_colours(&of_parts);
#if RAYWAVE_HIGHLIGHTS > 0
    add_gloss(&part, found, sample, &gloss);
#endif
#endif
    for (int k = 0; k < RAYWAVE_COLOURS; ++k)
      sums[k] += lanes_float_sum(LANES_SELECT((floatv)(0.0f), of_parts.of[k], found));
  }
  float light = 0.0f;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    radiance[k] = sums[k] / (float)covered;
    light += sums[k];
  }
#if RAYWAVE_PARTS_DIFFER && RAYWAVE_HIGHLIGHTS > 0
  set_highlight(&gloss, covered, specular, sample);
#else
  (void)specular;
#endif
  const Centroid centroid = centroid_of(lattice, parts, lights, light, covered, hit->t);
  move_to_centroid(lattice, &centroid, ((float)(lattice->first_x + column) + 0.5f) * lattice->step,
                   ((float)(lattice->first_y + row) + 0.5f) * lattice->step, dx, dy, hit->t,
                   sample);
}
#endif

// Puts a sample onto its surface, with the normal that visibility asks for.
static inline void put_on_surface(const Shaded* shaded, int lane, Sample* sample) {
  sample->x = shaded->x[lane];
  sample->y = shaded->y[lane];
  sample->z = shaded->z[lane];
#if RAYWAVE_NORMAL_MAPS
  sample->nx = shaded->side_x[lane];
  sample->ny = shaded->side_y[lane];
  sample->nz = shaded->side_z[lane];
#else
  sample->nx = shaded->nx[lane];
  sample->ny = shaded->ny[lane];
  sample->nz = shaded->nz[lane];
#endif
}

// Adds the sample of a layer, found by `hit` of the ray with tangents (dx, dy). A sample stands for
// its whole cell: `parts` are the hits of the layer's parts, `covered` of them. Without that, edges
// of objects, textures and shadows would move by up to half a cell. It shines from the centroid of
// their light; its visibility and the lights of its highlights are those of `hit`.
//
// seen    result of look_around_centres for samples of the centre ray, else SEEN_UNKNOWN
// shaded  its lane `lane` is of this hit
CALLED void add_sample(const SceneArrays* scene, const Lattice* lattice, int column, int row,
                       const Hit* hit, float dx, float dy, const Hits* parts, int covered, int seen,
                       const Shaded* shaded, int lane, Cell* cell) {
  uint keys[RAYWAVE_LANES];
  int key_x = lattice->first_x + column, key_y = lattice->first_y + row;
  // A surface and its mirror image beyond the hologram share their phases.
  if (shaded->z[lane] < lattice->eye_z) {
    key_x = -1 - key_x;
    key_y = -1 - key_y;
  }
  LANES_STORE(cell_key((intv)(key_x), (intv)(key_y), (intv)(cell->rank)), keys);
  OccluderCache* occluder_cache = cell->occluder_cache + min(cell->rank, OCCLUDER_CACHES - 1);
  if (!cell->keeps_unseen && (covered == 0 || seen == 0)) {
    ++cell->rank;
    return;
  }
#if RAYWAVE_BOUNCES > 0
  // A surface without light of its own is no source.
  cell->mirrors |= shaded->own[lane] < 1.0f;
  if (!(shaded->own[lane] > 0.0f)) return;
#endif
  ++cell->rank;

  Sample sample;
  put_on_surface(shaded, lane, &sample);
  // Rays start on the outer side of a surface layer only when normals roughly agree with its faces.
  float3 face = normalize(triangle_cross(&scene->tree, hit->triangle));
  if (seen == SEEN_UNBROKEN)
    seen = fabs(dot(face, (float3)(sample.nx, sample.ny, sample.nz))) > STEEP ? VISIBILITY_ALL
                                                                              : SEEN_UNKNOWN;

#if RAYWAVE_LANES == 1
  const Lookout lookout = {
      sample.x, sample.y, sample.z, sample.nx, sample.ny, sample.nz, seen == SEEN_UNKNOWN};
#endif
  uint visibility[VISIBILITY_WORDS];
  const int parts_seen = look_around(scene, lattice, &sample, occluder_cache, seen, visibility);
  if (!cell->keeps_unseen && parts_seen == 0) return;
  sample.hidden = parts_seen < VISIBILITY_ALL;
#if RAYWAVE_NORMAL_MAPS
  // Rays have left the surface: from here on the normal is for highlights
  sample.nx = shaded->nx[lane];
  sample.ny = shaded->ny[lane];
  sample.nz = shaded->nz[lane];
#endif

  float radiance[RAYWAVE_COLOURS], specular[RAYWAVE_COLOURS];
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    radiance[k] = shaded->radiance[k][lane];
    specular[k] = shaded->specular[k][lane];
  }
  sample.shininess = shaded->shininess[lane];
#if RAYWAVE_ANTIALIAS
  // Parts that differ in coverage only are not shaded.
  if (RAYWAVE_PARTS_DIFFER ? covered > 0 : covered > 0 && covered < PARTS)
    light_of_parts(scene, lattice, column, row, hit, dx, dy, parts, covered, cell, radiance,
                   specular, &sample);
#else
  (void)parts;
#endif
  const float own = (RAYWAVE_ANTIALIAS ? (float)covered / (float)PARTS : 1.0f) * shaded->own[lane];
  sample.weight = fabs(sample.z - lattice->eye_z) / lattice->full_z;
  sample.radiance = radiance[0] * own;
  sample.specular = specular[0] * own;
  sample.triangle = hit->triangle;
  sample.key = keys[0];
  sample.profile = 0;
  sample.path = -1;
  const float3 to_centre =
      (float3)((lattice->eye_x - sample.x) / (sample.z - lattice->eye_z),
               (lattice->eye_y - sample.y) / (sample.z - lattice->eye_z), -1.0f);
  if (dot(face, to_centre) < 0.0f) face = -face;
  face /= fmax(dot(face, to_centre), 1e-6f);
  sample.tilt_x = face.x;
  sample.tilt_y = face.y;
  sample.tilt_z = face.z;

  const int slot = cell->count++;
  if (slot >= cell->slots) return;
  cell->hidden += sample.hidden;
  cell->samples[slot] = sample;
#if RAYWAVE_LANES == 1
  cell->lookouts[slot] = lookout;
#endif
#if RAYWAVE_COLOURS > 1
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    cell->colours[slot * SAMPLE_COLOURS + k] = radiance[k] * own;
    cell->colours[slot * SAMPLE_COLOURS + RAYWAVE_COLOURS + k] = specular[k] * own;
  }
#endif
  for (int w = 0; w < VISIBILITY_WORDS; ++w)
    cell->visibility_masks[slot * VISIBILITY_WORDS + w] = visibility[w];
  for (int w = 0; w < LIT_WORDS; ++w) cell->lit[slot * LIT_WORDS + w] = shaded->lit[w][lane];
}

#endif
