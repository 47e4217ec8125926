// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <mutex>
#include <raywave/live.hpp>
#include <utility>

#include "host/api/state.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/live/planning.hpp"

namespace raywave::v0 {
namespace {

void require_unplanned(const Scene::State& scene, bool has_goal) {
  if (has_goal && scene.is_planned)
    throw InputError("preset, budget, psnr and rate: the scene of a plan has its values chosen");
}

raywave::Goal goal_for(const Scene::State& scene, const Goal& goal) {
  require_unplanned(scene, goal_of(goal).any());
  return goal_of(goal);
}

int checked_side(int longest) {
  if (longest >= 16 && longest <= 4096) return longest;
  throw InputError("longest: must be 16 to 4096 pixels, got " + std::to_string(longest));
}

void require(bool is_possible, const char* name, const std::string& what, double got) {
  if (!is_possible) throw InputError(std::string(name) + ": " + what + ", got " + number_text(got));
}

}  // namespace

struct LiveView::State {
  State(const Scene& scene, const LiveOptions& options)
      : of(scene),
        opened(open(options.on)),
        live(opened.device, opened.fft, scene.state().world(),
             planning_of(scene.state().scenes, goal_for(scene.state(), options.goal),
                         opened.device.info()),
             checked_side(options.longest)),
        start(live.start()) {}

  /// Refuses what can only be a slip.
  void require_possible(const Viewing& viewing) const {
    require_unplanned(of.state(), viewing.preset.has_value());
    if (viewing.poses.size() != start.poses.size())
      throw InputError("poses: there are " + std::to_string(viewing.poses.size()) +
                       ", and the scene has " + std::to_string(start.poses.size()) + " objects");
    for (std::size_t i = 0; i < viewing.poses.size(); ++i)
      require_pose(i, viewing.poses.size(), viewing.poses[i].position_m,
                   viewing.poses[i].rotation_deg);
    for (const double x : viewing.view)
      require(std::abs(x) <= 1, "view", "must be -1 to 1, in half holograms", x);
    require(viewing.aperture >= 0.01 && viewing.aperture <= 1, "aperture",
            "must be 0.01 to 1, the part of the hologram", viewing.aperture);
    if (const auto& pupil_m = viewing.pupil_m)
      require(*pupil_m >= 1e-6 && *pupil_m <= 1, "pupil", "must be 1e-06 to 1 m", *pupil_m);
    const bool has_part = viewing.aperture != 1;
    if (has_part && viewing.pupil_m)
      throw InputError("pupil: takes the place of aperture; give one of them");
    if (of.state().scenes[0].viewer.eyepiece_m && (has_part || viewing.view != Vec2{0, 0}))
      throw InputError(
          "view, aperture: behind an eyepiece, the viewer's first pupil is looked through; "
          "the scene's viewer.pupil_position moves it, pupil sets its width");
    require(std::abs(viewing.stops) <= 20, "stops", "must be -20 to 20", viewing.stops);
  }

  Light changed(std::size_t light, const std::vector<std::string>& values) const {
    require_one_of("light", light, start.lights.size());
    auto overrides = of.overrides();
    for (const auto& value : values)
      overrides.push_back("light." + std::to_string(light) + "." + value);
    return parse_scenes(of.state().text, overrides).front().lights[light];
  }

  const Scene of;
  Opened opened;
  LiveScene live;
  const raywave::Viewing start;
  std::mutex mutex;
};

void Viewing::Pose::turn(const Vec3& by_deg) {
  raywave::Viewing::Pose pose{.rotation_deg = vector_of(rotation_deg)};
  pose.turn(vector_of(by_deg));
  rotation_deg = {pose.rotation_deg.x, pose.rotation_deg.y, pose.rotation_deg.z};
}

LiveView::LiveView(const Scene& scene, const LiveOptions& options)
    : state_(std::make_unique<State>(scene, options)) {}
LiveView::~LiveView() = default;
LiveView::LiveView(LiveView&&) noexcept = default;
LiveView& LiveView::operator=(LiveView&&) noexcept = default;

Viewing LiveView::start() const {
  Viewing viewing;
  viewing.focus_m = state_->start.focus_m;
  for (const auto& [at, turned] : state_->start.poses)
    viewing.poses.push_back({{at.x, at.y, at.z}, {turned.x, turned.y, turned.z}});
  return viewing;
}

Vec2 LiveView::window_m() const {
  const auto window_m = state_->live.window_m();
  return {window_m.x, window_m.y};
}

double LiveView::depth_m() const {
  const std::lock_guard lock(state_->mutex);
  return state_->live.depth_m();
}

std::vector<std::string> LiveView::notes() const {
  const std::lock_guard lock(state_->mutex);
  return state_->live.notes();
}

LivePicture LiveView::look(const Viewing& viewing) {
  const std::lock_guard lock(state_->mutex);
  state_->require_possible(viewing);
  auto wanted = state_->start;
  for (std::size_t i = 0; i < viewing.poses.size(); ++i)
    wanted.poses[i] = {vector_of(viewing.poses[i].position_m),
                       vector_of(viewing.poses[i].rotation_deg)};
  for (const auto& [light, values] : viewing.lights)
    wanted.lights.at(light) = state_->changed(light, values);
  wanted.focus_m = viewing.focus_m;
  wanted.eye = vector_of(viewing.view);
  wanted.part = viewing.aperture;
  wanted.pupil_m = viewing.pupil_m;
  wanted.hologram = viewing.has_levels;
  wanted.lens = viewing.has_lens;
  wanted.stops = viewing.stops;
  wanted.plans = {viewing.preset, viewing.is_refined};
  auto picture = state_->live.look(wanted);
  return {picture.size_px.x,  picture.size_px.y, std::move(picture.rgb),
          picture.hologram_s, picture.picture_s, std::move(picture.note)};
}

}  // namespace raywave::v0
