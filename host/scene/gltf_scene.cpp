// SPDX-License-Identifier: Apache-2.0
#include "host/scene/gltf_scene.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "host/scene/mesh.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

/// The axes of a pose, without its scale.
glm::dmat3 axes_of(const glm::dmat4& pose, const std::string& where) {
  const auto z = glm::dvec3(pose[2]), y = glm::dvec3(pose[1]);
  const auto x = glm::cross(y, z);
  if (!(glm::length(z) > 0 && glm::length(x) > 1e-9 * glm::length(y) * glm::length(z)))
    throw InputError(where + ": its camera has no direction");
  const auto forward = glm::normalize(z), right = glm::normalize(x);
  return {right, glm::cross(forward, right), forward};
}

Similarity placing_of(const GltfCamera& camera, double scale, const std::string& where) {
  const glm::dmat3 from_camera(glm::dvec3(-1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, -1));
  Similarity placing;
  placing.scale = scale;
  placing.turn = from_camera * glm::transpose(axes_of(camera.world_from_camera, where));
  placing.shift = -(placing.turn * (scale * glm::dvec3(camera.world_from_camera[3])));
  return placing;
}

/// A light of the file. Photometric units become intensities whose matt white surface shows as
/// much: illuminance over pi.
Light light_of(const GltfLight& from, const Similarity& placing, Channels channels) {
  Light light;
  if (channels.all) light.colour = from.colour;
  const double share = channels.all ? 1 : from.colour[channels.first];
  light.intensity = std::min(from.intensity * share / std::numbers::pi, 1e30);
  light.type = from.type == GltfLight::Type::directional ? LightType::directional
               : from.type == GltfLight::Type::spot      ? LightType::spot
                                                         : LightType::point;
  place_light(from.world_from_light, placing, light);
  if (light.type == LightType::directional) return light;
  light.falls_off = true;
  light.intensity = std::min(light.intensity * placing.scale * placing.scale, 1e30);
  light.outer_deg = from.outer_deg;
  light.inner_deg = std::min(from.inner_deg, 0.999 * from.outer_deg);
  return light;
}

GltfSet load_set(const Value& file_value, const std::filesystem::path& file) {
  GltfSet set;
  read_mesh_file(file, file_value.where(), {"set"},
                 [&](ReaderPipe& pipe) { set = receive_gltf_set(pipe); });
  return set;
}

/// The one of them that a name or a number means; null: none.
///
/// names  gets those that are there, for messages
template <class Named>
const Named* named_by(const Value& wanted, const std::vector<Named>& all, std::string& names) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (wanted.is(all[i].name) || (wanted.node->is_integer() && wanted.node->as_integer()->get() ==
                                                                    static_cast<std::int64_t>(i)))
      return &all[i];
    if (i < 8) names += (i > 0 ? ", " : "") + in_quotes(all[i].name);
  }
  names += (all.size() > 8 ? " ..., or" : ", or");
  names += " its number, 0 to " + std::to_string(all.size() - 1);
  return nullptr;
}

/// The camera that a name or a number means; the first one without either.
const GltfCamera& camera_of(const GltfSet& set, const std::optional<Value>& wanted) {
  if (!wanted) return set.cameras.front();
  std::string names;
  if (const auto* camera = named_by(*wanted, set.cameras, names)) return *camera;
  wanted->fail("one of " + names);
}

}  // namespace

void place_light(const glm::dmat4& world_from_light, const Similarity& world_from_file,
                 Light& light) {
  light.direction = world_from_file.turn * -glm::dvec3(world_from_light[2]);
  const double length = glm::length(light.direction);
  light.direction = length > 0 ? light.direction / length : glm::dvec3(0, 0, 1);
  if (light.type != LightType::directional)
    light.position_m = world_from_file(glm::dvec3(world_from_light[3]));
}

std::optional<GltfScene> read_gltf_scene(Section section, Scene& scene) {
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
    return {};
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
  object.rotation_deg = fixed_axis_angles_deg(placing.turn);
  object.position_m = placing.shift;
  object.cut_m = cut_m.value_or(std::clamp(camera.near * scale, 1e-6, 1e4));
  scene.objects.push_back(object);
  GltfScene found{file,
                  where,
                  placing,
                  scene.objects.size() - 1,
                  scene.lights.size(),
                  set.lights,
                  static_cast<std::int32_t>(&camera - set.cameras.data())};
  const auto channels = scene.channels();
  for (const auto& light : set.lights) {
    scene.lights.push_back(light_of(light, placing, channels));
    scene.lights.back().where = where;
  }
  for (const auto& note : set.notes) scene.notes.push_back(where + ": " + one_line(note));
  return found;
}

namespace {

/// The channels of the animations that a value names.
std::vector<GltfChannel> channels_of(const GltfMotion& motion, const Value& which) {
  const auto& all = motion.animations;
  if (all.empty()) which.fail("left out: the file has no animation");
  std::string names;
  if (const auto* animation = named_by(which, all, names)) return animation->channels;
  const auto choice = "one of its animations " + names;
  if (!which.node->is_boolean()) which.fail("true, " + choice);
  std::vector<GltfChannel> channels;
  std::set<std::tuple<std::int32_t, GltfChannel::Path, std::int32_t>> known;
  for (const auto& animation : all) {
    for (const auto& channel : animation.channels) {
      if (!known.emplace(channel.node, channel.path, channel.target).second)
        which.fail(choice + ", since two of them move the same node");
      channels.push_back(channel);
    }
  }
  return channels;
}

/// True for a channel that does more than say what the node is at rest, in floats.
bool changes(const GltfChannel& channel, const GltfMotion& motion) {
  const auto& node = motion.nodes[static_cast<std::size_t>(channel.node)];
  auto rest = channel.path == GltfChannel::Path::rotation ? node.rotation
              : channel.path == GltfChannel::Path::scale  ? glm::dvec4(node.scale, 0)
                                                          : glm::dvec4(node.translation, 0);
  if (channel.path == GltfChannel::Path::weights) {
    rest = glm::dvec4(0);
    for (const auto& wearer : motion.wearers)
      for (int k = 0; k < 4 && wearer.node == channel.node; ++k)
        if (const auto target = static_cast<std::size_t>(channel.target + k);
            target < wearer.weights.size())
          rest[k] = wearer.weights[target];
  }
  const double rounding = 0x1p-22 * glm::length(rest);
  const bool is_cubic = channel.steps == GltfChannel::Steps::cubic;
  for (std::size_t i = 0; i < channel.values.size(); ++i) {
    const bool is_slope = is_cubic && i % 3 != 1;
    if (glm::length(channel.values[i] - (is_slope ? glm::dvec4(0) : rest)) > rounding) return true;
  }
  return false;
}

/// By node: the nearest node with a channel from it upwards, itself included; -1: it stays.
std::vector<std::int32_t> movers_of(const GltfMoves& moves) {
  std::vector<std::int32_t> mover(moves.nodes.size(), -1);
  for (const auto& channel : moves.channels)
    if (channel.path != GltfChannel::Path::weights)
      mover[static_cast<std::size_t>(channel.node)] = channel.node;
  for (std::size_t i = 0; i < mover.size(); ++i)
    if (const auto parent = moves.nodes[i].parent; mover[i] < 0 && parent >= 0)
      mover[i] = mover[static_cast<std::size_t>(parent)];
  return mover;
}

/// By node: its mesh's weights of morph targets change, or a joint of its skin moves.
std::vector<bool> deforming_of(const std::vector<GltfWearer>& wearers,
                               const std::vector<GltfChannel>& channels,
                               const std::vector<std::int32_t>& mover) {
  std::set<std::int32_t> weighted;  // nodes
  for (const auto& channel : channels)
    if (channel.path == GltfChannel::Path::weights) weighted.insert(channel.node);
  std::vector<bool> deforms(mover.size(), false);
  for (const auto& wearer : wearers)
    deforms[static_cast<std::size_t>(wearer.node)] =
        (!wearer.weights.empty() && weighted.contains(wearer.node)) ||
        std::any_of(wearer.joints.begin(), wearer.joints.end(),
                    [&](auto joint) { return mover[static_cast<std::size_t>(joint)] >= 0; });
  return deforms;
}

}  // namespace

std::optional<GltfMoves> read_gltf_moves(const Value& which, const std::optional<GltfScene>& gltf,
                                         Scene& scene) {
  if (which.node->is_boolean() && !which.boolean()) return {};
  if (!gltf) which.fail("left out where [scene] names no glTF file");
  GltfMotion motion;
  read_mesh_file(gltf->file, gltf->where, {"motion"},
                 [&](ReaderPipe& pipe) { motion = receive_gltf_motion(pipe); });
  GltfMoves moves;
  moves.world_from_file = gltf->world_from_file;
  for (auto& channel : channels_of(motion, which))
    if (changes(channel, motion)) moves.channels.push_back(std::move(channel));
  moves.nodes = std::move(motion.nodes);

  const auto mover = movers_of(moves);
  const auto deforming = deforming_of(motion.wearers, moves.channels, mover);
  std::vector<bool> has_skin(moves.nodes.size(), false);
  for (const auto& wearer : motion.wearers)
    has_skin[static_cast<std::size_t>(wearer.node)] = !wearer.joints.empty();
  std::map<std::int32_t, std::vector<std::int32_t>> parts;  // numbers of nodes by their mover
  const auto name_of = [&](std::size_t node) {
    const auto& name = motion.names[node];
    return "node " +
           (name.empty() ? std::to_string(moves.nodes[node].number) : in_quotes(one_line(name)));
  };
  for (std::size_t i = 0; i < moves.nodes.size(); ++i) {
    const auto& node = moves.nodes[i];
    // A skin follows its joints alone
    if (node.has_mesh != 0 && !deforming[i])
      parts[has_skin[i] ? -1 : mover[i]].push_back(node.number);
    if (mover[i] < 0) continue;
    if (node.light >= 0 && static_cast<std::size_t>(node.light) < gltf->lights.size())
      moves.lights.push_back({gltf->first_light + static_cast<std::size_t>(node.light),
                              static_cast<std::int32_t>(i), name_of(i)});
    if (node.camera == gltf->camera)
      scene.notes.push_back(gltf->where + ": the hologram stays where its camera is at rest");
  }
  for (const auto& note : motion.notes) scene.notes.push_back(gltf->where + ": " + one_line(note));

  const auto whole = scene.objects[gltf->object];
  bool is_first = true;
  const auto add = [&](std::int32_t node, std::vector<std::int32_t> numbers, bool deforms) {
    auto part = whole;
    part.nodes = std::move(numbers);
    part.deforms = deforms;
    const auto index = is_first ? gltf->object : scene.objects.size();
    if (node >= 0) {
      const auto name = name_of(static_cast<std::size_t>(node));
      part.where += ": " + name;
      moves.objects.push_back({index, node, name, deforms});
    }
    if (is_first)
      scene.objects[index] = std::move(part);
    else
      scene.objects.push_back(std::move(part));
    is_first = false;
  };
  for (auto& part : parts) add(part.first, std::move(part.second), false);  // what stays first
  for (std::size_t i = 0; i < moves.nodes.size(); ++i)
    if (deforming[i]) add(static_cast<std::int32_t>(i), {moves.nodes[i].number}, true);
  if (moves.objects.empty() && moves.lights.empty())
    which.fail("left out: nothing that shows or shines moves");
  return moves;
}

}  // namespace raywave
