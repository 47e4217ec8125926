// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "host/common/error.hpp"
#include "host/scene/reader/gltf_buffers.hpp"
#include "host/scene/reader/gltf_deform.hpp"
#include "host/scene/reader/gltf_json.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

using Path = GltfChannel::Path;
constexpr const char* keys = "keys of an animation";

std::string cut(std::string text) {
  text.resize(std::min(text.size(), longest_text));
  return text;
}

class MotionReader {
public:
  MotionReader(const json& root, const fs::path& file)
      : root_(root), buffers_(root, file, most_keys_of_file) {}

  GltfMotion read() {
    int cameras = 0, lights = 0;
    for_each_node(
        root_, [&](const json& node, std::int32_t number, std::int32_t parent, const glm::dmat4&) {
          if (motion_.nodes.size() >= most_nodes_of_file)
            throw InputError("more than " + std::to_string(most_nodes_of_file) + " nodes");
          place_.emplace(number, static_cast<std::int32_t>(motion_.nodes.size()));
          auto& made = motion_.nodes.emplace_back(gltf_place_of(node));
          made.number = number;
          made.parent = parent;
          made.has_mesh = member(node, "mesh").is_number_unsigned();
          if (camera_of(root_, node).is_object()) made.camera = cameras++;
          if (light_of(root_, node).is_object()) made.light = lights++;
          motion_.names.push_back(cut(text_or(member(node, "name"), "")));
          if (auto wearer = wearer_of(root_, node, number))
            motion_.wearers.push_back(std::move(*wearer));
        });
    for (auto& wearer : motion_.wearers) wearer = placed(std::move(wearer));
    const auto& animations = member(root_, "animations");
    for (std::size_t i = 0; animations.is_array() && i < animations.size(); ++i) {
      if (i >= most_animations_of_file)
        throw InputError("more than " + std::to_string(most_animations_of_file) + " animations");
      read_animation(animations[i]);
    }
    return std::move(motion_);
  }

private:
  void note(const char* what) {
    if (std::find(motion_.notes.begin(), motion_.notes.end(), what) == motion_.notes.end())
      motion_.notes.emplace_back(what);
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
    made.name = cut(text_or(member(animation, "name"), ""));
    for (const auto& channel : member(animation, "channels")) {
      const auto& target = member(channel, "target");
      const auto path = text_or(member(target, "path"), "");
      if (path == "pointer") note("only nodes are moved (KHR_animation_pointer is ignored)");
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
    channel.times_s = buffers_.numbers(member(sampler, "input"), "SCALAR", keys);
    for (std::size_t i = 0; i < channel.times_s.size(); ++i)
      if (!(channel.times_s[i] >= 0 && channel.times_s[i] <= 1e15) ||
          (i > 0 && !(channel.times_s[i] > channel.times_s[i - 1])))
        throw InputError("times of an animation do not ascend from 0");
    const auto values = buffers_.numbers(member(sampler, "output"),
                                         is_weights ? "SCALAR"
                                         : is_turn  ? "VEC4"
                                                    : "VEC3",
                                         keys);
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
      left_ -= std::min(left_, channel.times_s.size());
      if (left_ == 0)
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

  const json& root_;
  GltfBuffers buffers_;
  GltfMotion motion_;
  std::map<std::int32_t, std::int32_t> place_;  // of a node in motion_.nodes, by its number
  std::size_t channels_ = 0, left_ = most_keys_of_file;
};

}  // namespace

GltfMotion read_gltf_motion(const fs::path& file) {
  const json root = gltf_json(file);
  if (!is_gltf2(root)) throw InputError("it is no glTF of version 2");
  return MotionReader(root, file).read();
}

}  // namespace raywave
