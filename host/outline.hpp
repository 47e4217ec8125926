// SPDX-License-Identifier: Apache-2.0
/// What plans must know of every vertex and triangle of a world.
#pragma once

#include <algorithm>
#include <array>
#include <glm/vec2.hpp>
#include <limits>

#include "host/mesh.hpp"

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

/// A world as the hologram's window sees it through a plane at distance_m.
struct Outline {
  std::array<Interval, 2> tangents;  // of chief rays, to the hologram's centre
  std::array<Interval, 2> passed;    // where light passes through the plane on its way into the window
  double steepest[2];                // of light into the window, `wider` times as large: by how much it is beyond largest_tangent, m
};

Outline outline_of(const World& world, double distance_m, glm::dvec2 window_m, double wider, glm::dvec2 largest_tangent);

/// Where aimed gathering costs least: footprints grow with the distance of a sample from the WRP, so the middle, by area as the hologram
/// sees it, of the objects' near sides. Either winding may be the outside.
double middle_of_surfaces(const World& world);

}  // namespace raywave
