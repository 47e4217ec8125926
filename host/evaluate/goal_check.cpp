// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/goal_check.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/common/text.hpp"
#include "host/evaluate/stopwatch.hpp"

namespace raywave {
namespace {

constexpr double pixels_in_blur = 3;
constexpr int lens_points = 4;

std::vector<Scene> scenes_of(const std::vector<Planned>& planned) {
  std::vector<Scene> scenes;
  for (const auto& laser : planned) scenes.push_back(laser.scene);
  return scenes;
}

}  // namespace

std::optional<double> GoalCheck::wanted_db() const {
  if (goal.psnr_db) return goal.psnr_db;
  return goal.preset ? predicted_db : std::nullopt;
}

bool GoalCheck::is_kept() const {
  if (const auto time_s = goal.time_s()) return picture_s <= *time_s;
  return !measured_db || !wanted_db() || *measured_db >= *wanted_db() - tolerance_db;
}

std::string GoalCheck::text() const {
  std::string text;
  if (const auto time_s = goal.time_s())
    text = "a picture took " + duration_text(picture_s) + ", where " + duration_text(*time_s) +
           " were asked for";
  if (!measured_db) return text;
  text += format("%sPSNR %.1f dB measured in %s at %s", text.empty() ? "" : "; ", *measured_db,
                 window.text().c_str(), length_text(std::round(resolution_m * 1e7) / 1e7).c_str());
  if (goal.psnr_db) text += format(", where %.4g were asked for", *goal.psnr_db);
  if (goal.preset) text += format(", by the preset %s", name_of(*goal.preset));
  return predicted_db ? text + format(", %.1f predicted", *predicted_db) : text;
}

void GoalCheck::measure(const QualityResult& result, double pitch_m) {
  window = result.window;
  resolution_m = result.blur_px * pitch_m / blur_of_resolution;
  double sum_db = 0, count = 0;
  for (const auto& row : result.rows) {
    if (row.view != whole_view.name && !row.pupil) continue;
    sum_db += row.figures.luminance.psnr_db;
    ++count;
  }
  measured_db = sum_db / count;
}

double picture_s(const Rendered& rendered) {
  double sum_s = 0;
  for (const auto& laser : rendered.lasers)
    for (const auto* stage : {"samples", "trace", "propagate", "refine", "encode"})
      sum_s += seconds_of(laser.seconds, stage);
  return sum_s;
}

std::optional<GoalCheck> promised(const Goal& goal, const std::vector<Planned>& planned,
                                  const Rendered& rendered) {
  if (!goal.any() || planned.empty()) return {};
  const auto& prediction = planned[planned_laser(scenes_of(planned))].prediction;
  if (!prediction.pictures || prediction.pictures->dark) return {};
  return GoalCheck{.goal = goal,
                   .predicted_db = prediction.pictures->mean_psnr_db,
                   .window = prediction.pictures->window,
                   .resolution_m = prediction.resolution_m,
                   .picture_s = picture_s(rendered)};
}

void measure_judged(const cl::Device& device, const std::vector<Scene>& scenes, const World& world,
                    const Rendered& rendered, const RenderOptions& how, GoalCheck& check) {
  const auto laser = planned_laser(scenes);
  const auto& scene = scenes[laser];
  const auto& pitch_m = scene.hologram.pitch_m;
  QualitySpec what;
  what.views = false;
  what.field = false;
  what.window = check.window;
  if (scene.viewer.eyepiece_m) what.pupils = pupils_of(scene.viewer);
  what.blur_m = blur_of_resolution * check.resolution_m;
  what.lens_points = lens_points;
  what.square_px =
      std::max(1, static_cast<int>(*what.blur_m / std::max(pitch_m.x, pitch_m.y) / pixels_in_blur));
  const Rendered one{{rendered.lasers[laser]}, {}, {}};
  LensPictures lens;
  check.measure(timed(check.seconds,
                      [&] {
                        return assess_frames(device, {scene}, world, one,
                                             {one.lasers[0].plan.hologram.frames}, how, what, lens)
                            .front();
                      }),
                pitch_m.x);
}

std::optional<GoalCheck> check_goal(const cl::Device& device, const Goal& goal,
                                    const std::vector<Planned>& planned, const World& world,
                                    Rendered& rendered, const RenderOptions& how) {
  auto check = promised(goal, planned, rendered);
  if (!check) return {};
  if (goal.psnr_db) measure_judged(device, scenes_of(planned), world, rendered, how, *check);
  if (!check->is_kept())
    for (auto& each : rendered.lasers) each.notes.push_back(check->text());
  return check;
}

Json json_of(const GoalCheck& check) {
  Json json;
  const auto& goal = check.goal;
  if (goal.psnr_db) json["asked_psnr_db"] = *goal.psnr_db;
  if (goal.preset) json["preset"] = name_of(*goal.preset);
  if (goal.budget_s) json["budget_s"] = *goal.budget_s;
  if (goal.rate_per_s) json["rate_per_s"] = *goal.rate_per_s;
  if (check.predicted_db) json["predicted_psnr_db"] = *check.predicted_db;
  if (check.measured_db) json["measured_psnr_db"] = *check.measured_db;
  if ((check.measured_db && !goal.preset) || goal.time_s()) json["kept"] = check.is_kept();
  json.update({{"window_m", json_of(check.window)},
               {"resolution_m", check.resolution_m},
               {"seconds", check.seconds},
               {"picture_s", check.picture_s}});
  return json;
}

void judge_as_planned(const GoalCheck& check, QualitySpec& spec) {
  if (!check.predicted_db) return;
  if (!spec.blur_m) spec.blur_m = blur_of_resolution * check.resolution_m;
  if (!spec.window) spec.window = check.window;
}

GoalCheck goal_of_json(const Json& json) {
  GoalCheck check;
  const auto take = [&](const char* key, std::optional<double>& value) {
    if (json.contains(key)) value = json.at(key).get<double>();
  };
  take("asked_psnr_db", check.goal.psnr_db);
  take("budget_s", check.goal.budget_s);
  take("rate_per_s", check.goal.rate_per_s);
  take("predicted_psnr_db", check.predicted_db);
  if (json.contains("preset"))
    check.goal.preset = choice_of<Preset>(json.at("preset").get<std::string>(), "preset");
  const auto& window = json.at("window_m");
  for (int axis = 0; axis < 2; ++axis) {
    check.window.low_m[axis] = window.at("low").at(static_cast<std::size_t>(axis)).get<double>();
    check.window.high_m[axis] = window.at("high").at(static_cast<std::size_t>(axis)).get<double>();
  }
  check.resolution_m = json.at("resolution_m").get<double>();
  return check;
}

}  // namespace raywave
