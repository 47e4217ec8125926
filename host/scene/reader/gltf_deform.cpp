// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "host/common/error.hpp"
#include "host/scene/reader/gltf_primitive.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

using nlohmann::json;

constexpr const char* remedy = "; export the file again, or without the skin or the morph targets";

using Order = std::vector<std::uint32_t>;

/// Vectors of three floats, appended.
void append_vectors(const GltfPrimitive& from, const GltfNumbers& numbers, const std::string& name,
                    const Order& order, std::vector<glm::vec3>& to) {
  for (const auto vertex : order) {
    const auto v = numbers.vector_at(vertex);
    if (!(std::abs(v.x) <= 1e30 && std::abs(v.y) <= 1e30 && std::abs(v.z) <= 1e30))
      from.fail(from.what(name) + ": vertex " + std::to_string(vertex) + " has no numbers");
    to.emplace_back(v);
  }
}

void read_targets(const GltfPrimitive& from, const Order& order, DeformingPart& part) {
  const auto& targets = member(from.object(), "targets");
  if ((targets.is_array() ? targets.size() : 0) != part.weights.size())
    from.fail(from.what("its primitives differ in the number of morph targets"));
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
    from.fail(from.what("its skin has " + std::to_string(part.joints.size()) + " joints and " +
                        std::to_string(matrices.count) + " inverse bind matrices"));
  for (std::size_t i = 0; i < part.joints.size(); ++i) {
    for (int k = 0; k < 16; ++k) {
      auto& number = part.joint_from_mesh[i][k / 4][k % 4];
      number = matrices.at(i, static_cast<std::uint64_t>(k));
      if (!(std::abs(number) <= 1e15))
        from.fail(from.what("inverse bind matrix " + std::to_string(i) + " has no numbers"));
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
      from.fail(from.what("it has a skin, but not " + (from.has(joints) ? weights : joints)));
    if (4 * sets.size() >= most_influences)
      from.fail(
          from.what("more than " + std::to_string(most_influences) + " joints move one vertex"));
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
          from.fail(from.what("a weight" + vertex + " is no number >= 0"));
        const bool is_joint = joint >= 0 && joint < static_cast<double>(part.joints.size()) &&
                              joint == std::floor(joint);
        if (!is_joint && weight > 0)
          from.fail(from.what("a joint" + vertex + " is not among the " +
                              std::to_string(part.joints.size()) + " of its skin"));
        part.joint_of.push_back(static_cast<std::uint16_t>(is_joint ? joint : 0));
        part.weight_of.push_back(static_cast<float>(weight));
        sum += part.weight_of.back();
      }
    }
    if (!(sum > 0)) from.fail(from.what("the weights" + vertex + " are all 0"));
  }
}

}  // namespace

GltfPart deforming_part(GltfFile& gltf, const GltfPrimitive& from, const json& node,
                        const GltfWearer& wearer, const std::map<std::int32_t, glm::dmat4>& poses,
                        const glm::dmat4& instance, const Order& order, std::uint64_t& left) {
  GltfPart made;
  auto& part = made.part;
  const auto needed = order.size() * (1 + wearer.weights.size());
  if (needed > left)
    from.fail(from.what("more than " + std::to_string(most_deforming_of_file) +
                        " vertices deform, of all morph targets"));
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
      from.fail(from.what("joint " + std::to_string(i) + " of its skin is node " +
                          std::to_string(part.joints[i]) + ", which is not in the scene"));
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
