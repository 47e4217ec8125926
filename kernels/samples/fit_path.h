// SPDX-License-Identifier: Apache-2.0
// Polynomials over the window for the rest of a path and for its amplitude (path_layout.h).
#ifndef RAYWAVE_FIT_PATH_H
#define RAYWAVE_FIT_PATH_H

#include "kernels/samples/chief_path.h"
#include "kernels/samples/options.h"
#include "kernels/samples/path_layout.h"
#include "kernels/scene/shade.h"

#if RAYWAVE_BOUNCES > 0
#if PLACES_DIFFER
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
  return own * phong(scene, &s, lattice->bias, lattice->reach, RAYWAVE_ANTIALIAS == 4,
                     hits->triangle >= 0);
}

#if RAYWAVE_PATHS
// Light of a path's source towards where rays with these unit directions come from.
static inline floatv light_of_source(const SceneArrays* scene, const Lattice* lattice,
                                     const ChiefPath* chief, Vector direction, intv active,
                                     uint key) {
  const Rays rays = {chief->source.x - direction.x * lattice->layer_gap,
                     chief->source.y - direction.y * lattice->layer_gap,
                     chief->source.z - direction.z * lattice->layer_gap,
                     direction.x,
                     direction.y,
                     direction.z,
                     (floatv)(0.0f),
                     (floatv)(lattice->reach),
                     active};
  Hits hits = chief->hits;
  hits.t = lattice->layer_gap;
  (void)key;
  return light_of_hits(scene, lattice, &rays, &hits, PLACE_OF_KEY(key));
}

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
  float rest_x[PATH_NODES + RAYWAVE_LANES];  // derivatives of the rest
  float rest_y[PATH_NODES + RAYWAVE_LANES];
  float amplitude[PATH_NODES + RAYWAVE_LANES];
} AtNodes;

static inline float fitted(__global const float* row, const float* values) {
  float sum = 0.0f;
  for (int node = 0; node < PATH_NODES; ++node) sum += row[node] * values[node];
  return sum;
}

// Newton's steps that aim a node's ray, at most, besides the last, which is not followed: it starts
// where the ray misses by less than a quarter of a cell
#define PATH_STEPS 4
// A place of the window sees a source brighter than its middle does by so much at most, or darker:
// beyond, it is near a caustic
#define MOST_BRIGHTER 8.0f
#define MOST_DARKER 32.0f

#define PATH_FITTED 0
#define PATH_MISSED 1
#define PATH_FOLDED 2

// The rest of a path over the window, beyond that of its virtual point, and its amplitude. Each
// node's ray is aimed by the chief path's derivatives and by Newton's method. PATH_MISSED: a node
// has no path, and what the chief path's curvature says stands for all. PATH_FOLDED: near a
// caustic, where paths to the window cross or part, that says nothing either.
//
// path   that of a virtual point; unchanged where it has folded
// clear  becomes false where something hides the source from a node
CALLED int fit_path(const SceneArrays* scene, const Lattice* lattice, const PathCell* cell,
                    const Sequence* sequence, const ChiefPath* chief, uint key, float own_light,
                    bool shines, SamplePath* path, bool* clear) {
  const float q =
      sqrt(1.0f + chief->tangent_x * chief->tangent_x + chief->tangent_y * chief->tangent_y);
  const float depth = chief->distance / q, image_x = chief->tangent_x * depth,
              image_y = chief->tangent_y * depth, side = copysign(1.0f, depth);
  const float cosine = fmax(-dot(chief->face, vector_first(chief->toward)), 1e-6f);
  float3 e1, e2;
  across(vector_first(chief->toward), &e1, &e2);
  AtNodes at;
  const float cell_area = lattice->step * lattice->step * chief->area;
  intv missed = LANES_INDEX < 0, folded = missed;
  for (int first = 0; first < PATH_NODES; first += RAYWAVE_LANES) {
    const intv active = first + LANES_INDEX < PATH_NODES;
    const floatv x = LANES_LOAD(cell->fit + first) * lattice->half_width,
                 y = LANES_LOAD(cell->fit + PATH_NODES + first) * lattice->half_height;
    floatv tangent_x = chief->tangent_x + chief->turn[0] * x + chief->turn[1] * y,
           tangent_y = chief->tangent_y + chief->turn[2] * x + chief->turn[3] * y;
    Followed f;
    Derivatives derivatives;
    floatv distance, miss_1, miss_2, determinant, by[4];
    int steps = 0;
    intv misses;
    do {
      start_rays(lattice, x, y, tangent_x, tangent_y, active, &f, &derivatives);
      follow(scene, lattice, sequence, true, &f, &derivatives);
      miss_of(&f, chief, e1, e2, &distance, &miss_1, &miss_2);
      miss_by_tangents(&f, &derivatives, chief, e1, e2, distance, by);
      determinant = by[0] * by[3] - by[1] * by[2];
      const floatv inverse =
          1.0f / LANES_SELECT(determinant, (floatv)(1e-30f), determinant == 0.0f);
      tangent_x += (by[3] * miss_1 - by[1] * miss_2) * inverse;
      tangent_y += (by[0] * miss_2 - by[2] * miss_1) * inverse;
      misses = active & f.found & (miss_1 * miss_1 + miss_2 * miss_2 > 0x1p-4f * cell_area);
    } while (++steps <= PATH_STEPS && LANES_ANY(misses));
    *clear = *clear && !LANES_ANY(active & !(f.first & has_clear_way(scene, lattice, chief, &f)));
    determinant = chief->turned ? -determinant : determinant;
    missed |= active & (!f.found | (distance <= 0.0f));
    folded |=
        active & f.found &
        ((miss_1 * miss_1 + miss_2 * miss_2 > cell_area) |
         (determinant * MOST_BRIGHTER < chief->area) | (determinant > MOST_DARKER * chief->area));

    // Directions: those of the path's light, less those of the virtual point's
    const floatv per_q = 1.0f / sqrt(1.0f + tangent_x * tangent_x + tangent_y * tangent_y);
    const floatv off_x = image_x - x, off_y = image_y - y,
                 far = sqrt(off_x * off_x + off_y * off_y + depth * depth);
    LANES_STORE((off_x / far - side * tangent_x * per_q) * lattice->half_width, at.rest_x + first);
    LANES_STORE((off_y / far - side * tangent_y * per_q) * lattice->half_height, at.rest_y + first);

    // Light per solid angle, over that of the chief path and of a point's 1 / distance
    const floatv turned = -(chief->face.x * f.direction.x + chief->face.y * f.direction.y +
                            chief->face.z * f.direction.z);
    floatv light = f.share * attenuated_share(f.attenuation, distance) / chief->share;
    if (shines)
      light *= light_of_source(scene, lattice, chief, f.direction, active, key) / own_light;
    const floatv wide = fmax(turned, (floatv)(0.0f)) / cosine * chief->area /
                        fmax(determinant, chief->area / MOST_BRIGHTER);
    const floatv cube = per_q * per_q * per_q * (q * q * q);
    const floatv nearer = far / fabs(chief->distance);
    // The determinant's plane lies across the chief path, not across this one
    const floatv along = vector_first(chief->toward).x * f.direction.x +
                         vector_first(chief->toward).y * f.direction.y +
                         vector_first(chief->toward).z * f.direction.z;
    LANES_STORE(
        sqrt(fmax(light, (floatv)(0.0f)) * wide * cube / fmax(along, (floatv)(1e-3f))) * nearer,
        at.amplitude + first);
  }
  // The window sees an image from beyond half its distance to the scene through less of that than
  // the window itself is wide; others may leave their mirror or glass since they turn too far.
  const float ahead = lattice->near_z - lattice->centre_z, xx = 1.0f + ahead * chief->turn[0],
              xy = ahead * chief->turn[1], yx = ahead * chief->turn[2],
              yy = 1.0f + ahead * chief->turn[3];
  const bool is_missed = LANES_ANY(missed);
  if (LANES_ANY(folded) || (is_missed && xx * xx + xy * xy + yx * yx + yy * yy > 2.0f))
    return PATH_FOLDED;
  if (is_missed) {
    // The curvature of the wavefront, less that of the point's sphere
    const float wx = lattice->half_width, wy = lattice->half_height, rate = 1.0f / chief->distance,
                dx = chief->tangent_x / q, dy = chief->tangent_y / q;
    path->rest[0] = 0.5f * side * (chief->bend[0] - rate * (1.0f - dx * dx)) * wx * wx;
    path->rest[1] = side * (chief->bend[1] + rate * dx * dy) * wx * wy;
    path->rest[2] = 0.5f * side * (chief->bend[2] - rate * (1.0f - dy * dy)) * wy * wy;
    return PATH_MISSED;
  }
  for (int term = 0; term < PATH_TERMS; ++term) {
    __global const float* row = cell->fit + PATH_FIT_ROWS + 2 * PATH_NODES * term;
    path->rest[term] = fitted(row, at.rest_x) + fitted(row + PATH_NODES, at.rest_y);
  }
  for (int term = 0; term < PATH_AMPLITUDE_TERMS; ++term)
    path->amplitude[term] =
        fitted(cell->fit + PATH_FIT_AMPLITUDE + PATH_NODES * term, at.amplitude);
  return PATH_FITTED;
}
#endif

#endif

#endif
