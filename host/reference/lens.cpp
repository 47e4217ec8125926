// SPDX-License-Identifier: Apache-2.0
#include "host/reference/lens.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "host/reference/looks.hpp"
#include "host/reference/rays.hpp"

namespace raywave::reference {
namespace {

constexpr double sideways = 2e-6;       // error of a ray in floats, as a fraction of the distance
constexpr double cosine_margin = 1e-5;  // at which a light sets

class Looking {
public:
  Looking(const Scene& scene, const World& world, const Plan& plan)
      : scene_(scene),
        world_(world),
        lights_(lights_of(scene, world)),
        ambient_light_(ambient_light_of(scene)),
        plan_(plan),
        origin_m_(plan.extent.origin_m),
        size_m_(glm::distance(world.min_m, world.max_m)) {
    for (std::size_t i = 0; i < world.triangles.size(); ++i) {
      Corners corners{};
      float* const to[] = {corners.a, corners.b, corners.c};
      const auto p = world.corners_m(i);
      glm::dvec3 middle(0);
      for (std::size_t c = 0; c < 3; ++c) {
        for (int axis = 0; axis < 3; ++axis)
          to[c][axis] = static_cast<float>(p[c][axis] - origin_m_[axis]);
        middle += (p[c] - origin_m_) / 3.0;
      }
      double radius = 0;
      for (const auto& corner : p)
        radius = std::max(radius, glm::distance(corner - origin_m_, middle));
      triangles_.push_back(corners);
      balls_.push_back({middle, 1.01 * radius + 1e-5 * size_m_});
    }
  }

  /// Where a ray is on its way over mirrors and through glass.
  struct Way {
    double share = 1;  // share of the light
    double attenuation_per_m = 0;
    int bounces = 0;
    int from = -1;  // triangle
  };

  /// Radiance along a ray of unit direction; both in the scene frame.
  double radiance(glm::dvec3 origin, glm::dvec3 direction, int light_place, Way way) {
    const auto hit = nearest(origin, direction, INFINITY, way.from);
    if (hit.triangle < 0) return 0;
    const auto triangle = static_cast<std::size_t>(hit.triangle);
    auto look = look_at(scene_, world_, triangle, hit.u, hit.v);
    // Normals turn to the viewer's side as the triangle's does.
    const auto p = world_.corners_m(triangle);
    const auto face = glm::cross(p[1] - p[0], p[2] - p[0]);
    const bool entering = (glm::dot(face, direction) > 0) != (glm::dot(face, look.smooth) > 0);
    if (!entering) {
      look.smooth = -look.smooth;
      look.normal = -look.normal;
    }
    way.share *= std::exp(-hit.t * way.attenuation_per_m);
    way.from = hit.triangle;
    const auto point = origin + hit.t * direction;
    const auto reaches = [&](std::size_t, const SeenLight& light) {
      if (std::abs(glm::dot(look.normal, light.direction)) < cosine_margin) unsure = true;
      return !scene_.trace.shadows || !is_hidden(point, look.smooth, light, hit.triangle);
    };
    const auto light =
        light_from(lights_, look, point + origin_m_, -direction, light_place, reaches);
    const double own =
        (1 - look.reflectivity - look.transparency) *
        shown_radiance(scene_, look.ambient * ambient_light_ + look.emission + light);
    return way.share * own + beyond(point, direction, look, entering, light_place, way);
  }

  bool unsure = false;  // set by what rays met since it was cleared

private:
  /// The radiance that a mirror or glass shows at a point.
  double beyond(glm::dvec3 point, glm::dvec3 direction, const Look& look, bool entering,
                int light_place, const Way& way) {
    if (way.bounces == plan_.specular.bounces || look.reflectivity + look.transparency == 0)
      return 0;
    const double ratio = entering ? 1 / look.ior : look.ior,
                 cosine = -glm::dot(direction, look.smooth);
    const double reflected = look.transparency > 0 ? mirrored_by_clear(ratio, std::abs(cosine)) : 0;
    double sum = 0;
    const auto add = [&](glm::dvec3 onwards, double share, double attenuation_per_m) {
      // A path that carries less than a thousandth of the light ends
      if (std::abs(way.share * share - 1e-3) < 1e-6) unsure = true;
      if (way.share * share < 1e-3) return;
      sum += radiance(point, onwards, light_place,
                      {way.share * share, attenuation_per_m, way.bounces + 1, way.from});
    };
    add(glm::reflect(direction, look.smooth), look.reflectivity + look.transparency * reflected,
        way.attenuation_per_m);
    if (reflected < 1 && look.transparency > 0) {
      const double cosine_beyond = std::sqrt(1 - ratio * ratio * (1 - cosine * cosine));
      if (cosine_beyond < cosine_margin) unsure = true;
      add(ratio * direction + (ratio * cosine - cosine_beyond) * look.smooth,
          look.transparency * (1 - reflected), entering ? look.attenuation_per_m : 0);
    }
    return sum;
  }

  struct Ball {
    glm::dvec3 middle;
    double radius;
  };

  Hit nearest(glm::dvec3 origin, glm::dvec3 direction, double t_max, int from) {
    const Ray ray{origin, direction, 0, t_max};
    const auto may_meet = [&](std::size_t i) {
      const auto way = balls_[i].middle - origin;
      const double along = glm::dot(way, direction);
      return static_cast<int>(i) != from &&
             glm::dot(way, way) - along * along <= balls_[i].radius * balls_[i].radius;
    };
    const auto is_sure = [&](const Corners& triangle) {
      return intersect(triangle, ray, -sideways).triangle >= 0;
    };
    return nearest_there(scene_, world_, plan_, triangles_, ray, sideways, may_meet, is_sure,
                         unsure);
  }

  bool is_hidden(glm::dvec3 point, glm::dvec3 normal, const SeenLight& light, int from) {
    const double reach = light.distance_m.value_or(4 * size_m_), off = 1e-5 * size_m_;
    const bool hidden = nearest(point, light.direction, reach, from).triangle >= 0;
    if ((nearest(point + off * normal, light.direction, reach, -1).triangle >= 0) != hidden)
      unsure = true;
    return hidden;
  }

  const Scene& scene_;
  const World& world_;
  std::vector<PlacedLight> lights_;
  double ambient_light_;
  const Plan& plan_;
  glm::dvec3 origin_m_;
  double size_m_;
  std::vector<Corners> triangles_;
  std::vector<Ball> balls_;
};

}  // namespace

LensPicture seen_by_lens(const Scene& scene, const World& world, const Plan& plan,
                         const LensView& view) {
  Looking looking(scene, world, plan);
  LensPicture picture;
  const auto half_m = plan.window_m() / 2.0;
  const double start_m = plan.extent.near_m > 0 ? 0 : plan.extent.near_m - 1e-3;  // z of rays
  for (int row = 0; row < view.size.y; ++row) {
    for (int column = 0; column < view.size.x; ++column) {
      const glm::dvec3 in_focus((column - (view.size.x - 1) / 2.0) * view.pixel_m.x,
                                ((view.size.y - 1) / 2.0 - row) * view.pixel_m.y, view.z_m);
      looking.unsure = false;
      double sum = 0;
      for (int j = 0; j < view.points; ++j) {
        for (int i = 0; i < view.points; ++i) {
          const glm::dvec3 from(half_m.x * ((2 * i + 1.0) / view.points - 1),
                                half_m.y * (1 - (2 * j + 1.0) / view.points), 0);
          const auto way = (in_focus - from) / view.z_m;  // along z
          sum += looking.radiance(from + start_m * way - plan.extent.origin_m, glm::normalize(way),
                                  light_place_of(i + column, j + row), {});
        }
      }
      picture.radiance.push_back(sum / (view.points * view.points));
      picture.unsure.push_back(looking.unsure);
    }
  }
  return picture;
}

}  // namespace raywave::reference
