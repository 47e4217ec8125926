// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/wrps/planning/wrp_culling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <span>

#include "host/plan/footprint.hpp"

namespace raywave {
namespace {

/// The part of a triangle that lies in a layer: a convex polygon of at most five corners.
struct Polygon {
  std::array<glm::dvec3, 5> corners;
  std::size_t count = 0;
};

Polygon within(const DepthLayer& layer, const std::array<glm::dvec3, 3>& triangle) {
  Polygon part{{triangle[0], triangle[1], triangle[2]}, 3};
  for (const double side : {1.0, -1.0}) {
    const double at = side > 0 ? layer.begin_m : layer.end_m;
    const auto before = part;
    part.count = 0;
    for (std::size_t i = 0; i < before.count; ++i) {
      const auto &a = before.corners[i], &b = before.corners[(i + 1) % before.count];
      const bool a_inside = side * a.z >= side * at, b_inside = side * b.z >= side * at;
      if (a_inside) part.corners[part.count++] = a;
      if (a_inside != b_inside)
        part.corners[part.count++] = glm::mix(a, b, (at - a.z) / (b.z - a.z));
    }
  }
  return part;
}

/// True when a rectangle around `middle` meets a convex polygon, by the separating axes of both.
bool meets(glm::dvec2 middle, glm::dvec2 half, std::span<const glm::dvec2> polygon) {
  const auto apart = [&](glm::dvec2 axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto& corner : polygon) {
      low = std::min(low, glm::dot(corner - middle, axis));
      high = std::max(high, glm::dot(corner - middle, axis));
    }
    const double reach = std::abs(axis.x) * half.x + std::abs(axis.y) * half.y;
    return low > reach || high < -reach;
  };
  if (apart({1, 0}) || apart({0, 1})) return false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto side = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (apart({-side.y, side.x})) return false;
  }
  return true;
}

}  // namespace

glm::dvec2 reach_of_light(const Plan& plan, const DepthLayer& layer, double z_m) {
  // A chief ray is that to the hologram's centre, so even a narrow cone counts as the whole window.
  glm::dvec2 reach;
  for (int axis = 0; axis < 2; ++axis) {
    const double window_m = plan.tile_window_m()[axis], cone = plan.tiling.cone[axis];
    reach[axis] = window_m / 2 +
                  half_width_of(std::max(cone, 1.0), window_m, layer.distance_m, z_m) +
                  plane_wave_tail * spot_of(plan.hologram.wavelength_m, z_m, cone, window_m);
  }
  return reach;
}

std::vector<Wrp> lit_wrps(const Plan& plan, const World& world, std::vector<Wrp> wrps) {
  std::vector<bool> lit(wrps.size(), false);
  std::size_t dark = wrps.size();

  // Marks the WRPs that a triangle lights: those that the chief rays of its part in their layer
  // cross, or pass within the reach of light.
  const auto look_at = [&](std::size_t triangle) {
    const auto corners = world.corners_m(triangle);
    for (std::size_t s = 0; s < plan.layers.size(); ++s) {
      const auto& layer = plan.layers[s];
      const auto part = within(layer, corners);
      if (part.count == 0) continue;
      glm::dvec2 half(0);
      for (std::size_t i = 0; i < part.count; ++i)
        half = glm::max(half, reach_of_light(plan, layer, part.corners[i].z));
      // Where chief rays to the WRP's tile cross its plane
      std::array<glm::dvec2, 5> crossing;
      const Tile* to = nullptr;
      for (std::size_t i = 0; i < wrps.size(); ++i) {
        if (lit[i] || wrps[i].layer != s) continue;
        if (const auto* tile = &plan.tile_of(wrps[i]); tile != to) {
          to = tile;
          for (std::size_t j = 0; j < part.count; ++j) {
            const auto& p = part.corners[j];
            crossing[j] = to->centre_m + (glm::dvec2(p) - to->centre_m) * (layer.distance_m / p.z);
          }
        }
        if (!meets(wrps[i].centre_m, half, std::span(crossing).first(part.count))) continue;
        lit[i] = true;
        --dark;
      }
    }
  };

  // A few triangles from everywhere come first: mostly they light all. Primes keep out of step with
  // the rows of meshes.
  for (const std::size_t step : {10007, 1009, 101, 1}) {
    for (std::size_t i = 0; i < world.triangles.size(); i += step) {
      if (dark == 0) return wrps;
      look_at(i);
    }
  }
  if (dark == wrps.size()) return wrps;
  std::vector<Wrp> kept;
  for (std::size_t i = 0; i < wrps.size(); ++i) {
    if (lit[i]) kept.push_back(std::move(wrps[i]));
  }
  return kept;
}

}  // namespace raywave
