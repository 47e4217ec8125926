// SPDX-License-Identifier: Apache-2.0
/// Rays against triangles one by one in double precision: the oracle of kernels/scene/bvh.h.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>

#include "host/geometry/bvh.hpp"

namespace raywave::reference {

/// Points origin + t direction, t_min < t < t_max. The direction need not be a unit vector.
struct Ray {
  glm::dvec3 origin{0}, direction{0, 0, 1};
  double t_min = 0, t_max = 1;
};

struct Hit {
  double t = 0;
  int triangle = -1;    // -1: miss
  double u = 0, v = 0;  // the point is (1 - u - v) a + u b + v c
  // Largest change of t when the ray moves sideways by the fraction `sideways` of its distance,
  // given to intersect()
  double t_uncertainty = 0;
};

/// The ray against one triangle (number 0), both sides, edges and corners included; a triangle of
/// no area is never hit.
///
/// sideways  grows the triangle by this fraction of the summed distances from the ray's origin to
///           its corners; the hit is then cut to the triangle's own range of t, and a triangle of
///           no area may be hit
Hit intersect(const Corners& triangle, const Ray& ray, double sideways = 0);

/// Nearest of all hits.
Hit nearest_hit(std::span<const Corners> triangles, const Ray& ray);

/// True when anything lies in (t_min, t_max).
bool occluded(std::span<const Corners> triangles, const Ray& ray);

/// Sideways error of a ray in single precision, as a fraction of the summed distances to a
/// triangle's corners: no less than the widening in bvh_triangle (20 2^-24 in the 1-norm, of up to
/// 3 x 3 x the distance).
constexpr double float_sideways = 250 * 0x1p-24;

/// Rounding explains a device's hit when it lies on a triangle that the ray meets within rounding,
/// at that triangle's distance, and no later than the nearest exact hit.
struct Verdict {
  std::string fault;   // the mistake; empty when rounding explains the hit
  bool exact = false;  // it is the exact hit itself
};

Verdict judge(const Hit& hit, const Ray& ray, std::span<const Corners> triangles);

enum class Seen { no, yes, unsure };  // unsure: an edge passes closer than floats tell

/// Tells whether the path from `from` to `to`, which begins `bias_m` off the surface, is free.
Seen free_path(std::span<const Corners> triangles, glm::dvec3 from, glm::dvec3 off_surface,
               double bias_m, glm::dvec3 to);

// Formulas of shading and of random phases that several oracles share, in double precision.

/// c^m as shading uses it: 0 for c <= 0, but 0^0 = 1.
double power_of_cosine(double cosine, double exponent);

/// The random phase, in turns, of the cube (i, j, k), and of a sample's key: kernels/common/hash.h
/// in host arithmetic.
double phase_turns(std::int32_t i, std::int32_t j, std::int32_t k, std::uint32_t seed);
double phase_turns_of_key(std::uint32_t key, std::uint32_t seed);

}  // namespace raywave::reference
