// SPDX-License-Identifier: Apache-2.0
/// Extents of a world as the hologram sees it, and its mean depths: the input of plans.
#pragma once

#include <algorithm>
#include <array>
#include <glm/vec2.hpp>
#include <limits>
#include <span>
#include <vector>

#include "host/geometry/world.hpp"

namespace raywave {

struct Interval {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double x) { add({x, x}); }
  void add(const Interval& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
  }
  double middle() const { return (low + high) / 2; }
  double extent() const { return high - low; }
};

/// Extents, along x and y, of surfaces as the hologram's window sees them through a plane.
struct Extents {
  // Slopes x/z and y/z of the chief rays, from the surfaces to the hologram's centre
  std::array<Interval, 2> tangents;
  // Interval of the plane, in metres, in which light passes it on its path into the window
  std::array<Interval, 2> passed;
  // Largest sideways distance, in metres, of a surface from the region whose light reaches all of
  // the window, made `wider` times as large, below largest_tangent; > 0: some light is steeper
  std::array<double, 2> beyond_m{-std::numeric_limits<double>::infinity(),
                                 -std::numeric_limits<double>::infinity()};
  void add(const Extents& other);
};

/// The hologram's window, or a tile's, and a plane before it through which light passes.
struct SeenThrough {
  double distance_m;    // from the plane to the hologram, along the light
  glm::dvec2 centre_m;  // of the window
  glm::dvec2 half_m;    // half the window's sides
  glm::dvec2 largest_tangent;
  double wider;  // factor on the window's sides, for `beyond_m`
};

/// Extents of surfaces.
///
/// points  all corners of the surfaces
Extents extents_of(std::span<const glm::dvec3> points, const SeenThrough& seen);

/// Extents of all surfaces of a world, to a few roundings.
Extents extents_of(const World& world, const SeenThrough& seen);

/// Sources of light that are no surfaces of their own: what mirrors and glass show.
struct DepthWeight {
  double z_m = 0;
  double seen_m2 = 0;  // twice the area that the hologram sees
};

/// Distances (m) of WRPs from the hologram at which aimed gathering costs least. Footprints grow
/// with the distance of a sample from its WRP, so these are the mean depths of the objects' near
/// sides, weighted with their area as the hologram sees it.
///
/// layers   number of depth layers; fewer distances are returned when fewer have surfaces. Either
///          winding may be the outside.
/// dark     objects whose surfaces have no light of their own; none: all have
std::vector<double> middles_of_surfaces(const World& world, int layers,
                                        const std::vector<bool>& dark = {},
                                        std::span<const DepthWeight> more = {});

}  // namespace raywave
