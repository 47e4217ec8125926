// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "host/common/error.hpp"
#include "host/scene/light.hpp"
#include "host/scene/reader/gltf_file.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

using Path = GltfChannel::Path;
constexpr const char* keys = "keys of an animation";

/// The camera and the light that a node is; null where it is none.
const json& camera_of(const GltfFile& gltf, const json& node) {
  return gltf.of("cameras", member(node, "camera"));
}

const json& light_of(const GltfFile& gltf, const json& node) {
  constexpr const char* name = "KHR_lights_punctual";
  return element(member(extension(gltf.root(), name), "lights"),
                 member(extension(node, name), "light"));
}

void add_camera(const json& camera, const json& node, const glm::dmat4& pose, GltfSet& set) {
  if (!camera.is_object() || set.cameras.size() >= most_cameras_of_file) return;
  const auto name = name_or(member(node, "name"), name_or(member(camera, "name"), ""));
  const auto& lens =
      member(camera, member(camera, "perspective").is_object() ? "perspective" : "orthographic");
  set.cameras.push_back({name, pose, std::clamp(number_or(member(lens, "znear"), 0), 0.0, 1e15)});
}

void add_light(const json& light, const glm::dmat4& pose, GltfSet& set) {
  if (set.lights.size() >= most_lights_of_file)
    throw InputError("more than " + std::to_string(most_lights_of_file) + " lights");
  GltfLight made;
  const auto type = text_or(member(light, "type"), "");
  made.type = type == "point"  ? GltfLight::Type::point
              : type == "spot" ? GltfLight::Type::spot
                               : GltfLight::Type::directional;
  made.world_from_light = pose;
  made.colour =
      glm::clamp(vector_or(member(light, "color"), glm::dvec3(1)), glm::dvec3(0), glm::dvec3(1e15));
  made.intensity = std::clamp(number_or(member(light, "intensity"), 1), 0.0, 1e15);
  const auto& spot = member(light, "spot");
  constexpr double right = 1.5707963267948966;
  const double outer_deg = glm::degrees(number_or(member(spot, "outerConeAngle"), right / 2)),
               inner_deg = glm::degrees(number_or(member(spot, "innerConeAngle"), 0));
  made.outer_deg = std::clamp(outer_deg, least_spot_deg, 90.0);
  made.inner_deg = std::clamp(inner_deg, 0.0, made.outer_deg);
  set.lights.push_back(made);
  if (!member(light, "range").is_null())
    add_note(set.notes,
             "the range of lights is ignored: they fall off with the square of the "
             "distance");
  if (made.type == GltfLight::Type::spot && outer_deg < least_spot_deg)
    add_note(set.notes, "spots narrower than 0.5 degrees are widened to that");
}

class MotionReader {
public:
  explicit MotionReader(GltfFile& gltf) : gltf_(gltf) {}

  GltfMotion read() {
    int cameras = 0, lights = 0;
    gltf_.for_each_node([&](const json& node, std::int32_t number, std::int32_t parent,
                            const glm::dmat4&, bool is_shown) {
      if (motion_.nodes.size() >= most_nodes_of_file)
        throw InputError("more than " + std::to_string(most_nodes_of_file) + " nodes");
      place_.emplace(number, static_cast<std::int32_t>(motion_.nodes.size()));
      auto& made = motion_.nodes.emplace_back(gltf_place_of(node));
      made.number = number;
      made.parent = parent;
      if (camera_of(gltf_, node).is_object()) made.camera = cameras++;
      motion_.names.push_back(name_or(member(node, "name"), ""));
      if (!is_shown) return;
      made.has_mesh = has_triangles(node);
      if (light_of(gltf_, node).is_object()) made.light = lights++;
      auto wearer = wearer_of(gltf_, node, number);
      if (made.has_mesh && (!wearer.joints.empty() || !wearer.weights.empty()))
        motion_.wearers.push_back(std::move(wearer));
    });
    for (auto& wearer : motion_.wearers) wearer = placed(std::move(wearer));
    for (const auto& animation : member(gltf_.root(), "animations")) {
      if (motion_.animations.size() >= most_animations_of_file)
        throw InputError("more than " + std::to_string(most_animations_of_file) + " animations");
      read_animation(animation);
    }
    return std::move(motion_);
  }

private:
  /// True where a node shows more than points and lines.
  bool has_triangles(const json& node) const {
    const auto& all = member(gltf_.of("meshes", member(node, "mesh")), "primitives");
    return std::any_of(all.begin(), all.end(), [](const json& primitive) {
      return count_or(member(primitive, "mode"), 4) >= 4;
    });
  }

  std::vector<double> numbers(const json& accessor, const char* kind) {
    const auto found = gltf_.numbers(accessor, kind, keys, false, left_);
    left_ -= found.count;
    std::vector<double> all;
    all.reserve(found.count * found.components);
    for (std::uint64_t i = 0; i < found.count; ++i)
      for (std::uint64_t k = 0; k < found.components; ++k) all.push_back(found.at(i, k));
    return all;
  }

  /// The places of a mesh's joints among the nodes.
  GltfWearer placed(GltfWearer wearer) const {
    wearer.node = place_.at(wearer.node);
    for (auto& joint : wearer.joints) {
      const auto found = place_.find(joint);
      if (found == place_.end())
        throw InputError("node " + std::to_string(joint) +
                         " is a joint of a skin, and not in the scene; export the file again");
      joint = found->second;
    }
    return wearer;
  }

  void read_animation(const json& animation) {
    auto& made = motion_.animations.emplace_back();
    made.name = name_or(member(animation, "name"), "");
    for (const auto& channel : member(animation, "channels")) {
      const auto& target = member(channel, "target");
      const auto path = text_or(member(target, "path"), "");
      if (path == "pointer")
        add_note(motion_.notes, "only nodes are moved (KHR_animation_pointer is ignored)");
      const auto found = place_.find(static_cast<std::int32_t>(
          std::min<std::uint64_t>(count_or(member(target, "node"), INT32_MAX), INT32_MAX)));
      constexpr std::array<const char*, 4> paths{"translation", "rotation", "scale", "weights"};
      const auto known = std::find(paths.begin(), paths.end(), path);
      if (known == paths.end() || found == place_.end()) continue;
      const auto& sampler = element(member(animation, "samplers"), member(channel, "sampler"));
      read_channel(sampler, found->second, static_cast<Path>(known - paths.begin()), made.channels);
    }
  }

  std::size_t targets_of(std::int32_t node) const {
    for (const auto& wearer : motion_.wearers)
      if (wearer.node == node) return wearer.weights.size();
    return 0;
  }

  void read_channel(const json& sampler, std::int32_t node, Path path,
                    std::vector<GltfChannel>& channels) {
    const auto steps = text_or(member(sampler, "interpolation"), "LINEAR");
    if (steps != "LINEAR" && steps != "STEP" && steps != "CUBICSPLINE")
      throw InputError("the interpolation of an animation is none of LINEAR, STEP and CUBICSPLINE");
    GltfChannel channel;
    channel.node = node;
    channel.path = path;
    channel.steps = steps == "STEP"          ? GltfChannel::Steps::step
                    : steps == "CUBICSPLINE" ? GltfChannel::Steps::cubic
                                             : GltfChannel::Steps::linear;
    const bool is_turn = path == Path::rotation, is_weights = path == Path::weights;
    const std::size_t size = is_weights ? targets_of(node) : is_turn ? 4 : 3;
    if (size == 0) return;  // of a mesh without morph targets
    if (!is_weights && motion_.nodes[static_cast<std::size_t>(node)].has_matrix != 0)
      throw InputError("a node that is animated has a matrix");
    channel.times_s = numbers(member(sampler, "input"), "SCALAR");
    for (std::size_t i = 0; i < channel.times_s.size(); ++i)
      if (!(channel.times_s[i] >= 0 && channel.times_s[i] <= 1e15) ||
          (i > 0 && !(channel.times_s[i] > channel.times_s[i - 1])))
        throw InputError("times of an animation do not ascend from 0");
    const auto values = numbers(member(sampler, "output"), is_weights ? "SCALAR"
                                                           : is_turn  ? "VEC4"
                                                                      : "VEC3");
    const std::size_t each = channel.steps == GltfChannel::Steps::cubic ? 3 : 1;
    if (values.size() != each * channel.times_s.size() * size)
      throw InputError("an animation has not as many values as times");
    for (const double value : values)
      if (!(std::abs(value) <= 1e15)) throw InputError("a value of an animation is no number");
    for (std::size_t first = 0; first < size; first += 4) {
      if (++channels_ > most_moves_of_file)
        throw InputError("more than " + std::to_string(most_moves_of_file) +
                         " values are animated");
      // Vectors of four and more, of all keys together
      keys_ += channel.times_s.size();
      if (keys_ > most_keys_of_file)
        throw InputError("more than " + std::to_string(most_keys_of_file) + " " + keys);
      channel.target = static_cast<std::int32_t>(first);
      channel.values.assign(values.size() / size, glm::dvec4(0));
      for (std::size_t i = 0; i < channel.values.size(); ++i)
        for (std::size_t k = first; k < std::min(first + 4, size); ++k)
          channel.values[i][static_cast<int>(k - first)] = values[i * size + k];
      for (std::size_t i = each / 2; is_turn && i < channel.values.size(); i += each) {
        auto& v = channel.values[i];
        const double length = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z + v.w * v.w);
        if (!(length > 1e-6)) throw InputError("a rotation of an animation is zero");
        v /= length;
      }
      channels.push_back(channel);
    }
  }

  GltfFile& gltf_;
  GltfMotion motion_;
  std::map<std::int32_t, std::int32_t> place_;  // of a node in motion_.nodes, by its number
  std::size_t channels_ = 0, keys_ = 0, left_ = most_keys_of_file;
};

std::unique_ptr<GltfFile> opened(const fs::path& file) {
  auto gltf = GltfFile::open(file);
  if (!gltf) throw InputError("it is no glTF of version 2");
  return gltf;
}

}  // namespace

GltfSet read_gltf_set(const fs::path& file) {
  const auto gltf = opened(file);
  GltfSet set;
  gltf->for_each_node(
      [&](const json& node, std::int32_t, std::int32_t, const glm::dmat4& pose, bool is_shown) {
        add_camera(camera_of(*gltf, node), node, pose, set);
        if (const auto& light = light_of(*gltf, node); is_shown && light.is_object())
          add_light(light, pose, set);
      });
  return set;
}

GltfMotion read_gltf_motion(const fs::path& file) { return MotionReader(*opened(file)).read(); }

}  // namespace raywave
