// SPDX-License-Identifier: Apache-2.0
// Checks of rays through the tree against a search of all triangles in double precision.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "host/evaluate/selftest/checks.hpp"
#include "host/evaluate/selftest/ray_caster.hpp"
#include "host/reference/surfaces.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave::selftest {
namespace {

using reference::Random;
using reference::Ray;
using reference::Surface;

RayCaster caster(const cl::Device& device, const Bvh& bvh) {
  return {device, lanes_for(device.info()), bvh};
}

Bvh tree_of(const Surface& surface) { return build_bvh(surface.positions, surface.triangles, {}); }

/// Counts hits that rounding errors cannot explain.
Finding hits(const cl::Device& device, const Surface& surface, const std::vector<Ray>& rays) {
  const auto bvh = tree_of(surface);
  const auto found = caster(device, bvh).nearest(rays);
  Finding finding;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto verdict = reference::judge(found[i], rays[i], bvh.triangles);
    if (verdict.fault.empty()) continue;
    finding.measured += 1;
    finding.note = verdict.fault;
  }
  return finding;
}

/// Counts wrong occlusion tests of rays of any length through a ring: a ray is reported as free
/// although it is blocked by more than rounding errors, or as blocked although it is free.
Finding visibility(const cl::Device& device) {
  Random random(4);
  const double size = 5e-3;
  const auto bvh = tree_of(reference::torus(size));
  auto rays = reference::random_rays(random, 5003, size);
  for (auto& ray : rays) ray.t_max *= reference::uniform(random, 0.05, 0.5);
  rays = reference::as_float(std::move(rays));
  const auto found = caster(device, bvh).occluded(rays);
  Finding finding;
  int hidden = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto any = [&](double sideways, double t_min, double t_max) {
      return std::any_of(bvh.triangles.begin(), bvh.triangles.end(), [&](const auto& t) {
        const auto hit = reference::intersect(t, rays[i], sideways);
        return hit.triangle >= 0 && hit.t > t_min && hit.t < t_max;
      });
    };
    const double rounding = 1e-5 * (std::abs(rays[i].t_max) + size / length(rays[i].direction));
    hidden += found[i] != 0;
    finding.measured += found[i] != 0
                            ? !any(reference::float_sideways, -rounding, rays[i].t_max + rounding)
                            : any(-reference::float_sideways, rounding, rays[i].t_max - rounding);
  }
  finding.note = std::to_string(hidden) + " hidden";
  return finding;
}

/// Counts rays at shared edges and vertices of closed meshes (5 mm and 1 m wide) that pass through.
Finding cracks(const cl::Device& device, std::size_t count) {
  constexpr std::size_t most_at_once = 1 << 18;
  Finding finding;
  for (const double size : {5e-3, 1.0}) {
    for (const auto& mesh : {reference::sphere({0, 0, 0}, size, 24), reference::torus(size)}) {
      Random random(6);
      const auto bvh = tree_of(mesh);
      auto casts = caster(device, bvh);
      for (std::size_t left = count / 4; left > 0;) {
        const auto rays =
            reference::rays_at_edges(random, bvh.triangles, std::min(left, most_at_once), size);
        for (const auto& hit : casts.nearest(rays))
          finding.measured += hit.triangle < 0 || !(hit.t <= 1 + 1e-5);
        left -= rays.size();
      }
    }
  }
  return finding;
}

/// RMS error of the length of nearly parallel rays from a WRP to a bumpy surface.
Finding hit_distance(const cl::Device& device, double distance_m) {
  Random random(8);
  const auto bvh = tree_of(reference::torus(5e-3));
  std::vector<Ray> rays;
  for (int i = 0; i < 20000; ++i) {
    const auto p = reference::in_box(random, 4e-3);
    const double x = reference::uniform(random, -0.05, 0.05),
                 y = reference::uniform(random, -0.05, 0.05);
    rays.push_back({{p.x, p.y, -distance_m}, normalize(glm::dvec3(x, y, 1)), 0, 10});
  }
  rays = reference::as_float(rays);
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; const auto& hit : caster(device, bvh).nearest(rays)) {
    const auto& ray = rays[i++];
    if (hit.triangle < 0) continue;
    const auto exact =
        reference::intersect(bvh.triangles[static_cast<std::size_t>(hit.triangle)], ray);
    if (exact.triangle < 0) continue;
    sum += std::pow(hit.t - exact.t, 2);
    ++count;
  }
  return {std::sqrt(sum / count), ""};  // without hits NaN, which fails the check
}

}  // namespace

std::vector<SelfCheck> ray_checks(SelfTestSize size) {
  std::vector<SelfCheck> checks;
  const auto add = [&](const std::string& claim, const char* quantity, double bound, auto measure) {
    checks.push_back({"rays", claim, quantity, bound, measure});
  };
  for (const auto& [name, scale] : {std::pair("1 um", 1e-6), {"10 mm", 1e-2}, {"1 km", 1e3}}) {
    add(std::string("5,000 rays, soup of slivers, points, duplicates, ") + name, "wrong hits", 0,
        [scale = scale](const cl::Device& device) {
          Random random(2);
          const auto soup = reference::soup(random, 300, scale);
          return hits(device, soup,
                      reference::as_float(reference::random_rays(random, 5003, scale)));
        });
  }
  add("one triangle", "wrong hits", 0, [](const cl::Device& device) {
    Random random(3);
    Surface one;
    one.triangle({-1, -1, 0}, {2, -1, 0.2}, {-1, 2, 0.3});
    return hits(device, one, reference::as_float(reference::random_rays(random, 1001, 0.5)));
  });
  const std::size_t many = size == SelfTestSize::full ? 10'000'000 : 100'000;
  add((size == SelfTestSize::full ? "10,000,000" : "100,000") +
          std::string(" rays at shared edges and vertices, 5 mm and 1 m"),
      "slipped through", 0, [=](const cl::Device& device) { return cracks(device, many); });
  for (const auto& [name, distance_m, bound] :
       {std::tuple("5 mm", 5e-3, 0.2e-9), {"100 mm", 0.1, 5e-9}, {"1 m", 1.0, 40e-9}})
    add(std::string("length of rays from ") + name + " away", "m rms", bound,
        [distance_m = distance_m](const cl::Device& device) {
          return hit_distance(device, distance_m);
        });
  add("5,000 visibility rays through a ring, cut off anywhere", "wrong answers", 0, visibility);
  return checks;
}

}  // namespace raywave::selftest
