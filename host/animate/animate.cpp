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
#include "host/carriers/planning/facts.hpp"
#include "host/common/digest.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/panel.hpp"
#include "host/plan/message_text.hpp"
#include "host/planning/make_plan.hpp"
#include "host/trace/device_limits.hpp"
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
    : Animator(device, std::vector<Scene>{std::move(scene)}, fft) {}

Animator::Animator(const cl::Device& device, std::vector<Scene> scenes, cl::FftBackend fft)
    : device_(device),
      fft_(fft),
      schedule_(scenes.at(0).animation.value(), scenes[0].sampling.frames) {
  for (auto& one : scenes)
    lasers_.push_back({with_shapes(with_frames(std::move(one), schedule_)), {}, {}});
  world_ = build_world(scene());
  for (auto& laser : lasers_) plan_laser(laser);
}

/// Plans over all pictures, and for the first one, where the world is left.
void Animator::plan_laser(Laser& laser) {
  Scene moved = laser.scene;
  const auto move_to = [&](int picture) {
    try {
      moved = scene_at(laser.scene, picture);
      move_objects(moved, world_);
      reach_m_ = glm::max(reach_m_, glm::max(glm::abs(glm::dvec2(world_.min_m)),
                                             glm::abs(glm::dvec2(world_.max_m))));
    } catch (const InputError& error) {
      throw InputError(std::string(error.what()) + "; this is in picture " +
                       std::to_string(picture) + " of the animation");
    }
  };
  const bool has_doubles = device_.info().fp64;
  if (laser.scene.colour) {
    // One encoding for all pictures and lasers
    move_to(0);
    laser.scene.slm.encoding =
        make_plan(moved, world_, Method::wrp, RenderOptions{}.rays_per_axis, has_doubles)
            .slm.encoding;
  }
  const MemoryUse use{Method::wrp, fft_, laser.scene.colour.has_value()};
  laser.base = std::make_shared<const Plan>(
      fitting_plan_of_poses(moved, world_, schedule_.pictures(), move_to,
                            limits_of(device_.info()).for_one_of(static_cast<int>(lasers_.size())),
                            use, RenderOptions{}.rays_per_axis, has_doubles));
  move_to(0);
  laser.plan = std::make_shared<const Plan>(make_plan(
      moved, world_, Method::wrp, RenderOptions{}.rays_per_axis, has_doubles, laser.base.get()));
}

std::vector<std::string> Animator::laser_names() const {
  std::vector<std::string> names;
  for (const auto& laser : lasers_)
    if (lasers_.size() > 1) names.push_back(laser_name(laser.plan->hologram.wavelength_m));
  return names;
}

std::vector<std::string> Animator::notes(const PlanNotes& of_plan) const {
  std::vector<RenderResult> all;
  for (const auto& laser : lasers_) {
    auto& one = all.emplace_back();
    one.plan = *laser.plan;
    one.notes = of_plan(scene_at(laser.scene, 0), world_, one.plan);
  }
  return notes_of(all);
}

std::optional<LaserSet> Animator::colours() const {
  if (lasers_.size() == 1) return {};
  return scene().colour.value().lasers;
}

Camera Animator::camera(int picture) const {
  auto camera = camera_at(scene().animation.value(), picture);
  const auto& first = plan();
  if (!camera.depth_m) {
    const double middle_m = (first.extent.near_m + first.extent.far_m) / 2;
    camera.depth_m = std::abs(middle_m) < first.extent.closest_m ? first.extent.near_m : middle_m;
  }
  if (!camera.window_m) {
    // What lies beyond is dark: pixels show no steeper light
    glm::dvec2 lit_m(0);
    for (const auto& laser : lasers_) {
      const auto sine = glm::min(laser.plan->hologram.largest_sine, glm::dvec2(0.99));
      lit_m = glm::max(lit_m, first.window_m() + 2 * laser.plan->extent.farthest_m() * sine /
                                                     glm::sqrt(1.0 - sine * sine));
    }
    camera.window_m = glm::min(2.0 * window_margin * reach_m_, lit_m);
  }
  return camera;
}

glm::ivec2 Animator::stored_size() const {
  const auto size = plan().hologram.size;
  return plan().slm.rotate_deg % 180 == 0 ? size : glm::ivec2(size.y, size.x);
}

std::string Animator::run_name(FrameStorage storage) const {
  const auto& info = device_.info();
  std::string text;
  for (const auto& part :
       {std::string(version), scene().digest, info.platform, info.name, info.driver,
        std::string(name_of(fft_)), std::string(storage == FrameStorage::pngs ? "pngs" : "stream")})
    text += part + '\n';
  for (const auto& laser : lasers_) {
    const auto& base = *laser.base;
    for (const auto& part :
         {digest_of_contents(laser.scene, world_),
          std::to_string(base.tiling.grid.x) + " x " + std::to_string(base.tiling.grid.y),
          std::to_string(base.most_layers), std::string(name_of(propagation_of(base)))})
      text += part + '\n';
  }
  return hash_name(text);
}

bool Animator::lasers_dim(const Laser& laser) const {
  return laser.scene.colour && laser.scene.slm.encoding == Encoding::phase;
}

Renderer Animator::renderer(const Progress& progress) const {
  RenderOptions how;
  how.progress = progress;
  how.fft = fft_;
  how.keep_field = scene().colour.has_value();  // which the lasers' powers follow
  std::vector<Scene> scenes;
  for (const auto& laser : lasers_) {
    // Begins with the first picture whichever comes next: frames of instances lie where it has them
    scenes.push_back(scene_at(laser.scene, 0));
    how.base_plans.push_back(laser.base);
  }
  return {device_, std::move(scenes), world_, how};
}

void Animator::show(const Scene& scene, int picture, Renderer& renderer) const {
  for (const auto i : moving_objects(*scene.animation)) {
    const auto& object = scene.objects[i];
    renderer.set_solid_pose(i, object.position_m, object.rotation_deg, object.solid_scale.value());
    if (object.shape) renderer.set_shape(i, *object.shape);
  }
  for (const auto i : moving_lights(*scene.animation)) renderer.set_light(i, scene.lights[i]);
  renderer.set_seed(scene.sampling.seed + static_cast<std::uint32_t>(schedule_.first_of(picture)));
}

double Animator::power_of(const Laser& laser, const RenderResult& result, int picture) const {
  const auto& colour = laser.scene.colour.value();
  return colour.lasers.white_powers[colour.laser] * laser_need(result, schedule_.count_of(picture));
}

Animator::Scale Animator::brightest(Renderer& renderer) const {
  Scale scale;
  const bool scales = std::any_of(lasers_.begin(), lasers_.end(), [&](const Laser& laser) {
    return laser.plan->slm.encoding != Encoding::phase || (lasers_.size() > 1 && lasers_dim(laser));
  });
  if (!scales) return scale;
  for (const int picture : schedule_.spread(Schedule::pictures_that_scale)) {
    show(scene_at(scene(), picture), picture, renderer);
    const auto results = renderer.render_lasers();
    double power = 0;
    for (std::size_t i = 0; i < lasers_.size(); ++i) {
      scale.clip = std::max(scale.clip, results[i].clip);
      if (lasers_.size() > 1) power += power_of(lasers_[i], results[i], picture);
    }
    scale.power = std::max(scale.power, power);
  }
  return scale;
}

Animator::Pictures::Pictures(const Animator& animator, const Progress& progress)
    : of_(animator), renderer_(animator.renderer(progress)), scale_(of_.brightest(renderer_)) {
  if (scale_.clip > 0) renderer_.set_clip(scale_.clip);
}

AnimatedPicture Animator::Pictures::make(int picture) {
  const auto scene = scene_at(of_.scene(), picture);
  of_.show(scene, picture, renderer_);
  auto results = renderer_.render_lasers();
  const auto count = static_cast<std::size_t>(of_.schedule_.count_of(picture));
  const auto lasers = of_.lasers();
  AnimatedPicture made;
  made.levels.resize(count * lasers);
  made.line = of_.line_of(picture, scene, results[0]);
  for (std::size_t i = 0; i < lasers; ++i) {
    auto& result = results[i];
    const auto& laser = of_.lasers_[i];
    result.clip = scale_.clip;  // that it is shown with
    for (std::size_t j = 0; j < count; ++j)
      made.levels[j * lasers + i] = std::move(result.levels[j]);
    add_lines(made.notes, result.notes);
    if (lasers > 1)
      made.powers.push_back(of_.power_of(laser, result, picture) /
                            (of_.lasers_dim(laser) && scale_.power > 0 ? scale_.power : 1));
    for (const auto& [stage, s] : result.processor_seconds) made.processor_seconds[stage] += s;
  }
  if (!made.powers.empty()) made.line["powers"] = made.powers;
  if (!made.notes.empty()) made.line["notes"] = made.notes;
  return made;
}

void Animator::turn(std::vector<std::vector<std::uint8_t>>& levels) const {
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const auto& of_laser = plan(i % lasers());
    levels[i] =
        for_slm(LevelPicture{of_laser.hologram.size, std::move(levels[i])}, of_laser.slm).levels;
  }
}

AnimateResult Animator::make_frames(FrameFiles& files, const Progress& progress,
                                    std::optional<int> wanted_end) const {
  AnimateResult made;
  const int first = files.next(), all_pictures = schedule_.pictures(),
            end = std::min(wanted_end.value_or(all_pictures), all_pictures),
            begin = first - files.pictures();
  if (first >= end) {
    files.finish();
    return made;
  }
  Pictures pictures(*this);
  std::chrono::steady_clock::time_point start;
  WriteQueue queue(longest_queue);
  for (int picture = first; picture < end; ++picture) {
    if (progress)
      progress(
          "picture " + std::to_string(picture) + ", of 0 to " + std::to_string(all_pictures - 1),
          static_cast<double>(picture - begin) / (end - begin));
    // std::function wants what can be copied
    const auto one = std::make_shared<AnimatedPicture>(pictures.make(picture));
    add_lines(made.notes, one->notes);
    const auto holograms = static_cast<int>(one->levels.size());
    if (picture > first) {
      for (const auto& [stage, s] : one->processor_seconds) made.processor_seconds[stage] += s;
      made.timed_holograms += holograms;
    }
    queue.push([one, &files, this] {
      turn(one->levels);
      files.add(one->levels, one->line);
    });
    if (picture == first) start = std::chrono::steady_clock::now();
    ++made.pictures;
    made.holograms += holograms;
  }
  queue.finish();
  files.finish();
  made.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return made;
}

nlohmann::ordered_json Animator::line_of(int picture, const Scene& scene,
                                         const RenderResult& result) const {
  const auto& animation = scene.animation.value();
  nlohmann::ordered_json line{{"picture", picture},
                              {"time_s", picture / animation.rate_per_s},
                              {"seed", result.plan.hologram.seed},
                              {"samples", result.samples},
                              {"near_m", result.plan.extent.near_m},
                              {"far_m", result.plan.extent.far_m},
                              {"planes", result.plan.wrps.size()}};
  auto& objects = line["objects"] = nlohmann::ordered_json::array();
  for (const auto i : moving_objects(animation)) {
    const auto& object = scene.objects[i];
    objects.push_back({{"object", i},
                       {"position_m", json_of(object.position_m)},
                       {"rotation_deg", json_of(object.rotation_deg)},
                       {"scale", object.solid_scale.value()}});
    if (object.shape && !object.deforms) objects.back()["mesh"] = *object.shape;
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
  return line;
}

}  // namespace raywave
