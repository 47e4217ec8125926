// SPDX-License-Identifier: Apache-2.0
#include "host/reference/rays.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <sstream>

namespace raywave::reference {
namespace {

glm::dvec3 vec(const float* p) { return {p[0], p[1], p[2]}; }

}  // namespace

Hit intersect(const Corners& triangle, const Ray& ray, double sideways) {
  const auto& d = ray.direction;
  const auto a = vec(triangle.a) - ray.origin, b = vec(triangle.b) - ray.origin,
             c = vec(triangle.c) - ray.origin;
  const double side_a = dot(d, cross(b, c)), side_b = dot(d, cross(c, a)),
               side_c = dot(d, cross(a, b));
  const double volume = side_a + side_b + side_c;
  if (volume == 0 && sideways == 0) return {};

  double slack_a = 0, slack_b = 0, slack_c = 0;
  if (sideways != 0) {
    const double reach = (length(a) + length(b) + length(c)) * sideways * length(d);
    slack_a = reach * distance(b, c), slack_b = reach * distance(c, a),
    slack_c = reach * distance(a, b);
  }
  const bool front = side_a >= -slack_a && side_b >= -slack_b && side_c >= -slack_c;
  const bool back = side_a <= slack_a && side_b <= slack_b && side_c <= slack_c;
  if (!front && !back) return {};

  const double t_a = dot(a, d) / dot(d, d), t_b = dot(b, d) / dot(d, d),
               t_c = dot(c, d) / dot(d, d);
  const auto [nearest, farthest] = std::minmax({t_a, t_b, t_c});
  Hit hit{.triangle = 0};
  if (volume != 0) {
    hit.u = side_b / volume;
    hit.v = side_c / volume;
    hit.t_uncertainty =
        std::min(1.0, (slack_a + slack_b + slack_c) / std::abs(volume)) * (farthest - nearest);
  } else {
    hit.t_uncertainty = farthest - nearest;
  }
  hit.t = std::clamp(t_a + hit.u * (t_b - t_a) + hit.v * (t_c - t_a), nearest, farthest);
  return hit.t > ray.t_min - hit.t_uncertainty && hit.t < ray.t_max + hit.t_uncertainty ? hit
                                                                                        : Hit{};
}

Hit nearest_hit(std::span<const Corners> triangles, const Ray& ray) {
  Hit best{.t = ray.t_max};
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    auto hit = intersect(triangles[i], ray);
    if (hit.triangle < 0 || hit.t >= best.t) continue;
    best = hit;
    best.triangle = static_cast<int>(i);
  }
  return best;
}

bool occluded(std::span<const Corners> triangles, const Ray& ray) {
  return std::any_of(triangles.begin(), triangles.end(),
                     [&](const auto& t) { return intersect(t, ray).triangle >= 0; });
}

Verdict judge(const Hit& hit, const Ray& ray, std::span<const Corners> triangles) {
  constexpr double u24 = 0x1p-24;  // rounding of a float
  const auto exact = nearest_hit(triangles, ray);
  // Distances to planes through a triangle are sums of terms as large as the distance to its
  // corners.
  const auto tolerance = [&](int i) {
    const auto& triangle = triangles[static_cast<std::size_t>(i)];
    const auto own = intersect(triangle, ray, float_sideways);
    return own.t_uncertainty +
           16 * u24 *
               (std::abs(own.t) + length(vec(triangle.a) - ray.origin) / length(ray.direction));
  };
  std::ostringstream fault;
  if (hit.triangle < 0) {
    const bool lost = exact.triangle >= 0 && exact.t < ray.t_max - tolerance(exact.triangle) &&
                      exact.t > ray.t_min + tolerance(exact.triangle);
    if (lost) fault << "lost: triangle " << exact.triangle << " at " << exact.t;
    return {fault.str(), exact.triangle < 0};
  }
  const auto own =
      intersect(triangles[static_cast<std::size_t>(hit.triangle)], ray, float_sideways);
  if (own.triangle < 0) {
    fault << "phantom: triangle " << hit.triangle << " at " << hit.t;
  } else if (!(std::abs(hit.t - own.t) <= tolerance(hit.triangle))) {
    fault << "t " << hit.t << " instead of " << own.t;
  } else if (!(hit.t > float(ray.t_min) && hit.t < float(ray.t_max))) {
    fault << "t " << hit.t << " outside its limits";
  } else if (!(hit.u >= 0 && hit.v >= 0 && hit.u + hit.v <= 1 + 2 * u24)) {
    fault << "weights " << hit.u << ", " << hit.v;
  } else if (exact.triangle >= 0 &&
             !(hit.t <= exact.t + tolerance(exact.triangle) + tolerance(hit.triangle))) {
    fault << "triangle " << hit.triangle << " at " << hit.t << " behind " << exact.triangle
          << " at " << exact.t;
  }
  return {fault.str(),
          exact.triangle == hit.triangle ||
              (exact.triangle >= 0 && std::abs(exact.t - hit.t) <= 16 * u24 * exact.t)};
}

Seen free_path(std::span<const Corners> triangles, glm::dvec3 from, glm::dvec3 off_surface,
               double bias_m, glm::dvec3 to) {
  const Ray rays[] = {{from + bias_m * off_surface, to - from, 0, 1},
                      {from + 0.5 * bias_m * off_surface, to - from, 0, 1},
                      {from + 1.5 * bias_m * off_surface, to - from, 0, 1}};
  const auto& d = rays[0].direction;
  bool unsure = false;
  for (const auto& t : triangles) {
    // No ray that passes farther away than this meets the triangle
    const auto a = vec(t.a), b = vec(t.b), c = vec(t.c), away = (a + b + c) / 3.0 - rays[0].origin;
    const double far = 2 * (distance(a, b) + distance(b, c)) + 2 * std::abs(bias_m) +
                       1e-4 * (std::abs(away.x) + std::abs(away.y) + std::abs(away.z));
    const auto beside = cross(away, d);
    if (dot(beside, beside) > far * far * dot(d, d)) continue;
    const bool strict = intersect(t, rays[0]).triangle >= 0;
    if (strict) {
      bool wavers = false;
      for (const auto& ray : rays) wavers |= intersect(t, ray, -1e-6).triangle < 0;
      if (!wavers) return Seen::no;
      unsure = true;
    } else {
      for (const auto& ray : rays) unsure |= intersect(t, ray, 1e-6).triangle >= 0;
    }
  }
  return unsure ? Seen::unsure : Seen::yes;
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

}  // namespace raywave::reference
