// SPDX-License-Identifier: Apache-2.0
#include "host/reference/looks.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "host/reference/rays.hpp"

namespace raywave::reference {
namespace {

/// The texel that place i of n is, beyond the edges too.
int wrapped(int i, int n, Wrap wrap) {
  switch (wrap) {
    case Wrap::clamp:
      return std::clamp(i, 0, n - 1);
    case Wrap::mirror: {
      const int twice = ((i % (2 * n)) + 2 * n) % (2 * n);
      return twice < n ? twice : 2 * n - 1 - twice;
    }
    case Wrap::repeat:
      break;
  }
  return ((i % n) + n) % n;
}

/// The pictures of a material.
MaterialMaps maps_of(const Scene& scene, const World& world, std::size_t triangle) {
  if (const auto own = world.material_of(triangle); own >= 0)
    return world.maps[static_cast<std::size_t>(own)];
  MaterialMaps maps;
  const auto object = static_cast<std::size_t>(world.triangle_object[triangle]);
  const auto material = static_cast<std::size_t>(scene.objects[object].material);
  if (scene.materials[material].texture) maps.colour.image = world.textures[material];
  return maps;
}

const Material& material_of(const Scene& scene, const World& world, std::size_t triangle) {
  if (const auto own = world.material_of(triangle); own >= 0)
    return world.materials[static_cast<std::size_t>(own)];
  const auto object = static_cast<std::size_t>(world.triangle_object[triangle]);
  return scene.materials[static_cast<std::size_t>(scene.objects[object].material)];
}

double shininess_of_roughness(double roughness) {
  return std::min(1e4, 0.5 / std::max(std::pow(roughness, 4), 1e-300) - 0.5);
}

}  // namespace

glm::dvec3 seen_colour(const Scene& scene, glm::dvec3 colour) {
  return scene.colour ? colour : glm::dvec3(colour[channel_of(scene.hologram.wavelength_m)]);
}

double shown_radiance(const Scene& scene, glm::dvec3 radiance) {
  return scene.colour ? scene.colour->light_of(radiance) : radiance.x;
}

double map_at(const SurfaceMap& map, glm::dvec2 uv, int channel) {
  if (!map) return 1;
  const auto& image = *map.image;
  const auto texels = image.channel(channel);
  const auto row = [&](const std::array<double, 3>& r) { return r[0] * uv.x + r[1] * uv.y + r[2]; };
  const double x = row(map.place.across) * image.width - 0.5,
               y = (1 - row(map.place.up)) * image.height - 0.5;
  double sum = 0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const int column = static_cast<int>(std::floor(x)) + dx,
                line = static_cast<int>(std::floor(y)) + dy;
      const double share = (1 - std::abs(x - column)) * (1 - std::abs(y - line));
      const auto texel =
          static_cast<std::size_t>(wrapped(line, image.height, map.place.wrap_v)) * image.width +
          static_cast<std::size_t>(wrapped(column, image.width, map.place.wrap_u));
      sum += share * static_cast<double>(texels[texel]);
    }
  }
  return sum;
}

Look look_at(const Scene& scene, const World& world, std::size_t triangle, double v, double w) {
  const auto& m = material_of(scene, world, triangle);
  const auto maps = maps_of(scene, world, triangle);
  const auto seen = [&](glm::dvec3 whole) { return seen_colour(scene, whole); };
  const auto t = world.triangles[triangle];
  const double weights[] = {1 - v - w, v, w};
  glm::dvec2 uv(0);
  glm::dvec4 colour(0);
  glm::dvec3 smooth(0);
  for (int i = 0; i < 3; ++i) {
    uv += weights[i] * glm::dvec2(world.uvs[t[i]]);
    smooth += weights[i] * glm::dvec3(world.normals[t[i]]);
    colour +=
        weights[i] * (world.colours.empty() ? glm::dvec4(1) : glm::dvec4(world.colours[t[i]]));
  }
  if (!m.vertex_colours) colour = glm::dvec4(1);
  const auto texel = [&](const SurfaceMap& map) {
    return glm::dvec3(map_at(map, uv, 0), map_at(map, uv, 1), map_at(map, uv, 2));
  };
  const auto tint = texel(maps.colour) * glm::dvec3(colour);

  // Phong's numbers
  Look look;
  look.ambient = seen(m.ambient) * tint;
  look.diffuse = seen(m.diffuse) * tint;
  look.specular = seen(m.specular);
  look.shininess = m.shininess;
  look.emission = seen(m.emission) * texel(maps.emission) * (m.unlit ? tint : glm::dvec3(1));
  const double wavelength_m = scene.hologram.wavelength_m;
  look.reflectivity = m.reflectivity.at(wavelength_m);
  look.transparency = m.transparency.at(wavelength_m);
  look.ior = m.ior.at(wavelength_m);
  look.attenuation_per_m = -std::log(m.attenuation.at(wavelength_m)) / m.attenuation_distance_m;
  look.alpha_mode = m.alpha_mode;
  look.alpha_cutoff = m.alpha_cutoff;
  look.alpha = m.alpha * map_at(maps.alpha, uv) * map_at(maps.opacity, uv) * colour.a;
  if (const auto& metal = m.metallic_roughness) {
    const auto base = seen(metal->base) * tint;
    const double metallic = metal->metallic * map_at(maps.metallic, uv),
                 roughness = metal->roughness * map_at(maps.roughness, uv);
    look.ambient = metal->ambient_share * base;
    look.diffuse = base * (1 - metallic);
    look.shininess = shininess_of_roughness(roughness);
    const auto reflectance = metal->reflectance * (1 - metallic) + base * metallic;
    if (look.shininess < 1) {
      look.diffuse += reflectance;
      look.specular = glm::dvec3(0);
    } else {
      look.specular = reflectance * (look.shininess + 2) / 2.0;
    }
  }

  // Normals
  const auto turn = world.motion_of(world.triangle_object[triangle]).turn;
  look.smooth = look.normal = glm::normalize(turn * smooth);
  if (!maps.normal[0]) return look;
  const auto p = world.corners_m(triangle);
  const glm::dvec2 a(world.uvs[t.x]), b = glm::dvec2(world.uvs[t.y]) - a,
                                      c = glm::dvec2(world.uvs[t.z]) - a;
  const double area = b.x * c.y - b.y * c.x;
  if (area == 0) return look;
  const auto along_u = ((p[1] - p[0]) * c.y - (p[2] - p[0]) * b.y) / area,
             along_v = ((p[2] - p[0]) * b.x - (p[1] - p[0]) * c.x) / area;
  const auto tangent = glm::normalize(along_u - look.smooth * glm::dot(look.smooth, along_u));
  auto bitangent = glm::cross(look.smooth, tangent);
  if (glm::dot(bitangent, along_v) < 0) bitangent = -bitangent;
  glm::dvec3 n;
  for (int i = 0; i < 3; ++i) n[i] = 2 * map_at(maps.normal[static_cast<std::size_t>(i)], uv) - 1;
  look.normal = glm::normalize(m.normal_scale * (n.x * tangent + n.y * bitangent) +
                               std::max(n.z, 1e-3) * look.smooth);
  return look;
}

double mirrored_by_clear(double ratio, double cosine) {
  const double in = std::acos(std::min(cosine, 1.0));
  if (ratio * std::sin(in) >= 1) return 1;
  // Fresnel's coefficients from the angles on both sides
  const double cos_in = std::cos(in), cos_out = std::cos(std::asin(ratio * std::sin(in)));
  const double s_wave = (ratio * cos_in - cos_out) / (ratio * cos_in + cos_out),
               p_wave = (ratio * cos_out - cos_in) / (ratio * cos_out + cos_in);
  return (s_wave * s_wave + p_wave * p_wave) / 2;
}

bool is_there(const Look& look, glm::dvec3 place_m, const Plan& plan, bool* doubt) {
  if (look.alpha_mode == AlphaMode::opaque) return true;
  double least = look.alpha_cutoff;
  if (look.alpha_mode == AlphaMode::blend) {
    const glm::dvec3 offset(0.37, 0.43, 0.31);
    std::int32_t cell[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double at = place_m[axis] * blend_cells_of_pitch / plan.samples.pitch_m + offset[axis];
      cell[axis] = static_cast<std::int32_t>(std::floor(at));
      if (doubt && std::abs(at - std::round(at)) < 0.02 + 1e-6 * std::abs(at)) *doubt = true;
    }
    least = phase_turns(cell[0], cell[1], cell[2], plan.hologram.seed);
  }
  if (doubt && std::abs(look.alpha - least) < 1e-5) *doubt = true;
  return look.alpha >= least && (look.alpha > 0 || look.alpha_mode != AlphaMode::blend);
}

double ambient_light_of(const Scene& scene) {
  double sum = 0;
  bool any = false;
  for (const auto& light : scene.lights) {
    if (light.type != LightType::ambient) continue;
    sum += light.intensity;
    any = true;
  }
  return any ? sum : 1;
}

SeenLight seen_light(const PlacedLight& light, glm::dvec3 place_m, int which) {
  const auto& at = light.places[light.places.size() > 1 ? static_cast<std::size_t>(which) : 0];
  SeenLight seen;
  seen.highlights = light.highlights;
  seen.intensity = light.intensity;
  seen.colour = light.colour;
  if (!light.is_point) {
    seen.direction = at;
    return seen;
  }
  const auto way = at - place_m;
  seen.distance_m = glm::length(way);
  seen.direction = way / *seen.distance_m;
  if (light.is_spot()) {
    const double cosine = glm::dot(-seen.direction, light.axis);
    seen.intensity *= std::pow(
        std::clamp((cosine - light.outer_cosine) / (light.inner_cosine - light.outer_cosine), 0.0,
                   1.0),
        2);
  }
  if (light.falls_off) seen.intensity /= std::max(*seen.distance_m * *seen.distance_m, 1e-12);
  return seen;
}

std::vector<PlacedLight> lights_of(const Scene& scene, const World& world) {
  return placed_lights(scene.lights, environments_of(world.textures, lighting_of(scene, world)));
}

glm::dvec3 light_from(const std::vector<PlacedLight>& lights, const Look& look, glm::dvec3 place_m,
                      std::optional<glm::dvec3> to_viewer, int which,
                      const std::function<bool(std::size_t, const SeenLight&)>& reaches) {
  glm::dvec3 sum(0);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const auto seen = seen_light(lights[i], place_m, which);
    const double facing = glm::dot(look.normal, seen.direction);
    if (facing <= 0 || glm::dot(look.smooth, seen.direction) <= 0 || !(seen.intensity > 0) ||
        !reaches(i, seen))
      continue;
    auto part = look.diffuse * facing;
    if (to_viewer && seen.highlights)
      part += look.specular *
              power_of_cosine(glm::dot(2 * facing * look.normal - seen.direction, *to_viewer),
                              look.shininess);
    sum += seen.intensity * seen.colour * part;
  }
  return sum;
}

}  // namespace raywave::reference
