// SPDX-License-Identifier: Apache-2.0
#include "host/plan/front_view.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vector_relational.hpp>
#include <numeric>
#include <type_traits>

#include "host/plan/placed_lights.hpp"

namespace raywave {
namespace {

/// The lights' part of Phong's model and the ambient light, as kernels/scene/shade.h has them.
class Shading {
public:
  Shading(const Scene& scene, const World& world, const Plan& plan)
      : materials_(plan.lighting.materials),
        first_of_meshes_(static_cast<std::size_t>(plan.lighting.first_of_meshes)),
        world_(world),
        channel_(channel_of(scene.hologram.wavelength_m)) {
    double sum = 0;
    bool any = false;
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
      const auto& light = scene.lights[i];
      if (light.type == LightType::environment) {
        // Seen from afar it is ambient light of matt surfaces
        const auto environments = environments_of(world.textures, plan.lighting);
        surrounding_ += light.intensity * mean_radiance(*environments.at(i));
        directions_around_ += light.samples;
      } else if (light.type != LightType::ambient) {
        lights_.push_back(light);
      } else {
        sum += light.intensity;
        any = true;
      }
    }
    ambient_light_ = any ? sum : 1;

    // Of many lights the brightest stand for all
    if (lights_.size() <= most) return;
    const auto total = [&] {
      return std::accumulate(lights_.begin(), lights_.end(), 0.0,
                             [](double s, const Light& light) { return s + light.intensity; });
    };
    const double all = total();
    stand_for_ = static_cast<double>(lights_.size()) / most;
    std::partial_sort(lights_.begin(), lights_.begin() + most, lights_.end(),
                      [](const Light& a, const Light& b) { return a.intensity > b.intensity; });
    lights_.resize(most);
    const double brighter = total() > 0 ? all / total() : 1;
    for (auto& light : lights_) light.intensity *= brighter;
  }

  /// normal  towards the viewer, of unit length. Of what lies before the hologram, too, the viewer
  ///         sees the side that faces -z.
  double radiance(int material, glm::dvec3 place, glm::dvec3 normal, glm::dvec2 uv) const {
    const auto& m = materials_[static_cast<std::size_t>(material)];
    const double texel = texel_at(texture(static_cast<std::size_t>(material)), uv, channel_);
    const auto to_viewer = glm::normalize(place.z > 0 ? -place : place);
    double sum = m.ambient[channel_] * texel * ambient_light_ +
                 m.emission[channel_] * (m.unlit ? texel : 1) +
                 m.diffuse[channel_] * texel * surrounding_;
    for (const auto& light : lights_) {
      const auto to_light = glm::normalize(way_to(light, place));
      const double facing = glm::dot(normal, to_light);
      if (facing <= 0) continue;
      const double mirrored = glm::dot(2 * facing * normal - to_light, to_viewer);
      const double highlight = m.shininess == 0 ? 1
                               : mirrored > 0   ? std::pow(std::min(mirrored, 1.0), m.shininess)
                                                : 0;
      sum += intensity_at(light, place) *
             (m.diffuse[channel_] * texel * facing + m.specular[channel_] * highlight);
    }
    return sum;
  }

  /// Directions in which a surface looks for lights, half of those of an environment.
  double lights_faced(glm::dvec3 place, glm::dvec3 normal) const {
    double faced = 0;
    for (const auto& light : lights_)
      if (glm::dot(normal, way_to(light, place)) > 0 && intensity_at(light, place) > 0)
        faced += directions_of(light);
    return stand_for_ * faced + 0.5 * directions_around_;
  }

private:
  static glm::dvec3 way_to(const Light& light, glm::dvec3 place) {
    return light.type == LightType::directional ? -light.direction : light.position_m - place;
  }

  static double intensity_at(const Light& light, glm::dvec3 place) {
    if (light.type == LightType::directional) return light.intensity;
    const auto way = place - light.position_m;
    double intensity = light.intensity;
    if (light.falls_off) intensity /= std::max(glm::dot(way, way), 1e-12);
    if (light.type != LightType::spot) return intensity;
    const double inner = std::cos(glm::radians(light.inner_deg)),
                 outer = std::cos(glm::radians(light.outer_deg)),
                 cosine = glm::dot(glm::normalize(way), glm::normalize(light.direction));
    return intensity * std::pow(std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0), 2);
  }

  /// The colour of a material; where it lies otherwise than its mesh's coordinates say is not
  /// looked at.
  const Image* texture(std::size_t material) const {
    return material < first_of_meshes_
               ? texture_of(materials_, world_.textures, material)
               : world_.maps[material - first_of_meshes_].colour.image.get();
  }

  static double texel_at(const Image* texture, glm::dvec2 uv, int channel) {
    if (!texture) return 1;
    const auto index = [](double share, int count) {
      return std::clamp(static_cast<int>((share - std::floor(share)) * count), 0, count - 1);
    };
    const int x = index(uv.x, texture->width),
              y = texture->height - 1 - index(uv.y, texture->height);
    return texture->channel(
        channel)[static_cast<std::size_t>(y) * static_cast<std::size_t>(texture->width) +
                 static_cast<std::size_t>(x)];
  }

  static constexpr std::size_t most = 32;

  const std::vector<Material>& materials_;
  std::size_t first_of_meshes_;  // of the materials
  const World& world_;
  int channel_;
  std::vector<Light> lights_;     // without ambient ones and environments
  double surrounding_ = 0;        // mean radiance of environments
  double directions_around_ = 0;  // in which they are looked for
  double stand_for_ = 1;          // lights of the scene for each of `lights_`
  double ambient_light_;
};

/// True where a surface, seen from the hologram, is so steep that it counts as a break: as
/// kernels/samples/breaks.cl has it.
///
/// cross  of two edges of its triangle
bool is_steep(const Plan& plan, glm::dvec3 place, glm::dvec3 cross) {
  constexpr double least_cosine = 0.2, least_cosine_aside = 0.05;
  const auto half = glm::dvec2(plan.window_m()) / 2.0 * std::max(1.0, plan.cone.half_width);
  const double along = std::abs(glm::dot(cross, place)), size = glm::length(cross),
               distance = glm::length(place);
  return along < least_cosine * size * distance ||
         along - std::abs(cross.x) * half.x - std::abs(cross.y) * half.y <
             least_cosine_aside * size * (distance + half.x + half.y);
}

/// Finds where surfaces end, and what lies behind breaks: a ray to the hologram passes a break when
/// that lies within half the hologram times the difference of their nearness (1 / depth).
///
/// steep  cells that are breaks as a whole
void find_breaks(const Plan& plan, const std::vector<bool>& steep, FrontView& view) {
  constexpr float jump = 4;  // depths of a cell from one surface to the next
  constexpr int coarsest = 128;
  // Differences alone count, and 0 is no surface.
  const auto offset = static_cast<float>(plan.extent.near_m > 0 ? 0 : 2 / plan.extent.closest_m);
  const auto nearness = [&](int x, int y) {
    const float z = view.depth_m[view.cell(x, y)];
    return z != 0 ? 1 / z + offset : 0.0f;
  };
  // Nearness is linear along planes: one that falls by more than the slope on the other side ends.
  const float least_fall = jump * static_cast<float>(view.step);
  const auto ends = [&](glm::ivec2 here, glm::ivec2 way) {
    const auto inside = [&](glm::ivec2 at) {
      return at.x >= 0 && at.y >= 0 && at.x < view.size.x && at.y < view.size.y;
    };
    const auto there = here + way, before = here - way;
    if (!inside(there)) return false;
    const float q = nearness(here.x, here.y), beyond = nearness(there.x, there.y),
                slope = inside(before) ? nearness(before.x, before.y) - q : 0;
    return beyond == 0 || q - beyond > 2 * std::abs(slope) + least_fall * q;
  };

  // Hiding is looked at in blocks of cells: in no time, and accurately enough for a count.
  const int block = std::max(1, std::max(view.size.x, view.size.y) / coarsest);
  const glm::ivec2 blocks = (view.size + block - 1) / block;
  const auto at_block = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(blocks.x) +
           static_cast<std::size_t>(x);
  };
  std::vector<float> nearest_break(area_of(blocks));  // 0: none
  auto ending = nearest_break;                        // of these, only where a surface ends
  float farthest = 1e30f;
  view.for_surfaces([&](int x, int y, std::size_t cell, double) {
    const float q = nearness(x, y);
    if (q == 0) return;
    farthest = std::min(farthest, q);
    const glm::ivec2 here(x, y);
    const bool is_end =
        ends(here, {1, 0}) || ends(here, {-1, 0}) || ends(here, {0, 1}) || ends(here, {0, -1});
    view.ends += is_end;
    view.steep += steep[cell];
    const auto at = at_block(x / block, y / block);
    if (is_end) ending[at] = std::max(ending[at], q);
    if (is_end || steep[cell]) nearest_break[at] = std::max(nearest_break[at], q);
  });

  const auto half = glm::vec2(plan.window_m()) / 2.0f;
  const float width = static_cast<float>(view.step) * static_cast<float>(block);
  const auto behind = [&](const std::vector<float>& breaks) {
    std::vector<bool> is_behind(breaks.size(), false);
    for (int y = 0; y < blocks.y; ++y) {
      for (int x = 0; x < blocks.x; ++x) {
        const float q = breaks[at_block(x, y)];
        if (q == 0) continue;
        const auto reach = (q - farthest) * half / width;
        const auto low = glm::ivec2(glm::max(glm::vec2(x, y) - reach, glm::vec2(0))),
                   high = glm::ivec2(glm::min(glm::vec2(x, y) + reach, glm::vec2(blocks - 1)));
        for (int v = low.y; v <= high.y; ++v) {
          for (int u = low.x; u <= high.x; ++u) {
            if (is_behind[at_block(u, v)]) continue;
            const float there = nearness(std::min(u * block + block / 2, view.size.x - 1),
                                         std::min(v * block + block / 2, view.size.y - 1)),
                        rise = q - there;
            if (there > 0 && rise > least_fall * q &&
                static_cast<float>(std::abs(u - x)) * width < rise * half.x &&
                static_cast<float>(std::abs(v - y)) * width < rise * half.y)
              is_behind[at_block(u, v)] = true;
          }
        }
      }
    }
    return is_behind;
  };
  const auto behind_end = behind(ending), behind_break = behind(nearest_break);
  view.partly_hidden.assign(view.depth_m.size(), false);
  view.for_surfaces([&](int x, int y, std::size_t cell, double) {
    const auto at = at_block(x / block, y / block);
    view.partly_hidden[cell] = behind_end[at];
    view.hidden += behind_end[at];
    view.behind_breaks += behind_break[at];
  });
}

/// Replaces mirrors and glass by what they show.
///
/// specular  share of the light that each cell's surface mirrors or lets through
void add_images(const Plan& plan, const std::vector<float>& specular, FrontView& view) {
  if (plan.specular.images.rays == 0) return;
  double light = 0, cells = 0;
  for (std::size_t cell = 0; cell < specular.size(); ++cell) {
    if (view.depth_m[cell] == 0 || specular[cell] > 0) continue;
    light += view.radiance[cell];
    ++cells;
  }
  const double mean = cells > 0 ? light / cells : 0,
               segments = plan.specular.images.segments / plan.specular.images.rays,
               lost = plan.specular.images.lost / plan.specular.images.rays;
  const auto& images = plan.specular.images.all;
  view.for_surfaces([&](int x, int y, std::size_t cell, double) {
    if (specular[cell] == 0) return;
    ++view.specular;
    view.segments += segments;
    view.lost += lost;
    const bool has_own = specular[cell] < 1;
    if (!has_own) view.sources[cell] = view.depth_m[cell] = view.radiance[cell] = 0;
    const glm::ivec2 at((view.tangent(x, y) - plan.specular.images.low) /
                        plan.specular.images.step);
    if (glm::any(glm::lessThan(at, glm::ivec2(0))) ||
        glm::any(glm::greaterThanEqual(at, plan.specular.images.size)))
      return;
    const int ray = at.y * plan.specular.images.size.x + at.x;
    float brightest = 0;
    for (auto i = std::ranges::lower_bound(images, ray, {}, &Images::Image::ray);
         i != images.end() && i->ray == ray; ++i) {
      ++view.sources[cell];
      ++view.images;
      view.image_surfaces += i->surfaces;
      const auto shown = static_cast<float>(i->share * mean);
      view.radiance[cell] += shown;
      if (shown <= brightest || has_own) continue;
      brightest = shown;
      view.depth_m[cell] = static_cast<float>(
          std::clamp(i->at_m.z, plan.specular.images.near_m, plan.specular.images.far_m));
      view.shiny[cell] = false;
    }
  });
}

}  // namespace

FrontView front_view(const Scene& scene, const World& world, const Plan& plan, int longest) {
  FrontView view;
  const auto range = glm::dvec2(plan.lattice.size) * plan.lattice.step;
  view.step = std::max(range.x, range.y) / longest;
  view.low = glm::dvec2(plan.lattice.first) * plan.lattice.step;
  view.eye_z_m = plan.lattice.eye_m.z;
  const auto from_eye = [&](const glm::dvec3& p_m) { return p_m.z - view.eye_z_m; };
  view.size = glm::max(glm::ivec2(glm::ceil(range / view.step - 1e-9)), glm::ivec2(1));
  const auto cells = area_of(view.size);
  view.depth_m.assign(cells, 0);
  view.radiance.assign(cells, 0);
  view.shiny.assign(cells, false);
  view.sources.assign(cells, 0);
  std::vector<float> specular(cells, 0);
  const Shading shading(scene, world, plan);
  std::vector<glm::vec3> hit(cells);  // triangle's index is kept apart: a float counts too few
  std::vector<std::uint32_t> nearest(cells, 0);

  for (std::size_t t = 0; t < world.triangles.size(); ++t) {
    const auto p = world.corners_m(t);
    glm::dvec2 at[3];  // cells from the corner
    for (std::size_t i = 0; i < 3; ++i)
      at[i] = (glm::dvec2(p[i]) / from_eye(p[i]) - view.low) / view.step - 0.5;
    const auto least = glm::min(glm::min(at[0], at[1]), at[2]),
               most = glm::max(glm::max(at[0], at[1]), at[2]);
    view.boxes += (most.x - least.x) * (most.y - least.y);
    const auto cross = [](glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; };
    const double area = cross(at[1] - at[0], at[2] - at[0]);
    if (!(std::abs(area) > 1e-12)) continue;
    const auto low = glm::max(glm::ceil(least), glm::dvec2(0));
    const auto high = glm::min(glm::floor(most), glm::dvec2(view.size - 1));
    const bool closed = world.object_closed[static_cast<std::size_t>(world.triangle_object[t])];
    for (double y = low.y; y <= high.y; ++y) {
      for (double x = low.x; x <= high.x; ++x) {
        const glm::dvec2 here(x, y);
        const double a = cross(at[1] - here, at[2] - here) / area,
                     b = cross(at[2] - here, at[0] - here) / area, c = 1 - a - b;
        if (a < 0 || b < 0 || c < 0) continue;
        view.pierced += closed ? 0.5 : 1;
        const auto cell = view.cell(static_cast<int>(x), static_cast<int>(y));
        const glm::dvec3 share =
            glm::dvec3(a / from_eye(p[0]), b / from_eye(p[1]), c / from_eye(p[2]));
        const double away = 1 / (share.x + share.y + share.z);
        // 0 is no surface
        const double depth = away + view.eye_z_m == 0 ? 1e-12 : away + view.eye_z_m;
        if (view.depth_m[cell] != 0 && view.depth_m[cell] <= static_cast<float>(depth)) continue;
        view.depth_m[cell] = static_cast<float>(depth);
        nearest[cell] = static_cast<std::uint32_t>(t);
        hit[cell] = glm::vec3(share * away);
      }
    }
  }

  std::vector<bool> steep(cells, false);
  std::vector<double> levels(scene.objects.size(), 1);  // triangles, then depth of the tree
  for (const auto object : world.triangle_object) ++levels[static_cast<std::size_t>(object)];
  for (auto& level : levels) level = std::log2(level);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    if (view.depth_m[cell] == 0) continue;
    view.sources[cell] = 1;
    const auto corners = world.triangles[nearest[cell]];
    const auto mix = [&](const auto& values) {
      using Value = std::decay_t<decltype(values[0])>;
      return values[corners.x] * typename Value::value_type(hit[cell].x) +
             values[corners.y] * typename Value::value_type(hit[cell].y) +
             values[corners.z] * typename Value::value_type(hit[cell].z);
    };
    const auto p = world.corners_m(nearest[cell]);
    const glm::dvec3 place =
        double{hit[cell].x} * p[0] + double{hit[cell].y} * p[1] + double{hit[cell].z} * p[2];
    const auto face = glm::cross(p[1] - p[0], p[2] - p[0]);
    const auto object = world.triangle_object[nearest[cell]];
    const auto smooth = world.motion_of(object).turn * glm::dvec3(mix(world.normals));
    const double length = glm::length(smooth);
    auto normal = length > 0 ? smooth / length : glm::normalize(face);
    const auto forwards = place.z > 0 ? place : -place;  // from the eye
    if ((glm::dot(face, forwards) > 0) == (glm::dot(face, normal) > 0)) normal = -normal;
    const int number = plan.lighting.material_of(static_cast<std::size_t>(object),
                                                 world.material_of(nearest[cell]));
    const auto& material = plan.lighting.materials[static_cast<std::size_t>(number)];
    const double wavelength_m = scene.hologram.wavelength_m;
    const double mirrored = std::min(
        material.reflectivity.at(wavelength_m) + material.transparency.at(wavelength_m), 1.0);
    specular[cell] = static_cast<float>(mirrored);
    view.covered += mirrored < 1;
    view.shiny[cell] = has_highlights(material, scene.channels()) && mirrored < 1;
    view.radiance[cell] = static_cast<float>(
        (1 - mirrored) * shading.radiance(number, place, normal, glm::dvec2(mix(world.uvs))));
    steep[cell] = is_steep(plan, place, face);
    const double lights = shading.lights_faced(place, normal);
    view.lights_faced += lights;
    view.lights_faced_levels += lights * levels[static_cast<std::size_t>(object)];
    if (material.diffuse != glm::dvec3(0)) view.looks += plan.lighting.diffuse_rays;
    if (view.shiny[cell]) view.looks += plan.lighting.gloss_rays;
  }
  find_breaks(plan, steep, view);
  add_images(plan, specular, view);
  return view;
}

}  // namespace raywave
