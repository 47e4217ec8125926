// SPDX-License-Identifier: Apache-2.0
#include "host/plan/predict/front_view.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <type_traits>

namespace raywave {
namespace {

/// The lights' part of Phong's model and the ambient light, as kernels/scene/shade.h has them.
class Shading {
public:
  Shading(const Scene& scene, const Textures& textures)
      : scene_(scene), textures_(textures), channel_(channel_of(scene.hologram.wavelength_m)) {
    double sum = 0;
    bool any = false;
    for (const auto& light : scene.lights) {
      if (light.type != LightType::ambient) continue;
      sum += light.intensity;
      any = true;
    }
    ambient_light_ = any ? sum : 1;
  }

  /// normal  towards the viewer, of unit length
  double radiance(int material, glm::dvec3 place, glm::dvec3 normal, glm::dvec2 uv) const {
    const auto& m = scene_.materials[static_cast<std::size_t>(material)];
    const double texel =
        texel_at(texture_of(scene_.materials, textures_, static_cast<std::size_t>(material)), uv);
    const auto to_viewer = -glm::normalize(place);
    double sum = m.ambient[channel_] * texel * ambient_light_;
    for (const auto& light : scene_.lights) {
      if (light.type == LightType::ambient) continue;
      const auto to_light = glm::normalize(light.type == LightType::point ? light.position_m - place
                                                                          : -light.direction);
      const double facing = glm::dot(normal, to_light);
      if (facing <= 0) continue;
      const double mirrored = glm::dot(2 * facing * normal - to_light, to_viewer);
      const double highlight = m.shininess == 0 ? 1
                               : mirrored > 0   ? std::pow(std::min(mirrored, 1.0), m.shininess)
                                                : 0;
      sum += light.intensity *
             (m.diffuse[channel_] * texel * facing + m.specular[channel_] * highlight);
    }
    return sum;
  }

private:
  static double texel_at(const Image* texture, glm::dvec2 uv) {
    if (!texture) return 1;
    const auto index = [](double share, int count) {
      return std::clamp(static_cast<int>((share - std::floor(share)) * count), 0, count - 1);
    };
    const int x = index(uv.x, texture->width),
              y = texture->height - 1 - index(uv.y, texture->height);
    return texture->pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(texture->width) +
                           static_cast<std::size_t>(x)];
  }

  const Scene& scene_;
  const Textures& textures_;
  int channel_;
  double ambient_light_;
};

}  // namespace

FrontView front_view(const Scene& scene, const World& world, const Plan& plan, int longest) {
  FrontView view;
  const auto range = glm::dvec2(plan.lattice.size) * plan.lattice.step;
  view.step = std::max(range.x, range.y) / longest;
  view.low = glm::dvec2(plan.lattice.first) * plan.lattice.step;
  view.size = glm::max(glm::ivec2(glm::ceil(range / view.step - 1e-9)), glm::ivec2(1));
  const auto cells = static_cast<std::size_t>(view.size.x) * static_cast<std::size_t>(view.size.y);
  view.depth_m.assign(cells, 0);
  view.radiance.assign(cells, 0);
  view.shiny.assign(cells, false);
  const Shading shading(scene, world.textures);
  std::vector<glm::vec3> hit(cells);  // triangle's index is kept apart: a float counts too few
  std::vector<std::uint32_t> nearest(cells, 0);

  for (std::size_t t = 0; t < world.triangles.size(); ++t) {
    const auto p = world.corners_m(t);
    glm::dvec2 at[3];  // cells from the corner
    for (std::size_t i = 0; i < 3; ++i)
      at[i] = (glm::dvec2(p[i]) / p[i].z - view.low) / view.step - 0.5;
    const auto cross = [](glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; };
    const double area = cross(at[1] - at[0], at[2] - at[0]);
    if (!(std::abs(area) > 1e-12)) continue;
    const auto low = glm::max(glm::ceil(glm::min(glm::min(at[0], at[1]), at[2])), glm::dvec2(0));
    const auto high =
        glm::min(glm::floor(glm::max(glm::max(at[0], at[1]), at[2])), glm::dvec2(view.size - 1));
    const bool closed = world.object_closed[static_cast<std::size_t>(world.triangle_object[t])];
    for (double y = low.y; y <= high.y; ++y) {
      for (double x = low.x; x <= high.x; ++x) {
        const glm::dvec2 here(x, y);
        const double a = cross(at[1] - here, at[2] - here) / area,
                     b = cross(at[2] - here, at[0] - here) / area, c = 1 - a - b;
        if (a < 0 || b < 0 || c < 0) continue;
        view.pierced += closed ? 0.5 : 1;
        const auto cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) +
                          static_cast<std::size_t>(x);
        const glm::dvec3 share = glm::dvec3(a / p[0].z, b / p[1].z, c / p[2].z);
        const double depth = 1 / (share.x + share.y + share.z);
        if (view.depth_m[cell] != 0 && view.depth_m[cell] <= static_cast<float>(depth)) continue;
        view.depth_m[cell] = static_cast<float>(depth);
        nearest[cell] = static_cast<std::uint32_t>(t);
        hit[cell] = glm::vec3(share * depth);
      }
    }
  }

  for (std::size_t cell = 0; cell < cells; ++cell) {
    if (view.depth_m[cell] == 0) continue;
    ++view.covered;
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
    if ((glm::dot(face, place) > 0) == (glm::dot(face, normal) > 0)) normal = -normal;
    const int material = scene.objects[static_cast<std::size_t>(object)].material;
    view.shiny[cell] = scene.materials[static_cast<std::size_t>(material)]
                           .specular[channel_of(scene.hologram.wavelength_m)] > 0;
    view.radiance[cell] =
        static_cast<float>(shading.radiance(material, place, normal, glm::dvec2(mix(world.uvs))));
  }
  return view;
}

}  // namespace raywave
