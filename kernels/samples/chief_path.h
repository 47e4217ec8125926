// SPDX-License-Identifier: Apache-2.0
// The path of a sample over mirrors and through glass to the window's centre, its derivatives, and
// which parts of the window see the sample along it.
#ifndef RAYWAVE_CHIEF_PATH_H
#define RAYWAVE_CHIEF_PATH_H

#include "kernels/samples/options.h"
#include "kernels/samples/ray_bundles.h"
#include "kernels/samples/specular_path.h"
#include "kernels/samples/visibility.h"

#if RAYWAVE_BOUNCES > 0
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
  int rank;               // number of the next source
  float nearest_image;    // distance of virtual points, at least
  float farthest_before;  // negative; 0: none are before the hologram
  float farthest_beyond;
  float folded_image;  // where light near caustics shines from; negative before the hologram
} PathCell;

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
  bool turned;     // that determinant is negative
  float turn[4];   // d (tangents) / d (place on the window), the source held: xx, xy, yx, yy
  float bend[3];   // second derivatives of the path: xx, xy, yy, 1 / m
  float distance;  // of the virtual point along the ray, from the window on
  float slope_x, slope_y;  // relative change of the area that the source turns, per metre
} ChiefPath;

// Vectors of unit length across a direction.
static inline void across(float3 direction, float3* first, float3* second) {
  const float3 other =
      fabs(direction.x) < 0.7f ? (float3)(1.0f, 0.0f, 0.0f) : (float3)(0.0f, 1.0f, 0.0f);
  *first = normalize(cross(direction, other));
  *second = cross(direction, *first);
}

// Follows the ray with these tangents from the window's centre to a surface layer; false where it
// does not come there.
CALLED bool find_chief(const SceneArrays* scene, const Lattice* lattice, const PathCell* cell,
                       const Sequence* sequence, const BundleLayer* surface_layer, float tangent_x,
                       float tangent_y, ChiefPath* chief) {
  Followed f;
  Derivatives by;
  start_rays(lattice, (floatv)(0.0f), (floatv)(0.0f), (floatv)(tangent_x), (floatv)(tangent_y),
             LANES_INDEX >= 0, &f, &by);
  follow(scene, lattice, sequence, true, &f, &by);
  if (!LANES_ANY(f.found)) return false;
  // A layer behind another one of the same material is not the first that has it
  f.nearest = fmax(f.nearest, (floatv)(surface_layer->from));
  if (surface_layer->from > 0.0f) f.first = LANES_INDEX < 0;
  const Hits hits =
      meet_material(scene, surface_layer->material, lattice->layer_gap, lattice->reach, true, &f);
  if (!LANES_ANY(f.found)) return false;
  const Vector source = vector_along(f.place, f.direction, hits.t);
  if (!LANES_ANY(lies_on(scene, surface_layer, source, hits.triangle, lattice->layer_gap)))
    return false;

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
  chief->turned = determinant < 0.0f;
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
  const bool is_before =
      cell->farthest_before < 0.0f && (rate < 0.0f || cell->farthest_beyond == 0.0f);
  const float farthest = (is_before ? cell->farthest_before : cell->farthest_beyond) * q,
              nearest = cell->nearest_image * q;
  chief->distance =
      rate * farthest > 1.0f ? copysign(fmax(fabs(1.0f / rate), nearest), farthest) : farthest;

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

// Mask of the rays with nothing between their last surface and a path's source, which they may miss
// a little.
CALLED intv has_clear_way(const SceneArrays* scene, const Lattice* lattice, const ChiefPath* chief,
                          const Followed* f) {
  const float3 source = chief->source + lattice->bias * chief->face;
  const Vector way = vector_of(source.x - f->place.x, source.y - f->place.y, source.z - f->place.z);
  const floatv length = sqrt(vector_dot(way, way)), along = vector_dot(way, f->direction);
  const Vector missed = vector_along(way, f->direction, -along);
  const float cell = lattice->step * sqrt(chief->area);
  const floatv most = 16.0f * fmax((floatv)(cell), lattice->step * length);
  const intv comes = f->found & (along > 0.0f) & (vector_dot(missed, missed) <= most * most);
  const Rays rays = {f->place.x, f->place.y,          f->place.z,     way.x, way.y,
                     way.z,      f->nearest / length, (floatv)(1.0f), comes};
  return comes & !bvh_occluded(&scene->tree, &rays);
}

#if RAYWAVE_VISIBILITY_PARTS > 0
// Mask of the parts (i, j) of the window that see a path's source. With a surface layer, any place
// on it does.
CALLED intv parts_that_see(const SceneArrays* scene, const Lattice* lattice,
                           const Sequence* sequence, const ChiefPath* chief,
                           const BundleLayer* surface_layer, intv i, intv j) {
  const floatv x = ((2.0f * LANES_TO_FLOAT(i) + 1.0f) / (float)RAYWAVE_VISIBILITY_PARTS - 1.0f) *
                   lattice->half_width,
               y = ((2.0f * LANES_TO_FLOAT(j) + 1.0f) / (float)RAYWAVE_VISIBILITY_PARTS - 1.0f) *
                   lattice->half_height;
  Followed f;
  start_rays(lattice, x, y, chief->tangent_x + chief->turn[0] * x + chief->turn[1] * y,
             chief->tangent_y + chief->turn[2] * x + chief->turn[3] * y, LANES_INDEX >= 0, &f, 0);
  follow(scene, lattice, sequence, false, &f, 0);
  if (!LANES_ANY(f.found)) return f.found;
  if (surface_layer) {
    const Hits hits = meet_material(scene, surface_layer->material, lattice->layer_gap,
                                    lattice->reach, false, &f);
    return f.found & lies_on(scene, surface_layer, vector_along(f.place, f.direction, hits.t),
                             hits.triangle, lattice->layer_gap);
  }
  return has_clear_way(scene, lattice, chief, &f);
}
#endif

// Fills the visibility mask of a path, as look_around does; returns how many parts see it.
//
// each           whether each part is asked from the first
// surface_layer  where parts see any place on it (parts_that_see), else null
CALLED int look_along(const SceneArrays* scene, const Lattice* lattice, const Sequence* sequence,
                      const ChiefPath* chief, bool each, const BundleLayer* surface_layer,
                      uint* visibility) {
  for (int w = 0; w < VISIBILITY_WORDS; ++w) visibility[w] = 0;
#if RAYWAVE_VISIBILITY_PARTS == 0
  (void)scene, (void)lattice, (void)sequence, (void)chief, (void)each, (void)surface_layer;
  return VISIBILITY_ALL;
#else
  int seen = 0;
#if SIXTEEN_TELL
  for (int first = 0; first < 16 && !each; first += RAYWAVE_LANES) {
    const intv a = (first + LANES_INDEX) / 4, b = (first + LANES_INDEX + a) % 4;
    const intv sees = parts_that_see(scene, lattice, sequence, chief, surface_layer,
                                     part_of_16(a, b), part_of_16(b, a));
    seen += lanes_sum(LANES_SELECT((intv)(0), (intv)(1), sees));
  }
  if (seen == 0 && !each) return 0;
  if (seen == 16) return see_all(visibility);
  seen = 0;
#else
  (void)each;
#endif
  for (int first = 0; first < VISIBILITY_ALL; first += RAYWAVE_LANES) {
    const intv part = first + LANES_INDEX;
    const intv sees =
        parts_that_see(scene, lattice, sequence, chief, surface_layer,
                       part % RAYWAVE_VISIBILITY_PARTS, part / RAYWAVE_VISIBILITY_PARTS);
    seen += lanes_sum(LANES_SELECT((intv)(0), (intv)(1), sees));
    visibility[first / 32] |=
        (uint)lanes_sum(LANES_SELECT((intv)(0), (intv)(1) << (part % 32), sees));
  }
  return seen;
#endif
}

#endif

#endif
