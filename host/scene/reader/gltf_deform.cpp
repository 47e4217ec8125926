// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/gltf_deform.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>

#include "host/common/error.hpp"
#include "host/scene/reader/gltf_buffers.hpp"
#include "host/scene/reader/gltf_json.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

using nlohmann::json;

/// "mesh "body"": a node's mesh, for messages.
std::string name_of_mesh(const json& root, const json& node) {
  const auto& index = member(node, "mesh");
  auto name = text_or(member(element(member(root, "meshes"), index), "name"), "");
  name.resize(std::min(name.size(), std::size_t{100}));
  return "mesh " + (name.empty() ? std::to_string(count_or(index, 0)) : '"' + name + '"');
}

[[noreturn]] void fail(const std::string& why) {
  throw InputError(why + "; export the file again, or without the skin or the morph targets");
}

/// Vectors of three floats.
std::vector<glm::vec3> vectors_of(const std::vector<double>& numbers, const std::string& what) {
  std::vector<glm::vec3> vectors(numbers.size() / 3);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!(std::abs(numbers[i]) <= 1e30))
      fail(what + ": vertex " + std::to_string(i / 3) + " has no numbers");
    vectors[i / 3][static_cast<int>(i % 3)] = static_cast<float>(numbers[i]);
  }
  return vectors;
}

class PartReader {
public:
  PartReader(const json& root, const std::filesystem::path& file)
      : root_(root), buffers_(root, file, most_deforming_of_file) {}

  GltfParts read() {
    std::map<std::int32_t, glm::dmat4> poses;
    std::vector<std::pair<const json*, GltfWearer>> wearers;
    for_each_node(root_, [&](const json& node, std::int32_t number, std::int32_t,
                             const glm::dmat4& world_from_node) {
      poses.emplace(number, world_from_node);
      if (auto wearer = wearer_of(root_, node, number)) wearers.emplace_back(&node, *wearer);
    });
    GltfParts parts;
    for (const auto& [node, wearer] : wearers) {
      mesh_ = name_of_mesh(root_, *node);
      auto& of_node = parts[wearer.node];
      for (const auto& primitive :
           member(element(member(root_, "meshes"), member(*node, "mesh")), "primitives")) {
        of_node.emplace_back();
        if (count_or(member(primitive, "mode"), 4) >= 4)
          of_node.back() = part_of(primitive, *node, wearer, poses);
      }
    }
    return parts;
  }

private:
  std::string what(const std::string& name) const { return mesh_ + ": " + name; }

  /// As GltfBuffers::numbers has them.
  std::vector<double> numbers(const json& accessor, const char* type, const std::string& what,
                              bool whole = false) {
    try {
      return buffers_.numbers(accessor, type, what, whole);
    } catch (const InputError& error) {
      fail(error.what());
    }
  }

  GltfPart part_of(const json& primitive, const json& node, const GltfWearer& wearer,
                   const std::map<std::int32_t, glm::dmat4>& poses) {
    GltfPart made;
    auto& part = made.part;
    const auto& attributes = member(primitive, "attributes");
    part.node = wearer.node;
    const auto& positions = element(member(root_, "accessors"), member(attributes, "POSITION"));
    if (number_or(member(positions, "componentType"), 0) != 5126)
      fail(what("POSITION is missing, compressed or quantized, and must be floats"));
    part.positions = vectors(attributes, "POSITION");
    const auto count = part.positions.size();
    if (member(attributes, "NORMAL").is_null())
      part.normals.resize(count, glm::vec3(0));
    else
      part.normals = vectors(attributes, "NORMAL", count);
    if (const auto& indices = member(primitive, "indices"); !indices.is_null()) {
      for (const double corner : numbers(indices, "SCALAR", what("indices"), true)) {
        if (!(corner >= 0 && corner < static_cast<double>(count)))
          fail(what("a triangle names a vertex that is not there"));
        made.corners.push_back(static_cast<std::uint32_t>(corner));
      }
    }
    read_targets(primitive, wearer, part);
    if (wearer.joints.empty()) {
      part.joints = {wearer.node};
      part.joint_from_mesh = {glm::dmat4(1)};
    } else {
      part.joints = wearer.joints;
      read_matrices(
          member(element(member(root_, "skins"), member(node, "skin")), "inverseBindMatrices"),
          part);
      read_influences(attributes, part);
    }
    for (std::size_t i = 0; i < part.joints.size(); ++i) {
      const auto pose = poses.find(part.joints[i]);
      if (pose == poses.end())
        fail(what("joint " + std::to_string(i) + " of its skin is node " +
                  std::to_string(part.joints[i]) + ", which is not in the scene"));
      made.world_from_mesh.push_back(pose->second * part.joint_from_mesh[i]);
    }
    return made;
  }

  /// expected  so many, unless it is 0
  /// of        for messages, behind the name
  std::vector<glm::vec3> vectors(const json& attributes, const char* name, std::size_t expected = 0,
                                 const char* of = "") {
    const auto told = name + std::string(of);
    auto found =
        vectors_of(numbers(member(attributes, name), "VEC3", what(told), true), what(told));
    require_count(told, found.size(), expected);
    return found;
  }

  void require_count(const std::string& name, std::size_t count, std::size_t expected) const {
    if (expected > 0 && count != expected)
      fail(what(name) + " is given for " + std::to_string(count) + " vertices, and POSITION for " +
           std::to_string(expected));
  }

  void read_targets(const json& primitive, const GltfWearer& wearer, DeformingPart& part) {
    part.weights = wearer.weights;
    const auto& targets = member(primitive, "targets");
    if ((targets.is_array() ? targets.size() : 0) != part.weights.size())
      fail(what("its primitives differ in the number of morph targets"));
    if (part.weights.empty()) return;
    const auto count = part.positions.size();
    // A target without positions, or one that only some of the targets have
    const auto add = [&](const json& target, const char* name, std::vector<glm::vec3>& to) {
      if (member(target, name).is_null()) {
        to.resize(to.size() + count, glm::vec3(0));
        return;
      }
      const auto found = vectors(target, name, count, " of a morph target");
      to.insert(to.end(), found.begin(), found.end());
    };
    bool has_normals = false;
    for (const auto& target : targets) {
      add(target, "POSITION", part.target_positions);
      has_normals = has_normals || !member(target, "NORMAL").is_null();
    }
    for (const auto& target : targets)
      if (has_normals) add(target, "NORMAL", part.target_normals);
  }

  void read_matrices(const json& accessor, DeformingPart& part) {
    part.joint_from_mesh.resize(part.joints.size(), glm::dmat4(1));
    if (accessor.is_null()) return;
    const auto matrices = numbers(accessor, "MAT4", what("inverse bind matrices"));
    if (matrices.size() < 16 * part.joints.size())
      fail(what("its skin has " + std::to_string(part.joints.size()) + " joints and " +
                std::to_string(matrices.size() / 16) + " inverse bind matrices"));
    for (std::size_t i = 0; i < 16 * part.joints.size(); ++i) {
      if (!(std::abs(matrices[i]) <= 1e15))
        fail(what("inverse bind matrix " + std::to_string(i / 16) + " has no numbers"));
      part.joint_from_mesh[i / 16][static_cast<int>(i / 4 % 4)][static_cast<int>(i % 4)] =
          matrices[i];
    }
  }

  /// JOINTS_0 and WEIGHTS_0, JOINTS_1 ... side by side.
  void read_influences(const json& attributes, DeformingPart& part) {
    const auto count = part.positions.size();
    std::vector<std::vector<double>> joints, weights;
    while (true) {
      const auto number = std::to_string(joints.size());
      const auto joints_name = "JOINTS_" + number, weights_name = "WEIGHTS_" + number;
      const auto &of_joints = member(attributes, joints_name.c_str()),
                 &of_weights = member(attributes, weights_name.c_str());
      if (of_joints.is_null() && of_weights.is_null() && !joints.empty()) break;
      if (of_joints.is_null() || of_weights.is_null())
        fail(what("it has a skin, but not " + (of_joints.is_null() ? joints_name : weights_name)));
      if (4 * joints.size() >= most_influences)
        fail(what("more than " + std::to_string(most_influences) + " joints move one vertex"));
      joints.push_back(numbers(of_joints, "VEC4", what(joints_name), true));
      weights.push_back(numbers(of_weights, "VEC4", what(weights_name)));
      require_count(joints_name, joints.back().size() / 4, count);
      require_count(weights_name, weights.back().size() / 4, count);
    }
    part.influences = static_cast<std::uint32_t>(4 * joints.size());
    for (std::size_t i = 0; i < count; ++i) {
      const auto vertex = " of vertex " + std::to_string(i);
      double sum = 0;
      for (std::size_t set = 0; set < joints.size(); ++set) {
        for (std::size_t k = 4 * i; k < 4 * i + 4; ++k) {
          const double weight = weights[set][k], joint = joints[set][k];
          if (!(weight >= 0 && weight <= 1e15))
            fail(what("a weight" + vertex + " is no number >= 0"));
          const bool is_joint = joint >= 0 && joint < static_cast<double>(part.joints.size()) &&
                                joint == std::floor(joint);
          if (!is_joint && weight > 0)
            fail(what("a joint" + vertex + " is not among the " +
                      std::to_string(part.joints.size()) + " of its skin"));
          part.joint_of.push_back(static_cast<std::uint16_t>(is_joint ? joint : 0));
          part.weight_of.push_back(static_cast<float>(weight));
          sum += part.weight_of.back();
        }
      }
      if (!(sum > 0)) fail(what("the weights" + vertex + " are all 0"));
    }
  }

  const json& root_;
  GltfBuffers buffers_;
  std::string mesh_;  // that is read, for messages
};

}  // namespace

std::optional<GltfWearer> wearer_of(const json& root, const json& node, std::int32_t number) {
  const auto& mesh = element(member(root, "meshes"), member(node, "mesh"));
  const auto& targets = member(element(member(mesh, "primitives"), json(0u)), "targets");
  const auto& skin_index = member(node, "skin");
  if (!mesh.is_object() || (skin_index.is_null() && (!targets.is_array() || targets.empty())))
    return {};
  GltfWearer wearer;
  wearer.node = number;
  const auto fail_here = [&](const std::string& why) {
    fail(name_of_mesh(root, node) + ": " + why);
  };
  if (!skin_index.is_null()) {
    const auto& joints = member(element(member(root, "skins"), skin_index), "joints");
    if (!joints.is_array() || joints.empty() || joints.size() > most_joints_of_skin)
      fail_here("its skin has no joints, or more than " + std::to_string(most_joints_of_skin));
    for (const auto& joint : joints) {
      const auto of_file = count_or(joint, UINT64_MAX);
      if (of_file > INT32_MAX) fail_here("a joint of its skin is no number of a node");
      wearer.joints.push_back(static_cast<std::int32_t>(of_file));
    }
  }
  if (!targets.is_array()) return wearer;
  if (targets.size() > most_targets_of_mesh)
    fail_here("more than " + std::to_string(most_targets_of_mesh) + " morph targets");
  const auto& own = member(node, "weights");
  const auto& weights = own.is_null() ? member(mesh, "weights") : own;
  wearer.weights.resize(targets.size(), 0);
  if (weights.is_null()) return wearer;
  if (!weights.is_array() || weights.size() != targets.size())
    fail_here("it has not as many weights as morph targets");
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (!(std::abs(number_or(weights[i], INFINITY)) <= 1e15))
      fail_here("a weight of a morph target is no number");
    wearer.weights[i] = weights[i].get<double>();
  }
  return wearer;
}

GltfParts read_gltf_parts(const json& root, const std::filesystem::path& file) {
  return PartReader(root, file).read();
}

void reorder(DeformingPart& part, const std::vector<std::uint32_t>& order) {
  const auto count = part.positions.size();
  // each  elements of a vertex; vertices follow each other in blocks, of targets
  const auto reordered = [&](auto& all, std::size_t each) {
    if (all.empty()) return;
    std::remove_reference_t<decltype(all)> wanted;
    wanted.reserve(order.size() * (all.size() / count));
    for (std::size_t block = 0; block < all.size(); block += count * each)
      for (const auto vertex : order)
        for (std::size_t k = 0; k < each; ++k) wanted.push_back(all[block + vertex * each + k]);
    all = std::move(wanted);
  };
  reordered(part.normals, 1);
  reordered(part.joint_of, part.influences);
  reordered(part.weight_of, part.influences);
  reordered(part.target_positions, 1);
  reordered(part.target_normals, 1);
  reordered(part.positions, 1);
}

}  // namespace raywave
