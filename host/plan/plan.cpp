// SPDX-License-Identifier: Apache-2.0
#include "host/plan/plan.hpp"

#include <algorithm>
#include <glm/common.hpp>

namespace raywave {

const DepthLayer& Plan::layer_at(double z_m) const {
  return *std::find_if(layers.begin(), layers.end() - 1,
                       [&](const DepthLayer& layer) { return z_m < layer.end_m; });
}

std::pair<std::size_t, std::size_t> Plan::wrps_of(std::size_t tile) const {
  const auto [first, end] =
      std::equal_range(wrps.begin(), wrps.end(), Wrp{.tile = tile},
                       [](const Wrp& a, const Wrp& b) { return a.tile < b.tile; });
  return {static_cast<std::size_t>(first - wrps.begin()),
          static_cast<std::size_t>(end - wrps.begin())};
}

std::size_t Plan::most_wrps_of_a_tile() const {
  std::vector<std::size_t> counts(tiles.size(), 0);
  for (const auto& wrp : wrps) ++counts[wrp.tile];
  return *std::max_element(counts.begin(), counts.end());
}

std::size_t Plan::gathered_pixels() const {
  if (compact)
    return static_cast<std::size_t>(compact->row_stride()) *
           static_cast<std::size_t>(compact->size.y);
  std::size_t largest = 0;
  for (const auto& layer : layers) {
    const auto gathered = gathered_size(layer);
    largest = std::max(largest,
                       static_cast<std::size_t>(gathered.x) * static_cast<std::size_t>(gathered.y));
  }
  return largest;
}

bool encodes_transforms(const Plan& plan, bool keep_field) {
  return plan.compact && !keep_field && !encodes_whole(plan) && plan.most_wrps_of_a_tile() == 1;
}

bool encodes_whole(const Plan& plan) {
  return plan.refine || plan.slm.band != glm::dvec2(1) ||
         (plan.tiles.size() > 1 && plan.slm.encoding != Encoding::phase);
}

WrpsExtent wrps_extent(const Plan& plan, const DepthLayer& layer) {
  WrpsExtent extent{glm::dvec2(std::numeric_limits<double>::infinity()),
                    glm::dvec2(-std::numeric_limits<double>::infinity())};
  if (plan.compact) return {-extent.first, -extent.last};  // light crosses them anywhere
  const auto half_window = plan.tile_window_m() / 2.0;
  for (const auto& wrp : plan.wrps) {
    if (&plan.layer_of(wrp) != &layer) continue;
    extent.first = glm::min(extent.first, glm::dvec2(wrp.centre_m) - half_window);
    extent.last = glm::max(extent.last, glm::dvec2(wrp.centre_m) + half_window);
  }
  return extent;
}

std::pair<float, float> layer_bounds(const Plan& plan, const DepthLayer& layer) {
  const auto in_frame = [&](double z_m) {
    constexpr double largest = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(z_m - plan.origin_m.z, -largest, largest));
  };
  return {in_frame(layer.begin_m), in_frame(layer.end_m)};
}

}  // namespace raywave
