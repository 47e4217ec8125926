// SPDX-License-Identifier: Apache-2.0
#include "host/trace/device_scene.hpp"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <map>
#include <stdexcept>
#include <utility>

#include "host/common/error.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"
#include "host/trace/work_shape.hpp"

namespace raywave {
namespace {

/// Highlights with a larger exponent need directions in more than single precision: the relative
/// error of a float direction, 3e-7, grows by sqrt(shininess / 2) in the highlight.
constexpr double sharp_shininess = 128;

// Numbers of the Plan that kernels know by these names
static_assert(TEXTURES_NONE == 0 && TEXTURES_PLAIN == 1 && TEXTURES_LOOKS == 2);
static_assert(ALPHA_MASK == static_cast<int>(AlphaMode::mask) &&
              ALPHA_BLEND == static_cast<int>(AlphaMode::blend));
static_assert(WRAP_MIRROR == static_cast<int>(Wrap::mirror) &&
              WRAP_CLAMP == static_cast<int>(Wrap::clamp));

std::span<const float> floats_of(const auto& vectors) {
  return {reinterpret_cast<const float*>(vectors.data()),
          vectors.size() * sizeof(vectors[0]) / sizeof(float)};
}

/// A power of four near the largest brightness; 1 when the brightness fits floats well (2^-40 to
/// 2^40). Division by it is exact.
double unit_of(double brightest) {
  if (brightest == 0 || (brightest >= 0x1p-40 && brightest <= 0x1p40)) return 1;
  return std::ldexp(1.0, 2 * static_cast<int>(std::floor(std::log2(brightest) / 2)));
}

float in_units(double value, double unit) { return static_cast<float>(value / unit); }

struct Materials {
  std::vector<device::Material> materials;  // their emission in units of `unit`
  std::vector<float> texels;
  double unit = 1;                // unit of ambient, diffuse and specular
  double brightest_emission = 0;  // in that unit
};

/// Pictures on their way to the device; each is there once.
class Texels {
public:
  explicit Texels(std::vector<float>& all) : all_(all) {}

  /// Number of an image's first texel.
  std::int32_t first_of(const Image& image) {
    const auto [known, is_new] = known_.try_emplace(&image, 0);
    if (is_new) {
      if (all_.size() + image.pixels.size() > INT32_MAX)
        throw InputError(
            "the scene's textures hold more than 2147483647 texels; give smaller ones");
      known->second = static_cast<std::int32_t>(all_.size());
      all_.insert(all_.end(), image.pixels.begin(), image.pixels.end());
    }
    return known->second;
  }

  device::TextureMap map_of(const SurfaceMap& from) {
    device::TextureMap map{};
    map.first = -1;
    if (!from) return map;
    map.first = first_of(*from.image);
    map.width = from.image->width;
    map.height = from.image->height;
    const auto& place = from.place;
    map.wrap = static_cast<int>(place.wrap_u) + 4 * static_cast<int>(place.wrap_v);
    for (std::size_t i = 0; i < 3; ++i) {
      map.across[i] = static_cast<float>(place.across[i]);
      map.up[i] = static_cast<float>(place.up[i]);
    }
    return map;
  }

private:
  std::vector<float>& all_;
  std::map<const Image*, std::int32_t> known_;
};

double brightest_of(const SurfaceMap& map) {
  return map ? *std::max_element(map.image->pixels.begin(), map.image->pixels.end()) : 1;
}

/// Colours and alpha of the vertices, as kernels/scene/arrays.h has them.
std::vector<float> vertex_colours_of(const World& world, Channels channels) {
  std::vector<float> floats;
  for (const auto& c : world.colours) {
    for (int k = 0; k < channels.count(); ++k) floats.push_back(c[k]);
    floats.push_back(c.a);
  }
  return floats;
}

/// The pictures of a material of the plan.
MaterialMaps maps_of(const Plan& plan, const World& world, std::size_t number) {
  const auto of_scene = static_cast<std::size_t>(plan.lighting.first_of_meshes);
  if (number >= of_scene) return world.maps.at(number - of_scene);
  MaterialMaps maps;
  if (texture_of(plan.lighting.materials, world.textures, number))
    maps.colour.image = world.textures[number];
  return maps;
}

/// Sets what mirrors and glass do to light of the plan's wavelength.
void set_spectra(const Material& from, double wavelength_m, device::Material& to) {
  to.reflectivity = static_cast<float>(from.reflectivity.at(wavelength_m));
  to.transparency = static_cast<float>(from.transparency.at(wavelength_m));
  std::tie(to.ior, to.ior_low) = split(from.ior.at(wavelength_m));
  to.attenuation = static_cast<float>(-std::log(from.attenuation.at(wavelength_m)) /
                                      from.attenuation_distance_m);
}

Materials materials_of(const Plan& plan, const World& world) {
  const auto channels = plan.channels();
  Materials result;
  auto& [materials, all_texels, unit, brightest_emission] = result;
  Texels texels(all_texels);
  double brightest = 0;
  for (std::size_t i = 0; i < plan.lighting.materials.size(); ++i) {
    const auto& m = plan.lighting.materials[i];
    const auto maps = maps_of(plan, world, i);
    device::Material material{};
    const auto put = [&](const glm::dvec3& from, float* to) {
      for (int k = 0; k < channels.count(); ++k) to[k] = static_cast<float>(from[channels[k]]);
    };
    put(m.ambient, material.ambient);
    put(m.diffuse, material.diffuse);
    put(m.specular, material.specular);
    material.shininess = static_cast<float>(m.shininess);
    set_spectra(m, plan.hologram.wavelength_m, material);
    material.colour = texels.map_of(maps.colour);
    material.kind = (m.vertex_colours ? MATERIAL_VERTEX_COLOURS : 0) |
                    (m.metallic_roughness ? MATERIAL_METALLIC : 0) | (m.unlit ? MATERIAL_UNLIT : 0);
    put(m.emission, material.emission);
    material.emission_map = texels.map_of(maps.emission);
    if (const auto& metal = m.metallic_roughness) {
      put(metal->base, material.base);
      material.metallic = static_cast<float>(metal->metallic);
      material.roughness = static_cast<float>(metal->roughness);
      material.reflectance = static_cast<float>(metal->reflectance);
      material.ambient_share = static_cast<float>(metal->ambient_share);
    }
    material.roughness_map = texels.map_of(maps.roughness);
    if (maps.metallic) material.metallic_texels = texels.first_of(*maps.metallic.image);
    material.normal_scale = static_cast<float>(m.normal_scale);
    material.normal_map = texels.map_of(maps.normal[0]);
    if (maps.normal[0]) {
      material.normal_up_texels = texels.first_of(*maps.normal[1].image);
      material.normal_out_texels = texels.first_of(*maps.normal[2].image);
    }
    material.alpha_mode = static_cast<int>(m.alpha_mode);
    material.alpha = static_cast<float>(m.alpha);
    material.alpha_cutoff = static_cast<float>(m.alpha_cutoff);
    material.alpha_texels = maps.alpha ? texels.first_of(*maps.alpha.image) : -1;
    material.opacity_map = texels.map_of(maps.opacity);
    material.blend_rate = static_cast<float>(blend_cells_of_pitch / plan.samples.pitch_m);
    material.blend_seed = plan.hologram.seed;
    const double tint = brightest_of(maps.colour);
    for (int k = 0; k < channels.count(); ++k) {
      const int channel = channels[k];
      brightest = std::max({brightest, std::max(m.ambient[channel], m.diffuse[channel]) * tint,
                            m.specular[channel]});
      brightest_emission = std::max(brightest_emission, m.emission[channel] * (m.unlit ? tint : 1) *
                                                            brightest_of(maps.emission));
    }
    materials.push_back(material);
  }
  unit = unit_of(brightest);
  brightest_emission /= unit;
  for (auto& m : materials) {
    m.reflectance = in_units(m.reflectance, unit);
    for (float* shares : {m.ambient, m.diffuse, m.specular, m.emission, m.base}) {
      for (int k = 0; k < channels.count(); ++k) shares[k] = in_units(shares[k], unit);
    }
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

/// RAYWAVE_LIGHT_PLACES of kernels/scene/options.h.
std::size_t light_places_of(const std::vector<PlacedLight>& placed) {
  return std::any_of(placed.begin(), placed.end(),
                     [](const PlacedLight& light) { return light.places.size() > 1; })
             ? places_of_light
             : 1;
}

std::vector<device::Light> lights_in_scene_frame(const std::vector<PlacedLight>& placed,
                                                 const Plan& plan, double unit) {
  std::vector<device::Light> lights;
  const std::size_t places = light_places_of(placed);
  for (const auto& l : placed) {
    device::Light light{};
    light.intensity = in_units(l.intensity, unit);
    for (int k = 0; k < 3; ++k) light.colour[k] = static_cast<float>(l.colour[k]);
    light.of_laser =
        static_cast<float>(plan.hologram.colour ? plan.hologram.colour->light_of(l.colour) : 1);
    light.is_point = l.is_point;
    light.falls_off = l.falls_off;
    put(l.axis, light.axis_x, light.axis_y, light.axis_z);
    const double rate = l.is_spot() ? 1 / (l.inner_cosine - l.outer_cosine) : 0;
    light.edge_rate = static_cast<float>(rate);
    light.edge_offset = static_cast<float>(l.is_spot() ? -l.outer_cosine * rate : 1);
    for (std::size_t i = 0; i < places; ++i) {
      const auto& at = l.places[std::min(i, l.places.size() - 1)];
      const auto v = l.is_point ? at - plan.extent.origin_m : at;
      std::tie(light.x, light.x_low) = split(v.x);
      std::tie(light.y, light.y_low) = split(v.y);
      std::tie(light.z, light.z_low) = split(v.z);
      lights.push_back(light);
    }
  }
  return lights;
}

}  // namespace

int lanes_for(const cl::DeviceInfo& device) { return work_shape(device).lanes; }

cl::Options kernel_options(const Plan& plan) {
  const auto any = [&](const auto& test) { return plan.lighting.any_material(test); };
  const auto channels = plan.channels();
  const auto& all = plan.lighting.lights;
  const bool specular = any([&](const Material& m) { return has_highlights(m, channels); });
  const int lights = directions_of(all, [](const Light&) { return true; }),
            highlights =
                specular ? directions_of(all, [](const Light&l) { return l.highlights; }) : 0;
  const auto any_light = [&](const auto& test) {
    return std::any_of(all.begin(), all.end(), test);
  };
  return {{option::colours, std::to_string(channels.count())},
          {option::lights, std::to_string(lights)},
          {option::highlights, std::to_string(highlights)},
          {option::light_places, std::to_string(any_light(has_size) ? places_of_light : 1)},
          {option::spots, std::to_string(any_light([](const Light& l) {
             return l.type == LightType::spot || (l.type != LightType::ambient && l.falls_off);
           }))},
          {option::sharp, std::to_string(any([&](const Material& m) {
             return has_highlights(m, channels) && sharpest_shininess(m) > sharp_shininess;
           }))},
          {option::textures, std::to_string(plan.lighting.textures)},
          {option::normal_maps, plan.lighting.normal_maps ? "1" : "0"},
          {option::alpha, std::to_string(static_cast<int>(plan.lighting.alpha))},
          {option::shadows, std::to_string(!plan.lighting.shadows || lights == 0 ? 0
                                           : any_light(has_size) ? plan.lighting.shadow_rays
                                                                 : SHADOWS_ALL)},
          {option::diffuse_rays, std::to_string(plan.lighting.diffuse_rays)},
          {option::gloss_rays, std::to_string(plan.lighting.gloss_rays)},
          {option::bounces, std::to_string(plan.specular.bounces)}};
}

cl::Options kernel_options(const Plan& plan, const cl::DeviceInfo& device) {
  return cl::with(kernel_options(plan), {{option::lanes, std::to_string(lanes_for(device))}});
}

DeviceScene::DeviceScene(const cl::Device& device, const World& world, const Plan& plan,
                         bool for_samples)
    : device_(device), instances_(device, world, plan.extent.origin_m, tree, for_samples) {
  auto made = materials_of(plan, world);
  material_unit_ = made.unit;
  materials_ = std::move(made.materials);
  brightest_emission_ = made.brightest_emission;
  texels = {device, std::span<const float>(made.texels), "textures"};
  normals = {device, floats_of(world.normals), "normals"};
  uvs = {device, floats_of(world.uvs), "places on textures"};
  colours = {device, std::span<const float>(vertex_colours_of(world, plan.channels())),
             "colours of vertices"};
  options = kernel_options(plan, device.info());
  place(world, plan);
}

void DeviceScene::place(const World& world, const Plan& plan) {
  const auto start = std::chrono::steady_clock::now();
  for (const auto object : instances_.place(world, plan, tree)) {
    const auto& placed = world.placed[object];
    normals.write(floats_of(placed.own(world.normals)), 3 * placed.first_vertex);
  }
  tree_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (instances_.depth() > RAYWAVE_BVH_DEPTH)
    throw std::logic_error("a tree is deeper than kernels can follow");
  show_spectra(plan);
  upload_lights(world, plan);
}

void DeviceScene::upload_lights(const World& world, const Plan& plan) {
  if (!placed_ || lights_ != plan.lighting.lights) {
    lights_ = plan.lighting.lights;
    placed_ = placed_lights(lights_, environments_of(world.textures, plan.lighting));
  }
  upload_radiances(plan);
  diameter_m = static_cast<float>(glm::length(world.max_m - world.min_m));
  bias_m = static_cast<float>(ray_bias_m(world, plan));
}

void DeviceScene::show(const Plan& plan) {
  tree_seconds = 0;
  show_spectra(plan);
  upload_radiances(plan);
}

/// Materials for the plan's laser
void DeviceScene::show_spectra(const Plan& plan) {
  for (std::size_t i = 0; i < materials_.size(); ++i)
    set_spectra(plan.lighting.materials[i], plan.hologram.wavelength_m, materials_[i]);
}

/// Lights and materials, in units that keep floats in range.
void DeviceScene::upload_radiances(const Plan& plan) {
  double brightest_light = ambient_light_of(plan.lighting);
  for (const auto& l : *placed_) brightest_light = std::max(brightest_light, l.intensity);
  const double light_unit = unit_of(std::max(brightest_light, brightest_emission_));
  const auto light_data = lights_in_scene_frame(*placed_, plan, light_unit);
  cl::put(device_, lights, light_data, "lights");
  light.ambient = in_units(ambient_light_of(plan.lighting), light_unit);
  const auto laser = plan.hologram.colour
                         ? plan.hologram.colour->lasers.from_rgb[plan.hologram.colour->laser]
                         : glm::dvec3(1, 0, 0);
  for (int k = 0; k < 3; ++k) light.laser[k] = static_cast<float>(laser[k]);
  radiance_unit = material_unit_ * light_unit;
  // Emission needs no light, and is in units of both
  auto in_light_units = materials_;
  for (auto& m : in_light_units) {
    for (float& emission : m.emission) emission = in_units(emission, light_unit);
  }
  cl::put(device_, materials, in_light_units, "materials");
}

}  // namespace raywave
