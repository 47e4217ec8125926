// SPDX-License-Identifier: Apache-2.0
#include "host/scene/gltf_motion.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include "host/scene/vectors.hpp"

namespace raywave {
namespace {

using Path = GltfChannel::Path;
using Steps = GltfChannel::Steps;

glm::dquat quaternion_of(const glm::dvec4& q) { return {q.w, q.x, q.y, q.z}; }

}  // namespace

glm::dvec4 value_at(const GltfChannel& channel, double time_s) {
  const bool is_cubic = channel.steps == Steps::cubic;
  const auto at = [&](std::size_t key) { return channel.values[is_cubic ? 3 * key + 1 : key]; };
  const auto [k, s, span] = place_among(channel.times_s, time_s);
  if (channel.steps == Steps::step || span == 0) return at(k);
  const auto next = k + 1;
  const bool is_turn = channel.path == Path::rotation;
  if (is_cubic) {
    const auto value =
        hermite(at(k), channel.values[3 * k + 2], at(next), channel.values[3 * next], span, s);
    const double length = glm::length(value);
    return !is_turn ? value : length > 0 ? value / length : at(k);
  }
  if (!is_turn) return at(k) + s * (at(next) - at(k));
  const auto q = glm::normalize(glm::slerp(quaternion_of(at(k)), quaternion_of(at(next)), s));
  return {q.x, q.y, q.z, q.w};
}

std::vector<double> weights_at(const std::vector<GltfChannel>& channels, std::int32_t node,
                               std::vector<double> rest, double time_s) {
  for (const auto& channel : channels) {
    if (channel.node != node || channel.path != Path::weights) continue;
    const auto value = value_at(channel, time_s);
    const auto first = static_cast<std::size_t>(channel.target);
    for (std::size_t i = 0; i < 4 && first + i < rest.size(); ++i)
      rest[first + i] = value[static_cast<int>(i)];
  }
  return rest;
}

std::vector<glm::dmat4> poses_at(const std::vector<GltfNode>& nodes,
                                 const std::vector<GltfChannel>& channels, double time_s) {
  auto moved = nodes;
  for (const auto& channel : channels) {
    auto& node = moved[static_cast<std::size_t>(channel.node)];
    const auto value = value_at(channel, time_s);
    if (channel.path == Path::translation) node.translation = glm::dvec3(value);
    if (channel.path == Path::rotation) node.rotation = value;
    if (channel.path == Path::scale) node.scale = glm::dvec3(value);
  }
  std::vector<glm::dmat4> poses;
  poses.reserve(moved.size());
  for (const auto& node : moved)
    poses.push_back(node.parent < 0
                        ? matrix_of(node)
                        : poses[static_cast<std::size_t>(node.parent)] * matrix_of(node));
  return poses;
}

std::optional<Similarity> similarity_between(const glm::dmat4& from, const glm::dmat4& to) {
  constexpr double most_uneven = 1e-6;
  const glm::dmat3 before(from), after(to);
  const double stretch = glm::length(before[0]) * glm::length(before[1]) * glm::length(before[2]);
  if (!(std::abs(glm::determinant(before)) > 1e-12 * stretch)) return {};
  const auto linear = after * glm::inverse(before);
  const double determinant = glm::determinant(linear), scale = std::cbrt(determinant);
  Similarity motion;
  const double largest =
      std::max({glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2])});
  if (largest < smallest_scale) {
    motion.scale = smallest_scale;
  } else {
    if (!(scale > 0)) return {};
    const auto x = linear[0] / scale, y = linear[1] / scale, z = linear[2] / scale;
    const double uneven = std::max({std::abs(glm::dot(x, x) - 1), std::abs(glm::dot(y, y) - 1),
                                    std::abs(glm::dot(z, z) - 1), std::abs(glm::dot(x, y)),
                                    std::abs(glm::dot(y, z)), std::abs(glm::dot(z, x))});
    if (!(uneven <= 2 * most_uneven)) return {};
    motion.scale = scale;
    motion.turn[0] = glm::normalize(x);
    motion.turn[1] = glm::normalize(y - glm::dot(y, motion.turn[0]) * motion.turn[0]);
    motion.turn[2] = glm::cross(motion.turn[0], motion.turn[1]);
  }
  motion.shift = glm::dvec3(to[3]) - motion.turn * (motion.scale * glm::dvec3(from[3]));
  return motion;
}

glm::dvec3 fixed_axis_angles_deg(const glm::dmat3& turn) {
  // Rz Ry Rx. Where x and z become one axis, z makes up for any error of x
  const double x = std::atan2(turn[1][2], turn[2][2]),
               y = std::atan2(-turn[0][2], std::hypot(turn[1][2], turn[2][2]));
  const auto second = turn * glm::dvec3(0, std::cos(x), -std::sin(x));
  return glm::degrees(glm::dvec3(x, y, std::atan2(-second.x, second.y)));
}

}  // namespace raywave
