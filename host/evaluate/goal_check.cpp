// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/goal_check.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/common/format.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/stopwatch.hpp"

namespace raywave {
namespace {

constexpr double pixels_in_blur = 3;
constexpr int lens_points = 6;

}  // namespace

std::string GoalCheck::text() const {
  return format("PSNR %.1f dB measured in %s at %s, where %.4g were asked for, %.1f predicted",
                measured_db, window.text().c_str(),
                length_text(std::round(resolution_m * 1e7) / 1e7).c_str(), asked_db, predicted_db);
}

std::optional<GoalCheck> check_goal(const cl::Device& device, const Goal& goal,
                                    const std::vector<Planned>& planned, const World& world,
                                    Rendered& rendered, const RenderOptions& how) {
  const auto laser = static_cast<std::size_t>(
      std::max_element(planned.begin(), planned.end(),
                       [](const Planned& a, const Planned& b) {
                         return a.scene.hologram.wavelength_m < b.scene.hologram.wavelength_m;
                       }) -
      planned.begin());
  if (!goal.psnr_db || laser == planned.size()) return {};
  const auto& prediction = planned[laser].prediction;
  if (!prediction.pictures || prediction.pictures->dark) return {};
  GoalCheck check{.asked_db = *goal.psnr_db,
                  .predicted_db = prediction.pictures->mean_psnr_db,
                  .window = prediction.pictures->window,
                  .resolution_m = prediction.resolution_m};
  QualitySpec what;
  what.views = false;
  what.field = false;
  what.window = check.window;
  what.blur_m = blur_of_resolution * check.resolution_m;
  what.lens_points = lens_points;
  const auto& pitch_m = planned[laser].plan.hologram.pitch_m;
  what.square_px =
      std::max(1, static_cast<int>(*what.blur_m / std::max(pitch_m.x, pitch_m.y) / pixels_in_blur));
  const Rendered one{{rendered.lasers[laser]}, {}, {}};
  LensPictures lens;
  const auto result = timed(check.seconds, [&] {
    return assess_frames(device, {planned[laser].scene}, world, one,
                         {one.lasers[0].plan.hologram.frames}, how, what, lens)
        .front();
  });
  for (const auto& row : result.rows)
    check.measured_db += row.figures.luminance.psnr_db / static_cast<double>(result.rows.size());
  if (!check.is_kept())
    for (auto& each : rendered.lasers) each.notes.push_back(check.text());
  return check;
}

nlohmann::ordered_json json_of(const GoalCheck& check) {
  return {{"asked_psnr_db", check.asked_db},
          {"predicted_psnr_db", check.predicted_db},
          {"measured_psnr_db", check.measured_db},
          {"kept", check.is_kept()},
          {"window_m", json_of(check.window)},
          {"resolution_m", check.resolution_m},
          {"seconds", check.seconds}};
}

}  // namespace raywave
