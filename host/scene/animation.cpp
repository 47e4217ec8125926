// SPDX-License-Identifier: Apache-2.0
#include "host/scene/animation.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>

#include "host/scene/document.hpp"

namespace raywave {
namespace {

constexpr std::size_t most_keys = 100'000;

struct Name {
  std::string_view thing, property;
  Animated what;
};

constexpr std::array<Name, 10> names{{{"object", "position", Animated::object_position},
                                      {"object", "rotation", Animated::object_rotation},
                                      {"object", "scale", Animated::object_scale},
                                      {"object", "mesh", Animated::object_mesh},
                                      {"light", "direction", Animated::light_direction},
                                      {"light", "position", Animated::light_position},
                                      {"light", "intensity", Animated::light_intensity},
                                      {"camera", "depth", Animated::camera_depth},
                                      {"camera", "view", Animated::camera_view},
                                      {"camera", "aperture", Animated::camera_aperture}}};

/// The parts of "object.0.position" and "camera.view".
struct Parts {
  std::string_view thing, index, property;
};

Parts parts_of(std::string_view text) {
  const auto first = text.find('.'), last = text.rfind('.');
  if (first == std::string_view::npos) return {text, {}, {}};
  return {text.substr(0, first), first == last ? "" : text.substr(first + 1, last - first - 1),
          text.substr(last + 1)};
}

/// Reads which value of the scene a track changes.
void read_target(const Value& v, std::size_t objects, const std::vector<Light>& lights,
                 Track& track) {
  static const char* const must_be =
      "the name of what moves, as in \"object.0.position\": object.N.position, rotation, scale or "
      "mesh, "
      "light.N.direction, position or intensity, camera.depth, view or aperture";
  const auto parts = parts_of(v.string(must_be));
  const auto known = std::find_if(names.begin(), names.end(), [&](const Name& name) {
    return name.thing == parts.thing && name.property == parts.property;
  });
  const bool is_camera = parts.thing == "camera";
  if (known == names.end() || is_camera != parts.index.empty()) v.fail(must_be);
  track.what = known->what;
  if (is_camera) return;

  const auto end = parts.index.data() + parts.index.size();
  const auto read = std::from_chars(parts.index.data(), end, track.index);
  const auto count = parts.thing == "object" ? objects : lights.size();
  if (read.ec != std::errc() || read.ptr != end || track.index >= count)
    v.fail("of one of the " + std::to_string(count) + " " + std::string(parts.thing) +
           "s, counted from 0");
  if (parts.thing != "light") return;
  const auto& light = lights[track.index];
  const bool has_place = light.type == LightType::point || light.type == LightType::spot ||
                         light.type == LightType::area,
             has_direction = light.type == LightType::directional ||
                             light.type == LightType::spot ||
                             (light.type == LightType::area && light.radius_m > 0);
  if (track.what == Animated::light_direction && !has_direction)
    v.fail("of a light with a direction, which light " + std::to_string(track.index) + " has not");
  if (track.what == Animated::light_position && !has_place)
    v.fail("of a light with a position, which light " + std::to_string(track.index) + " has not");
}

double read_depth_m(const Value& v) { return v.length_m(between(1e-9, 1e4)); }

glm::dvec2 read_view(const Value& v) {
  return v.numbers<glm::dvec2>("two numbers [x, y], in half holograms", between(-1, 1));
}
glm::dvec2 read_aperture(const Value& v) {
  return v.numbers<glm::dvec2>("two numbers [x, y], in holograms", between(1e-3, 1));
}

glm::dvec3 read_key(const Value& v, Animated what) {
  switch (what) {
    case Animated::object_position:
    case Animated::light_position:
      return v.lengths_m(between(-1e4, 1e4));
    case Animated::object_rotation:
      return v.numbers(between(-1e6, 1e6));
    case Animated::light_direction:
      return v.direction();
    case Animated::object_scale:
      return {v.number(between(1e-6, 1e6)), 0, 0};
    case Animated::object_mesh:
      break;  // a file
    case Animated::light_intensity:
      return {v.number(at_least(0)), 0, 0};
    case Animated::camera_depth:
      return {read_depth_m(v), 0, 0};
    case Animated::camera_view:
      return {read_view(v), 0};
    case Animated::camera_aperture:
      return {read_aperture(v), 0};
  }
  v.fail("a value");
}

/// A time in pictures: a number, or a time with a unit.
double read_time(const Value& v, const Animation& animation) {
  const double most = animation.pictures;
  if (!v.node->is_string()) {
    const double picture = v.number(at_least(0));
    if (picture > most)
      v.fail("at most " + number_text(most) +
             ", which is animation.frames; of fewer pictures, `at` must be shorter, too (animate "
             "--pictures 0.." +
             number_text(most - 1) + " makes a part of the animation)");
    return picture;
  }
  const double picture =
      given_moment_s(v.node->as_string()->get(), v.where()) * animation.rate_per_s;
  if (picture > most + 1e-9)
    v.fail("at most " + number_text(animation.pictures / animation.rate_per_s) +
           " s, where the animation ends");
  return picture;
}

/// The elements of a list, each with its place.
std::vector<Value> elements(const Value& v, const char* must_be) {
  if (!v.is_array()) v.fail(must_be);
  std::vector<Value> all;
  while (all.size() < v.node->as_array()->size()) all.push_back(v.element(all.size()));
  if (all.empty() || all.size() > most_keys)
    v.fail("a list of 1 to " + std::to_string(most_keys) + " keys");
  return all;
}

Track read_track(Section section, const Animation& animation, std::size_t objects,
                 const std::vector<Light>& lights) {
  Track track;
  track.where = section.where();
  section.require("of", "what moves, for example \"object.0.rotation\"",
                  [&](const Value& v) { read_target(v, objects, lights, track); });
  section.read("steps", [&](const Value& v) {
    track.steps = v.choice<Steps>(
        {{"linear", Steps::linear}, {"cubic", Steps::cubic}, {"hold", Steps::hold}});
  });
  if (track.what == Animated::object_mesh && track.steps == Steps::cubic)
    section.fail("steps of meshes must be \"linear\" or \"hold\"");
  section.read("closed", [&](const Value& v) { track.closed = v.boolean(); });
  section.require("at", "when the keys are, for example [0, 120, 240]", [&](const Value& v) {
    for (const auto& one : elements(v, "a list of pictures or times, such as [0, \"2 s\"]")) {
      const double at = read_time(one, animation);
      if (!track.at.empty() && !(at > track.at.back())) one.fail("later than the key before it");
      track.at.push_back(at);
    }
  });
  section.require("values", "a value for each key", [&](const Value& v) {
    for (const auto& one : elements(v, "a list with a value for each key")) {
      if (track.what == Animated::object_mesh) {
        track.values.emplace_back(static_cast<double>(track.meshes.size()), 0, 0);
        track.meshes.push_back(one.existing_file());
      } else {
        track.values.push_back(read_key(one, track.what));
      }
    }
    if (track.values.size() != track.at.size())
      v.fail("as many as there are in `at`, " + std::to_string(track.at.size()));
    if (track.closed && track.values.size() < 2) v.fail("two or more where `closed` is true");
  });
  section.finish();
  return track;
}

Camera read_camera(Section section) {
  Camera camera;
  section.read("depth", [&](const Value& v) {
    if (!v.is("auto")) camera.depth_m = read_depth_m(v);
  });
  section.read("view", [&](const Value& v) { camera.view = read_view(v); });
  section.read("aperture", [&](const Value& v) { camera.aperture = read_aperture(v); });
  section.read("window", [&](const Value& v) {
    camera.window_m = v.lengths_m<glm::dvec2>("two lengths [x, y]", between(1e-9, 1e4));
  });
  section.finish();
  return camera;
}

/// Up to the last key; a loop's last key is the picture that would follow.
int pictures_of(const GltfMoves& moves, double rate_per_s) {
  double end_s = 0;
  for (const auto& channel : moves.channels) end_s = std::max(end_s, channel.times_s.back());
  return static_cast<int>(
      std::clamp(std::round(end_s * rate_per_s), 1.0, double{Animation::most_pictures}));
}

/// True for a track of what a glTF file moves.
bool is_moved(const GltfMoves& moves, const Track& track) {
  const auto is_one_of = [&](const std::vector<GltfMoves::Moved>& all) {
    return std::any_of(all.begin(), all.end(),
                       [&](const auto& moved) { return moved.index == track.index; });
  };
  switch (track.what) {
    case Animated::object_position:
    case Animated::object_rotation:
    case Animated::object_scale:
      return is_one_of(moves.objects);
    case Animated::light_direction:
    case Animated::light_position:
      return is_one_of(moves.lights);
    default:
      return false;
  }
}

}  // namespace

Animation read_animation(Section section, std::size_t objects, const std::vector<Light>& lights,
                         std::optional<GltfMoves> gltf) {
  Animation animation;
  animation.gltf = std::move(gltf);
  const bool has_frames = section.read("frames", [&](const Value& v) {
    animation.pictures = v.integer(1, Animation::most_pictures);
  });
  section.read("rate",
               [&](const Value& v) { animation.rate_per_s = v.number(between(0.01, 1e5)); });
  if (!has_frames) {
    if (!animation.gltf) section.fail("frames is missing: give the number of pictures");
    animation.pictures = pictures_of(*animation.gltf, animation.rate_per_s);
  }
  section.read("subframes", [&](const Value& v) {
    animation.subframes = v.integer(1, Animation::most_subframes);
  });
  section.read("slm_rate", [&](const Value& v) {
    if (animation.subframes) v.fail("left out where `subframes` is given: it is their quotient");
    animation.slm_rate_per_s =
        v.number(between(animation.rate_per_s, animation.rate_per_s * Animation::most_subframes));
  });
  animation.camera = read_camera(section.section("camera"));
  for (Section& track : section.sections("track")) {
    animation.tracks.push_back(read_track(track, animation, objects, lights));
    const auto& last = animation.tracks.back();
    if (animation.gltf && is_moved(*animation.gltf, last))
      track.fail("moves what the glTF file moves; leave one of the two out");
    for (std::size_t i = 0; i + 1 < animation.tracks.size(); ++i) {
      if (animation.tracks[i].what == last.what && animation.tracks[i].index == last.index)
        track.fail("moves what track " + std::to_string(i) + " moves; put all keys into one");
    }
  }
  section.finish();
  return animation;
}

}  // namespace raywave
