// SPDX-License-Identifier: Apache-2.0
#include "host/planning/cautions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "host/common/text.hpp"
#include "host/planning/images.hpp"
#include "host/planning/light_shown.hpp"

namespace raywave {
namespace {

/// Below this share of the scene's light a loss is not worth a line.
constexpr double least_loss = 0.005;

/// As is less of the light in mirrors and glass near a focus.
constexpr double most_folded = 0.05;

/// Share of the vertices whose light the pixels can show, but which the lattice does not sample.
double share_beside_lattice(const World& world, const Plan& plan) {
  const glm::dvec2 first(plan.lattice.first), last(plan.lattice.first + plan.lattice.size);
  double all = 0, beside = 0;
  for (const auto& at : positions_now(world)) {
    if (share_within_pixels(plan, 0, at.x, at.z) * share_within_pixels(plan, 1, at.y, at.z) == 0)
      continue;
    const auto ray = glm::dvec2(at) / at.z / plan.lattice.step;
    ++all;
    beside += ray.x < first.x || ray.y < first.y || ray.x > last.x || ray.y > last.y;
  }
  return all > 0 ? beside / all : 0;
}

}  // namespace

std::vector<std::string> image_warnings(const Plan& plan) {
  const auto& images = plan.specular.images;
  const bool has_paths = has_fitted_paths(plan);
  std::vector<std::string> warnings;
  if (const double error = !has_paths              ? images.points_error
                           : plan.virtual_planes() ? images.coupled_error
                                                   : images.paths_error;
      error > most_points_error)
    warnings.push_back("what curved mirrors and glass show is about " + percent_text(error) +
                       " too bright or too dark" +
                       (!has_paths ? ": trace.bounces \"paths\" shows more of it as bright as it is"
                        : images.paths_error < error
                            ? ": virtual planes cannot follow its paths as "
                              "--method points does"
                            : ", since it lies near a focus of theirs"));
  if (has_paths && images.folded > most_folded)
    warnings.push_back(percent_text(images.folded) +
                       " of what mirrors and glass show lies near a focus of theirs: it is a "
                       "picture " +
                       length_text(std::round(images.folded_m * 1e4) / 1e4) +
                       " away, the same from all places of the hologram, and up to a tenth too "
                       "bright or too dark");
  return warnings;
}

std::vector<std::string> cut_warnings(const Scene& scene, const World& world, const Plan& plan) {
  if (!plan.holds_all_light() || !scene.wrp.grid) return {};
  const double beside = share_beside_lattice(world, plan);
  if (beside <= least_loss) return {};
  return {percent_text(beside) +
          " of the scene's vertices lie beside what wrp.grid lets in: a larger wrp.grid, or "
          "\"auto\", samples them"};
}

std::vector<std::string> thin_object_warnings(const Scene& scene, const World& world,
                                              const Plan& plan) {
  if (!plan.samples.aimed || world.area_samples.size() != scene.objects.size()) return {};
  std::size_t count = 0;
  std::string first;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    // In tangents: what the object covers, and the box around it
    double area = 0, z_m = 0;
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
    for (const auto& sample : world.area_samples[i]) {
      std::array<glm::dvec2, 3> at;
      const auto corners = world.corners_m(sample.triangle);
      std::transform(corners.begin(), corners.end(), at.begin(),
                     [](const auto& corner) { return glm::dvec2(corner) / corner.z; });
      const auto a = at[1] - at[0], b = at[2] - at[0];
      area += sample.share * std::abs(a.x * b.y - a.y * b.x) / 2;
      for (const auto& corner : at) {
        low = glm::min(low, corner);
        high = glm::max(high, corner);
      }
      z_m = corners[0].z;
    }
    if (world.object_closed[i]) area /= 2;  // a ray meets front and back
    const double thinness = area / glm::length(high - low);
    if (!(thinness > 0 && thinness < plan.lattice.step) || count++ > 0) continue;
    first = scene.objects[i].where + ": about " + length_text(two_digits(thinness * z_m)) +
            " thin as seen from the hologram, where rays are " +
            length_text(two_digits(plan.lattice.step * z_m)) + " apart";
  }
  if (count == 0) return {};
  return {first + (count > 1 ? " (and " + std::to_string(count - 1) + " more)" : "") +
          ": they meet parts of it or nothing; a smaller sampling.pitch finds it"};
}

}  // namespace raywave
