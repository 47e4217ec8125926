// SPDX-License-Identifier: Apache-2.0
#include "host/animate/timeline.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <string>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/gltf_scene.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {
namespace {

/// Slope of a cubic track at key k, per picture.
glm::dvec3 slope_at(const Track& track, std::size_t k) {
  const auto last = track.values.size() - 1;
  const auto rise = [&](std::size_t from, std::size_t to) {
    return track.values[to] - track.values[from];
  };
  const auto run = [&](std::size_t from, std::size_t to) { return track.at[to] - track.at[from]; };
  if (k > 0 && k < last) return rise(k - 1, k + 1) / run(k - 1, k + 1);
  if (track.closed) return (rise(0, 1) + rise(last - 1, last)) / (run(0, 1) + run(last - 1, last));
  const auto from = k == 0 ? 0 : last - 1;
  return rise(from, from + 1) / run(from, from + 1);
}

/// "scene.toml:41: track 0: at picture 12: "
std::string place_of(const Track& track, double time) {
  return track.where + ": at picture " + number_text(time) + ": ";
}

bool is_object(Animated what) {
  return what == Animated::object_position || what == Animated::object_rotation ||
         what == Animated::object_scale || what == Animated::object_mesh;
}

bool is_light(Animated what) {
  return what == Animated::light_direction || what == Animated::light_position ||
         what == Animated::light_intensity;
}

void move_object(const Track& track, double time, Object& object) {
  const auto value = value_at(track, time);
  if (track.what == Animated::object_position) object.position_m = value;
  if (track.what == Animated::object_rotation) object.rotation_deg = value;
  if (track.what == Animated::object_mesh) object.shape = value.x;
  if (track.what != Animated::object_scale) return;
  if (!(value.x > 0))
    throw InputError(place_of(track, time) + "the cubic curve falls to a scale of " +
                     number_text(value.x) + ", and it must be > 0; add a key, or use linear steps");
  object.solid_scale = value.x;
}

void move_light(const Track& track, double time, Light& light) {
  const auto value = value_at(track, time);
  if (track.what == Animated::light_position) light.position_m = value;
  // A cubic curve may dip below a key of 0
  if (track.what == Animated::light_intensity) light.intensity = std::max(value.x, 0.0);
  if (track.what != Animated::light_direction) return;
  if (glm::length(value) < 1e-9)
    throw InputError(place_of(track, time) +
                     "the direction between its keys is [0, 0, 0]; add a key beside it");
  light.direction = value;
}

/// Moves what a glTF file moves.
void move_nodes(const GltfMoves& moves, double time_s, const std::string& at, Scene& scene) {
  const auto rest = poses_at(moves.nodes, {}, 0),
             now = poses_at(moves.nodes, moves.channels, time_s);
  const auto& placing = moves.world_from_file;
  for (const auto& moved : moves.objects) {
    const auto node = static_cast<std::size_t>(moved.node);
    auto& object = scene.objects.at(moved.index);
    if (moved.deforms) {
      object.shape = time_s;
      continue;
    }
    const auto motion = similarity_between(rest[node], now[node]);
    if (!motion)
      throw InputError(object.where + ": " + at +
                       "it is stretched unevenly or mirrored, or has no extent at rest; raywave "
                       "moves, turns and scales objects of glTF files as a whole");
    object.position_m = placing(motion->shift);
    object.rotation_deg = fixed_axis_angles_deg(placing.turn * motion->turn);
    object.solid_scale = motion->scale;
  }
  for (const auto& moved : moves.lights)
    place_light(now[static_cast<std::size_t>(moved.node)], placing, scene.lights.at(moved.index));
}

std::set<std::size_t> moving(const Animation& animation, bool (*is_of)(Animated),
                             std::vector<GltfMoves::Moved> GltfMoves::*of_gltf) {
  std::set<std::size_t> moved;
  if (animation.gltf)
    for (const auto& one : *animation.gltf.*of_gltf) moved.insert(one.index);
  for (const auto& track : animation.tracks)
    if (is_of(track.what)) moved.insert(track.index);
  return moved;
}

}  // namespace

glm::dvec3 value_at(const Track& track, double time) {
  const auto& values = track.values;
  const auto [k, s, span] = place_among(track.at, time);
  if (track.steps == Steps::hold || s == 0) return values[k];
  const auto next = k + 1;
  if (track.steps == Steps::linear) return values[k] + s * (values[next] - values[k]);
  return hermite(values[k], slope_at(track, k), values[next], slope_at(track, next), span, s);
}

Scene with_shapes(Scene scene) {
  for (const auto& track : scene.animation.value().tracks)
    if (track.what == Animated::object_mesh) scene.objects.at(track.index).shapes = track.meshes;
  return scene;
}

Scene scene_at(const Scene& scene, double time) {
  auto moved = scene;
  const auto& animation = scene.animation.value();
  for (const auto object : moving_objects(animation)) moved.objects.at(object).solid_scale = 1;
  for (const auto& track : animation.tracks) {
    if (is_object(track.what)) move_object(track, time, moved.objects.at(track.index));
    if (is_light(track.what)) move_light(track, time, moved.lights.at(track.index));
  }
  if (animation.gltf)
    move_nodes(*animation.gltf, time / animation.rate_per_s,
               "at picture " + number_text(time) + ": ", moved);
  return moved;
}

Camera camera_at(const Animation& animation, double time) {
  auto camera = animation.camera;
  for (const auto& track : animation.tracks) {
    const auto value = value_at(track, time);
    if (track.what == Animated::camera_depth) camera.depth_m = std::max(value.x, 1e-9);
    if (track.what == Animated::camera_view) camera.view = glm::clamp(glm::dvec2(value), -1.0, 1.0);
    if (track.what == Animated::camera_aperture)
      camera.aperture = glm::clamp(glm::dvec2(value), 1e-3, 1.0);
  }
  return camera;
}

std::set<std::size_t> moving_objects(const Animation& animation) {
  return moving(animation, is_object, &GltfMoves::objects);
}
std::set<std::size_t> moving_lights(const Animation& animation) {
  return moving(animation, is_light, &GltfMoves::lights);
}

Schedule::Schedule(const Animation& animation, int frames)
    : pictures_(animation.pictures),
      rate_per_s_(animation.rate_per_s),
      each_(animation.slm_rate_per_s ? *animation.slm_rate_per_s / animation.rate_per_s
                                     : animation.subframes.value_or(frames)) {}

int Schedule::first_of(int picture) const {
  // Rates such as 59.94 for 23.976 are no exact quotients
  return static_cast<int>(std::ceil(picture * each_ - 1e-6));
}

int Schedule::most_of_a_picture() const {
  int most = 0;
  for (int picture = 0; picture < pictures_; ++picture) most = std::max(most, count_of(picture));
  return most;
}

std::vector<int> Schedule::spread(int most) const {
  const int count = std::min(pictures_, most);
  std::vector<int> all;
  for (int i = 0; i < count; ++i)
    all.push_back(static_cast<int>(static_cast<std::int64_t>(pictures_) * i / count));
  return all;
}

}  // namespace raywave
