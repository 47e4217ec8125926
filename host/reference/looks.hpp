// SPDX-License-Identifier: Apache-2.0
/// Materials and lights at a place, in double precision and one after the other: the oracle of
/// kernels/scene/look.h and of the lights in kernels/scene/lights.h.
#pragma once

#include <algorithm>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/placed_lights.hpp"
#include "host/plan/plan.hpp"
#include "host/reference/rays.hpp"
#include "host/scene/scene.hpp"

namespace raywave::reference {

/// A channel of a picture where the mesh's coordinates are uv; bilinear between texel centres.
double map_at(const SurfaceMap& map, glm::dvec2 uv, int channel = 0);

/// The channels of a colour that the hologram sees; of one wavelength, all three are its own.
glm::dvec3 seen_colour(const Scene& scene, glm::dvec3 colour);

/// The part that the hologram shows of a radiance that consists of such colours.
double shown_radiance(const Scene& scene, glm::dvec3 radiance);

/// A material at a place of a triangle, for the hologram's wavelength, without light.
struct Look {
  glm::dvec3 ambient{0}, diffuse{0}, specular{0}, emission{0};  // seen_colour
  double shininess = 0;
  double reflectivity = 0, transparency = 0;  // for the hologram's wavelength, as all below
  double ior = 1.5, attenuation_per_m = 0;    // index and attenuation within
  double alpha = 1;
  AlphaMode alpha_mode = AlphaMode::opaque;
  double alpha_cutoff = 0.5;
  glm::dvec3 smooth{0, 0, 1};  // interpolated normal in the mesh's sense, of unit length, world
  glm::dvec3 normal{0, 0, 1};  // the same as a normal map turns it
};

/// v and w: weights of the triangle's second and third corner.
Look look_at(const Scene& scene, const World& world, std::size_t triangle, double v, double w);

/// Share of unpolarised light that a clear surface mirrors, by Fresnel's formulas; 1 at total
/// internal reflection.
///
/// ratio   index of refraction on the side of the light over that beyond
/// cosine  between the light and the normal, >= 0
double mirrored_by_clear(double ratio, double cosine);

/// Tells whether a surface is there: alpha at least the cutoff, or at least a number that belongs
/// to the cell of a place. `doubt`, if given, becomes true where floats may find the other answer.
///
/// place_m  in the frame of the object's instance: where the object was placed at first, from the
///          scene's origin then
bool is_there(const Look& look, glm::dvec3 place_m, const Plan& plan, bool* doubt = nullptr);

/// Sum of the ambient lights; 1 without one.
double ambient_light_of(const Scene& scene);

/// A light as a place sees it.
struct SeenLight {
  glm::dvec3 direction{0};           // towards it, of unit length
  std::optional<double> distance_m;  // empty: it has none
  double intensity = 0;
  glm::dvec3 colour{1};
  bool highlights = true;
};

/// place_m  world
/// which    of the places of lights that have a size
SeenLight seen_light(const PlacedLight& light, glm::dvec3 place_m, int which);

/// All lights but ambient ones, in the order of the device.
std::vector<PlacedLight> lights_of(const Scene& scene, const World& world);

/// The place of lights that the ray (i, j) of a regular set looks for.
inline int light_place_of(int i, int j) { return (i & 3) | (j & 3) << 2; }

/// Light of all lights towards the viewer, without ambient light and emission.
///
/// look       with normals on the viewer's side
/// to_viewer  of unit length; without it there are no highlights
/// which      of the places of lights that have a size
/// reaches    called with the number of a light that the surface faces and how it is seen: true
///            when nothing lies between
glm::dvec3 light_from(const std::vector<PlacedLight>& lights, const Look& look, glm::dvec3 place_m,
                      std::optional<glm::dvec3> to_viewer, int which,
                      const std::function<bool(std::size_t, const SeenLight&)>& reaches);

// The nearest surface that is there, found one triangle after the other.

/// The nearest hit of a ray at which its surface is there.
///
/// triangles  of the world, one for each, in the scene frame
/// sideways   error of a ray in floats, as a fraction of the distance
/// may_meet   tells of a triangle's number whether the ray may meet it
/// is_sure    tells of a triangle whether the ray meets it within floats' errors, too
/// unsure     becomes true where floats may find another hit
template <class MayMeet, class IsSure>
Hit nearest_there(const Scene& scene, const World& world, const Plan& plan,
                  std::span<const Corners> triangles, const Ray& ray, double sideways,
                  const MayMeet& may_meet, const IsSure& is_sure, bool& unsure) {
  Hit best{.t = ray.t_max};
  double doubtful = ray.t_max;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!may_meet(i)) continue;
    const auto wide = intersect(triangles[i], ray, sideways);
    if (wide.triangle < 0) continue;
    const auto exact = intersect(triangles[i], ray);
    if (!is_sure(triangles[i])) doubtful = std::min(doubtful, wide.t);
    if (exact.triangle < 0 || exact.t >= best.t) continue;
    if (plan.lighting.alpha != AlphaMode::opaque) {
      bool doubt = false;
      const bool there = is_there(look_at(scene, world, i, exact.u, exact.v),
                                  ray.origin + exact.t * ray.direction, plan, &doubt);
      if (doubt) doubtful = std::min(doubtful, exact.t);
      if (!there) continue;
    }
    best = exact;
    best.triangle = static_cast<int>(i);
  }
  if (doubtful <= best.t && doubtful < ray.t_max) unsure = true;
  return best;
}

// The field that a pixel's fan of rays gathers, in double precision, ray by ray and triangle by
// triangle, followed by recursion: the oracle of kernels/gather/fan.cl.

struct TracedField {
  std::vector<std::complex<double>> field;  // as FanTracer::trace fills it
  /// Pixels one of whose rays, moved by less than single precision resolves, would meet another
  /// triangle, phase cell or shadow: there two right answers differ.
  std::vector<bool> undecided;
  /// Counts of events on the rays, to show that a test covers them.
  std::int64_t hits = 0, shadowed = 0, mirrored = 0, refracted = 0, totally_reflected = 0;
};

/// sum over the fan of sqrt(radiance) / r exp(2 pi i (r / wavelength + phase of the cell)), r the
/// optical length from pixel to source in the phase, and in the amplitude the length in air that
/// spreads light as much, a quarter of a pixel at least. Triangles have corners in single precision
/// in the scene frame, as the device has them; all else is double.
TracedField trace_fan(const Scene& scene, const World& world, const Plan& plan, const Wrp& wrp,
                      std::uint32_t seed);

}  // namespace raywave::reference
