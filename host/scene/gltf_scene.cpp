// SPDX-License-Identifier: Apache-2.0
#include "host/scene/gltf_scene.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <optional>
#include <string>

#include "host/scene/mesh.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

/// Where the file's coordinates go: p becomes turn (scale p) + shift_m.
struct Placing {
  glm::dmat3 turn{1};
  double scale = 1;
  glm::dvec3 shift_m{0};

  glm::dvec3 place_m(const glm::dvec3& p) const { return turn * (scale * p) + shift_m; }
};

/// The axes of a pose, without its scale.
glm::dmat3 axes_of(const glm::dmat4& pose, const std::string& where) {
  const auto z = glm::dvec3(pose[2]), y = glm::dvec3(pose[1]);
  const auto x = glm::cross(y, z);
  if (!(glm::length(z) > 0 && glm::length(x) > 1e-9 * glm::length(y) * glm::length(z)))
    throw InputError(where + ": its camera has no direction");
  const auto forward = glm::normalize(z), right = glm::normalize(x);
  return {right, glm::cross(forward, right), forward};
}

Placing placing_of(const GltfCamera& camera, double scale, const std::string& where) {
  const glm::dmat3 from_camera(glm::dvec3(-1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, -1));
  Placing placing;
  placing.scale = scale;
  placing.turn = from_camera * glm::transpose(axes_of(camera.world_from_camera, where));
  placing.shift_m = -(placing.turn * (scale * glm::dvec3(camera.world_from_camera[3])));
  return placing;
}

/// Angles about the x, then the y, then the z axis that make a rotation.
glm::dvec3 angles_deg(const glm::dmat3& turn) {
  const auto at = [&](int row, int column) { return turn[column][row]; };
  const double sine = std::clamp(-at(2, 0), -1.0, 1.0);
  const bool is_upright = std::hypot(at(2, 1), at(2, 2)) > 1e-12;
  return glm::degrees(
      glm::dvec3(is_upright ? std::atan2(at(2, 1), at(2, 2)) : std::atan2(-at(1, 2), at(1, 1)),
                 std::asin(sine), is_upright ? std::atan2(at(1, 0), at(0, 0)) : 0));
}

/// A light of the file. Photometric units become intensities whose matt white surface shows as
/// much: illuminance over pi.
Light light_of(const GltfLight& from, const Placing& placing, Channels channels) {
  Light light;
  if (channels.all) light.colour = from.colour;
  const double share = channels.all ? 1 : from.colour[channels.first];
  light.intensity = std::min(from.intensity * share / std::numbers::pi, 1e30);
  light.direction = placing.turn * -glm::dvec3(from.world_from_light[2]);
  const double length = glm::length(light.direction);
  light.direction = length > 0 ? light.direction / length : glm::dvec3(0, 0, 1);
  if (from.type == GltfLight::Type::directional) return light;
  light.type = from.type == GltfLight::Type::spot ? LightType::spot : LightType::point;
  light.position_m = placing.place_m(glm::dvec3(from.world_from_light[3]));
  light.falls_off = true;
  light.intensity = std::min(light.intensity * placing.scale * placing.scale, 1e30);
  light.outer_deg = from.outer_deg;
  light.inner_deg = std::min(from.inner_deg, 0.999 * from.outer_deg);
  return light;
}

GltfSet load_set(const Value& file_value, const std::filesystem::path& file) {
  GltfSet set;
  read_mesh_file(
      file, file_value.document->where(*file_value.node, file_value.path) + ": " + file_value.label,
      {"set"}, [&](ReaderPipe& pipe) { set = receive_gltf_set(pipe); });
  return set;
}

/// The camera that a name or a number means; the first one without either.
const GltfCamera& camera_of(const GltfSet& set, const std::optional<Value>& wanted) {
  if (!wanted) return set.cameras.front();
  std::string names;
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    const auto& name = set.cameras[i].name;
    if (wanted->is(name) || (wanted->node->is_integer() &&
                             wanted->node->as_integer()->get() == static_cast<std::int64_t>(i)))
      return set.cameras[i];
    if (i < 8) names += (i > 0 ? ", " : "") + in_quotes(name);
  }
  wanted->fail("one of " + names + (set.cameras.size() > 8 ? " ..." : "") +
               ", or its number, 0 to " + std::to_string(set.cameras.size() - 1));
}

}  // namespace

void read_gltf_scene(Section section, Scene& scene) {
  std::optional<Value> file_value, camera_value;
  std::filesystem::path file;
  std::optional<double> wanted_scale, cut_m;
  section.read("gltf", [&](const Value& v) {
    file_value = v;
    file = v.existing_file();
  });
  section.read("camera", [&](const Value& v) { camera_value = v; });
  section.read("scale", [&](const Value& v) { wanted_scale = v.number(between(1e-9, 1e9)); });
  section.read("cut", [&](const Value& v) { cut_m = v.length_m(between(1e-9, 1e4)); });
  section.finish();
  if (!file_value) {
    if (camera_value || wanted_scale || cut_m)
      section.fail("gltf is missing: give the name of a .gltf or .glb file");
    return;
  }

  const double scale = wanted_scale.value_or(1);
  const auto set = load_set(*file_value, file);
  const auto where = section.where() + ": gltf " + in_quotes(file.string());
  if (set.cameras.empty())
    throw InputError(where +
                     ": it has no camera: add one, or name the file as the mesh of an "
                     "[[object]]");
  const auto& camera = camera_of(set, camera_value);
  const auto placing = placing_of(camera, scale, where);
  Object object;
  object.mesh = file;
  object.where = where;
  object.anchor = Anchor::origin;
  object.unit_m = scale;
  object.rotation_deg = angles_deg(placing.turn);
  object.position_m = placing.shift_m;
  object.cut_m = cut_m.value_or(std::clamp(camera.near * scale, 1e-6, 1e4));
  scene.objects.push_back(object);
  const auto channels = scene.channels();
  for (const auto& light : set.lights) {
    scene.lights.push_back(light_of(light, placing, channels));
    scene.lights.back().where = where;
  }
  for (const auto& note : set.notes) scene.notes.push_back(where + ": " + one_line(note));
}

}  // namespace raywave
