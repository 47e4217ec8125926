// SPDX-License-Identifier: Apache-2.0
#include "host/reference/shading.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "host/reference/rays.hpp"
#include "host/scene/image.hpp"

namespace raywave::reference {
namespace {

// Sideways error of a hit in single precision, as a fraction of the distance (kernels/scene/bvh.h)
constexpr double sideways = 1e-6;
constexpr double cell_margin = 2e-5;  // of a phase cell
// Shortest path off the last surface, as a fraction of the scene's size: the device may leave out
// a shorter one
constexpr double shortest_path = 0x1.2p-16;
// Margin on the cosine at which a light sets, or refraction becomes total
constexpr double cosine_margin = 1e-5;

/// A surface where a ray meets it; the normal faces the side the ray came from.
struct Surface {
  glm::dvec3 point{0}, normal{0};
  bool entering = true;  // met from outside
  const Material* material = nullptr;
  double texel = 1;
  int triangle = -1;
};

class Tracing {
public:
  Tracing(const Scene& scene, const World& world, const Plan& plan, std::uint32_t seed)
      : scene_(scene),
        world_(world),
        plan_(plan),
        seed_(seed),
        channel_(channel_of(scene.hologram.wavelength_m)),
        size_m_(distance(world.min_m, world.max_m)) {
    for (std::size_t i = 0; i < world.triangles.size(); ++i) {
      const auto corners = world.corners_m(i);
      Corners triangle{};
      float* const to[] = {triangle.a, triangle.b, triangle.c};
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const auto p = corners[corner] - plan.origin_m;
        for (int axis = 0; axis < 3; ++axis) to[corner][axis] = static_cast<float>(p[axis]);
      }
      triangles_.push_back(triangle);
    }
    bool has_ambient = false;
    double sum = 0;
    for (const auto& l : scene.lights) {
      if (l.type != LightType::ambient) continue;
      has_ambient = true;
      sum += l.intensity;
    }
    ambient_light_ = has_ambient ? sum : 1;
  }

  /// Length of a path: the phase counts each segment times the refractive index there, the
  /// spreading each segment divided by it.
  struct Length {
    double optical_m = 0, spread_m = 0;
  };

  /// What a ray goes through.
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
    const auto& m = *surface.material;
    const double metal = m.reflectivity.at(plan_.wavelength_m),
                 clear = m.transparency.at(plan_.wavelength_m);
    length.optical_m += hit.t * medium.index;
    length.spread_m += hit.t / medium.index;
    weight *= std::exp(-hit.t * medium.attenuation_per_m);
    const double radiance = weight * (1 - metal - clear) * phong(surface, -direction);
    auto sum = std::polar(
        std::sqrt(std::max(radiance, 0.0)) /
            std::max(length.spread_m, std::min(plan_.pitch_m.x, plan_.pitch_m.y) / 4),
        2 * std::numbers::pi *
            (std::remainder(length.optical_m / plan_.wavelength_m, 1) + cell_phase(surface.point)));
    if (bounces_left == 0 || (metal == 0 && clear == 0)) return sum;

    const Medium glass{m.ior.at(plan_.wavelength_m),
                       -std::log(m.attenuation.at(plan_.wavelength_m)) / m.attenuation_distance_m};
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
      // Fresnel's coefficients from the angles on both sides
      const double in = std::acos(std::min(std::abs(along), 1.0)),
                   out = std::asin(ratio * std::sin(in));
      const double cos_in = std::cos(in), cos_out = std::cos(out);
      const double s_wave = (ratio * cos_in - cos_out) / (ratio * cos_in + cos_out),
                   p_wave = (ratio * cos_out - cos_in) / (ratio * cos_out + cos_in);
      const double reflected = (s_wave * s_wave + p_wave * p_wave) / 2;
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
  bool undecided = false;  // set by what rays met since it was cleared

private:
  /// A ray that leaves triangle `from` does not meet it again.
  Hit nearest(glm::dvec3 origin, glm::dvec3 direction, double t_max, int from) {
    const Ray ray{origin, direction, 0, t_max};
    Hit best{.t = t_max};
    double doubtful = t_max;
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      if (static_cast<int>(i) == from) continue;
      const auto wide = intersect(triangles_[i], ray, sideways);
      if (wide.triangle < 0) continue;
      const auto exact = intersect(triangles_[i], ray),
                 narrow = intersect_narrow(triangles_[i], ray);
      if (narrow.triangle < 0) doubtful = std::min(doubtful, wide.t);
      if (exact.triangle < 0 || exact.t >= best.t) continue;
      best = exact;
      best.triangle = static_cast<int>(i);
    }
    if (doubtful <= best.t && doubtful < t_max) undecided = true;
    return best;
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
    glm::dvec2 uv(0);
    for (int i = 0; i < 3; ++i) {
      normal += weights[i] * glm::dvec3(world_.normals[corners[i]]);
      uv += weights[i] * glm::dvec2(world_.uvs[corners[i]]);
    }
    normal = world_.motion_of(world_.triangle_object[triangle]).turn * normal;
    const auto p = world_.corners_m(triangle);
    auto face = cross(p[1] - p[0], p[2] - p[0]);
    if (dot(face, normal) < 0) face = -face;
    Surface surface;
    surface.entering = dot(face, direction) <= 0;
    surface.point = origin + hit.t * direction;
    surface.normal = normalize(surface.entering ? normal : -normal);
    const auto object = static_cast<std::size_t>(world_.triangle_object[triangle]);
    const auto material = static_cast<std::size_t>(scene_.objects[object].material);
    surface.material = &scene_.materials[material];
    surface.triangle = hit.triangle;
    const auto* texture = texture_of(scene_.materials, world_.textures, material);
    surface.texel = texture ? texture_at(*texture, uv) : 1;
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
    const auto& m = *surface.material;
    double radiance = m.ambient[channel_] * surface.texel * ambient_light_;
    for (const auto& l : scene_.lights) {
      if (l.type == LightType::ambient) continue;
      const bool is_point = l.type == LightType::point;
      const auto to_light = is_point ? l.position_m - plan_.origin_m - surface.point : -l.direction;
      const auto direction = normalize(to_light);
      const double facing = dot(surface.normal, direction);
      if (std::abs(facing) < cosine_margin && m.specular[channel_] > 0) undecided = true;
      if (facing <= 0) continue;
      if (scene_.trace.shadows && in_shadow(surface, direction, is_point ? length(to_light) : 1)) {
        ++result.shadowed;
        continue;
      }
      const auto mirrored = 2 * facing * surface.normal - direction;
      radiance += l.intensity *
                  (m.diffuse[channel_] * surface.texel * facing +
                   m.specular[channel_] * power_of_cosine(dot(mirrored, to_viewer), m.shininess));
    }
    return radiance;
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
  int channel_;
  double size_m_;  // of the scene
  double ambient_light_ = 1;
  std::vector<Corners> triangles_;
};

}  // namespace

double texture_at(const Image& image, glm::dvec2 uv) {
  const double x = uv.x * image.width - 0.5, y = (1 - uv.y) * image.height - 0.5;
  const auto texel = [&](double column, double row) {
    const auto wrapped = [](double i, int n) {
      return static_cast<std::size_t>(i - n * std::floor(i / n));
    };
    return static_cast<double>(
        image.pixels[wrapped(row, image.height) * image.width + wrapped(column, image.width)]);
  };
  const double left = std::floor(x), top = std::floor(y);
  double sum = 0;
  for (const double column : {left, left + 1})
    for (const double row : {top, top + 1})
      sum += (1 - std::abs(x - column)) * (1 - std::abs(y - row)) * texel(column, row);
  return sum;
}

double power_of_cosine(double cosine, double exponent) {
  if (cosine <= 0) return exponent == 0 ? 1 : 0;
  return std::pow(std::min(cosine, 1.0), exponent);
}

double phase_turns(std::int32_t i, std::int32_t j, std::int32_t k, std::uint32_t seed) {
  const auto x = static_cast<std::uint32_t>(i), y = static_cast<std::uint32_t>(j),
             z = static_cast<std::uint32_t>(k);
  std::uint32_t h = x * 0x9e3779b1u ^ (y * 0x85ebca77u + 0x165667b1u);
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h ^= z * 0xc2b2ae3du;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  return phase_turns_of_key(h ^ (h >> 15), seed);
}

double phase_turns_of_key(std::uint32_t key, std::uint32_t seed) {
  std::uint32_t h = (key ^ (seed * 0x9e3779b9u)) * 0x846ca68bu;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h ^= h >> 15;
  return (h >> 8) * 0x1p-24;
}

TracedField trace_fan(const Scene& scene, const World& world, const Plan& plan, const Wrp& wrp,
                      std::uint32_t seed) {
  Tracing tracing(scene, world, plan, seed);
  for (int row = 0; row < plan.size.y; ++row) {
    for (int column = 0; column < plan.size.x; ++column) {
      const glm::dvec2 off((column - (plan.size.x - 1) / 2.0) * plan.pitch_m.x,
                           ((plan.size.y - 1) / 2.0 - row) * plan.pitch_m.y);
      const auto pixel_m = wrp.centre_m + glm::dvec3(off, 0);  // world
      std::complex<double> sum = 0;
      tracing.undecided = false;
      for (const auto& centre_tangent : wrp.fan) {
        const auto tangent = centre_tangent + wrp.convergence_per_m * glm::dvec2(pixel_m);
        const auto direction = normalize(glm::dvec3(tangent, 1));
        if (std::abs(direction.x) > plan.largest_sine.x ||
            std::abs(direction.y) > plan.largest_sine.y)
          continue;
        sum += tracing.gathered(pixel_m - plan.origin_m, direction, 1, {}, {}, plan.bounces);
      }
      tracing.result.field.push_back(sum);
      tracing.result.undecided.push_back(tracing.undecided);
    }
  }
  return std::move(tracing.result);
}

}  // namespace raywave::reference
