// SPDX-License-Identifier: Apache-2.0
#include "host/reference/looks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

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

// Sideways error of a hit in single precision, as a fraction of the distance (kernels/scene/bvh.h)
constexpr double sideways = 1e-6;
constexpr double cell_margin = 2e-5;  // margin of a phase cell
// Shortest path off the last surface, as a fraction of the scene's size: the device may leave out
// a shorter one
constexpr double shortest_path = 0x1.2p-16;
// Margin on the cosine at which a light sets, or refraction becomes total
constexpr double cosine_margin = 1e-5;

/// A surface where a ray meets it; the normal faces the side the ray came from.
struct Surface {
  glm::dvec3 point{0}, normal{0};
  bool entering = true;  // met from outside
  Look look;             // with normals to that side
  int triangle = -1;
};

class Tracing {
public:
  Tracing(const Scene& scene, const World& world, const Plan& plan, std::uint32_t seed)
      : scene_(scene),
        world_(world),
        plan_(plan),
        seed_(seed),
        lights_(lights_of(scene, world)),
        size_m_(distance(world.min_m, world.max_m)) {
    for (std::size_t i = 0; i < world.triangles.size(); ++i) {
      const auto corners = world.corners_m(i);
      Corners triangle{};
      float* const to[] = {triangle.a, triangle.b, triangle.c};
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const auto p = corners[corner] - plan.extent.origin_m;
        for (int axis = 0; axis < 3; ++axis) to[corner][axis] = static_cast<float>(p[axis]);
      }
      triangles_.push_back(triangle);
    }
    ambient_light_ = ambient_light_of(scene);
  }

  /// Length of a path: the phase counts each segment times the refractive index there, the
  /// spreading each segment divided by it.
  struct Length {
    double optical_m = 0, spread_m = 0;
  };

  /// The media that a ray goes through.
  struct Medium {
    double index = 1, attenuation_per_m = 0;
  };

  /// The wave that arrives along a ray after a path of `length`, which leaves triangle `from` at
  /// the cosine `slope` to its normal.
  std::complex<double> gathered(glm::dvec3 origin, glm::dvec3 direction, double weight,
                                Length length, Medium medium, int bounces_left, int from = -1,
                                double slope = 1) {
    const auto hit = nearest(origin, direction, 1, from);
    if (hit.triangle < 0) return 0;
    ++result.hits;
    if (from >= 0 && hit.t < shortest_path * size_m_ / std::max(slope, 1.0 / 64)) undecided = true;
    const auto surface = surface_at(origin, direction, hit);
    const double metal = surface.look.reflectivity, clear = surface.look.transparency;
    length.optical_m += hit.t * medium.index;
    length.spread_m += hit.t / medium.index;
    weight *= std::exp(-hit.t * medium.attenuation_per_m);
    const double radiance = weight * (1 - metal - clear) * phong(surface, -direction);
    auto sum =
        std::copysign(std::sqrt(std::max(radiance, 0.0)), length.spread_m) /
        std::max(std::abs(length.spread_m),
                 std::min(plan_.hologram.pitch_m.x, plan_.hologram.pitch_m.y) / 4) *
        std::polar(1.0, 2 * std::numbers::pi *
                            (std::remainder(length.optical_m / plan_.hologram.wavelength_m, 1) +
                             cell_phase(surface.point)));
    if (bounces_left == 0 || (metal == 0 && clear == 0)) return sum;

    const Medium glass{surface.look.ior, surface.look.attenuation_per_m};
    const auto beyond = surface.entering ? glass : Medium{};
    const double along = -dot(direction, surface.normal);
    const double ratio = surface.entering ? 1 / glass.index : glass.index;
    const double k = 1 - ratio * ratio * (1 - along * along);
    if (clear > 0 && std::abs(k) < cosine_margin) undecided = true;
    double mirrored = metal;
    // A path that carries less than a thousandth of the light ends
    const auto continues = [&](double share) {
      if (std::abs(weight * share - 1e-3) < 1e-6) undecided = true;
      return weight * share >= 1e-3;
    };
    if (clear > 0 && k <= 0) {
      mirrored += clear;
      ++result.totally_reflected;
    } else if (clear > 0) {
      const double reflected = mirrored_by_clear(ratio, std::abs(along));
      mirrored += clear * reflected;
      if (continues(clear * (1 - reflected))) {
        ++result.refracted;
        const auto refracted = ratio * direction + (ratio * along - std::sqrt(k)) * surface.normal;
        sum += gathered(surface.point, refracted, weight * clear * (1 - reflected), length, beyond,
                        bounces_left - 1, hit.triangle, std::sqrt(k));
      }
    }
    if (mirrored > 0 && continues(mirrored)) {
      ++result.mirrored;
      sum += gathered(surface.point, reflect(direction, surface.normal), weight * mirrored, length,
                      medium, bounces_left - 1, hit.triangle, along);
    }
    return sum;
  }

  TracedField result;
  int light_place = 0;     // of lights that have a size, for the next rays
  bool undecided = false;  // set by what rays met since it was cleared

private:
  /// A ray that leaves triangle `from` does not meet it again.
  Hit nearest(glm::dvec3 origin, glm::dvec3 direction, double t_max, int from) {
    const Ray ray{origin, direction, 0, t_max};
    const auto may_meet = [&](std::size_t i) { return static_cast<int>(i) != from; };
    const auto is_sure = [&](const Corners& triangle) {
      return intersect_narrow(triangle, ray).triangle >= 0;
    };
    return nearest_there(scene_, world_, plan_, triangles_, ray, sideways, may_meet, is_sure,
                         undecided);
  }

  /// The hit, unless it lies so near to an edge that single precision may miss it.
  static Hit intersect_narrow(const Corners& triangle, const Ray& ray) {
    const auto hit = intersect(triangle, ray);
    if (hit.triangle < 0) return hit;
    const auto corner = [](const float* p) { return glm::dvec3(p[0], p[1], p[2]); };
    const auto a = corner(triangle.a), b = corner(triangle.b), c = corner(triangle.c);
    const double area = length(cross(b - a, c - a)), move = 3 * hit.t * sideways;
    const double cosine =
        std::abs(dot(cross(b - a, c - a), ray.direction)) / (area * length(ray.direction));
    const auto from_edge = [&](double weight, double edge) {
      return weight * area / edge * cosine;
    };
    const double least =
        std::min({from_edge(1 - hit.u - hit.v, distance(b, c)), from_edge(hit.u, distance(c, a)),
                  from_edge(hit.v, distance(a, b))});
    return least > move ? hit : Hit{};
  }

  Surface surface_at(glm::dvec3 origin, glm::dvec3 direction, const Hit& hit) const {
    const auto triangle = static_cast<std::size_t>(hit.triangle);
    const auto corners = world_.triangles[triangle];
    const double weights[] = {1 - hit.u - hit.v, hit.u, hit.v};
    glm::dvec3 normal(0);
    for (int i = 0; i < 3; ++i) normal += weights[i] * glm::dvec3(world_.normals[corners[i]]);
    normal = world_.motion_of(world_.triangle_object[triangle]).turn * normal;
    const auto p = world_.corners_m(triangle);
    auto face = cross(p[1] - p[0], p[2] - p[0]);
    if (dot(face, normal) < 0) face = -face;
    Surface surface;
    surface.entering = dot(face, direction) <= 0;
    surface.point = origin + hit.t * direction;
    surface.normal = normalize(surface.entering ? normal : -normal);
    surface.triangle = hit.triangle;
    surface.look = look_at(scene_, world_, triangle, hit.u, hit.v);
    if (!surface.entering) {
      surface.look.smooth = -surface.look.smooth;
      surface.look.normal = -surface.look.normal;
    }
    return surface;
  }

  /// Undecided when it depends on how far off the surface the path to the light begins.
  bool in_shadow(const Surface& surface, glm::dvec3 direction, double distance_m) {
    const auto meets = [&](glm::dvec3 from) {
      return nearest(from, direction, distance_m, surface.triangle).triangle >= 0;
    };
    const bool shadowed = meets(surface.point);
    if (meets(surface.point + shortest_path * size_m_ * surface.normal) != shadowed)
      undecided = true;
    return shadowed;
  }

  double phong(const Surface& surface, glm::dvec3 to_viewer) {
    const auto& look = surface.look;
    for (const auto& light : lights_) {
      const auto seen = seen_light(light, surface.point + plan_.extent.origin_m, light_place);
      if (std::abs(glm::dot(look.normal, seen.direction)) < cosine_margin &&
          look.specular != glm::dvec3(0))
        undecided = true;
    }
    const auto reaches = [&](std::size_t, const SeenLight& light) {
      if (!scene_.trace.shadows ||
          !in_shadow(surface, light.direction, light.distance_m.value_or(1)))
        return true;
      ++result.shadowed;
      return false;
    };
    return shown_radiance(
        scene_, look.ambient * ambient_light_ + look.emission +
                    light_from(lights_, look, surface.point + plan_.extent.origin_m, to_viewer,
                               light_place, reaches));
  }

  double cell_phase(glm::dvec3 point) {
    std::int32_t cell[3];
    for (int axis = 0; axis < 3; ++axis) {
      // Flat scenes lie within one cell, since the origin is their middle.
      const double place = point[axis] / scene_.sampling.pitch_m + (axis == 2 ? 0.31 : 0);
      cell[axis] = static_cast<std::int32_t>(std::floor(place));
      if (std::abs(place - std::round(place)) < cell_margin) undecided = true;
    }
    return phase_turns(cell[0], cell[1], cell[2], seed_);
  }

  const Scene& scene_;
  const World& world_;
  const Plan& plan_;
  std::uint32_t seed_;
  std::vector<PlacedLight> lights_;
  double size_m_;  // size of the scene
  double ambient_light_ = 1;
  std::vector<Corners> triangles_;
};

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

TracedField trace_fan(const Scene& scene, const World& world, const Plan& plan, const Wrp& wrp,
                      std::uint32_t seed) {
  Tracing tracing(scene, world, plan, seed);
  for (int row = 0; row < plan.hologram.size.y; ++row) {
    for (int column = 0; column < plan.hologram.size.x; ++column) {
      const glm::dvec2 off((column - (plan.hologram.size.x - 1) / 2.0) * plan.hologram.pitch_m.x,
                           ((plan.hologram.size.y - 1) / 2.0 - row) * plan.hologram.pitch_m.y);
      const auto pixel_m = wrp.centre_m + glm::dvec3(off, 0);  // world
      std::complex<double> sum = 0;
      tracing.undecided = false;
      for (const auto& tangent : wrp.fan) {
        const auto direction = normalize(glm::dvec3(tangent, 1));
        if (std::abs(direction.x) > plan.hologram.largest_sine.x ||
            std::abs(direction.y) > plan.hologram.largest_sine.y)
          continue;
        const auto ray = static_cast<int>(&tangent - wrp.fan.data());
        tracing.light_place = light_place_of(ray + column, ray / 4 + row);
        // Rays come from before the scene where it reaches to the eye's side of the plane
        const double start_m =
            plan.extent.near_m > 0
                ? 0
                : std::min(0.0, plan.extent.near_m - 1e-3 - wrp.centre_m.z) / direction.z;
        sum += tracing.gathered(pixel_m - plan.extent.origin_m + start_m * direction, direction, 1,
                                {start_m, start_m}, {}, plan.specular.bounces);
      }
      tracing.result.field.push_back(sum);
      tracing.result.undecided.push_back(tracing.undecided);
    }
  }
  return std::move(tracing.result);
}

}  // namespace raywave::reference
