// SPDX-License-Identifier: Apache-2.0
#include "host/animate/animate.hpp"

#include <algorithm>
#include <chrono>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/animate/contents.hpp"
#include "host/animate/write_queue.hpp"
#include "host/common/digest.hpp"
#include "host/common/error.hpp"
#include "host/encode/panel.hpp"
#include "host/plan/make_plan.hpp"
#include "host/plan/predict/memory.hpp"
#include "host/trace/tuning.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

/// Pictures that wait to be written.
constexpr std::size_t longest_queue = 2;

/// Of what is seen around all objects.
constexpr double window_margin = 1.04;

/// The scene with as many frames as the picture with most holograms needs.
Scene with_frames(Scene scene, const Schedule& schedule) {
  scene.sampling.frames = schedule.most_of_a_picture();
  return scene;
}

nlohmann::ordered_json json_of(const glm::dvec3& v) { return {v.x, v.y, v.z}; }
nlohmann::ordered_json json_of(const glm::dvec2& v) { return {v.x, v.y}; }

}  // namespace

Animator::Animator(const cl::Device& device, Scene scene, cl::FftBackend fft)
    : device_(device),
      scene_(std::move(scene)),
      fft_(fft),
      schedule_(scene_.animation.value(), scene_.sampling.frames) {
  scene_ = with_shapes(with_frames(std::move(scene_), schedule_));
  world_ = build_world(scene_);
  Scene moved = scene_;
  const auto move_to = [&](int picture) {
    try {
      moved = scene_at(scene_, picture);
      move_objects(moved, world_);
      reach_m_ = glm::max(reach_m_, glm::max(glm::abs(glm::dvec2(world_.min_m)),
                                             glm::abs(glm::dvec2(world_.max_m))));
    } catch (const InputError& error) {
      throw InputError(std::string(error.what()) + "; this is in picture " +
                       std::to_string(picture) + " of the animation");
    }
  };
  const MemoryUse use{Method::wrp, fft_, false};
  const bool has_doubles = device_.info().fp64;
  base_ = std::make_shared<const Plan>(
      fitting_plan_of_poses(moved, world_, schedule_.pictures(), move_to, limits_of(device_.info()),
                            use, RenderOptions{}.rays_per_axis, has_doubles));
  move_to(0);
  plan_ = std::make_shared<const Plan>(make_plan(
      moved, world_, Method::wrp, RenderOptions{}.rays_per_axis, has_doubles, base_.get()));
}

Camera Animator::camera(int picture) const {
  auto camera = camera_at(scene_.animation.value(), picture);
  if (!camera.depth_m) {
    const double middle_m = (plan_->near_m + plan_->far_m) / 2;
    camera.depth_m = std::abs(middle_m) < plan_->closest_m ? plan_->near_m : middle_m;
  }
  if (!camera.window_m) {
    // What lies beyond is dark: pixels show no steeper light
    const auto sine = glm::min(plan_->largest_sine, glm::dvec2(0.99));
    const auto lit_m = glm::dvec2(plan_->size) * plan_->pitch_m +
                       2 * plan_->farthest_m * sine / glm::sqrt(1.0 - sine * sine);
    camera.window_m = glm::min(2.0 * window_margin * reach_m_, lit_m);
  }
  return camera;
}

glm::ivec2 Animator::stored_size() const {
  const auto size = plan_->size;
  return plan_->slm.rotate_deg % 180 == 0 ? size : glm::ivec2(size.y, size.x);
}

std::string Animator::run_name(FrameStorage storage) const {
  const auto& info = device_.info();
  std::string text;
  for (const auto& part :
       {std::string(version), scene_.digest, digest_of_contents(scene_, world_), info.platform,
        info.name, info.driver, std::string(name_of(fft_)),
        std::string(storage == FrameStorage::pngs ? "pngs" : "stream"),
        std::to_string(base_->tile_grid.x) + " x " + std::to_string(base_->tile_grid.y),
        std::to_string(base_->most_layers), std::string(base_->compact ? "compact" : "spectrum")})
    text += part + '\n';
  return hash_name(text);
}

void Animator::show(const Scene& scene, int picture, Renderer& renderer) const {
  for (const auto i : moving_objects(*scene_.animation)) {
    const auto& object = scene.objects[i];
    renderer.set_solid_pose(i, object.position_m, object.rotation_deg, object.solid_scale.value());
    if (object.shape) renderer.set_shape(i, *object.shape);
  }
  for (const auto i : moving_lights(*scene_.animation)) renderer.set_light(i, scene.lights[i]);
  renderer.set_seed(scene_.sampling.seed + static_cast<std::uint32_t>(schedule_.first_of(picture)));
}

double Animator::brightest(Renderer& renderer) const {
  double clip = 0;
  if (plan_->slm.encoding == Encoding::phase) return clip;  // it shows no amplitudes
  for (const int picture : schedule_.spread(Schedule::pictures_that_scale)) {
    show(scene_at(scene_, picture), picture, renderer);
    clip = std::max(clip, renderer.render().clip);
  }
  return clip;
}

AnimateResult Animator::make_frames(FrameFiles& files, const Progress& progress) const {
  AnimateResult made;
  const int first = files.pictures(), end = schedule_.pictures();
  if (first >= end) {
    files.finish();
    return made;
  }
  RenderOptions how;
  how.fft = fft_;
  how.keep_field = false;
  how.base_plan = base_;
  // Begins with the first picture whichever comes next: frames of instances lie where it has them
  Renderer renderer(device_, scene_at(scene_, 0), world_, how);
  if (const double clip = brightest(renderer); clip > 0) renderer.set_clip(clip);
  std::chrono::steady_clock::time_point start;
  WriteQueue queue(longest_queue);
  for (int picture = first; picture < end; ++picture) {
    if (progress)
      progress("picture " + std::to_string(picture + 1) + " of " + std::to_string(end),
               static_cast<double>(picture) / end);
    const auto scene = scene_at(scene_, picture);
    show(scene, picture, renderer);
    auto result = renderer.render();
    result.levels.resize(static_cast<std::size_t>(schedule_.count_of(picture)));
    for (const auto& note : result.notes)
      if (std::find(made.notes.begin(), made.notes.end(), note) == made.notes.end())
        made.notes.push_back(note);
    // std::function wants what can be copied
    auto levels =
        std::make_shared<std::vector<std::vector<std::uint8_t>>>(std::move(result.levels));
    queue.push([levels, &files, size = result.plan.size, slm = result.plan.slm,
                line = line_of(picture, scene, result)] {
      for (auto& one : *levels) one = for_slm(LevelPicture{size, std::move(one)}, slm).levels;
      files.add(*levels, line);
    });
    if (picture > first)
      for (const auto& [stage, s] : result.processor_seconds) made.processor_seconds[stage] += s;
    if (picture == first) start = std::chrono::steady_clock::now();
    ++made.pictures;
    made.holograms += schedule_.count_of(picture);
    if (picture > first) made.timed_holograms += schedule_.count_of(picture);
  }
  queue.finish();
  files.finish();
  made.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return made;
}

nlohmann::ordered_json Animator::line_of(int picture, const Scene& scene,
                                         const RenderResult& result) const {
  const auto& animation = scene_.animation.value();
  nlohmann::ordered_json line{{"picture", picture},
                              {"time_s", picture / animation.rate_per_s},
                              {"seed", result.plan.seed},
                              {"samples", result.samples},
                              {"near_m", result.plan.near_m},
                              {"far_m", result.plan.far_m},
                              {"planes", result.plan.wrps.size()}};
  auto& objects = line["objects"] = nlohmann::ordered_json::array();
  for (const auto i : moving_objects(animation)) {
    const auto& object = scene.objects[i];
    objects.push_back({{"object", i},
                       {"position_m", json_of(object.position_m)},
                       {"rotation_deg", json_of(object.rotation_deg)},
                       {"scale", object.solid_scale.value()}});
    if (object.shape) objects.back()["mesh"] = *object.shape;
  }
  auto& lights = line["lights"] = nlohmann::ordered_json::array();
  for (const auto i : moving_lights(animation)) {
    const auto& light = scene.lights[i];
    lights.push_back({{"light", i}, {"intensity", light.intensity}});
    if (light.type == LightType::point) lights.back()["position_m"] = json_of(light.position_m);
    if (light.type == LightType::directional) lights.back()["direction"] = json_of(light.direction);
  }
  const auto at = camera(picture);
  line["camera"] = {{"depth_m", at.depth_m.value()},
                    {"view", json_of(at.view)},
                    {"aperture", json_of(at.aperture)}};
  if (!result.notes.empty()) line["notes"] = result.notes;
  return line;
}

}  // namespace raywave
