// SPDX-License-Identifier: Apache-2.0
/// How the pictures of a hologram are judged: where they are focused, how they are blurred, and
/// what is left out. Shared by their measurement (host/evaluate/quality.hpp) and their prediction
/// (host/forecast/picture_model.hpp).
#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "host/plan/front_view.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// Pixels left out on every side after the blur.
inline constexpr int picture_border_px = 20;

/// Depths that pictures are focused on, in metres: nearest surface, farthest surface, and out of
/// focus, before the nearest by a tenth of the depth between them, or by 1 % of its distance where
/// that is more; of a scene on both sides of the hologram, of the depth on the nearest one's side.
/// Surfaces at one depth count once.
std::vector<double> quality_depths_m(const Plan& plan);

/// The part of every picture that is judged.
struct PictureWindow {
  glm::dvec2 low_m{0, 0}, high_m{0, 0};

  static PictureWindow around_axis(glm::dvec2 size_m) { return {-size_m / 2.0, size_m / 2.0}; }
  glm::dvec2 size_m() const { return high_m - low_m; }
  /// The smallest window around the axis that holds it.
  glm::dvec2 centred_size_m() const;
  /// "13.2 x 8.2 mm", "13.2 x 8.2 mm around (1, 0) mm"
  std::string text() const;
  bool operator==(const PictureWindow&) const = default;
};

/// The rectangle around what a lens sees, at all quality_depths_m, with a margin of 4 blurs and the
/// border; no farther than the lattice, where the scene goes on beyond it. Around the axis and as
/// large as what WRPs cover where all is dark, and where surfaces lie near the hologram.
///
/// blur_m  standard deviation
PictureWindow quality_window(const Plan& plan, const FrontView& view, double blur_m);

}  // namespace raywave
