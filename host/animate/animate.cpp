// SPDX-License-Identifier: Apache-2.0
#include "host/animate/animate.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "host/animate/frame_files.hpp"
#include "host/carriers/planning/facts.hpp"
#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/encode/panel.hpp"
#include "host/plan/message_text.hpp"
#include "host/planning/make_plan.hpp"
#include "host/trace/work_shape.hpp"
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

Json json_of(const glm::dvec3& v) { return {v.x, v.y, v.z}; }
Json json_of(const glm::dvec2& v) { return {v.x, v.y}; }

template <class T>
concept Number = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// Adds values to a digest. Structs are taken apart by name: one that gets another member does not
/// compile before its place here is decided.
class Contents {
public:
  std::string digest() const { return digest_.text(); }

  template <Number T>
  void add(T value) {
    add_bytes(&value, sizeof value);
  }
  template <glm::length_t size, Number T>
  void add(const glm::vec<size, T>& v) {
    for (glm::length_t i = 0; i < size; ++i) add(v[i]);
  }
  template <class A, class B>
  void add(const std::pair<A, B>& pair) {
    add(pair.first);
    add(pair.second);
  }
  template <class T>
  void add(const std::optional<T>& value) {
    add(value.has_value());
    if (value) add(*value);
  }
  template <class T, std::size_t size>
  void add(const std::array<T, size>& all) {
    for (const auto& one : all) add(one);
  }
  template <class T>
  void add(const std::vector<T>& all) {
    add(all.size());
    for (const auto& one : all) add(one);
  }

  void add(const Image& image) {
    add(image.width);
    add(image.height);
    add_bytes(image.pixels.data(), image.pixels.size() * sizeof(float));
  }
  /// Pictures that are shared are read once.
  void add(const std::shared_ptr<const Image>& image) {
    auto& known = images_[image.get()];
    if (known.empty()) {
      Contents one;
      if (image) one.add(*image);
      known = one.digest();
    }
    digest_.add(known);
  }

  void add(const Spectrum& spectrum) {
    const auto& [channels, table] = spectrum;
    add_all(channels, table);
  }
  void add(const MetallicRoughness& look) {
    const auto& [base, metallic, roughness, reflectance, ambient_share, sharpest] = look;
    add_all(base, metallic, roughness, reflectance, ambient_share, sharpest);
  }
  void add(const Material& material) {
    const auto& [name, ambient, diffuse, specular, shininess, texture, reflectivity, transparency,
                 ior, attenuation, attenuation_distance_m, emission, vertex_colours, unlit,
                 metallic_roughness, normal_scale, alpha_mode, alpha, alpha_cutoff, where] =
        material;
    add_all(ambient, diffuse, specular, shininess, reflectivity, transparency, ior, attenuation,
            attenuation_distance_m, emission, vertex_colours, unlit, metallic_roughness,
            normal_scale, alpha_mode, alpha, alpha_cutoff);
  }
  void add(const MapPlace& place) {
    const auto& [across, up, wrap_u, wrap_v] = place;
    add_all(across, up, wrap_u, wrap_v);
  }
  void add(const MaterialMaps& maps) {
    for (const auto* map : maps.all()) add_all(map->image, map->place);
  }
  void add(const Light& light) {
    const auto& [type, direction, position_m, intensity, colour, falls_off, inner_deg, outer_deg,
                 edges_m, radius_m, samples, highlights, picture, rotation_deg, where] = light;
    add_all(type, direction, position_m, intensity, colour, falls_off, inner_deg, outer_deg,
            edges_m, radius_m, samples, highlights, rotation_deg);
  }
  void add(const Object& object) {
    const auto& [mesh, width_m, position_m, rotation_deg, solid_scale, material, normals, where,
                 unit_m, anchor, cut_m, nodes, shapes, shape, deforms] = object;
    add_all(width_m, position_m, rotation_deg, solid_scale, material, normals, unit_m, anchor,
            cut_m);
    if (!nodes.empty()) add(nodes);
    if (shape) add(*shape);
  }
  void add(const glm::dmat4& m) {
    for (int i = 0; i < 4; ++i) add(m[i]);
  }
  void add(const GltfNode& node) {
    const auto& [number, parent, has_mesh, light, camera, has_matrix, translation, rotation, scale,
                 matrix] = node;
    add_all(number, parent, has_matrix, translation, rotation, scale, matrix);
  }
  void add(const GltfChannel& channel) {
    const auto& [node, path, steps, times_s, values, target] = channel;
    add_all(node, path, steps, times_s, values, target);
  }
  void add(const DeformingPart& part) {
    const auto& [node, first_vertex, joints, joint_from_mesh, positions, normals, influences,
                 joint_of, weight_of, weights, target_positions, target_normals] = part;
    add_all(node, joints, joint_from_mesh, positions, normals, influences, joint_of, weight_of,
            weights, target_positions, target_normals);
  }
  void add(const GltfMoves& moves) {
    const auto& [nodes, channels, world_from_file, objects, lights] = moves;
    add_all(nodes, channels);  // all else follows from them and the scene's text
  }
  void add(const FlatnessSpec& flatness) {
    const auto& [file, picture, in_nm, centre, where] = flatness;
    add_all(picture, in_nm, centre);
  }
  void add(const ZernikeTerm& term) {
    const auto& [noll, turns] = term;
    add_all(noll, turns);
  }
  void add(const StopSpec& stop) {
    const auto& [size, centre] = stop;
    add_all(size, centre);
  }
  void add(const Illumination& light) {
    const auto& [focus_m, sine, profile, source_size_rad, bandwidth_m] = light;
    add_all(focus_m, sine, profile.diameter_m, source_size_rad, bandwidth_m);
    if (profile.picture) add(*profile.picture);
  }
  void add(const Lut& lut) {
    const auto& [levels, values, amplitudes] = lut;
    add_all(levels, values, amplitudes);
  }
  void add(const SlmSpec& slm) {
    const auto& [encoding, clip, band, bits, levels, levels_per_turn, invert, offset_turns, lut,
                 flatness, zernike, carrier, shift_m, shift_distance_m, lens_m, flip_x, flip_y,
                 rotate_deg, stop, fill, undiffracted, crosstalk, rate_per_s, illumination, notes] =
        slm;
    (void)notes, (void)rate_per_s;  // say nothing of the light
    add_all(encoding, clip, band, bits, levels, levels_per_turn, invert, offset_turns, lut,
            flatness, zernike, carrier, shift_m, shift_distance_m, lens_m, flip_x, flip_y,
            rotate_deg, stop, fill, undiffracted, crosstalk.sigma_m, crosstalk.size,
            crosstalk.weights, illumination);
  }
  /// What its files gave: all else follows from it.
  void add(const World& world) {
    add_all(world.positions, world.normals, world.uvs, world.colours, world.triangles,
            world.triangle_object, world.triangle_material, world.materials, world.maps,
            world.textures);
    for (const auto& placed : world.placed) {
      if (!placed.deforming) continue;
      for (const auto& key : placed.deforming->keys) add_all(key.positions_m, key.normals);
      if (placed.deforming->mesh)
        for (const auto& part : placed.deforming->mesh->parts) add(part);
    }
  }

  template <class... T>
  void add_all(const T&... values) {
    (add(values), ...);
  }

private:
  void add_bytes(const void* bytes, std::size_t size) {
    digest_.add({static_cast<const char*>(bytes), size});
  }

  Digest digest_;
  std::map<const Image*, std::string> images_;
};

}  // namespace

Animator::Animator(const cl::Device& device, Scene scene, cl::FftBackend fft)
    : Animator(device, std::vector<Scene>{std::move(scene)}, fft) {}

Animator::Animator(const cl::Device& device, std::vector<Scene> scenes, cl::FftBackend fft,
                   std::filesystem::path folder, const std::optional<cl::DeviceInfo>& waves)
    : device_(device),
      fft_(fft),
      schedule_(scenes.at(0).animation.value(), scenes[0].sampling.frames),
      folder_(std::move(folder)) {
  for (auto& one : scenes)
    lasers_.push_back({with_shapes(with_frames(std::move(one), schedule_)), {}, {}});
  world_ = build_world(scene());
  std::vector<const Scene*> all_scenes;
  for (const auto& laser : lasers_) all_scenes.push_back(&laser.scene);
  depends_on_ = given_of(device_, fft_, all_scenes, world_);
  if (waves) {
    waves_.emplace(*waves);
    depends_on_ += waves->name + '\n' + waves->driver + '\n';
  }
  shared_ = read_shared();
  if (shared_) reach_m_ = shared_->reach_m;
  std::vector<int> all(static_cast<std::size_t>(schedule_.pictures()));
  std::iota(all.begin(), all.end(), 0);
  poses_.assign(lasers_.size(), all);
  if (shared_) poses_ = shared_->poses;
  for (std::size_t i = 0; i < lasers_.size(); ++i) plan_laser(lasers_[i], poses_[i]);
}

MemoryLimits Animator::limits() const {
  return limits_of(device_.info()).least(limits_of(waves_.value_or(device_).info()));
}

std::string Animator::shared_by() const {
  auto text = depends_on_;
  const auto limits = this->limits();
  for (const auto bytes : {limits.device_bytes, limits.largest_buffer_bytes, limits.host_bytes})
    text += std::to_string(bytes) + '\n';
  return hash_name(text);
}

std::optional<Animator::Shared> Animator::read_shared() const {
  if (folder_.empty()) return {};
  std::ifstream stream(folder_ / FrameFiles::shared_name);
  try {
    const auto json = Json::parse(stream);
    if (json.at("by") != shared_by()) return {};
    Shared shared{json.at("poses").get<std::vector<std::vector<int>>>(),
                  {json.at("reach_m").at(0).get<double>(), json.at("reach_m").at(1).get<double>()},
                  {json.at("clip").get<double>(), json.at("power").get<double>()}};
    const auto is_whole = [&](const std::vector<int>& poses) {
      return !poses.empty() && std::ranges::all_of(poses, [&](int pose) {
        return pose >= 0 && pose < schedule_.pictures();
      });
    };
    if (shared.poses.size() == lasers_.size() && std::ranges::all_of(shared.poses, is_whole))
      return shared;
  } catch (const Json::exception&) {  // not there, or damaged
  }
  return {};
}

void Animator::share(const Scale& scale) const {
  write_text(folder_ / FrameFiles::shared_name,
             Json{{"by", shared_by()},
                  {"poses", poses_},
                  {"reach_m", Json::array({reach_m_.x, reach_m_.y})},
                  {"clip", scale.clip},
                  {"power", scale.power}}
                     .dump() +
                 "\n");
}

/// Plans over all pictures, and for the first one, where the world is left.
void Animator::plan_laser(Laser& laser, std::vector<int>& poses) {
  Scene moved = laser.scene;
  const auto move_to = [&](int picture) {
    try {
      moved = scene_at(laser.scene, picture);
      move_objects(moved, world_);
      if (world_.min_m.z < nearest_.second) nearest_ = {picture, world_.min_m.z};
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
  // As Renderer holds them
  const bool holds_fields = lasers_.size() > 1 && laser.scene.slm.encoding != Encoding::phase &&
                            laser.scene.sampling.frames > 1;
  const MemoryUse use{Method::wrp, fft_, holds_fields};
  laser.base = std::make_shared<const Plan>(fitting_plan_of_poses(
      moved, world_, poses, move_to, limits().for_one_of(static_cast<int>(lasers_.size())), use,
      RenderOptions{}.rays_per_axis, has_doubles));
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

std::optional<Pupil> Animator::pupil() const {
  if (!scene().viewer.eyepiece_m) return {};
  return pupils_of(scene().viewer).front();
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
  auto text = depends_on_ + (storage == FrameStorage::pngs ? "pngs" : "stream") + '\n';
  for (const auto& laser : lasers_) {
    const auto& base = *laser.base;
    text += std::to_string(base.tiling.grid.x) + " x " + std::to_string(base.tiling.grid.y) + '\n' +
            std::to_string(base.most_layers) + '\n' + name_of(propagation_of(base)) + '\n';
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
  how.keep_field = false;
  how.waves_device = waves_;
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
  if (shared_) return shared_->scale;
  for (const int picture : schedule_.spread(Schedule::pictures_that_scale)) {
    show(scene_at(scene(), picture), picture, renderer);
    const auto results = renderer.render_lasers().lasers;
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
  auto results = renderer_.render_lasers().lasers;
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

AnimateResult Animator::make_frames(FrameFiles& files, const Progress& progress) const {
  return make_missing(
      files,
      [&]() -> std::function<AnimatedPicture(int)> {
        const auto pictures = std::make_shared<Pictures>(*this);
        if (files.is_part() && !folder_.empty() && !shared_) share(pictures->scale());
        return [pictures](int picture) { return pictures->make(picture); };
      },
      [&](auto& levels) { turn(levels); }, progress);
}

AnimateResult make_missing(FrameFiles& files,
                           const std::function<std::function<AnimatedPicture(int)>()>& begin,
                           const std::function<void(std::vector<std::vector<std::uint8_t>>&)>& turn,
                           const Progress& progress) {
  AnimateResult made;
  if (files.missing().empty()) {
    files.finish();
    return made;
  }
  const auto make = begin();
  std::chrono::steady_clock::time_point start;
  WriteQueue queue(longest_queue);
  while (const auto next = files.next()) {
    const int picture = *next;
    if (progress)
      progress(files.word() + (" " + std::to_string(picture)) + ", of 0 to " +
                   std::to_string(files.all() - 1),
               static_cast<double>(picture - files.wanted().first) /
                   (files.wanted().end - files.wanted().first));
    // std::function wants what can be copied
    const auto one = std::make_shared<AnimatedPicture>(make(picture));
    add_lines(made.notes, one->notes);
    const auto holograms = static_cast<int>(one->levels.size());
    if (made.pictures > 0) {
      for (const auto& [stage, s] : one->processor_seconds) made.processor_seconds[stage] += s;
      made.timed_holograms += holograms;
      if (files.is_helper()) one->line[FrameFiles::times_key] = one->processor_seconds;
    }
    queue.push([one, &files, picture, &turn] {
      turn(one->levels);
      files.add(picture, one->levels, one->line);
    });
    if (made.pictures == 0) start = std::chrono::steady_clock::now();
    ++made.pictures;
    made.holograms += holograms;
  }
  queue.finish();
  files.finish();
  made.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return made;
}

Json Animator::line_of(int picture, const Scene& scene, const RenderResult& result) const {
  const auto& animation = scene.animation.value();
  Json line{{"picture", picture},
            {"time_s", picture / animation.rate_per_s},
            {"seed", result.plan.hologram.seed},
            {"samples", result.samples},
            {"near_m", result.plan.extent.near_m},
            {"far_m", result.plan.extent.far_m},
            {"planes", result.plan.wrps.size()}};
  auto& objects = line["objects"] = Json::array();
  for (const auto i : moving_objects(animation)) {
    const auto& object = scene.objects[i];
    objects.push_back({{"object", i},
                       {"position_m", json_of(object.position_m)},
                       {"rotation_deg", json_of(object.rotation_deg)},
                       {"scale", object.solid_scale.value()}});
    if (object.shape && !object.deforms) objects.back()["mesh"] = *object.shape;
  }
  auto& lights = line["lights"] = Json::array();
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

std::string given_of(const cl::Device& device, cl::FftBackend fft,
                     const std::vector<const Scene*>& scenes, const World& world) {
  std::string text;
  const auto& info = device.info();
  for (const auto& part : {std::string(version), scenes.at(0)->digest, info.platform, info.name,
                           info.driver, std::string(name_of(fft))})
    text += part + '\n';
  for (const auto* scene : scenes) text += digest_of_contents(*scene, world) + '\n';
  return text;
}

std::string digest_of_contents(const Scene& scene, const World& world) {
  Contents contents;
  contents.add_all(scene.objects, scene.lights, scene.materials, scene.slm, world);
  if (scene.animation && scene.animation->gltf) contents.add(*scene.animation->gltf);
  return contents.digest();
}

}  // namespace raywave
