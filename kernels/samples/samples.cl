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
#include "kernels/common/hash.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/samples/breaks.h"
#include "kernels/samples/lattice_rays.h"
#include "kernels/samples/options.h"
#include "kernels/samples/visibility.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/shade.h"

#define SAMPLE_COLOURS (2 * RAYWAVE_COLOURS)
#define LIT_WORDS (RAYWAVE_LIGHTS > 32 ? (RAYWAVE_LIGHTS + 31) / 32 : 1)

// 1: the parts of a cell differ in more than coverage, so that all of them are traced.
#define PARTS_DIFFER (RAYWAVE_TEXTURES || RAYWAVE_SHADOWS || RAYWAVE_LIGHT_PLACES > 1)

// How far a layer lies behind another, in biases of rays, to be behind it for certain.
#define BEHIND 16.0f

// One hit of one ray.
typedef struct {
  float t;
  int triangle;
  float u, v;
} Hit;

static inline Hit hit_of_lane(const Layers* layers, int layer, int lane) {
  float t[RAYWAVE_LANES], u[RAYWAVE_LANES], v[RAYWAVE_LANES];
  int triangle[RAYWAVE_LANES];
  LANES_STORE(layers->t[layer], t);
  LANES_STORE(layers->triangle[layer], triangle);
  LANES_STORE(layers->u[layer], u);
  LANES_STORE(layers->v[layer], v);
  const Hit hit = {t[lane], triangle[lane], u[lane], v[lane]};
  return hit;
}

// Distance within which hits belong to the same layer: what a slope of 80 degrees spans in a cell.
static inline float layer_reach(const Lattice* lattice, float t) {
  return 4.0f * lattice->step * fabs(t + (lattice->near_z - lattice->eye_z));
}

// Cosine to the ray below which a layer is steep, and cosine between normals above which two hits
// of a steep layer belong together.
#define STEEP 0.25f
#define ALIKE 0.9f

#if RAYWAVE_ANTIALIAS
// A layer as one ray of its cell meets it. Hits of the parts' rays are compared with it.
typedef struct {
  float t;
  float reach;
  bool steep;              // seen so nearly edge-on that a cell spans more than `reach` of it
  float3 at, normal;       // for steep layers only
  int packet_column, row;  // of the parts' rays
} Sheet;

// hit: of the ray with tangents (dx, dy)
static inline Sheet sheet_of(const SceneArrays* scene, const Lattice* lattice, const Hit* hit,
                             float dx, float dy, int packet_column, int row) {
  Sheet sheet;
  sheet.t = hit->t;
  sheet.reach = layer_reach(lattice, hit->t);
  sheet.normal = normalize(triangle_cross(&scene->tree, hit->triangle));
  sheet.steep = fabs(sheet.normal.x * dx + sheet.normal.y * dy + sheet.normal.z) < STEEP;
  const float depth = hit->t + (lattice->near_z - lattice->eye_z);
  sheet.at =
      (float3)(lattice->eye_x + depth * dx, lattice->eye_y + depth * dy, lattice->eye_z + depth);
  sheet.packet_column = packet_column;
  sheet.row = row;
  return sheet;
}

// Mask of the hits of a packet's rays that belong to a layer: those at about the same distance and,
// for a steep layer, those in the same plane.
static inline intv belongs(const SceneArrays* scene, const Lattice* lattice, const Sheet* sheet,
                           int packet, floatv t, intv triangle) {
  const intv near = fabs(t - sheet->t) < sheet->reach, far = (triangle >= 0) & !near;
  if (!sheet->steep || !LANES_ANY(far)) return near;
  const Rays rays = part_rays(lattice, sheet->packet_column, sheet->row, packet, LANES_INDEX >= 0);
  float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES];
  int candidate[RAYWAVE_LANES], same[RAYWAVE_LANES];
  LANES_STORE(rays.ox + t * rays.dx, x);
  LANES_STORE(rays.oy + t * rays.dy, y);
  LANES_STORE(rays.oz + t, z);
  LANES_STORE(LANES_SELECT((intv)(-1), triangle, far), candidate);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    same[lane] = 0;
    if (candidate[lane] < 0) continue;
    const float3 normal = normalize(triangle_cross(&scene->tree, candidate[lane]));
    const float off = dot(sheet->normal, (float3)(x[lane], y[lane], z[lane]) - sheet->at);
    same[lane] = fabs(dot(sheet->normal, normal)) > ALIKE && fabs(off) < 0.25f * sheet->reach;
  }
  return near | (LANES_LOAD(same) != 0);
}

#if RAYWAVE_ALPHA == ALPHA_BLEND
// Mask of the hits of surfaces that are there with a probability. They are no rims: whether they
// hide something is for the rays to the hologram to find out, which are many.
static inline intv is_blended(const SceneArrays* scene, intv triangle) {
  int number[RAYWAVE_LANES], blended[RAYWAVE_LANES];
  LANES_STORE(triangle, number);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    blended[lane] = 0;
    if (number[lane] < 0) continue;
    const int material = scene->tree.triangles[number[lane]].material;
    blended[lane] = scene->materials[material].alpha_mode == ALPHA_BLEND;
  }
  return LANES_LOAD(blended) != 0;
}
#endif

// Nearest hits of the parts' rays that belong to no layer of the centre ray: the rim of an object
// that the centre ray misses. It hides what lies behind it in those parts, which the sample of the
// layer behind cannot know from the centre ray.
CALLED void find_rims(const SceneArrays* scene, const Lattice* lattice, const Layers* parts,
                      const Layers* centre, int lane, int column, int row, int packet_column,
                      floatv* rims) {
  Sheet sheets[BVH_LAYERS];
  int count = 0;
  const float dx = ((float)(lattice->first_x + column) + 0.5f) * lattice->step,
              dy = ((float)(lattice->first_y + row) + 0.5f) * lattice->step;
  for (int j = 0; j < BVH_LAYERS; ++j) {
    const Hit hit = hit_of_lane(centre, j, lane);
    if (hit.triangle >= 0)
      sheets[count++] = sheet_of(scene, lattice, &hit, dx, dy, packet_column, row);
  }
  for (int packet = 0; packet < PACKETS; ++packet) rims[packet] = lattice->reach;
  for (int i = 0; i < BVH_LAYERS; ++i) {
    for (int packet = 0; packet < PACKETS; ++packet) {
      const floatv t = parts[packet].t[i];
      intv rim = (parts[packet].triangle[i] >= 0) & (t < rims[packet]);
#if RAYWAVE_ALPHA == ALPHA_BLEND
      rim &= !is_blended(scene, parts[packet].triangle[i]);
#endif
      for (int j = 0; j < count && LANES_ANY(rim); ++j)
        rim &= !belongs(scene, lattice, sheets + j, packet, t,
                        LANES_SELECT((intv)(-1), parts[packet].triangle[i], rim));
      rims[packet] = LANES_SELECT(rims[packet], t, rim);
    }
  }
}

// Removes the hits of a layer from the parts' hits, one for each ray. Returns how many of them lie
// behind no rim.
CALLED int claim(const SceneArrays* scene, const Lattice* lattice, Layers* parts,
                 const floatv* rims, const Sheet* sheet, Hits* claimed) {
  intv count = 0;
  for (int packet = 0; packet < PACKETS; ++packet) {
    Layers* layers = parts + packet;
    Hits hits = {(floatv)(sheet->t), (intv)(-1), (floatv)(0.0f), (floatv)(0.0f)};
    for (int i = 0; i < BVH_LAYERS; ++i) {
      const intv open = (layers->triangle[i] >= 0) & (hits.triangle < 0);
      if (!LANES_ANY(open)) continue;
      const intv take = open & belongs(scene, lattice, sheet, packet, layers->t[i],
                                       LANES_SELECT((intv)(-1), layers->triangle[i], open));
      hits.t = LANES_SELECT(hits.t, layers->t[i], take);
      hits.triangle = LANES_SELECT(hits.triangle, layers->triangle[i], take);
      hits.u = LANES_SELECT(hits.u, layers->u[i], take);
      hits.v = LANES_SELECT(hits.v, layers->v[i], take);
      layers->triangle[i] = LANES_SELECT(layers->triangle[i], (intv)(-1), take);
    }
    hits.triangle = LANES_SELECT(hits.triangle, (intv)(-1), hits.t > rims[packet]);
    count += LANES_SELECT((intv)(0), (intv)(1), hits.triangle >= 0);
    claimed[packet] = hits;
  }
  return lanes_sum(count);
}

// The first ray with a hit that no layer has claimed, or -1; *hit receives that hit.
static inline int unclaimed(const Layers* parts, Hit* hit) {
  for (int packet = 0; packet < PACKETS; ++packet) {
    intv any = 0;
    for (int i = 0; i < BVH_LAYERS; ++i) any |= parts[packet].triangle[i] >= 0;
    if (!LANES_ANY(any)) continue;
    int left[RAYWAVE_LANES];
    LANES_STORE(LANES_SELECT((intv)(0), (intv)(1), any), left);
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
      for (int i = 0; i < BVH_LAYERS && left[lane]; ++i) {
        *hit = hit_of_lane(parts + packet, i, lane);
        if (hit->triangle >= 0) return packet * RAYWAVE_LANES + lane;
      }
    }
  }
  return -1;
}
#endif

// Radiance without highlights. words: the mask of the lights that it comes from.
static inline Radiance scattered(const SceneArrays* scene, const Surface* s, const Lattice* lattice,
                                 intv active, uintv* words) {
  Radiance radiance = own_light(scene, s);
  for (int w = 0; w < LIT_WORDS; ++w) words[w] = 0;
#if RAYWAVE_LIGHTS > 0
  for (int l = 0; l < RAYWAVE_LIGHTS; ++l) {
    const Incident in = incident(scene->lights, l, s, lattice->reach);
    const intv lit = lit_by(scene, &in, s, lattice->bias, active);
    for (int k = 0; k < RAYWAVE_COLOURS; ++k)
      radiance.of[k] +=
          LANES_SELECT((floatv)(0.0f), s->diffuse[k] * in.facing * intensity_of(&in, k), lit);
    words[l / 32] |= LANES_AS_UINT(LANES_SELECT((intv)(0), (intv)(1), lit)) << (l % 32);
  }
#else
  (void)scene, (void)lattice, (void)active;
#endif
  return radiance;
}

static inline floatv sum_of_colours(const Radiance* radiance) {
  floatv sum = radiance->of[0];
  for (int k = 1; k < RAYWAVE_COLOURS; ++k) sum += radiance->of[k];
  return sum;
}

// What the samples of a packet's hits have in common with their surfaces.
typedef struct {
  float x[RAYWAVE_LANES];
  float y[RAYWAVE_LANES];
  float z[RAYWAVE_LANES];
  float nx[RAYWAVE_LANES];
  float ny[RAYWAVE_LANES];
  float nz[RAYWAVE_LANES];
#if RAYWAVE_NORMAL_MAPS
  float side_x[RAYWAVE_LANES];
  float side_y[RAYWAVE_LANES];
  float side_z[RAYWAVE_LANES];
#endif
  float radiance[RAYWAVE_COLOURS][RAYWAVE_LANES];
  float specular[RAYWAVE_COLOURS][RAYWAVE_LANES];
  float shininess[RAYWAVE_LANES];
  float own[RAYWAVE_LANES];  // share of the light that is neither mirrored nor let through
  uint lit[LIT_WORDS][RAYWAVE_LANES];
} Shaded;

// column, row  of the cells
CALLED void shade(const SceneArrays* scene, const Lattice* lattice, const Rays* rays,
                  const Hits* hits, intv column, int row, Shaded* shaded) {
  Surface s = surface_at(scene, rays, hits);
  LOOK_FOR_LIGHTS(&s, light_place_of(column, (intv)(row)));
  (void)column, (void)row;
  uintv words[LIT_WORDS];
  const Radiance radiance = scattered(scene, &s, lattice, hits->triangle >= 0, words);
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) LANES_STORE(radiance.of[k], shaded->radiance[k]);
  for (int w = 0; w < LIT_WORDS; ++w) LANES_STORE(words[w], shaded->lit[w]);
  LANES_STORE(s.x, shaded->x);
  LANES_STORE(s.y, shaded->y);
  LANES_STORE(s.z, shaded->z);
  LANES_STORE(s.nx, shaded->nx);
  LANES_STORE(s.ny, shaded->ny);
  LANES_STORE(s.nz, shaded->nz);
#if RAYWAVE_NORMAL_MAPS
  LANES_STORE(s.side_x, shaded->side_x);
  LANES_STORE(s.side_y, shaded->side_y);
  LANES_STORE(s.side_z, shaded->side_z);
#endif
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) LANES_STORE(s.specular[k], shaded->specular[k]);
  LANES_STORE(s.shininess, shaded->shininess);
  LANES_STORE(1.0f - s.reflectivity - s.transparency, shaded->own);
}

// The same of one hit of a ray with these tangents, in lane 0.
static inline void shade_one(const SceneArrays* scene, const Lattice* lattice, const Hit* hit,
                             float dx, float dy, int column, int row, Shaded* shaded) {
  const Rays ray = lattice_rays(lattice, (floatv)(dx), (floatv)(dy), LANES_INDEX == 0);
  const Hits hits = {(floatv)(hit->t),
                     LANES_SELECT((intv)(-1), (intv)(hit->triangle), LANES_INDEX == 0),
                     (floatv)(hit->u), (floatv)(hit->v)};
  shade(scene, lattice, &ray, &hits, (intv)(column), row, shaded);
}

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
  int slots;
  int count;                      // of all samples, with or without a slot
  int hidden;                     // of the samples that have a slot
  int rank;                       // number of the next source
  int mirrors;                    // 1: it has mirrors or glass
  int packet_column;              // first cell whose parts share a packet with this one's
  OccluderCache* occluder_cache;  // by rank; deeper layers share the last one
} Cell;

#define OCCLUDER_CACHES 4

// Adds the sample of a layer, found by `hit` of the ray with tangents (dx, dy). A sample stands for
// its whole cell: `parts` are the hits of the layer's parts, `covered` of them. Without that, edges
// of objects, textures and shadows would move by up to half a cell. It shines from the centroid of
// their light; its normal, its visibility and the lights of its highlights are those of `hit`.
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
  if (!RAYWAVE_KEEP_UNSEEN && (covered == 0 || seen == 0)) {
    ++cell->rank;
    return;
  }
#if RAYWAVE_BOUNCES > 0
  // What has no light of its own is no source.
  cell->mirrors |= shaded->own[lane] < 1.0f;
  if (!(shaded->own[lane] > 0.0f)) return;
#endif
  ++cell->rank;

  Sample sample;
  sample.x = shaded->x[lane];
  sample.y = shaded->y[lane];
  sample.z = shaded->z[lane];
#if RAYWAVE_NORMAL_MAPS
  sample.nx = shaded->side_x[lane];
  sample.ny = shaded->side_y[lane];
  sample.nz = shaded->side_z[lane];
#else
  sample.nx = shaded->nx[lane];
  sample.ny = shaded->ny[lane];
  sample.nz = shaded->nz[lane];
#endif

  // Rays start on the outer side of a sheet only when normals roughly agree with its faces.
  float3 face = normalize(triangle_cross(&scene->tree, hit->triangle));
  if (seen == SEEN_UNBROKEN)
    seen = fabs(dot(face, (float3)(sample.nx, sample.ny, sample.nz))) > STEEP ? VISIBILITY_ALL
                                                                              : SEEN_UNKNOWN;

  uint visibility[VISIBILITY_WORDS];
  const int parts_seen = look_around(scene, lattice, &sample, occluder_cache, seen, visibility);
  if (!RAYWAVE_KEEP_UNSEEN && parts_seen == 0) return;
  sample.hidden = parts_seen < VISIBILITY_ALL;
#if RAYWAVE_NORMAL_MAPS
  // Rays have left the surface: from here on the normal is for highlights
  sample.nx = shaded->nx[lane];
  sample.ny = shaded->ny[lane];
  sample.nz = shaded->nz[lane];
#endif

  float radiance[RAYWAVE_COLOURS];
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) radiance[k] = shaded->radiance[k][lane];
#if RAYWAVE_ANTIALIAS
  // Parts that differ in coverage only are not shaded.
  if (PARTS_DIFFER ? covered > 0 : covered > 0 && covered < PARTS) {
    // Of all colours together: the sample is at the same place for each laser
    floatv lights[PACKETS];
    float sums[RAYWAVE_COLOURS];
    for (int k = 0; k < RAYWAVE_COLOURS; ++k) sums[k] = 0.0f;
    for (int packet = 0; packet < PACKETS; ++packet) {
      const intv found = parts[packet].triangle >= 0;
      Radiance of_parts;
      for (int k = 0; k < RAYWAVE_COLOURS; ++k) of_parts.of[k] = radiance[k];
      lights[packet] = sum_of_colours(&of_parts);
#if PARTS_DIFFER
      if (!LANES_ANY(found)) continue;
      const Rays rays = part_rays(lattice, cell->packet_column, row, packet, found);
      Surface part = surface_at(scene, &rays, parts + packet);
      LOOK_FOR_LIGHTS(&part, light_place_of_part(packet, column, row));
      uintv unused[LIT_WORDS];
      of_parts = scattered(scene, &part, lattice, found, unused);
      lights[packet] = sum_of_colours(&of_parts);
#endif
      for (int k = 0; k < RAYWAVE_COLOURS; ++k)
        sums[k] += lanes_float_sum(LANES_SELECT((floatv)(0.0f), of_parts.of[k], found));
    }
    float light = 0.0f;
    for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
      radiance[k] = sums[k] / (float)covered;
      light += sums[k];
    }
    const Centroid centroid = centroid_of(lattice, parts, lights, light, covered, hit->t);
    move_to_centroid(
        lattice, &centroid, ((float)(lattice->first_x + column) + 0.5f) * lattice->step,
        ((float)(lattice->first_y + row) + 0.5f) * lattice->step, dx, dy, hit->t, &sample);
  }
#else
  (void)parts;
#endif
  const float own = (RAYWAVE_ANTIALIAS ? (float)covered / (float)PARTS : 1.0f) * shaded->own[lane];
  sample.weight = fabs(sample.z - lattice->eye_z) / lattice->full_z;
  sample.radiance = radiance[0] * own;
  sample.specular = shaded->specular[0][lane] * own;
  sample.shininess = shaded->shininess[lane];
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
#if RAYWAVE_COLOURS > 1
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) {
    cell->colours[slot * SAMPLE_COLOURS + k] = radiance[k] * own;
    cell->colours[slot * SAMPLE_COLOURS + RAYWAVE_COLOURS + k] = shaded->specular[k][lane] * own;
  }
#endif
  for (int w = 0; w < VISIBILITY_WORDS; ++w)
    cell->visibility_masks[slot * VISIBILITY_WORDS + w] = visibility[w];
  for (int w = 0; w < LIT_WORDS; ++w) cell->lit[slot * LIT_WORDS + w] = shaded->lit[w][lane];
}

#if RAYWAVE_ANTIALIAS
// Hits of the rays through a packet's parts from the distances *from on. *from becomes the distance
// where rays that met as many layers as one traversal keeps must go on, and lattice->reach for all
// others.
CALLED void look_at_parts(const SceneArrays* scene, const Lattice* lattice, int column, int row,
                          int packet, floatv* from, Layers* layers) {
  Rays rays = part_rays(lattice, column, row, packet, *from < lattice->reach);
  rays.t_min = *from;
  bvh_layers(&scene->tree, &rays, layers);
  const intv full = layers->triangle[BVH_LAYERS - 1] >= 0;
  *from =
      LANES_SELECT((floatv)(lattice->reach), layers->t[BVH_LAYERS - 1] + lattice->layer_gap, full);
  keep_sources(layers, scene, &rays, lattice->layer_gap);
}
#endif

#if RAYWAVE_ANTIALIAS
// Marks cells in which the rays through all parts meet the same layers as the centre ray: those
// without breaks and, where the centre ray and half of the parts' rays meet the same layers, those
// in which the other half would too. That half has rays in all four rows and columns, to find thin
// objects, and in the corners, to find edges. No cell is whole when parts differ in more than
// coverage.
CALLED void find_whole_cells(const SceneArrays* scene, const Lattice* lattice, const Breaks* breaks,
                             int first, int row, const Layers* centres, int* whole) {
  // A ray through an edge may meet both triangles of a sheet: rays through the parts tell.
  intv twice = 0;
  for (int i = 0; i + 1 < BVH_LAYERS; ++i)
    twice |= (centres->triangle[i + 1] >= 0) &
             (centres->t[i + 1] - centres->t[i] < BEHIND * lattice->bias);
  int doubtful[RAYWAVE_LANES];
  LANES_STORE(twice, doubtful);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    whole[lane] = 0;
#if !PARTS_DIFFER
    whole[lane] =
        !doubtful[lane] && unbroken_cell(lattice, breaks, min(first + lane, lattice->nx - 1), row);
#endif
  }
#if RAYWAVE_ANTIALIAS == 4 && RAYWAVE_LANES >= 8 && !PARTS_DIFFER
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
    bvh_layers(&scene->tree, &rays, &parts);
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

// What the samples of the centre rays see, by layer and lane: SEEN_UNBROKEN or 0 where no breaks
// lie in their way, else the results of look_around_four.
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

__kernel void find_samples(SCENE_PARAMETERS, Lattice lattice, int breaks_known,
                           __global const float* break_cells, __global const float* break_tiles,
                           int first_row, int rows, int slots, __global int2* counts,
                           __global int* mirrors, __global Sample* samples,
                           __global uint* visibility_masks, __global uint* lit,
                           __global float* sample_colours) {
#if RAYWAVE_COLOURS == 1
  (void)sample_colours;
#endif
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  if (first >= lattice.nx || (int)get_global_id(1) >= rows) return;
  const int band_row = row_in_turn((int)get_global_id(1), rows), row = first_row + band_row;
  if (row >= lattice.ny) return;
  const SceneArrays scene = SCENE_OF_PARAMETERS;
  const Breaks breaks = {break_cells, break_tiles, breaks_known};

  // Layers that the cells' centre rays meet, and cells whose parts need no rays of their own.
  const Rays centres = centre_rays(&lattice, first, row, LANES_INDEX >= 0);
  Layers first_centres;
  bvh_layers(&scene.tree, &centres, &first_centres);
#if RAYWAVE_ANTIALIAS
  Layers parts[PACKETS];
  floatv from[PACKETS], rims[PACKETS];
#if CELLS_OF_PACKET > 1
  Layers shared_parts = parts[0];
  floatv shared_from = 0.0f;
#endif
  int whole[RAYWAVE_LANES];
  find_whole_cells(&scene, &lattice, &breaks, first, row, &first_centres, whole);
#endif

  // Visibility of the samples of centre rays, from four neighbours together where they agree.
  OccluderCache occluder_cache[OCCLUDER_CACHES];
  for (int rank = 0; rank < OCCLUDER_CACHES; ++rank) {
    for (int i = 0; i < 16; ++i) occluder_cache[rank].triangle[i] = -1;
  }
  int seen[BVH_LAYERS][RAYWAVE_LANES];
  Layers sources = first_centres;
  keep_sources(&sources, &scene, &centres, lattice.layer_gap);
  look_around_centres(&scene, &lattice, &breaks, first, row, &centres, &sources, occluder_cache,
                      seen);

  // Radiance of these samples, those of all lanes together
  Shaded shaded_one;
#if RAYWAVE_LANES > 1
  Shaded shaded[BVH_LAYERS];
  for (int i = 0; i < BVH_LAYERS; ++i) {
    intv wanted = sources.triangle[i] >= 0;
#if !RAYWAVE_KEEP_UNSEEN
    wanted &= LANES_LOAD(seen[i]) != 0;
#endif
    if (!LANES_ANY(wanted)) continue;
    const Hits hits = {sources.t[i], LANES_SELECT((intv)(-1), sources.triangle[i], wanted),
                       sources.u[i], sources.v[i]};
    shade(&scene, &lattice, &centres, &hits, first + LANES_INDEX, row, shaded + i);
  }
#endif

  // The samples of each cell: one for each layer of its centre ray, then one for each layer that
  // only parts of the cell show.
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
      slots,
      0,
      0,
      0,
      0,
      column - lane % CELLS_OF_PACKET,
      occluder_cache
    };
    const float centre_dx = ((float)(lattice.first_x + column) + 0.5f) * lattice.step;
    const float centre_dy = ((float)(lattice.first_y + row) + 0.5f) * lattice.step;
    const Layers* layers = &sources;
    Hit last = hit_of_lane(&first_centres, BVH_LAYERS - 1, lane);
    Hits claimed[PACKETS];
#if RAYWAVE_ANTIALIAS
    bool all_whole = true;  // of the cells that share packets with this one, from it on
    for (int cell = lane; cell == lane || cell % CELLS_OF_PACKET != 0; ++cell)
      all_whole &= whole[cell];
#endif
    // Rays that have met as many layers as one traversal keeps are traced again behind them.
    // Kernels are inlined whole: what takes long to compile stands here once.
    Layers further_layers;
    bool more = true;
    for (bool again = false; more; again = true) {
      more = false;
#if RAYWAVE_ANTIALIAS
      for (int packet = 0; packet < PACKETS; ++packet) {
        const bool looks = again ? !whole[lane] && LANES_ANY(from[packet] < lattice.reach)
                                 : !all_whole && lane % CELLS_OF_PACKET == 0;
        if (!again) from[packet] = 0.0f;
        if (looks)
          look_at_parts(&scene, &lattice, cell.packet_column, row, packet, from + packet,
                        parts + packet);
#if CELLS_OF_PACKET > 1
        // Each cell takes its own parts of the only packet.
        if (again) continue;
        if (looks) {
          shared_parts = parts[0];
          shared_from = from[0];
        }
        const intv mine = LANES_INDEX / PARTS == lane % CELLS_OF_PACKET;
        parts[0] = shared_parts;
        for (int i = 0; i < BVH_LAYERS; ++i)
          parts[0].triangle[i] = LANES_SELECT((intv)(-1), parts[0].triangle[i], mine);
        from[0] = LANES_SELECT((floatv)(lattice.reach), shared_from, mine);
#endif
      }
      if (!whole[lane])
        find_rims(&scene, &lattice, parts, layers, lane, column, row, cell.packet_column, rims);
#endif
      // Hits of the centre ray, then those of parts that belong to none of them
      for (int layer = 0;; ++layer) {
        Hit hit;
        float dx = centre_dx, dy = centre_dy;
        const bool of_centre = layer < BVH_LAYERS;
        if (of_centre) {
          hit = hit_of_lane(layers, layer, lane);
          if (hit.triangle < 0) continue;
        } else {
#if RAYWAVE_ANTIALIAS
          const int ray = whole[lane] ? -1 : unclaimed(parts, &hit);
          if (ray < 0) break;
          const Rays rays =
              part_rays(&lattice, cell.packet_column, row, ray / RAYWAVE_LANES, LANES_INDEX >= 0);
          float all_dx[RAYWAVE_LANES], all_dy[RAYWAVE_LANES];
          LANES_STORE(rays.dx, all_dx);
          LANES_STORE(rays.dy, all_dy);
          dx = all_dx[ray % RAYWAVE_LANES];
          dy = all_dy[ray % RAYWAVE_LANES];
#else
          break;
#endif
        }
        int covered = PARTS;
#if RAYWAVE_ANTIALIAS
        if (!whole[lane]) {
          const Sheet sheet = sheet_of(&scene, &lattice, &hit, dx, dy, cell.packet_column, row);
          covered = claim(&scene, &lattice, parts, rims, &sheet, claimed);
        }
#endif
        const bool is_known = of_centre && !again;
        const int seen_parts = is_known ? seen[layer][lane] : SEEN_UNKNOWN;
        const bool is_shaded = is_known && RAYWAVE_LANES > 1;
#if RAYWAVE_KEEP_UNSEEN
        const bool is_wanted = true;
#else
        const bool is_wanted = seen_parts != 0;
#endif
        if (!is_shaded && is_wanted)
          shade_one(&scene, &lattice, &hit, dx, dy, column, row, &shaded_one);
#if RAYWAVE_LANES > 1
        const Shaded* of_hit = is_shaded ? shaded + layer : &shaded_one;
#else
        const Shaded* of_hit = &shaded_one;
#endif
        add_sample(&scene, &lattice, column, row, &hit, dx, dy, claimed, covered, seen_parts,
                   of_hit, is_shaded ? lane : 0, &cell);
      }
#if RAYWAVE_ANTIALIAS
      for (int packet = 0; packet < PACKETS && !whole[lane]; ++packet)
        more |= LANES_ANY(from[packet] < lattice.reach);
#endif
      if (last.triangle >= 0) {
        Rays further = centre_rays(&lattice, first, row, LANES_INDEX == lane);
        further.t_min = last.t + lattice.layer_gap;
        bvh_layers(&scene.tree, &further, &further_layers);
        last = hit_of_lane(&further_layers, BVH_LAYERS - 1, lane);
        keep_sources(&further_layers, &scene, &centres, lattice.layer_gap);
        layers = &further_layers;
        more = true;
      } else if (more) {
        for (int i = 0; i < BVH_LAYERS; ++i) further_layers.triangle[i] = -1;
        layers = &further_layers;
      }
    }
    counts[place] = (int2)(cell.count, cell.hidden);
    mirrors[place] = cell.mirrors ? 1 + cell.rank : 0;
  }
}

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
