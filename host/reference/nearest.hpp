// SPDX-License-Identifier: Apache-2.0
/// The nearest surface that is there, found one triangle after the other.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "host/reference/looks.hpp"
#include "host/reference/rays.hpp"

namespace raywave::reference {

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

}  // namespace raywave::reference
