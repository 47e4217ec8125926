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
// RAYWAVE_LANES rays at a time. fit: path_layout.h. nearest_image, farthest_image: depths between
// which virtual points are kept. OpenCL C 1.2.
#include "kernels/common/hash.h"
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/samples/lattice_rays.h"
#include "kernels/samples/options.h"
#include "kernels/samples/path_layout.h"
#include "kernels/samples/specular_path.h"
#include "kernels/samples/visibility.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/shade.h"

#if RAYWAVE_BOUNCES > 0
#define LIT_WORDS (RAYWAVE_LIGHTS > 32 ? (RAYWAVE_LIGHTS + 31) / 32 : 1)

// A path that carries less of the light ends.
#define LEAST_SHARE 1e-3f

// Bundles that wait to be followed, at most; those beyond are left out. The last one is followed
// first and adds two for each sheet that it meets
#define MOST_WAITING (RAYWAVE_BOUNCES + 6)

// Hits are of one sheet when the second lies within this slope of the plane of the first, and its
// normal agrees.
#define SHEET_SLOPE 0.5f
#define SHEET_ALIKE 0.5f

// From so many surfaces on, rays stop at the first hit, and all that they meet of one material is
// one sheet: curved mirrors have spread them, and few carry much.
#define FIRST_HITS_FROM 2

// The samples of one cell.
typedef struct {
  __global Sample* samples;
  __global uint* visibility_masks;
  __global SamplePath* paths;
  __global const float* fit;
  int slots;
  int count;  // of all samples, with or without a slot
  int hidden;
  int column;
  int row;
  int rank;  // number of the next source
  float nearest_image;
  float farthest_image;
} PathCell;

// Rays of all parts of a cell after the surfaces of a sequence.
typedef struct {
  Sequence sequence;
  Followed rays[PACKETS];
} Bundle;

// What the rays of a bundle meet.
typedef struct {
  Layers layers[PACKETS];
  floatv nearest[PACKETS];  // distance of the first hit
} Met;

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

#if RAYWAVE_LIGHT_PLACES > 1
#define PLACE_OF_PART(packet, cell) light_place_of_part(packet, (cell)->column, (cell)->row)
// Where a sample looks for lights that make highlights (kernels/gather/radiance_towards.h)
#define PLACE_OF_KEY(key) ((intv)((int)((key)&15u)))
#else
#define PLACE_OF_PART(packet, cell) ((intv)(0))
#define PLACE_OF_KEY(key) ((intv)(0))
#endif

// Radiance of what rays meet, towards them. place: where they look for lights that have a size.
CALLED floatv light_of_hits(const SceneArrays* scene, const Lattice* lattice, const Rays* rays,
                            const Hits* hits, intv place) {
  Surface s = surface_at(scene, rays, hits);
  LOOK_FOR_LIGHTS(&s, place);
  (void)place;
#if REFINED_SURFACES
  s.place = ds3(s.x, s.y, s.z);
  s.normal = ds3(s.nx, s.ny, s.nz);
  s.towards = ds3(s.vx, s.vy, s.vz);
#endif
  const floatv own = 1.0f - s.reflectivity - s.transparency;
  return own * phong(scene, &s, lattice->bias, lattice->reach, hits->triangle >= 0);
}

// Leaves only hits of mirrors and glass.
static inline void keep_specular(const SceneArrays* scene, Layers* layers) {
  for (int i = 0; i < BVH_LAYERS && LANES_ANY(layers->triangle[i] >= 0); ++i) {
    int triangle[RAYWAVE_LANES];
    LANES_STORE(layers->triangle[i], triangle);
    for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
      if (triangle[lane] < 0) continue;
      __global const Material* m =
          scene->materials + scene->tree.triangles[triangle[lane]].material;
      if (!(m->reflectivity + m->transparency > 0.0f)) triangle[lane] = -1;
    }
    layers->triangle[i] = LANES_LOAD(triangle);
  }
}

// What the rays of a bundle meet: all outer sides of surfaces in air, since other parts of the
// window may see behind the first; within glass and after some surfaces the first only. What rays
// meet directly is for find_samples, but for mirrors and glass.
CALLED void meet(const SceneArrays* scene, const Lattice* lattice, const Bundle* bundle, Met* met) {
  for (int packet = 0; packet < PACKETS; ++packet) {
    const Followed* f = bundle->rays + packet;
    Layers* layers = met->layers + packet;
    const Rays rays = rays_of_followed(f, lattice->reach, f->found);
    if (bundle->sequence.length >= FIRST_HITS_FROM || LANES_ANY(f->found & f->inside)) {
      const Hits hits = bvh_nearest(&scene->tree, &rays);
      for (int i = 0; i < BVH_LAYERS; ++i) {
        layers->t[i] = i == 0 ? hits.t : (floatv)(lattice->reach);
        layers->triangle[i] = i == 0 ? hits.triangle : (intv)(-1);
        layers->u[i] = hits.u;
        layers->v[i] = hits.v;
      }
    } else {
      if (bundle->sequence.length == 0)
        bvh_layers(&scene->tree, &rays, layers);
      else
        bvh_all_layers(&scene->tree, &rays, layers);
      keep_sources(layers, scene, &rays, lattice->layer_gap);
    }
    met->nearest[packet] = lattice->reach;
    for (int i = 0; i < BVH_LAYERS; ++i)
      met->nearest[packet] = LANES_SELECT(
          met->nearest[packet], fmin(met->nearest[packet], layers->t[i]), layers->triangle[i] >= 0);
    if (bundle->sequence.length == 0) keep_specular(scene, layers);
  }
}

// A sheet of surface that rays of a bundle meet, as one of them does.
typedef struct {
  int material;
  float3 place;
  float3 normal;
  int ray;     // the part that it goes through
  bool whole;  // all that has the material
} BundleSheet;

// The first hit that no sheet has claimed: nearer layers first. False where there is none.
static inline bool next_sheet(const SceneArrays* scene, const Bundle* bundle, const Met* met,
                              BundleSheet* sheet) {
  for (int i = 0; i < BVH_LAYERS; ++i) {
    for (int packet = 0; packet < PACKETS; ++packet) {
      const Layers* layers = met->layers + packet;
      if (!LANES_ANY(layers->triangle[i] >= 0)) continue;
      const Followed* f = bundle->rays + packet;
      const Vector at = vector_along(f->place, f->direction, layers->t[i]);
      int triangle[RAYWAVE_LANES];
      float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES];
      LANES_STORE(layers->triangle[i], triangle);
      LANES_STORE(at.x, x);
      LANES_STORE(at.y, y);
      LANES_STORE(at.z, z);
      for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
        if (triangle[lane] < 0) continue;
        sheet->material = scene->tree.triangles[triangle[lane]].material;
        sheet->place = (float3)(x[lane], y[lane], z[lane]);
        sheet->normal = normalize(triangle_cross(&scene->tree, triangle[lane]));
        sheet->ray = packet * RAYWAVE_LANES + lane;
        sheet->whole = bundle->sequence.length >= FIRST_HITS_FROM;
        return true;
      }
    }
  }
  return false;
}

// Mask of hits that lie on a sheet.
static inline intv lies_on(const SceneArrays* scene, const BundleSheet* sheet, Vector at,
                           intv triangle, float gap) {
  if (sheet->whole) return hits_material(scene, triangle, sheet->material);
  float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES];
  int triangles[RAYWAVE_LANES], lies[RAYWAVE_LANES];
  LANES_STORE(triangle, triangles);
  LANES_STORE(at.x, x);
  LANES_STORE(at.y, y);
  LANES_STORE(at.z, z);
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    lies[lane] = 0;
    if (triangles[lane] < 0 || scene->tree.triangles[triangles[lane]].material != sheet->material)
      continue;
    const float3 normal = normalize(triangle_cross(&scene->tree, triangles[lane])),
                 off = (float3)(x[lane], y[lane], z[lane]) - sheet->place;
    lies[lane] = fabs(dot(normal, sheet->normal)) > SHEET_ALIKE &&
                 fabs(dot(off, sheet->normal)) <= SHEET_SLOPE * length(off) + gap;
  }
  return LANES_LOAD(lies) != 0;
}

// Removes a sheet's hits from those of a bundle, one for each ray.
CALLED void claim_sheet(const SceneArrays* scene, const Lattice* lattice, const BundleSheet* sheet,
                        const Bundle* bundle, Met* met, Hits* claimed) {
  for (int packet = 0; packet < PACKETS; ++packet) {
    const Followed* f = bundle->rays + packet;
    Layers* layers = met->layers + packet;
    Hits hits;
    hits.t = hits.u = hits.v = 0.0f;
    hits.triangle = -1;
    for (int i = 0; i < BVH_LAYERS; ++i) {
      const intv open = (layers->triangle[i] >= 0) & (hits.triangle < 0);
      if (!LANES_ANY(open)) continue;
      const intv take =
          open & lies_on(scene, sheet, vector_along(f->place, f->direction, layers->t[i]),
                         LANES_SELECT((intv)(-1), layers->triangle[i], open), lattice->layer_gap);
      hits.t = LANES_SELECT(hits.t, layers->t[i], take);
      hits.triangle = LANES_SELECT(hits.triangle, layers->triangle[i], take);
      hits.u = LANES_SELECT(hits.u, layers->u[i], take);
      hits.v = LANES_SELECT(hits.v, layers->v[i], take);
      layers->triangle[i] = LANES_SELECT(layers->triangle[i], (intv)(-1), take);
    }
    claimed[packet] = hits;
  }
}

// The path of a sample from the window's centre to its source, and its derivatives.
typedef struct {
  float tangent_x, tangent_y;  // at the window
  float3 source;
  float3 face;    // unit normal of its triangle, towards the path
  Hits hits;      // where the path meets it
  Vector toward;  // direction of the path there
  bool first;     // nothing lies between
  float share;
  float area;      // |d (source, across the path) / d (tangents)|
  float turn[4];   // d (tangents) / d (place on the window), the source held: xx, xy, yx, yy
  float bend[3];   // second derivatives of the path: xx, xy, yy, 1 / m
  float distance;  // of the virtual point along the ray
  float slope_x, slope_y;  // relative change of the area that the source turns, per metre
} ChiefPath;

// Vectors of unit length across a direction.
static inline void across(float3 direction, float3* first, float3* second) {
  const float3 other =
      fabs(direction.x) < 0.7f ? (float3)(1.0f, 0.0f, 0.0f) : (float3)(0.0f, 1.0f, 0.0f);
  *first = normalize(cross(direction, other));
  *second = cross(direction, *first);
}

// Follows the ray with these tangents from the window's centre to a sheet; false where it does not
// come there.
CALLED bool find_chief(const SceneArrays* scene, const Lattice* lattice, const PathCell* cell,
                       const Sequence* sequence, const BundleSheet* sheet, float tangent_x,
                       float tangent_y, ChiefPath* chief) {
  Followed f;
  Derivatives by;
  start_rays(lattice, (floatv)(0.0f), (floatv)(0.0f), (floatv)(tangent_x), (floatv)(tangent_y),
             LANES_INDEX >= 0, &f, &by);
  follow(scene, lattice, sequence, true, &f, &by);
  if (!LANES_ANY(f.found)) return false;
  const Hits hits =
      meet_material(scene, sheet->material, lattice->layer_gap, lattice->reach, true, &f);
  if (!LANES_ANY(f.found)) return false;
  const Vector source = vector_along(f.place, f.direction, hits.t);
  if (!LANES_ANY(lies_on(scene, sheet, source, hits.triangle, lattice->layer_gap))) return false;

  chief->tangent_x = tangent_x;
  chief->tangent_y = tangent_y;
  chief->hits = hits;
  chief->toward = f.direction;
  chief->source = vector_first(source);
  chief->first = LANES_ANY(f.first);
  chief->share = LANES_FIRST(f.share * attenuated_share(f.attenuation, hits.t));
  const float3 toward = vector_first(f.direction);
  const int triangle = LANES_FIRST(hits.triangle);
  const float3 cross_product = normalize(triangle_cross(&scene->tree, triangle));
  const float facing = -dot(cross_product, toward);
  chief->face = facing < 0.0f ? -cross_product : cross_product;
  const float cosine = fmax(fabs(facing), 1e-6f);

  // How the path's end moves across it
  float3 e1, e2;
  across(toward, &e1, &e2);
  float moves[2][DERIVATIVES];
  for (int which = 0; which < DERIVATIVES; ++which) {
    const float3 free = vector_first(vector_along(by.place[which], by.direction[which], hits.t));
    moves[0][which] = dot(free, e1);
    moves[1][which] = dot(free, e2);
  }
  const float determinant = moves[0][BY_TANGENT_X] * moves[1][BY_TANGENT_Y] -
                            moves[0][BY_TANGENT_Y] * moves[1][BY_TANGENT_X];
  chief->area = fabs(determinant);
  // In a caustic, the path may turn any way; nothing finite is right there.
  const float scale = moves[0][BY_TANGENT_X] * moves[0][BY_TANGENT_X] +
                      moves[0][BY_TANGENT_Y] * moves[0][BY_TANGENT_Y] +
                      moves[1][BY_TANGENT_X] * moves[1][BY_TANGENT_X] +
                      moves[1][BY_TANGENT_Y] * moves[1][BY_TANGENT_Y];
  const float per_determinant =
      1.0f / copysign(fmax(fabs(determinant), 1e-6f * scale + 1e-30f), determinant);
  for (int axis = 0; axis < 2; ++axis) {
    const float a = moves[0][axis], b = moves[1][axis];
    chief->turn[axis] =
        -(moves[1][BY_TANGENT_Y] * a - moves[0][BY_TANGENT_Y] * b) * per_determinant;
    chief->turn[2 + axis] =
        -(moves[0][BY_TANGENT_X] * b - moves[1][BY_TANGENT_X] * a) * per_determinant;
  }

  // The wavefront at the window's centre, and the point that it comes from on the whole. d: sines
  // of the ray to the axes; the path's derivatives are -d.
  const float q = sqrt(1.0f + tangent_x * tangent_x + tangent_y * tangent_y), dx = tangent_x / q,
              dy = tangent_y / q;
  const float along_x = dx * chief->turn[0] + dy * chief->turn[2],
              along_y = dx * chief->turn[1] + dy * chief->turn[3];
  chief->bend[0] = -(chief->turn[0] - dx * along_x) / q;
  chief->bend[1] = -0.5f * (chief->turn[1] - dx * along_y + chief->turn[2] - dy * along_x) / q;
  chief->bend[2] = -(chief->turn[3] - dy * along_y) / q;
  const float mx = 1.0f - dx * dx, my = 1.0f - dy * dy, mxy = -dx * dy;
  const float rate = (chief->bend[0] * mx + 2.0f * chief->bend[1] * mxy + chief->bend[2] * my) /
                     (mx * mx + 2.0f * mxy * mxy + my * my);
  const float farthest = cell->farthest_image * q, nearest = cell->nearest_image * q;
  chief->distance = rate * farthest > 1.0f ? fmax(1.0f / rate, nearest) : farthest;

  // How the end's direction turns, and with it the area that is seen
  for (int axis = 0; axis < 2; ++axis) {
    const float3 turned = vector_first(by.direction[axis]) +
                          vector_first(by.direction[BY_TANGENT_X]) * chief->turn[axis] +
                          vector_first(by.direction[BY_TANGENT_Y]) * chief->turn[2 + axis];
    const float slope =
        -dot(chief->face, turned) / cosine - (axis == 0 ? dx : dy) / chief->distance;
    if (axis == 0)
      chief->slope_x = slope;
    else
      chief->slope_y = slope;
  }
  return true;
}

#if RAYWAVE_VISIBILITY_PARTS > 0
// Mask of the parts (i, j) of the window that see a path's source.
CALLED intv parts_that_see(const SceneArrays* scene, const Lattice* lattice,
                           const Sequence* sequence, const ChiefPath* chief, intv i, intv j) {
  const floatv x = ((2.0f * LANES_TO_FLOAT(i) + 1.0f) / (float)RAYWAVE_VISIBILITY_PARTS - 1.0f) *
                   lattice->half_width,
               y = ((2.0f * LANES_TO_FLOAT(j) + 1.0f) / (float)RAYWAVE_VISIBILITY_PARTS - 1.0f) *
                   lattice->half_height;
  Followed f;
  start_rays(lattice, x, y, chief->tangent_x + chief->turn[0] * x + chief->turn[1] * y,
             chief->tangent_y + chief->turn[2] * x + chief->turn[3] * y, LANES_INDEX >= 0, &f, 0);
  follow(scene, lattice, sequence, false, &f, 0);
  if (!LANES_ANY(f.found)) return f.found;
  // From the last surface straight to the source, which the ray itself misses a little
  const float3 source = chief->source + lattice->bias * chief->face;
  const Vector way = vector_of(source.x - f.place.x, source.y - f.place.y, source.z - f.place.z);
  const floatv length = sqrt(vector_dot(way, way)), along = vector_dot(way, f.direction);
  const Vector missed = vector_along(way, f.direction, -along);
  const float cell = lattice->step * sqrt(chief->area);
  const floatv most = 16.0f * fmax((floatv)(cell), lattice->step * length);
  f.found &= (along > 0.0f) & (vector_dot(missed, missed) <= most * most);
  const Rays rays = {f.place.x, f.place.y,          f.place.z,      way.x,  way.y,
                     way.z,     f.nearest / length, (floatv)(1.0f), f.found};
  return f.found & !bvh_occluded(&scene->tree, &rays);
}
#endif

// Fills the visibility mask of a path, as look_around does; returns how many parts see it.
CALLED int look_along(const SceneArrays* scene, const Lattice* lattice, const Sequence* sequence,
                      const ChiefPath* chief, uint* visibility) {
  for (int w = 0; w < VISIBILITY_WORDS; ++w) visibility[w] = 0;
#if RAYWAVE_VISIBILITY_PARTS == 0
  (void)scene, (void)lattice, (void)sequence, (void)chief;
  return VISIBILITY_ALL;
#else
  int seen = 0;
#if SIXTEEN_TELL
  for (int first = 0; first < 16; first += RAYWAVE_LANES) {
    const intv a = (first + LANES_INDEX) / 4, b = (first + LANES_INDEX + a) % 4;
    const intv sees =
        parts_that_see(scene, lattice, sequence, chief, part_of_16(a, b), part_of_16(b, a));
    seen += lanes_sum(LANES_SELECT((intv)(0), (intv)(1), sees));
  }
  if (seen == 0) return 0;
  if (seen == 16) {
    for (int part = 0; part < VISIBILITY_ALL; ++part) visibility[part / 32] |= 1u << (part % 32);
    return VISIBILITY_ALL;
  }
  seen = 0;
#endif
  for (int first = 0; first < VISIBILITY_ALL; first += RAYWAVE_LANES) {
    const intv part = first + LANES_INDEX;
    const intv sees =
        parts_that_see(scene, lattice, sequence, chief, part % RAYWAVE_VISIBILITY_PARTS,
                       part / RAYWAVE_VISIBILITY_PARTS);
    seen += lanes_sum(LANES_SELECT((intv)(0), (intv)(1), sees));
    visibility[first / 32] |=
        (uint)lanes_sum(LANES_SELECT((intv)(0), (intv)(1) << (part % 32), sees));
  }
  return seen;
#endif
}

#if RAYWAVE_PATHS
// Where rays from places on the window pass the source, across the chief path.
static inline void miss_of(const Followed* f, const ChiefPath* chief, float3 e1, float3 e2,
                           floatv* distance, floatv* miss_1, floatv* miss_2) {
  const Vector way = vector_of(chief->source.x - f->place.x, chief->source.y - f->place.y,
                               chief->source.z - f->place.z);
  const float3 toward = vector_first(chief->toward);
  const floatv along =
      toward.x * f->direction.x + toward.y * f->direction.y + toward.z * f->direction.z;
  *distance =
      (toward.x * way.x + toward.y * way.y + toward.z * way.z) / fmax(along, (floatv)(1e-3f));
  const Vector off = vector_along(way, f->direction, -*distance);
  *miss_1 = e1.x * off.x + e1.y * off.y + e1.z * off.z;
  *miss_2 = e2.x * off.x + e2.y * off.y + e2.z * off.z;
}

// Derivatives of that by the tangents at the window: xx, xy, yx, yy.
static inline void miss_by_tangents(const Followed* f, const Derivatives* derivatives,
                                    const ChiefPath* chief, float3 e1, float3 e2, floatv distance,
                                    floatv* by) {
  const float3 toward = vector_first(chief->toward);
  const floatv per_along =
      1.0f / fmax(toward.x * f->direction.x + toward.y * f->direction.y + toward.z * f->direction.z,
                  (floatv)(1e-3f));
  for (int axis = 0; axis < 2; ++axis) {
    const Vector free = vector_along(derivatives->place[BY_TANGENT_X + axis],
                                     derivatives->direction[BY_TANGENT_X + axis], distance);
    const Vector step =
        vector_along(free, f->direction,
                     -(toward.x * free.x + toward.y * free.y + toward.z * free.z) * per_along);
    by[axis] = e1.x * step.x + e1.y * step.y + e1.z * step.z;
    by[2 + axis] = e2.x * step.x + e2.y * step.y + e2.z * step.z;
  }
}

// A sum over the nodes of values that lanes hold, packet by packet.
typedef struct {
  float rest_x[PATH_NODES + RAYWAVE_LANES];  // of the rest's derivatives
  float rest_y[PATH_NODES + RAYWAVE_LANES];
  float amplitude[PATH_NODES + RAYWAVE_LANES];
} AtNodes;

static inline float fitted(__global const float* row, const float* values) {
  float sum = 0.0f;
  for (int node = 0; node < PATH_NODES; ++node) sum += row[node] * values[node];
  return sum;
}

// The rest of a path over the window, beyond that of its virtual point, and its amplitude. Each
// node's ray is aimed by the chief path's derivatives and by one step of Newton's method. Where a
// node has no path, what the chief path's curvature says stands for all; returns false then.
CALLED bool fit_path(const SceneArrays* scene, const Lattice* lattice, const PathCell* cell,
                     const Sequence* sequence, const ChiefPath* chief, uint key, float own_light,
                     bool shines, SamplePath* path) {
  const float q =
      sqrt(1.0f + chief->tangent_x * chief->tangent_x + chief->tangent_y * chief->tangent_y);
  const float depth = chief->distance / q, image_x = chief->tangent_x * depth,
              image_y = chief->tangent_y * depth;
  const float cosine = fmax(-dot(chief->face, vector_first(chief->toward)), 1e-6f);
  float3 e1, e2;
  across(vector_first(chief->toward), &e1, &e2);
  AtNodes at;
  intv failed = LANES_INDEX < 0;
  for (int first = 0; first < PATH_NODES; first += RAYWAVE_LANES) {
    const intv active = first + LANES_INDEX < PATH_NODES;
    const floatv x = LANES_LOAD(cell->fit + first) * lattice->half_width,
                 y = LANES_LOAD(cell->fit + PATH_NODES + first) * lattice->half_height;
    floatv tangent_x = chief->tangent_x + chief->turn[0] * x + chief->turn[1] * y,
           tangent_y = chief->tangent_y + chief->turn[2] * x + chief->turn[3] * y;
    Followed f;
    Derivatives derivatives;
    floatv distance = 0.0f, miss_1 = 0.0f, miss_2 = 0.0f, determinant = 0.0f, by[4];
    for (int round = 0; round < 2; ++round) {
      const floatv inverse =
          1.0f / LANES_SELECT(determinant, (floatv)(1e-30f), determinant == 0.0f);
      if (round > 0) {
        tangent_x += (by[3] * miss_1 - by[1] * miss_2) * inverse;
        tangent_y += (by[0] * miss_2 - by[2] * miss_1) * inverse;
      }
      start_rays(lattice, x, y, tangent_x, tangent_y, active, &f, &derivatives);
      follow(scene, lattice, sequence, true, &f, &derivatives);
      miss_of(&f, chief, e1, e2, &distance, &miss_1, &miss_2);
      miss_by_tangents(&f, &derivatives, chief, e1, e2, distance, by);
      determinant = by[0] * by[3] - by[1] * by[2];
    }
    determinant = fabs(determinant);
    failed |= active &
              (!f.found | (distance <= 0.0f) |
               (miss_1 * miss_1 + miss_2 * miss_2 > lattice->step * lattice->step * chief->area));

    // Directions: those of the path's light, less those of the virtual point's
    const floatv per_q = 1.0f / sqrt(1.0f + tangent_x * tangent_x + tangent_y * tangent_y);
    const floatv off_x = image_x - x, off_y = image_y - y,
                 far = sqrt(off_x * off_x + off_y * off_y + depth * depth);
    LANES_STORE((off_x / far - tangent_x * per_q) * lattice->half_width, at.rest_x + first);
    LANES_STORE((off_y / far - tangent_y * per_q) * lattice->half_height, at.rest_y + first);

    // Light per solid angle, over that of the chief path and of a point's 1 / distance
    const floatv turned = -(chief->face.x * f.direction.x + chief->face.y * f.direction.y +
                            chief->face.z * f.direction.z);
    floatv light = f.share * attenuated_share(f.attenuation, distance) / chief->share;
    if (shines) {
      const Rays rays = {chief->source.x - f.direction.x * lattice->layer_gap,
                         chief->source.y - f.direction.y * lattice->layer_gap,
                         chief->source.z - f.direction.z * lattice->layer_gap,
                         f.direction.x,
                         f.direction.y,
                         f.direction.z,
                         (floatv)(0.0f),
                         (floatv)(lattice->reach),
                         active};
      Hits hits = chief->hits;
      hits.t = lattice->layer_gap;
      light *= light_of_hits(scene, lattice, &rays, &hits, PLACE_OF_KEY(key)) / own_light;
    }
    const floatv wide = fmax(turned, (floatv)(0.0f)) / cosine * chief->area /
                        fmax(determinant, 0.0625f * chief->area);
    const floatv cube = per_q * per_q * per_q * (q * q * q);
    const floatv nearer = far / chief->distance;
    // The determinant's plane lies across the chief path, not across this one
    const floatv along = vector_first(chief->toward).x * f.direction.x +
                         vector_first(chief->toward).y * f.direction.y +
                         vector_first(chief->toward).z * f.direction.z;
    LANES_STORE(
        sqrt(fmax(light, (floatv)(0.0f)) * wide * cube / fmax(along, (floatv)(1e-3f))) * nearer,
        at.amplitude + first);
  }
  for (int term = 0; term < PATH_TERMS; ++term) path->rest[term] = 0.0f;
  for (int term = 0; term < PATH_AMPLITUDE_TERMS; ++term) path->amplitude[term] = term == 0;
  if (LANES_ANY(failed)) {
    // The curvature of the wavefront, less that of the point's sphere
    const float wx = lattice->half_width, wy = lattice->half_height, rate = 1.0f / chief->distance,
                dx = chief->tangent_x / q, dy = chief->tangent_y / q;
    path->rest[0] = 0.5f * (chief->bend[0] - rate * (1.0f - dx * dx)) * wx * wx;
    path->rest[1] = (chief->bend[1] + rate * dx * dy) * wx * wy;
    path->rest[2] = 0.5f * (chief->bend[2] - rate * (1.0f - dy * dy)) * wy * wy;
    return false;
  }
  for (int term = 0; term < PATH_TERMS; ++term) {
    __global const float* row = cell->fit + PATH_FIT_ROWS + 2 * PATH_NODES * term;
    path->rest[term] = fitted(row, at.rest_x) + fitted(row + PATH_NODES, at.rest_y);
  }
  for (int term = 0; term < PATH_AMPLITUDE_TERMS; ++term)
    path->amplitude[term] =
        fitted(cell->fit + PATH_FIT_AMPLITUDE + PATH_NODES * term, at.amplitude);
  return true;
}
#endif

// Adds the sample of a sheet that shines.
CALLED void add_path(const SceneArrays* scene, const Lattice* lattice, const BundleSheet* sheet,
                     const Bundle* bundle, const Met* met, const Hits* claimed, PathCell* cell) {
  const Sequence* sequence = &bundle->sequence;
  uint keys[RAYWAVE_LANES];
  LANES_STORE(cell_key((intv)(lattice->first_x + cell->column),
                       (intv)(lattice->first_y + cell->row), (intv)(cell->rank)),
              keys);
  ++cell->rank;

  // Light of the rays, and its centroid. Rays that something else stops on their way count only
  // where it stops the path of the sample itself, since the visibility mask tells that then.
  floatv lights[PACKETS];
  float sums[2][4];  // of all rays, and of those that nothing stops: rays, light, moments
  for (int k = 0; k < 4; ++k) sums[0][k] = sums[1][k] = 0.0f;
  float finder_x = 0.0f, finder_y = 0.0f;
  for (int packet = 0; packet < PACKETS; ++packet) {
    const Followed* f = bundle->rays + packet;
    const Hits* hits = claimed + packet;
    const intv found = hits->triangle >= 0;
    floatv tangent_x, tangent_y;
    intv active;
    part_tangents(lattice, cell->column, cell->row, packet, &tangent_x, &tangent_y, &active);
    const int lane = sheet->ray - packet * RAYWAVE_LANES;
    if (lane >= 0 && lane < RAYWAVE_LANES) {
      float x[RAYWAVE_LANES], y[RAYWAVE_LANES];
      LANES_STORE(tangent_x, x);
      LANES_STORE(tangent_y, y);
      finder_x = x[lane];
      finder_y = y[lane];
    }
    lights[packet] = 0.0f;
    if (!LANES_ANY(found)) continue;
    const Rays rays = rays_of_followed(f, lattice->reach, found);
    lights[packet] =
        LANES_SELECT((floatv)(0.0f),
                     light_of_hits(scene, lattice, &rays, hits, PLACE_OF_PART(packet, cell)) *
                         f->share * attenuated_share(f->attenuation, hits->t),
                     found);
    const intv free = found & f->first & (hits->t <= met->nearest[packet]);
    for (int kind = 0; kind < 2; ++kind) {
      const intv counts = kind == 0 ? found : free;
      const floatv light = LANES_SELECT((floatv)(0.0f), lights[packet], counts);
      sums[kind][0] += (float)lanes_sum(LANES_SELECT((intv)(0), (intv)(1), counts));
      sums[kind][1] += lanes_float_sum(light);
      sums[kind][2] += lanes_float_sum(light * tangent_x);
      sums[kind][3] += lanes_float_sum(light * tangent_y);
    }
  }

  // The path through the centroid; where it misses the sheet, that of the ray which has found it
  ChiefPath chief;
  const int free = sums[1][1] > 0.0f;
  if (!(sums[0][1] > 0.0f)) return;
  bool is_found = find_chief(scene, lattice, cell, sequence, sheet, sums[free][2] / sums[free][1],
                             sums[free][3] / sums[free][1], &chief);
  if (!is_found)
    is_found = find_chief(scene, lattice, cell, sequence, sheet, finder_x, finder_y, &chief);
  if (!is_found) return;
  const int kind = chief.first && free;
  uint visibility[VISIBILITY_WORDS];
  const int parts_seen = look_along(scene, lattice, sequence, &chief, visibility);
  if (parts_seen == 0) return;

  const float depth = chief.distance / sqrt(1.0f + chief.tangent_x * chief.tangent_x +
                                            chief.tangent_y * chief.tangent_y);
  Sample sample;
  sample.x = lattice->centre_x + chief.tangent_x * depth;
  sample.y = lattice->centre_y + chief.tangent_y * depth;
  sample.z = lattice->centre_z + depth;
  sample.nx = chief.face.x;
  sample.ny = chief.face.y;
  sample.nz = chief.face.z;
  sample.weight = depth / lattice->full_z;
  sample.radiance = sums[kind][1] / (float)PARTS;
  sample.specular = 0.0f;
  sample.shininess = 0.0f;
  sample.tilt_x = chief.slope_x * depth;
  sample.tilt_y = chief.slope_y * depth;
  sample.tilt_z = -(sample.tilt_x * chief.tangent_x + sample.tilt_y * chief.tangent_y) - 1.0f;
  sample.key = keys[0];
  sample.triangle = LANES_FIRST(chief.hits.triangle);
  sample.hidden = parts_seen < VISIBILITY_ALL;
  sample.profile = 0;
  sample.path = -1;

  const int slot = cell->count++;
  if (slot >= cell->slots) return;
  cell->hidden += sample.hidden;
  for (int w = 0; w < VISIBILITY_WORDS; ++w)
    cell->visibility_masks[slot * VISIBILITY_WORDS + w] = visibility[w];
  SamplePath path;
  path.source[0] = chief.source.x;
  path.source[1] = chief.source.y;
  path.source[2] = chief.source.z;
#if RAYWAVE_PATHS
  __global const Material* material = scene->materials + sheet->material;
  bool shines = false;
#if RAYWAVE_SPECULAR && RAYWAVE_HIGHLIGHTS > 0
  shines = (material->kind & MATERIAL_METALLIC) != 0;
  for (int k = 0; k < RAYWAVE_COLOURS; ++k) shines |= material->specular[k] > 0.0f;
#endif
  (void)material;
  float own_light = 1.0f;
  if (shines) {
    const float3 toward = vector_first(chief.toward);
    const Rays rays = {(floatv)(chief.source.x - toward.x * lattice->layer_gap),
                       (floatv)(chief.source.y - toward.y * lattice->layer_gap),
                       (floatv)(chief.source.z - toward.z * lattice->layer_gap),
                       (floatv)(toward.x),
                       (floatv)(toward.y),
                       (floatv)(toward.z),
                       (floatv)(0.0f),
                       (floatv)(lattice->reach),
                       LANES_INDEX >= 0};
    Hits hits = chief.hits;
    hits.t = lattice->layer_gap;
    own_light = LANES_FIRST(light_of_hits(scene, lattice, &rays, &hits, PLACE_OF_KEY(sample.key)));
    shines = own_light > 0.0f;
  }
  // The polynomial of the amplitude holds how the source turns.
  if (fit_path(scene, lattice, cell, sequence, &chief, sample.key, own_light, shines, &path)) {
    sample.tilt_x = sample.tilt_y = 0.0f;
    sample.tilt_z = -1.0f;
  }
#else
  for (int term = 0; term < PATH_TERMS; ++term) path.rest[term] = 0.0f;
  for (int term = 0; term < PATH_AMPLITUDE_TERMS; ++term) path.amplitude[term] = term == 0;
#endif
  cell->samples[slot] = sample;
  cell->paths[slot] = path;
}

// Whether any part of the window sees a sheet along the sequence. Whatever lies behind one that
// none sees is hidden too.
CALLED bool is_seen(const SceneArrays* scene, const Lattice* lattice, const BundleSheet* sheet,
                    const Bundle* bundle, const Met* met, const Hits* claimed,
                    const PathCell* cell) {
  for (int packet = 0; packet < PACKETS; ++packet)
    if (LANES_ANY((claimed[packet].triangle >= 0) & bundle->rays[packet].first &
                  (claimed[packet].t <= met->nearest[packet])))
      return true;
  floatv tangent_x, tangent_y;
  intv active;
  part_tangents(lattice, cell->column, cell->row, sheet->ray / RAYWAVE_LANES, &tangent_x,
                &tangent_y, &active);
  float x[RAYWAVE_LANES], y[RAYWAVE_LANES];
  LANES_STORE(tangent_x, x);
  LANES_STORE(tangent_y, y);
  const int lane = sheet->ray % RAYWAVE_LANES;
  ChiefPath chief;
  uint visibility[VISIBILITY_WORDS];
  return find_chief(scene, lattice, cell, &bundle->sequence, sheet, x[lane], y[lane], &chief) &&
         look_along(scene, lattice, &bundle->sequence, &chief, visibility) > 0;
}

// Adds the bundles that go on from a sheet to those that wait.
CALLED void add_bundles(const SceneArrays* scene, const Lattice* lattice, const BundleSheet* sheet,
                        const Bundle* bundle, const Hits* claimed, Bundle* waiting, int* count) {
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
    next->sequence.material[next->sequence.length] = sheet->material;
    next->sequence.refracts |= (uint)refracts << next->sequence.length;
    ++next->sequence.length;
    ++*count;
  }
}

__kernel void find_paths(SCENE_PARAMETERS, Lattice lattice, float nearest_image,
                         float farthest_image, __global const float* fit,
                         __global const int2* cells, int cell_count, int slots,
                         __global int2* counts, __global Sample* samples,
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
                   farthest_image};
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
    // Rays that something stops before a sheet are no longer the first to meet it.
    BundleSheet sheet;
    while (next_sheet(&scene, &bundle, &met, &sheet)) {
      Hits claimed[PACKETS];
      claim_sheet(&scene, &lattice, &sheet, &bundle, &met, claimed);
      if (!is_seen(&scene, &lattice, &sheet, &bundle, &met, claimed, &cell)) continue;
      __global const Material* material = scene.materials + sheet.material;
      const float specular = material->reflectivity + material->transparency;
      const int length = bundle.sequence.length;
      if (length > 0 && specular < 1.0f)
        add_path(&scene, &lattice, &sheet, &bundle, &met, claimed, &cell);
      if (length < RAYWAVE_BOUNCES && specular > 0.0f) {
        Bundle stopped = bundle;
        for (int packet = 0; packet < PACKETS; ++packet)
          stopped.rays[packet].first &= claimed[packet].t <= met.nearest[packet];
        add_bundles(&scene, &lattice, &sheet, &stopped, claimed, waiting, &count);
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
