// SPDX-License-Identifier: Apache-2.0
#include "host/animate/contents.hpp"

#include <array>
#include <concepts>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "host/common/digest.hpp"

namespace raywave {
namespace {

template <class T>
concept Number = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// Adds values to a digest. Structs are taken apart by name: one that gets another member does not
/// compile before its place here is decided.
class Contents {
public:
  std::string digest() const { return digest_.text(); }

  template <Number T>
  void add(T value) {
    add_bytes(&value, sizeof value);
  }
  template <glm::length_t size, Number T>
  void add(const glm::vec<size, T>& v) {
    for (glm::length_t i = 0; i < size; ++i) add(v[i]);
  }
  template <class A, class B>
  void add(const std::pair<A, B>& pair) {
    add(pair.first);
    add(pair.second);
  }
  template <class T>
  void add(const std::optional<T>& value) {
    add(value.has_value());
    if (value) add(*value);
  }
  template <class T, std::size_t size>
  void add(const std::array<T, size>& all) {
    for (const auto& one : all) add(one);
  }
  template <class T>
  void add(const std::vector<T>& all) {
    add(all.size());
    for (const auto& one : all) add(one);
  }

  void add(const Image& image) {
    add(image.width);
    add(image.height);
    add_bytes(image.pixels.data(), image.pixels.size() * sizeof(float));
  }
  /// Pictures that are shared are read once.
  void add(const std::shared_ptr<const Image>& image) {
    auto& known = images_[image.get()];
    if (known.empty()) {
      Contents one;
      if (image) one.add(*image);
      known = one.digest();
    }
    digest_.add(known);
  }

  void add(const Spectrum& spectrum) {
    const auto& [channels, table] = spectrum;
    add_all(channels, table);
  }
  void add(const MetallicRoughness& look) {
    const auto& [base, metallic, roughness, reflectance, ambient_share, sharpest] = look;
    add_all(base, metallic, roughness, reflectance, ambient_share, sharpest);
  }
  void add(const Material& material) {
    const auto& [name, ambient, diffuse, specular, shininess, texture, reflectivity, transparency,
                 ior, attenuation, attenuation_distance_m, emission, vertex_colours, unlit,
                 metallic_roughness, normal_scale, alpha_mode, alpha, alpha_cutoff, where] =
        material;
    add_all(ambient, diffuse, specular, shininess, reflectivity, transparency, ior, attenuation,
            attenuation_distance_m, emission, vertex_colours, unlit, metallic_roughness,
            normal_scale, alpha_mode, alpha, alpha_cutoff);
  }
  void add(const MapPlace& place) {
    const auto& [across, up, wrap_u, wrap_v] = place;
    add_all(across, up, wrap_u, wrap_v);
  }
  void add(const MaterialMaps& maps) {
    for (const auto* map : maps.all()) add_all(map->image, map->place);
  }
  void add(const Light& light) {
    const auto& [type, direction, position_m, intensity, colour, falls_off, inner_deg, outer_deg,
                 edges_m, radius_m, samples, highlights, picture, rotation_deg, where] = light;
    add_all(type, direction, position_m, intensity, colour, falls_off, inner_deg, outer_deg,
            edges_m, radius_m, samples, highlights, rotation_deg);
  }
  void add(const Object& object) {
    const auto& [mesh, width_m, position_m, rotation_deg, solid_scale, material, normals, where,
                 unit_m, anchor, cut_m, nodes, shapes, shape, deforms] = object;
    add_all(width_m, position_m, rotation_deg, solid_scale, material, normals, unit_m, anchor,
            cut_m);
    if (!nodes.empty()) add(nodes);
    if (shape) add(*shape);
  }
  void add(const glm::dmat4& m) {
    for (int i = 0; i < 4; ++i) add(m[i]);
  }
  void add(const GltfNode& node) {
    const auto& [number, parent, has_mesh, light, camera, has_matrix, translation, rotation, scale,
                 matrix] = node;
    add_all(number, parent, has_matrix, translation, rotation, scale, matrix);
  }
  void add(const GltfChannel& channel) {
    const auto& [node, path, steps, times_s, values, target] = channel;
    add_all(node, path, steps, times_s, values, target);
  }
  void add(const DeformingPart& part) {
    const auto& [node, first_vertex, joints, joint_from_mesh, positions, normals, influences,
                 joint_of, weight_of, weights, target_positions, target_normals] = part;
    add_all(node, joints, joint_from_mesh, positions, normals, influences, joint_of, weight_of,
            weights, target_positions, target_normals);
  }
  void add(const GltfMoves& moves) {
    const auto& [nodes, channels, world_from_file, objects, lights] = moves;
    add_all(nodes, channels);  // all else follows from them and the scene's text
  }
  void add(const FlatnessSpec& flatness) {
    const auto& [file, picture, in_nm, centre, where] = flatness;
    add_all(picture, in_nm, centre);
  }
  void add(const ZernikeTerm& term) {
    const auto& [noll, turns] = term;
    add_all(noll, turns);
  }
  void add(const StopSpec& stop) {
    const auto& [size, centre] = stop;
    add_all(size, centre);
  }
  void add(const Illumination& light) {
    const auto& [focus_m, sine] = light;
    add_all(focus_m, sine);
  }
  void add(const Lut& lut) {
    const auto& [levels, values] = lut;
    add_all(levels, values);
  }
  void add(const SlmSpec& slm) {
    const auto& [encoding, clip, band, bits, levels, levels_per_turn, invert, offset_turns, lut,
                 flatness, zernike, carrier, shift_m, shift_distance_m, lens_m, flip_x, flip_y,
                 rotate_deg, stop, rate_per_s, illumination, notes] = slm;
    (void)notes, (void)rate_per_s;  // say nothing of the light
    add_all(encoding, clip, band, bits, levels, levels_per_turn, invert, offset_turns, lut,
            flatness, zernike, carrier, shift_m, shift_distance_m, lens_m, flip_x, flip_y,
            rotate_deg, stop, illumination);
  }
  /// What its files gave: all else follows from it.
  void add(const World& world) {
    add_all(world.positions, world.normals, world.uvs, world.colours, world.triangles,
            world.triangle_object, world.triangle_material, world.materials, world.maps,
            world.textures);
    for (const auto& placed : world.placed) {
      if (!placed.deforming) continue;
      for (const auto& key : placed.deforming->keys) add_all(key.positions_m, key.normals);
      if (placed.deforming->mesh)
        for (const auto& part : placed.deforming->mesh->parts) add(part);
    }
  }

  template <class... T>
  void add_all(const T&... values) {
    (add(values), ...);
  }

private:
  void add_bytes(const void* bytes, std::size_t size) {
    digest_.add({static_cast<const char*>(bytes), size});
  }

  Digest digest_;
  std::map<const Image*, std::string> images_;
};

}  // namespace

std::string digest_of_contents(const Scene& scene, const World& world) {
  Contents contents;
  contents.add_all(scene.objects, scene.lights, scene.materials, scene.slm, world);
  if (scene.animation && scene.animation->gltf) contents.add(*scene.animation->gltf);
  return contents.digest();
}

}  // namespace raywave
