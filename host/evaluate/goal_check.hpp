// SPDX-License-Identifier: Apache-2.0
/// Whether a hologram shows what a goal asked for.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/common/json.hpp"
#include "host/evaluate/quality.hpp"
#include "host/forecast/presets.hpp"

namespace raywave {

/// PSNR in dB: means of the whole pictures of the levels at quality_depths_m.
struct GoalCheck {
  Goal goal{};
  std::optional<double> predicted_db{}, measured_db{};
  PictureWindow window{};
  double resolution_m = 0;  // pictures are blurred by blur_of_resolution of it
  double seconds = 0;       // that measuring took
  double picture_s = 0;     // that the picture took

  /// Measurements on coarse pixels are off by as much from those of `raywave quality`.
  static constexpr double tolerance_db = 0.5;
  /// The PSNR that was asked for; of a preset, the one that was predicted of its plan.
  std::optional<double> wanted_db() const;
  bool is_kept() const;
  /// "PSNR 35.7 dB measured in 13.8 x 8.58 mm at 0.1 mm, where 40 were asked for, 40.3 predicted",
  /// "a picture took 1.2 s, where 2 s were asked for; PSNR ..."
  std::string text() const;
  /// Takes what was measured of a hologram.
  void measure(const QualityResult& result, double pitch_m);
};

/// What a goal asks of a render, before its pictures are measured.
///
/// planned  of the goal, by laser
/// returns  none where there is no goal, or nothing is predicted
std::optional<GoalCheck> promised(const Goal& goal, const std::vector<Planned>& planned,
                                  const Rendered& rendered);

/// Time of a picture of all lasers, as Goal::budget_s means it: from its samples to its levels.
double picture_s(const Rendered& rendered);

/// Measures the laser that goals are planned for, the longest wavelength, alone: in the window and
/// at the resolution of `check`. It is cheap: pixels are a third of a blur, and the lens has 4 x 4
/// points.
void measure_judged(const cl::Device& device, const std::vector<Scene>& scenes, const World& world,
                    const Rendered& rendered, const RenderOptions& how, GoalCheck& check);

/// Measures what a goal in PSNR has reached, as it is predicted (measure_judged). Where the goal is
/// not kept, the notes of all lasers get a line.
///
/// planned  of the goal, by laser
/// how      of the rendering; its progress is called
/// returns  as `promised`; what no PSNR was asked of is not measured
std::optional<GoalCheck> check_goal(const cl::Device& device, const Goal& goal,
                                    const std::vector<Planned>& planned, const World& world,
                                    Rendered& rendered, const RenderOptions& how);

Json json_of(const GoalCheck& check);
/// What a report has as its goal, without what was measured.
GoalCheck goal_of_json(const Json& json);

/// Where nothing else is given, pictures are judged as the goal was planned.
void judge_as_planned(const GoalCheck& check, QualitySpec& spec);

}  // namespace raywave
