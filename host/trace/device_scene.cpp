// SPDX-License-Identifier: Apache-2.0
#include "host/trace/device_scene.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <tuple>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"
#include "host/trace/work_shape.hpp"

namespace raywave {
namespace {

/// Highlights with a larger exponent need directions in more than single precision: the relative
/// error of a float direction, 3e-7, grows by sqrt(shininess / 2) in the highlight.
constexpr double sharp_shininess = 128;

template <class Vector>
std::span<const float> floats_of(const std::vector<Vector>& vectors) {
  return {reinterpret_cast<const float*>(vectors.data()),
          vectors.size() * sizeof(Vector) / sizeof(float)};
}

/// A power of four near the largest brightness; 1 when the brightness fits floats well (2^-40 to
/// 2^40). Division by it is exact.
double unit_of(double brightest) {
  if (brightest == 0 || (brightest >= 0x1p-40 && brightest <= 0x1p40)) return 1;
  return std::ldexp(1.0, 2 * static_cast<int>(std::floor(std::log2(brightest) / 2)));
}

float in_units(double value, double unit) { return static_cast<float>(value / unit); }

struct Materials {
  std::vector<device::Material> materials;
  std::vector<float> texels;
  double unit = 1;  // unit of ambient, diffuse and specular
};

Materials materials_of(const Plan& plan, const Textures& textures) {
  const int channel = channel_of(plan.wavelength_m);
  Materials result;
  auto& [materials, texels, unit] = result;
  double brightest = 0;
  for (std::size_t i = 0; i < plan.lighting.materials.size(); ++i) {
    const auto& m = plan.lighting.materials[i];
    device::Material material{};
    material.ambient = static_cast<float>(m.ambient[channel]);
    material.diffuse = static_cast<float>(m.diffuse[channel]);
    material.specular = static_cast<float>(m.specular[channel]);
    material.shininess = static_cast<float>(m.shininess);
    material.reflectivity = static_cast<float>(m.reflectivity.at(plan.wavelength_m));
    material.transparency = static_cast<float>(m.transparency.at(plan.wavelength_m));
    std::tie(material.ior, material.ior_low) = split(m.ior.at(plan.wavelength_m));
    material.attenuation = static_cast<float>(-std::log(m.attenuation.at(plan.wavelength_m)) /
                                              m.attenuation_distance_m);
    material.texture = -1;
    double brightest_texel = 1;
    if (const Image* texture = texture_of(plan.lighting.materials, textures, i)) {
      material.texture = static_cast<std::int32_t>(texels.size());
      material.texture_width = texture->width;
      material.texture_height = texture->height;
      texels.insert(texels.end(), texture->pixels.begin(), texture->pixels.end());
      brightest_texel = *std::max_element(texture->pixels.begin(), texture->pixels.end());
    }
    brightest =
        std::max({brightest, std::max(m.ambient[channel], m.diffuse[channel]) * brightest_texel,
                  m.specular[channel]});
    materials.push_back(material);
  }
  unit = unit_of(brightest);
  for (auto& m : materials) {
    for (float* share : {&m.ambient, &m.diffuse, &m.specular}) *share = in_units(*share, unit);
  }
  return result;
}

/// Sum of the ambient lights; 1 when there is none, so that the ambient share of a material is
/// used unchanged.
double ambient_light_of(const Lighting& lighting) {
  double sum = 0;
  bool any = false;
  for (const auto& l : lighting.lights) {
    if (l.type != LightType::ambient) continue;
    sum += l.intensity;
    any = true;
  }
  return any ? sum : 1;
}

std::vector<device::Light> lights_in_scene_frame(const Plan& plan, double unit) {
  std::vector<device::Light> lights;
  for (const auto& l : plan.lighting.lights) {
    if (l.type == LightType::ambient) continue;
    const bool is_point = l.type == LightType::point;
    const auto v = is_point ? l.position_m - plan.origin_m : -glm::normalize(l.direction);
    device::Light light{};
    std::tie(light.x, light.x_low) = split(v.x);
    std::tie(light.y, light.y_low) = split(v.y);
    std::tie(light.z, light.z_low) = split(v.z);
    light.intensity = in_units(l.intensity, unit);
    light.is_point = is_point;
    lights.push_back(light);
  }
  return lights;
}

}  // namespace

int lanes_for(const cl::DeviceInfo& device) { return work_shape(device).lanes; }

cl::Options kernel_options(const Plan& plan) {
  const auto any = [&](const auto& test) { return plan.lighting.any_material(test); };
  const int channel = channel_of(plan.wavelength_m);
  const auto lights = std::count_if(plan.lighting.lights.begin(), plan.lighting.lights.end(),
                                    [](const Light& l) { return l.type != LightType::ambient; });
  return {
      {option::lights, std::to_string(lights)},
      {option::specular,
       any([&](const Material& m) { return m.specular[channel] > 0; }) ? "1" : "0"},
      {option::sharp, any([&](const Material& m) {
         return m.specular[channel] > 0 && m.shininess > sharp_shininess;
       })
                          ? "1"
                          : "0"},
      {option::textures, any([](const Material& m) { return m.texture.has_value(); }) ? "1" : "0"},
      {option::shadows, plan.lighting.shadows && lights > 0 ? "1" : "0"},
      {option::bounces, std::to_string(plan.bounces)}};
}

DeviceScene::DeviceScene(const cl::Device& device, const World& world, const Plan& plan)
    : device_(device), instances_(device, world, plan.origin_m, tree) {
  const auto made = materials_of(plan, world.textures);
  material_unit_ = made.unit;
  materials = {device, std::span<const device::Material>(made.materials), "materials"};
  texels = {device, std::span<const float>(made.texels), "textures"};
  normals = {device, floats_of(world.normals), "normals"};
  uvs = {device, floats_of(world.uvs), "places on textures"};
  options =
      cl::with(kernel_options(plan), {{option::lanes, std::to_string(lanes_for(device.info()))}});
  place(world, plan);
}

void DeviceScene::place(const World& world, const Plan& plan) {
  const auto start = std::chrono::steady_clock::now();
  instances_.place(world, plan, tree);
  tree_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  options =
      // The depth is rounded up to a multiple of 16, so that scenes of similar size share kernels.
      cl::with(options, {{option::bvh_depth, std::to_string((instances_.depth() + 15) / 16 * 16)}});
  upload_lights(world, plan);
}

void DeviceScene::upload_lights(const World& world, const Plan& plan) {
  double brightest_light = ambient_light_of(plan.lighting);
  for (const auto& l : plan.lighting.lights)
    brightest_light = std::max(brightest_light, l.intensity);
  const double light_unit = unit_of(brightest_light);
  const auto light_data = lights_in_scene_frame(plan, light_unit);
  cl::put(device_, lights, light_data, "lights");
  ambient_light = in_units(ambient_light_of(plan.lighting), light_unit);
  radiance_unit = material_unit_ * light_unit;
  diameter_m = static_cast<float>(glm::length(world.max_m - world.min_m));
  bias_m = static_cast<float>(ray_bias_m(world, plan));
}

}  // namespace raywave
