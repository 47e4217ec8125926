// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/gltf_json.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <glm/common.hpp>
#include <glm/trigonometric.hpp>
#include <iterator>
#include <optional>
#include <set>
#include <vector>

#include "host/common/error.hpp"
#include "host/scene/gltf_motion.hpp"
#include "host/scene/light.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

using nlohmann::json;

/// The JSON chunk of a GLB, or the whole of a .gltf file.
std::string json_part(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (lower_extension(file) == ".gltf")
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  std::uint32_t head[5]{};  // magic, version, length; length and kind of the first chunk
  if (!stream.read(reinterpret_cast<char*>(head), sizeof head)) return {};
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error || head[0] != 0x46546c67 || head[3] > size) return {};
  std::string text(head[3], '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  return text;
}

template <class Vector>
std::optional<Vector> numbers(const json& array) {
  Vector v;
  if (!array.is_array() || array.size() != static_cast<std::size_t>(Vector::length())) return {};
  for (int i = 0; i < Vector::length(); ++i) {
    const auto& value = array[static_cast<std::size_t>(i)];
    if (!value.is_number() || !std::isfinite(value.get<double>())) return {};
    v[i] = std::clamp(value.get<double>(), -1e15, 1e15);
  }
  return v;
}

void add_camera(const json& root, const json& node, const glm::dmat4& pose, GltfSet& set) {
  const auto& camera = camera_of(root, node);
  if (!camera.is_object() || set.cameras.size() >= most_cameras_of_file) return;
  auto name = text_or(member(node, "name"), text_or(member(camera, "name"), ""));
  name.resize(std::min(name.size(), longest_text));
  const auto& lens =
      member(camera, member(camera, "perspective").is_object() ? "perspective" : "orthographic");
  set.cameras.push_back({name, pose, std::clamp(number_or(member(lens, "znear"), 0), 0.0, 1e15)});
}

void add_light(const json& root, const json& node, const glm::dmat4& pose, GltfSet& set) {
  const auto& light = light_of(root, node);
  if (!light.is_object()) return;
  if (set.lights.size() >= most_lights_of_file)
    throw InputError("more than " + std::to_string(most_lights_of_file) + " lights");
  GltfLight made;
  const auto type = text_or(member(light, "type"), "");
  made.type = type == "point"  ? GltfLight::Type::point
              : type == "spot" ? GltfLight::Type::spot
                               : GltfLight::Type::directional;
  made.world_from_light = pose;
  made.colour = glm::clamp(numbers<glm::dvec3>(member(light, "color")).value_or(glm::dvec3(1)),
                           glm::dvec3(0), glm::dvec3(1e15));
  made.intensity = std::clamp(number_or(member(light, "intensity"), 1), 0.0, 1e15);
  const auto& spot = member(light, "spot");
  constexpr double right = 1.5707963267948966;
  const double outer_deg = glm::degrees(number_or(member(spot, "outerConeAngle"), right / 2)),
               inner_deg = glm::degrees(number_or(member(spot, "innerConeAngle"), 0));
  made.outer_deg = std::clamp(outer_deg, least_spot_deg, 90.0);
  made.inner_deg = std::clamp(inner_deg, 0.0, made.outer_deg);
  set.lights.push_back(made);
  const auto note_once = [&](const char* note) {
    if (std::find(set.notes.begin(), set.notes.end(), note) == set.notes.end())
      set.notes.emplace_back(note);
  };
  if (!member(light, "range").is_null())
    note_once(
        "the range of lights is ignored: they fall off with the square of the "
        "distance");
  if (made.type == GltfLight::Type::spot && outer_deg < least_spot_deg)
    note_once("spots narrower than 0.5 degrees are widened to that");
}

}  // namespace

std::string lower_extension(const std::filesystem::path& file) {
  std::string text = file.extension().string();
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

json gltf_json(const std::filesystem::path& file) {
  return json::parse(json_part(file), nullptr, false);
}

bool is_gltf2(const json& root) {
  return text_or(member(member(root, "asset"), "version"), "").starts_with("2");
}

const json& member(const json& object, const char* name) {
  static const json none;
  if (!object.is_object()) return none;
  const auto found = object.find(name);
  return found == object.end() ? none : *found;
}

const json& element(const json& array, const json& index) {
  static const json none;
  if (!array.is_array() || !index.is_number_unsigned() ||
      index.get<std::uint64_t>() >= array.size())
    return none;
  return array[index.get<std::size_t>()];
}

double number_or(const json& value, double otherwise) {
  return value.is_number() && std::isfinite(value.get<double>()) ? value.get<double>() : otherwise;
}

std::string text_or(const json& value, const std::string& otherwise) {
  return value.is_string() ? value.get<std::string>() : otherwise;
}

GltfNode gltf_place_of(const json& node) {
  GltfNode place;
  const auto& matrix = member(node, "matrix");
  if (matrix.is_array() && matrix.size() == 16) {
    place.has_matrix = 1;
    for (int i = 0; i < 16; ++i)
      place.matrix[i / 4][i % 4] =
          std::clamp(number_or(matrix[static_cast<std::size_t>(i)], 0), -1e15, 1e15);
    return place;
  }
  place.translation = numbers<glm::dvec3>(member(node, "translation")).value_or(glm::dvec3(0));
  place.scale = numbers<glm::dvec3>(member(node, "scale")).value_or(glm::dvec3(1));
  const auto q = numbers<glm::dvec4>(member(node, "rotation")).value_or(glm::dvec4(0, 0, 0, 1));
  const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  if (length > 0) place.rotation = {q.x / length, q.y / length, q.z / length, q.w / length};
  return place;
}

const json& top_nodes_of(const json& root) {
  const auto& chosen = member(root, "scene");
  return member(element(member(root, "scenes"), chosen.is_null() ? json(0u) : chosen), "nodes");
}

const json& camera_of(const json& root, const json& node) {
  return element(member(root, "cameras"), member(node, "camera"));
}

const json& light_of(const json& root, const json& node) {
  constexpr const char* extension = "KHR_lights_punctual";
  return element(member(member(member(root, "extensions"), extension), "lights"),
                 member(member(member(node, "extensions"), extension), "light"));
}

void for_each_node(
    const json& root,
    const std::function<void(const json&, std::int32_t, std::int32_t, const glm::dmat4&)>& visit) {
  struct Pending {
    json index;
    std::int32_t parent;
    glm::dmat4 world_from_parent;
  };
  std::set<std::uint64_t> seen;
  std::vector<Pending> pending;
  // The last one is visited first
  const auto add_all = [&](const json& indices, std::int32_t parent, const glm::dmat4& pose) {
    if (!indices.is_array()) return;
    for (auto index = indices.rbegin(); index != indices.rend(); ++index)
      pending.push_back({*index, parent, pose});
  };
  add_all(top_nodes_of(root), -1, glm::dmat4(1));
  for (std::int32_t visited = 0; !pending.empty();) {
    const auto next = pending.back();
    pending.pop_back();
    const auto& node = element(member(root, "nodes"), next.index);
    if (!node.is_object() || !seen.insert(next.index.get<std::uint64_t>()).second) continue;
    const auto pose = next.world_from_parent * matrix_of(gltf_place_of(node));
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        if (!(std::abs(pose[i][j]) <= 1e30)) throw InputError("a node is nowhere");
    visit(node, next.index.get<std::int32_t>(), next.parent, pose);
    add_all(member(node, "children"), visited++, pose);
  }
}

GltfSet read_gltf_set(const std::filesystem::path& file) {
  const json root = gltf_json(file);
  if (!is_gltf2(root)) throw InputError("it is no glTF of version 2");
  GltfSet set;
  for_each_node(root, [&](const json& node, std::int32_t, std::int32_t, const glm::dmat4& pose) {
    add_camera(root, node, pose, set);
    add_light(root, node, pose, set);
  });
  return set;
}

}  // namespace raywave
