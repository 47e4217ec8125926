// SPDX-License-Identifier: Apache-2.0
/// A picture through a lens, in double precision, ray by ray and triangle by triangle: the oracle
/// of kernels/view/lens.cl.
#pragma once

#include <glm/vec2.hpp>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave::reference {

/// A picture as LensSpec asks for it, with the whole hologram open.
struct LensView {
  double z_m = 1;
  glm::ivec2 size{1, 1};  // pixels
  glm::dvec2 pixel_m{1, 1};
  int points = 1;  // per axis
};

struct LensPicture {
  std::vector<double> radiance;  // row 0 is the top
  // Pixels one of whose rays passes an edge, or has a light beside one, closer than floats tell
  std::vector<bool> unsure;
};

LensPicture seen_by_lens(const Scene& scene, const World& world, const Plan& plan,
                         const LensView& view);

}  // namespace raywave::reference
