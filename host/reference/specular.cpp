// SPDX-License-Identifier: Apache-2.0
#include "host/reference/specular.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>

namespace raywave::reference {
namespace {

struct Ray {
  glm::dvec3 origin, direction;
  double optical_m = 0, share = 1;
};

/// The ray after all surfaces; NaN where it misses one.
Ray followed(const std::vector<PerfectSurface>& surfaces, glm::dvec2 place_m, glm::dvec2 tangents,
             double start_m) {
  const glm::dvec3 way(tangents, 1);
  Ray ray{glm::dvec3(place_m, 0) + start_m * way, glm::normalize(way), start_m * glm::length(way)};
  double index = 1;
  for (const auto& s : surfaces) {
    double t = 0;
    glm::dvec3 normal = glm::normalize(s.normal);
    const auto off = ray.origin - s.centre;
    if (s.radius == 0) {
      t = -glm::dot(off, normal) / glm::dot(ray.direction, normal);
    } else {
      const double along = glm::dot(off, ray.direction);
      const double inside = along * along - glm::dot(off, off) + s.radius * s.radius;
      t = -along + (s.radius > 0 ? -1 : 1) * std::sqrt(inside);
      normal = (off + t * ray.direction) / std::abs(s.radius);
    }
    ray.origin += t * ray.direction;
    ray.optical_m += index * t;
    const double cosine = glm::dot(ray.direction, normal);
    if (s.beyond == 0) {
      ray.direction -= 2 * cosine * normal;
      continue;
    }
    const double in = std::acos(std::abs(cosine)), out = std::asin(index / s.beyond * std::sin(in));
    if (in > 1e-9) {
      // Fresnel, by angles
      const double s_wave = std::pow(std::sin(in - out) / std::sin(in + out), 2),
                   p_wave = std::pow(std::tan(in - out) / std::tan(in + out), 2);
      ray.share *= 1 - (s_wave + p_wave) / 2;
    } else {
      ray.share *= 1 - std::pow((s.beyond - index) / (s.beyond + index), 2);
    }
    const auto onwards = cosine < 0 ? -normal : normal;  // along the ray
    const auto aside = ray.direction - std::abs(cosine) * onwards;
    ray.direction = index / s.beyond * aside + std::cos(out) * onwards;
    index = s.beyond;
  }
  return ray;
}

}  // namespace

std::optional<SolvedPath> solve_path(const std::vector<PerfectSurface>& surfaces,
                                     glm::dvec2 place_m, glm::dvec3 point_m, glm::dvec2 from,
                                     double start_m) {
  SolvedPath path;
  path.tangents = from;
  glm::dvec3 e1, e2;
  const auto miss = [&](glm::dvec2 tangents) {
    const auto ray = followed(surfaces, place_m, tangents, start_m);
    const auto way = point_m - ray.origin;
    const auto off =
        way - ray.direction * glm::dot(way, path.arrival) / glm::dot(ray.direction, path.arrival);
    return glm::dvec2(glm::dot(off, e1), glm::dot(off, e2));
  };
  constexpr double step = 1e-6;
  for (int round = 0; round < 12; ++round) {
    path.arrival = followed(surfaces, place_m, path.tangents, start_m).direction;
    e1 = glm::normalize(glm::cross(
        path.arrival, std::abs(path.arrival.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
    e2 = glm::cross(path.arrival, e1);
    glm::dmat2 by_tangents;
    for (int axis = 0; axis < 2; ++axis) {
      auto more = path.tangents, less = path.tangents;
      more[axis] += step;
      less[axis] -= step;
      by_tangents[axis] = (miss(more) - miss(less)) / (2 * step);
    }
    path.spread_m2 = std::abs(glm::determinant(by_tangents));
    const auto off = miss(path.tangents);
    if (round > 3 && glm::length(off) < 1e-12) break;
    path.tangents -= glm::inverse(by_tangents) * off;
  }
  const auto ray = followed(surfaces, place_m, path.tangents, start_m);
  double index = 1;
  for (const auto& s : surfaces) index = s.beyond == 0 ? index : s.beyond;
  path.optical_m = ray.optical_m + index * glm::dot(point_m - ray.origin, ray.direction);
  path.share = ray.share;
  path.arrival = ray.direction;
  if (!(glm::length(miss(path.tangents)) < 1e-9) || !(path.optical_m > start_m))
    return std::nullopt;
  return path;
}

}  // namespace raywave::reference
