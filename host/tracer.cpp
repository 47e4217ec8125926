// SPDX-License-Identifier: Apache-2.0
#include "host/tracer.hpp"

#include <algorithm>
#include <chrono>
#include <glm/geometric.hpp>

#include "host/image.hpp"

namespace raywave {
namespace {

void put(float (&target)[3], glm::vec3 v) { std::copy_n(&v.x, 3, target); }
void put(float (&target)[2], glm::vec2 v) { std::copy_n(&v.x, 2, target); }

std::vector<device::TriangleShading> shading_in_leaf_order(const Scene& scene, const World& world, const Bvh& bvh) {
  std::vector<device::TriangleShading> shading(bvh.order.size());
  for (std::size_t i = 0; i < shading.size(); ++i) {
    const auto corners = world.triangles[bvh.order[i]];
    auto& s = shading[i];
    put(s.normal_a, world.normals[corners.x]);
    put(s.normal_b, world.normals[corners.y]);
    put(s.normal_c, world.normals[corners.z]);
    put(s.uv_a, world.uvs[corners.x]);
    put(s.uv_b, world.uvs[corners.y]);
    put(s.uv_c, world.uvs[corners.z]);
    s.material = scene.objects[static_cast<std::size_t>(world.triangle_object[bvh.order[i]])].material;
  }
  return shading;
}

std::pair<std::vector<device::Material>, std::vector<float>> materials_and_texels(const Scene& scene) {
  const int channel = channel_of(scene.hologram.wavelength_m);
  std::vector<device::Material> materials;
  std::vector<float> texels;
  for (const auto& m : scene.materials) {
    device::Material material{};
    material.ambient = static_cast<float>(m.ambient[channel]);
    material.diffuse = static_cast<float>(m.diffuse[channel]);
    material.specular = static_cast<float>(m.specular[channel]);
    material.shininess = static_cast<float>(m.shininess);
    material.reflectivity = static_cast<float>(m.reflectivity);
    material.transparency = static_cast<float>(m.transparency);
    material.ior = static_cast<float>(m.ior);
    material.texture = -1;
    if (m.texture) {
      const auto image = load_texture(*m.texture, channel, scene.file.string() + ": material \"" + m.name + "\"");
      material.texture = static_cast<std::int32_t>(texels.size());
      material.texture_width = image.width;
      material.texture_height = image.height;
      texels.insert(texels.end(), image.pixels.begin(), image.pixels.end());
    }
    materials.push_back(material);
  }
  return {std::move(materials), std::move(texels)};
}

std::vector<device::Light> lights_in_scene_frame(const Scene& scene, glm::dvec3 origin_m) {
  std::vector<device::Light> lights;
  for (const auto& l : scene.lights) {
    if (l.type == LightType::ambient) continue;
    const bool is_point = l.type == LightType::point;
    const glm::vec3 v(is_point ? l.position_m - origin_m : -glm::normalize(l.direction));
    lights.push_back({v.x, v.y, v.z, static_cast<float>(l.intensity), is_point});
  }
  return lights;
}

/// value as the sum of two floats
std::pair<float, float> split(double value) {
  const auto high = static_cast<float>(value);
  return {high, static_cast<float>(value - high)};
}

}  // namespace

int lanes_for(const cl::DeviceInfo& device) {
  for (const int lanes : {16, 8, 4}) {
    if (device.float_lanes >= lanes) return lanes;
  }
  return 1;
}

DeviceScene::DeviceScene(const cl::Device& device, const Scene& scene, const World& world, glm::dvec3 origin_m) {
  const auto start = std::chrono::steady_clock::now();
  const auto bvh = build_bvh(world.positions, world.triangles, origin_m);
  tree_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  nodes = {device, std::span<const device::BvhNode>(bvh.nodes), "tree"};
  triangles = {device, std::span<const device::Triangle>(bvh.triangles), "triangles"};
  const auto shading_data = shading_in_leaf_order(scene, world, bvh);
  shading = {device, std::span<const device::TriangleShading>(shading_data), "normals"};
  const auto [material_data, texel_data] = materials_and_texels(scene);
  materials = {device, std::span<const device::Material>(material_data), "materials"};
  texels = {device, std::span<const float>(texel_data), "textures"};
  const auto light_data = lights_in_scene_frame(scene, origin_m);
  lights = {device, std::span<const device::Light>(light_data), "lights"};

  double ambient = 0;
  bool has_ambient = false;
  for (const auto& l : scene.lights) {
    if (l.type != LightType::ambient) continue;
    ambient += l.intensity;
    has_ambient = true;
  }
  if (has_ambient) ambient_light = static_cast<float>(ambient);
  diameter_m = static_cast<float>(glm::length(world.max_m - world.min_m));

  const auto any = [&](auto&& test) { return std::any_of(material_data.begin(), material_data.end(), test); };
  const bool bounces = any([](const auto& m) { return m.reflectivity > 0 || m.transparency > 0; });
  options = {{"RAYWAVE_LANES", std::to_string(lanes_for(device.info()))},
             {"RAYWAVE_BVH_DEPTH", std::to_string(bvh.depth)},
             {"RAYWAVE_LIGHTS", std::to_string(light_data.size())},
             {"RAYWAVE_SPECULAR", any([](const auto& m) { return m.specular > 0; }) ? "1" : "0"},
             {"RAYWAVE_TEXTURES", texel_data.empty() ? "0" : "1"},
             {"RAYWAVE_SHADOWS", scene.trace.shadows ? "1" : "0"},
             {"RAYWAVE_BOUNCES", bounces ? std::to_string(scene.trace.depth) : "0"}};
}

Tracer::Tracer(const cl::Device& device, const Scene& scene, const World& world, const Plan& plan)
    : device_(device),
      plan_(plan),
      sampling_pitch_m_(scene.sampling.pitch_m),
      scene_(device, scene, world, plan.origin_m),
      lanes_(lanes_for(device.info())),
      program_(device, "trace.cl", scene_.options),
      trace_fan_(program_.kernel("trace_fan")) {}

void Tracer::trace(const Wrp& wrp, std::uint32_t seed, cl::ComplexBuffer& field) {
  std::vector<device::FanRay> rays;
  for (const auto& t : wrp.fan) {
    const double length = std::sqrt(1 + t.x * t.x + t.y * t.y);
    const auto [hi, lo] = split(length / plan_.wavelength_m);
    rays.push_back({static_cast<float>(t.x), static_cast<float>(t.y), static_cast<float>(length), hi, lo});
  }
  const cl::Buffer<device::FanRay> fan(device_, std::span<const device::FanRay>(rays), "fan");

  const glm::dvec3 centre = wrp.centre_m - plan_.origin_m;
  device::TracePlane plane{};
  plane.nx = plan_.size.x;
  plane.ny = plan_.size.y;
  plane.left = static_cast<float>(centre.x - (plan_.size.x - 1) / 2.0 * plan_.pitch_m.x);
  plane.top = static_cast<float>(centre.y + (plan_.size.y - 1) / 2.0 * plan_.pitch_m.y);
  plane.z = static_cast<float>(centre.z);
  plane.pitch_x = static_cast<float>(plan_.pitch_m.x);
  plane.pitch_y = static_cast<float>(plan_.pitch_m.y);
  std::tie(plane.turns_hi, plane.turns_lo) = split(1 / plan_.wavelength_m);
  plane.sampling_rate = static_cast<float>(1 / sampling_pitch_m_);
  plane.bias = scene_.diameter_m * 0x1p-16f;
  plane.reach = 4 * (scene_.diameter_m + static_cast<float>(plan_.far_m - plan_.distance_m) + static_cast<float>(glm::length(centre)));
  plane.seed = seed * 0x9e3779b9u;

  const auto packets = static_cast<std::size_t>((plan_.size.x + lanes_ - 1) / lanes_);
  const cl::Range local = lanes_ == 1 ? cl::Range{8, 8} : cl::Range{1, 1};
  trace_fan_.run({packets, static_cast<std::size_t>(plan_.size.y)}, local, scene_.nodes, scene_.triangles, scene_.shading, scene_.materials,
                 scene_.lights, scene_.texels, scene_.ambient_light, fan, static_cast<std::int32_t>(rays.size()), plane, field);
}

}  // namespace raywave
