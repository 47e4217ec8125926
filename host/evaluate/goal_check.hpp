// SPDX-License-Identifier: Apache-2.0
/// Whether a hologram shows what a goal asked for.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/evaluate/quality.hpp"
#include "host/forecast/presets.hpp"

namespace raywave {

/// PSNR in dB: means of the whole pictures of the levels at quality_depths_m.
struct GoalCheck {
  double asked_db = 0, predicted_db = 0, measured_db = 0;
  PictureWindow window;
  double resolution_m = 0;  // pictures are blurred by blur_of_resolution of it
  double seconds = 0;       // that measuring took

  /// Measurements on coarse pixels are off by as much from those of `raywave quality`.
  static constexpr double tolerance_db = 0.5;
  bool is_kept() const { return measured_db >= asked_db - tolerance_db; }
  /// "PSNR 35.7 dB measured in 13.8 x 8.58 mm at 0.1 mm, where 40 were asked for, 40.3 predicted"
  std::string text() const;
};

/// Measures what a goal in PSNR has reached, as it is predicted: in the same window, at the same
/// depths and resolution, of the laser that the goal was planned for. It is cheap: pixels are a
/// third of a blur, and the lens has 6 x 6 points. Where the goal is not kept, the notes of all
/// lasers get a line.
///
/// planned  of the goal, by laser
/// how      of the rendering; its progress is called
/// returns  none where the goal asks for no PSNR, or nothing is predicted
std::optional<GoalCheck> check_goal(const cl::Device& device, const Goal& goal,
                                    const std::vector<Planned>& planned, const World& world,
                                    Rendered& rendered, const RenderOptions& how);

nlohmann::ordered_json json_of(const GoalCheck& check);

}  // namespace raywave
