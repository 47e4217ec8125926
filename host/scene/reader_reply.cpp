// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader_reply.hpp"

#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>
#include <type_traits>
#include <utility>

#include "host/scene/light.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {
namespace {

void require(bool sound) {
  if (!sound) throw std::runtime_error("its reader returned nonsense");
}

void require_all(const auto& values, const auto& is_sound) {
  require(std::all_of(values.begin(), values.end(), is_sound));
}

bool is_normal(const glm::dvec3& n) {
  return n == glm::dvec3(0) || std::abs(glm::length(n) - 1) < 1e-6;
}

/// Reads a vector of so many values.
template <class T>
void receive_exactly(ReaderPipe& pipe, std::vector<T>& values, std::uint64_t count) {
  pipe.read_vector(values, count);
  require(values.size() == count);
}

/// The same of one that may be empty.
template <class T>
void receive_all_or_none(ReaderPipe& pipe, std::vector<T>& values, std::uint64_t count) {
  pipe.read_vector(values, count);
  require(values.empty() || values.size() == count);
}

/// Text as bytes. Whoever shows it makes one line of it.
void send_text(ReaderPipe& pipe, const std::string& text) {
  pipe.write_vector(std::vector<char>(text.begin(), text.end()));
}

std::string receive_text(ReaderPipe& pipe) {
  std::vector<char> bytes;
  pipe.read_vector(bytes, longest_text);
  return {bytes.begin(), bytes.end()};
}

std::uint64_t receive_count(ReaderPipe& pipe, std::uint64_t most) {
  std::uint64_t count = 0;
  pipe.read_value(count);
  require(count <= most);
  return count;
}

void send_count(ReaderPipe& pipe, std::uint64_t count) { pipe.write_value(count); }

void send_texts(ReaderPipe& pipe, const std::vector<std::string>& texts) {
  send_count(pipe, texts.size());
  for (const auto& text : texts) send_text(pipe, text);
}

std::vector<std::string> receive_texts(ReaderPipe& pipe) {
  std::vector<std::string> texts;
  for (auto left = receive_count(pipe, most_notes_of_file); left > 0; --left)
    texts.push_back(receive_text(pipe));
  return texts;
}

// They travel byte by byte, and have no bytes without a meaning.
static_assert(std::is_trivially_copyable_v<MeshLook> &&
              sizeof(MeshLook) == 20 * sizeof(double) + 4 * sizeof(std::int32_t) +
                                      5 * (6 * sizeof(double) + 4 * sizeof(std::int32_t)));

/// Numbers of a scene file are no larger.
constexpr double largest_number = 1e30;

bool is_within(double value, double low, double high) { return value >= low && value <= high; }

bool is_number(double value) { return is_within(value, -largest_number, largest_number); }

/// Of a vector, or a column of a matrix.
bool are_numbers(const auto& v) {
  for (int i = 0; i < v.length(); ++i)
    if (!is_number(v[i])) return false;
  return true;
}

bool is_colour(const glm::dvec3& c) { return are_numbers(c) && std::min({c.x, c.y, c.z}) >= 0; }

/// An enumeration may hold any number after it has come through a pipe.
template <class Enum>
bool is_one_of(Enum value, Enum last) {
  const auto number = static_cast<std::int32_t>(value);
  return number >= 0 && number <= static_cast<std::int32_t>(last);
}

bool is_map(const MeshMap& map, std::size_t pictures) {
  const auto is_row = [](const std::array<double, 3>& row) {
    return std::all_of(row.begin(), row.end(), is_number);
  };
  return map.picture >= -1 && map.picture < static_cast<std::int64_t>(pictures) &&
         is_one_of(map.place.wrap_u, Wrap::clamp) && is_one_of(map.place.wrap_v, Wrap::clamp) &&
         is_row(map.place.across) && is_row(map.place.up);
}

bool is_look(const MeshLook& look, std::size_t pictures) {
  for (const auto* map :
       {&look.base_map, &look.metallic_map, &look.emission_map, &look.normal_map, &look.alpha_map})
    if (!is_map(*map, pictures)) return false;
  return is_colour(look.base) && is_colour(look.specular) && is_colour(look.ambient) &&
         is_colour(look.emission) && is_within(look.alpha, 0, 1) &&
         is_within(look.shininess, 0, largest_number) && is_within(look.metallic, 0, 1) &&
         is_within(look.roughness, 0, 1) && is_within(look.alpha_cutoff, 0, largest_number) &&
         is_within(look.transmission, 0, 1) && is_within(look.ior, 1, 100) &&
         is_number(look.normal_scale) && is_one_of(look.model, LookModel::unlit) &&
         is_one_of(look.alpha_mode, AlphaMode::blend) && look.vertex_colours >= 0 &&
         look.vertex_colours <= 1 && look.two_sided >= 0 && look.two_sided <= 1;
}

bool is_pose(const glm::dmat4& m) {
  return are_numbers(m[0]) && are_numbers(m[1]) && are_numbers(m[2]) && are_numbers(m[3]);
}

static_assert(std::is_trivially_copyable_v<GltfNode> &&
              sizeof(GltfNode) == 6 * sizeof(std::int32_t) + 26 * sizeof(double));

bool is_turn(const glm::dvec4& quaternion) { return std::abs(glm::length(quaternion) - 1) < 1e-9; }

bool is_node(const GltfNode& node) {
  return node.number >= 0 && node.parent >= -1 && node.light >= -1 && node.camera >= -1 &&
         are_numbers(node.translation) && are_numbers(node.scale) && is_turn(node.rotation) &&
         is_pose(node.matrix);
}

/// keys  received before, in all; those of the channel are added
GltfChannel receive_channel(ReaderPipe& pipe, std::size_t nodes, std::size_t& keys) {
  using Path = GltfChannel::Path;
  using Steps = GltfChannel::Steps;
  std::vector<std::int32_t> head;
  receive_exactly(pipe, head, 4);
  require(head[0] >= 0 && head[0] < static_cast<std::int64_t>(nodes) && head[3] >= 0);
  GltfChannel channel{head[0], static_cast<Path>(head[1]), static_cast<Steps>(head[2]), {}, {},
                      head[3]};
  require(is_one_of(channel.path, Path::weights) && is_one_of(channel.steps, Steps::cubic));
  pipe.read_vector(channel.times_s, most_keys_of_file - keys);
  const auto count = channel.times_s.size(),
             each = std::size_t{channel.steps == Steps::cubic ? 3u : 1u};
  keys += count;
  require(count >= 1);
  receive_exactly(pipe, channel.values, each * count);
  for (std::size_t i = 0; i < count; ++i)
    require(is_within(channel.times_s[i], i == 0 ? 0 : channel.times_s[i - 1], largest_number) &&
            (i == 0 || channel.times_s[i] > channel.times_s[i - 1]));
  require_all(channel.values, [](const glm::dvec4& v) { return are_numbers(v); });
  if (channel.path == Path::rotation)
    for (std::size_t i = each / 2; i < channel.values.size(); i += each)
      require(is_turn(channel.values[i]));
  return channel;
}

void send_wearer(ReaderPipe& pipe, const GltfWearer& wearer) {
  pipe.write_vector(std::vector{wearer.node});
  pipe.write_vector(wearer.joints);
  pipe.write_vector(wearer.weights);
}

void require_nodes(const std::vector<std::int32_t>& numbers, std::size_t nodes) {
  require_all(numbers, [&](std::int32_t number) {
    return number >= 0 && static_cast<std::size_t>(number) < nodes;
  });
}

GltfWearer receive_wearer(ReaderPipe& pipe, std::size_t nodes) {
  GltfWearer wearer;
  std::vector<std::int32_t> node;
  receive_exactly(pipe, node, 1);
  pipe.read_vector(wearer.joints, most_joints_of_skin);
  pipe.read_vector(wearer.weights, most_targets_of_mesh);
  require_nodes(node, nodes);
  require_nodes(wearer.joints, nodes);
  require_all(wearer.weights, is_number);
  wearer.node = node[0];
  return wearer;
}

void send_part(ReaderPipe& pipe, const DeformingPart& part) {
  pipe.write_vector(std::vector<std::uint32_t>{static_cast<std::uint32_t>(part.node),
                                               part.first_vertex, part.influences});
  pipe.write_vector(part.joints);
  pipe.write_vector(part.joint_from_mesh);
  pipe.write_vector(part.positions);
  pipe.write_vector(part.normals);
  pipe.write_vector(part.joint_of);
  pipe.write_vector(part.weight_of);
  pipe.write_vector(part.weights);
  pipe.write_vector(part.target_positions);
  pipe.write_vector(part.target_normals);
}

/// vertices  of the mesh, at most
/// left      vertices that may come yet, of all targets
DeformingPart receive_part(ReaderPipe& pipe, std::size_t vertices, std::size_t& left) {
  DeformingPart part;
  std::vector<std::uint32_t> head;
  receive_exactly(pipe, head, 3);
  require(head[0] <= INT32_MAX && head[1] <= vertices && head[2] <= most_influences);
  part.node = static_cast<std::int32_t>(head[0]);
  part.first_vertex = head[1];
  part.influences = head[2];
  pipe.read_vector(part.joints, most_joints_of_skin);
  require(!part.joints.empty());
  require_nodes(part.joints, std::size_t{1} << 31);
  receive_exactly(pipe, part.joint_from_mesh, part.joints.size());
  require_all(part.joint_from_mesh, is_pose);
  pipe.read_vector(part.positions, std::min(vertices - part.first_vertex, left));
  const auto count = part.positions.size();
  left -= count;
  receive_exactly(pipe, part.normals, count);
  receive_exactly(pipe, part.joint_of, count * part.influences);
  require_all(part.joint_of, [&](std::uint16_t joint) { return joint < part.joints.size(); });
  receive_exactly(pipe, part.weight_of, count * part.influences);
  require_all(part.weight_of, [](float weight) { return is_within(weight, 0, largest_number); });
  pipe.read_vector(part.weights, most_targets_of_mesh);
  require_all(part.weights, is_number);
  const auto of_targets = count * part.weights.size();
  require(of_targets <= left);
  left -= of_targets;
  receive_exactly(pipe, part.target_positions, of_targets);
  receive_all_or_none(pipe, part.target_normals, of_targets);
  for (const auto* vectors :
       {&part.positions, &part.normals, &part.target_positions, &part.target_normals})
    require_all(*vectors, is_finite<3, float>);
  return part;
}

void send_material(ReaderPipe& pipe, const MeshMaterial& material) {
  send_text(pipe, material.name);
  pipe.write_value(material.look);
  send_texts(pipe, material.notes);
}

MeshMaterial receive_material(ReaderPipe& pipe, std::size_t pictures) {
  MeshMaterial material;
  material.name = receive_text(pipe);
  pipe.read_value(material.look);
  require(is_look(material.look, pictures));
  material.notes = receive_texts(pipe);
  return material;
}

}  // namespace

void ReaderPipe::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(descriptor_, bytes.data(), bytes.size());
    if (done < 0 && errno != EINTR) throw std::runtime_error("the pipe is closed");
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(done, 0)));
  }
}

void ReaderPipe::read(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::read(descriptor_, bytes.data(), bytes.size());
    if (done == 0 || (done < 0 && errno != EINTR)) throw std::runtime_error("the pipe is closed");
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(done, 0)));
  }
}

void send(ReaderPipe& pipe, const Mesh& mesh) {
  pipe.write_vector(mesh.positions);
  pipe.write_vector(mesh.normals);
  pipe.write_vector(mesh.uvs);
  pipe.write_vector(mesh.triangles);
  pipe.write_vector(mesh.colours);
  pipe.write_vector(mesh.triangle_material);
  send_count(pipe, mesh.pictures.size());
  for (const auto& picture : mesh.pictures) {
    send_text(pipe, picture.name);
    pipe.write_vector(picture.bytes);
  }
  send_count(pipe, mesh.materials.size());
  for (const auto& material : mesh.materials) send_material(pipe, material);
  send_texts(pipe, mesh.notes);
  pipe.write_vector(mesh.triangle_node);
  send_count(pipe, mesh.deforming.size());
  for (const auto& part : mesh.deforming) send_part(pipe, part);
}

void send(ReaderPipe& pipe, const GltfSet& set) {
  send_count(pipe, set.cameras.size());
  for (const auto& camera : set.cameras) {
    send_text(pipe, camera.name);
    pipe.write_value(camera.world_from_camera);
    pipe.write_value(camera.near);
  }
  pipe.write_vector(set.lights);
  send_texts(pipe, set.notes);
}

void send(ReaderPipe& pipe, const GltfMotion& motion) {
  pipe.write_vector(motion.nodes);
  for (const auto& name : motion.names) send_text(pipe, name);
  send_count(pipe, motion.animations.size());
  for (const auto& animation : motion.animations) {
    send_text(pipe, animation.name);
    send_count(pipe, animation.channels.size());
    for (const auto& channel : animation.channels) {
      pipe.write_vector(
          std::vector<std::int32_t>{channel.node, static_cast<std::int32_t>(channel.path),
                                    static_cast<std::int32_t>(channel.steps), channel.target});
      pipe.write_vector(channel.times_s);
      pipe.write_vector(channel.values);
    }
  }
  send_texts(pipe, motion.notes);
  send_count(pipe, motion.wearers.size());
  for (const auto& wearer : motion.wearers) send_wearer(pipe, wearer);
}

void send(ReaderPipe& pipe, const Image& image) {
  pipe.write_vector(std::vector<int>{image.width, image.height});
  pipe.write_vector(image.pixels);
}

void send(ReaderPipe& pipe, const std::vector<Image>& channels) {
  send_count(pipe, channels.size());
  for (const auto& channel : channels) send(pipe, channel);
}

Mesh receive_mesh(ReaderPipe& pipe) {
  Mesh mesh;
  pipe.read_vector(mesh.positions, most_vertices_of_file);
  const std::size_t count = mesh.positions.size();
  receive_exactly(pipe, mesh.normals, count);
  receive_exactly(pipe, mesh.uvs, count);
  pipe.read_vector(mesh.triangles, most_triangles_of_file);
  require_all(mesh.positions, is_position);
  require_all(mesh.normals, is_normal);
  require_all(mesh.uvs, is_finite<2, double>);
  require_all(mesh.triangles,
              [&](const glm::uvec3& t) { return t.x < count && t.y < count && t.z < count; });

  // What the file says of colours
  receive_all_or_none(pipe, mesh.colours, count);
  require_all(mesh.colours,
              [](const glm::vec4& c) { return is_colour(glm::dvec3(c)) && is_within(c.w, 0, 1); });
  receive_all_or_none(pipe, mesh.triangle_material, mesh.triangles.size());
  std::uint64_t bytes = 0;
  for (auto left = receive_count(pipe, most_pictures_of_file); left > 0; --left) {
    MeshPicture picture;
    picture.name = receive_text(pipe);
    pipe.read_vector(picture.bytes, most_picture_bytes - bytes);
    bytes += picture.bytes.size();
    mesh.pictures.push_back(std::move(picture));
  }
  for (auto left = receive_count(pipe, most_materials_of_file); left > 0; --left)
    mesh.materials.push_back(receive_material(pipe, mesh.pictures.size()));
  const auto materials = static_cast<std::int64_t>(mesh.materials.size());
  require_all(mesh.triangle_material, [&](std::int32_t m) { return m >= -1 && m < materials; });
  mesh.notes = receive_texts(pipe);
  receive_all_or_none(pipe, mesh.triangle_node, mesh.triangles.size());
  auto left_to_deform = most_deforming_of_file;
  for (auto left = receive_count(pipe, most_nodes_of_file); left > 0; --left)
    mesh.deforming.push_back(receive_part(pipe, count, left_to_deform));
  return mesh;
}

GltfSet receive_gltf_set(ReaderPipe& pipe) {
  GltfSet set;
  for (auto left = receive_count(pipe, most_cameras_of_file); left > 0; --left) {
    GltfCamera camera;
    camera.name = receive_text(pipe);
    pipe.read_value(camera.world_from_camera);
    pipe.read_value(camera.near);
    require(is_pose(camera.world_from_camera) && is_within(camera.near, 0, largest_number));
    set.cameras.push_back(std::move(camera));
  }
  pipe.read_vector(set.lights, most_lights_of_file);
  for (const auto& light : set.lights)
    require(is_one_of(light.type, GltfLight::Type::spot) && is_pose(light.world_from_light) &&
            is_colour(light.colour) && is_within(light.intensity, 0, largest_number) &&
            is_within(light.inner_deg, 0, light.outer_deg) &&
            is_within(light.outer_deg, least_spot_deg, 90));
  set.notes = receive_texts(pipe);
  return set;
}

GltfMotion receive_gltf_motion(ReaderPipe& pipe) {
  GltfMotion motion;
  pipe.read_vector(motion.nodes, most_nodes_of_file);
  std::int32_t before = 0;
  for (const auto& node : motion.nodes) {
    require(is_node(node) && node.parent < before++);
    motion.names.push_back(receive_text(pipe));
  }
  std::size_t keys = 0, moves = 0;
  for (auto left = receive_count(pipe, most_animations_of_file); left > 0; --left) {
    auto& animation = motion.animations.emplace_back();
    animation.name = receive_text(pipe);
    for (auto more = receive_count(pipe, most_moves_of_file - moves); more > 0; --more, ++moves) {
      animation.channels.push_back(receive_channel(pipe, motion.nodes.size(), keys));
    }
  }
  motion.notes = receive_texts(pipe);
  for (auto left = receive_count(pipe, motion.nodes.size()); left > 0; --left)
    motion.wearers.push_back(receive_wearer(pipe, motion.nodes.size()));
  return motion;
}

Image receive_image(ReaderPipe& pipe) {
  std::vector<int> size;
  receive_exactly(pipe, size, 2);
  require(std::min(size[0], size[1]) >= 1 && std::max(size[0], size[1]) <= largest_picture_side);
  Image image{size[0], size[1], {}};
  receive_exactly(pipe, image.pixels, std::uint64_t{1} * size[0] * size[1]);
  require_all(image.pixels, [](float v) { return std::isfinite(v); });
  return image;
}

std::vector<Image> receive_channels(ReaderPipe& pipe) {
  std::vector<Image> channels;
  for (auto left = receive_count(pipe, most_channels_of_reply); left > 0; --left) {
    channels.push_back(receive_image(pipe));
    require(channels.back().width == channels.front().width &&
            channels.back().height == channels.front().height);
  }
  return channels;
}

}  // namespace raywave
