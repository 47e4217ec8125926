// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
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
  set.cameras.push_back({name, pose, number_or(member(lens, "znear"), 0, 0, 1e15)});
}

void add_light(const json& light, const glm::dmat4& pose, GltfSet& set) {
  require_at_most(set.lights.size() + 1, most_lights_of_file, "lights");
  GltfLight made;
  const auto type = text_or(member(light, "type"), "");
  made.type = type == "point"  ? GltfLight::Type::point
              : type == "spot" ? GltfLight::Type::spot
                               : GltfLight::Type::directional;
  made.world_from_light = pose;
  made.colour = colour_or(member(light, "color"), glm::dvec3(1));
  made.intensity = number_or(member(light, "intensity"), 1, 0, 1e15);
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
      require_at_most(motion_.nodes.size() + 1, most_nodes_of_file, "nodes");
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
      require_at_most(motion_.animations.size() + 1, most_animations_of_file, "animations");
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
      require_at_most(++channels_, most_moves_of_file, "values are animated");
      // Vectors of four and more, of all keys together
      keys_ += channel.times_s.size();
      require_at_most(keys_, most_keys_of_file, keys);
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

constexpr const char* remedy = "; export the file again, or without the skin or the morph targets";

using Order = std::vector<std::uint32_t>;

/// Vectors of three floats, appended.
void append_vectors(const GltfPrimitive& from, const GltfNumbers& numbers, const std::string& name,
                    const Order& order, std::vector<glm::vec3>& to) {
  for (const auto vertex : order) {
    const auto v = numbers.vector_at(vertex);
    if (!(std::abs(v.x) <= 1e30 && std::abs(v.y) <= 1e30 && std::abs(v.z) <= 1e30))
      from.refuse(name + ": vertex " + std::to_string(vertex) + " has no numbers");
    to.emplace_back(v);
  }
}

void read_targets(const GltfPrimitive& from, const Order& order, DeformingPart& part) {
  const auto& targets = member(from.object(), "targets");
  if ((targets.is_array() ? targets.size() : 0) != part.weights.size())
    from.refuse("its primitives differ in the number of morph targets");
  // A target without positions, or one that only some of the targets have
  const auto add = [&](const json& target, const char* name, std::vector<glm::vec3>& to) {
    const auto& accessor = member(target, name);
    if (accessor.is_null()) {
      to.resize(to.size() + order.size(), glm::vec3(0));
      return;
    }
    const auto told = name + std::string(" of a morph target");
    const auto numbers = from.numbers(accessor, "VEC3", told);
    from.require_count(told, numbers.count);
    append_vectors(from, numbers, told, order, to);
  };
  bool has_normals = false;
  for (const auto& target : targets) {
    add(target, "POSITION", part.target_positions);
    has_normals = has_normals || !member(target, "NORMAL").is_null();
  }
  for (const auto& target : targets)
    if (has_normals) add(target, "NORMAL", part.target_normals);
}

void read_matrices(const GltfPrimitive& from, const json& accessor, DeformingPart& part) {
  part.joint_from_mesh.resize(part.joints.size(), glm::dmat4(1));
  if (accessor.is_null()) return;
  const auto matrices = from.numbers(accessor, "MAT4", "inverse bind matrices");
  if (matrices.count < part.joints.size())
    from.refuse("its skin has " + std::to_string(part.joints.size()) + " joints and " +
                std::to_string(matrices.count) + " inverse bind matrices");
  for (std::size_t i = 0; i < part.joints.size(); ++i) {
    for (int k = 0; k < 16; ++k) {
      auto& number = part.joint_from_mesh[i][k / 4][k % 4];
      number = matrices.at(i, static_cast<std::uint64_t>(k));
      if (!(std::abs(number) <= 1e15))
        from.refuse("inverse bind matrix " + std::to_string(i) + " has no numbers");
    }
  }
}

/// JOINTS_0 and WEIGHTS_0, JOINTS_1 ... side by side.
void read_influences(const GltfPrimitive& from, const Order& order, DeformingPart& part) {
  std::vector<std::pair<GltfNumbers, GltfNumbers>> sets;
  while (true) {
    const auto number = std::to_string(sets.size());
    const auto joints = "JOINTS_" + number, weights = "WEIGHTS_" + number;
    if (!from.has(joints) && !from.has(weights) && !sets.empty()) break;
    if (!from.has(joints) || !from.has(weights))
      from.refuse("it has a skin, but not " + (from.has(joints) ? weights : joints));
    if (4 * sets.size() >= most_influences)
      from.refuse("more than " + std::to_string(most_influences) + " joints move one vertex");
    sets.emplace_back(from.attribute(joints, "VEC4"), from.attribute(weights, "VEC4", false));
  }
  part.influences = static_cast<std::uint32_t>(4 * sets.size());
  for (const auto i : order) {
    const auto vertex = " of vertex " + std::to_string(i);
    double sum = 0;
    for (const auto& set : sets) {
      for (std::uint64_t k = 0; k < 4; ++k) {
        const double joint = set.first.at(i, k), weight = set.second.at(i, k);
        if (!(weight >= 0 && weight <= 1e15))
          from.refuse("a weight" + vertex + " is no number >= 0");
        const bool is_joint = joint >= 0 && joint < static_cast<double>(part.joints.size()) &&
                              joint == std::floor(joint);
        if (!is_joint && weight > 0)
          from.refuse("a joint" + vertex + " is not among the " +
                      std::to_string(part.joints.size()) + " of its skin");
        part.joint_of.push_back(static_cast<std::uint16_t>(is_joint ? joint : 0));
        part.weight_of.push_back(static_cast<float>(weight));
        sum += part.weight_of.back();
      }
    }
    if (!(sum > 0)) from.refuse("the weights" + vertex + " are all 0");
  }
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

GltfPart deforming_part(GltfFile& gltf, const GltfPrimitive& from, const json& node,
                        const GltfWearer& wearer, const std::map<std::int32_t, glm::dmat4>& poses,
                        const glm::dmat4& instance, const Order& order, std::uint64_t& left) {
  GltfPart made;
  auto& part = made.part;
  const auto needed = order.size() * (1 + wearer.weights.size());
  if (needed > left)
    from.refuse("more than " + std::to_string(most_deforming_of_file) +
                " vertices deform, of all morph targets");
  left -= needed;
  part.node = wearer.node;
  append_vectors(from, from.positions(), "POSITION", order, part.positions);
  if (from.has("NORMAL"))
    append_vectors(from, from.attribute("NORMAL", "VEC3"), "NORMAL", order, part.normals);
  part.normals.resize(part.positions.size(), glm::vec3(0));
  part.weights = wearer.weights;
  read_targets(from, order, part);
  if (wearer.joints.empty()) {
    part.joints = {wearer.node};
    part.joint_from_mesh = {instance};
  } else {
    part.joints = wearer.joints;
    read_matrices(from, member(gltf.of("skins", member(node, "skin")), "inverseBindMatrices"),
                  part);
    read_influences(from, order, part);
  }
  for (std::size_t i = 0; i < part.joints.size(); ++i) {
    const auto pose = poses.find(part.joints[i]);
    if (pose == poses.end())
      from.refuse("joint " + std::to_string(i) + " of its skin is node " +
                  std::to_string(part.joints[i]) + ", which is not in the scene");
    made.world_from_mesh.push_back(pose->second * part.joint_from_mesh[i]);
  }
  return made;
}

GltfWearer wearer_of(const GltfFile& gltf, const json& node, std::int32_t number) {
  GltfWearer wearer;
  wearer.node = number;
  const auto& mesh = gltf.of("meshes", member(node, "mesh"));
  const auto& targets = member(element(member(mesh, "primitives"), 0u), "targets");
  const auto& skin_index = member(node, "skin");
  if (!mesh.is_object()) return wearer;
  const auto fail = [&](const std::string& why) {
    throw InputError(name_of_mesh(gltf, node) + ": " + why + remedy);
  };
  if (!skin_index.is_null()) {
    const auto& joints = member(gltf.of("skins", skin_index), "joints");
    if (!joints.is_array() || joints.empty() || joints.size() > most_joints_of_skin)
      fail("its skin has no joints, or more than " + std::to_string(most_joints_of_skin));
    for (const auto& joint : joints) {
      if (!joint.is_number_unsigned() || joint.get<std::uint64_t>() > INT32_MAX)
        fail("a joint of its skin is no number of a node");
      wearer.joints.push_back(joint.get<std::int32_t>());
    }
  }
  if (!targets.is_array() || targets.empty()) return wearer;
  if (targets.size() > most_targets_of_mesh)
    fail("more than " + std::to_string(most_targets_of_mesh) + " morph targets");
  const auto& own = member(node, "weights");
  const auto& weights = own.is_null() ? member(mesh, "weights") : own;
  wearer.weights.resize(targets.size(), 0);
  if (weights.is_null()) return wearer;
  if (!weights.is_array() || weights.size() != targets.size())
    fail("it has not as many weights as morph targets");
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (!weights[i].is_number() || !(std::abs(weights[i].get<double>()) <= 1e15))
      fail("a weight of a morph target is no number");
    wearer.weights[i] = weights[i].get<double>();
  }
  return wearer;
}

}  // namespace raywave
