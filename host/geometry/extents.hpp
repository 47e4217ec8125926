// SPDX-License-Identifier: Apache-2.0
/// What plans must know of every vertex and triangle of a world.
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
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
  double middle() const { return (low + high) / 2; }
  double extent() const { return high - low; }
};

/// Surfaces as the hologram's window sees them through a plane at distance_m.
struct Extents {
  std::array<Interval, 2> tangents;  // of chief rays, to the hologram's centre
  // Where light passes through the plane on its way into the window
  std::array<Interval, 2> passed;
  // How far surfaces lie beyond where the window, `wider` times as large, receives their light
  // below largest_tangent; > 0: some do.
  std::array<double, 2> beyond_m{-std::numeric_limits<double>::infinity(),
                                 -std::numeric_limits<double>::infinity()};
  void add(const Extents& other);
};

/// The hologram's window, or a tile's, and what a plane before it shows of surfaces.
struct SeenThrough {
  double distance_m;    // from the plane to the hologram
  glm::dvec2 centre_m;  // of the window
  glm::dvec2 half_m;    // of its sides
  glm::dvec2 largest_tangent;
  double wider;
};

/// points  all corners of the surfaces
Extents extents_of(std::span<const glm::dvec3> points, const SeenThrough& seen);

/// Of all surfaces, to a few roundings.
Extents extents_of(const World& world, const SeenThrough& seen);

/// Where aimed gathering costs least: footprints grow with the distance of a sample from its WRP,
/// so the middles, by area as the hologram sees it, of the objects' near sides, in so many layers of
/// depth (or as many as have surfaces). Either winding may be the outside.
std::vector<double> middles_of_surfaces(const World& world, int layers);

}  // namespace raywave
