// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/judged_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "host/common/text.hpp"
#include "host/plan/lattice.hpp"

namespace raywave {
namespace {

/// Cells darker than this, over the brightest one, do not widen the window.
constexpr double least_light = 1e-3;
constexpr double margin_in_blurs = 4;

/// Edges of the view that surfaces touch.
struct Edges {
  glm::bvec2 low{false, false}, high{false, false};
};
Edges lit_edges(const FrontView& view) {
  Edges edges;
  view.for_surfaces([&](int x, int y, std::size_t, double) {
    const glm::ivec2 at(x, y);
    for (int axis = 0; axis < 2; ++axis) {
      edges.low[axis] |= at[axis] == 0;
      edges.high[axis] |= at[axis] == view.size[axis] - 1;
    }
  });
  return edges;
}

/// Farthest depth of the surfaces on the nearest one's side of the hologram, in metres.
double end_of_near_side_m(const Plan& plan) {
  if (plan.extent.near_m >= 0 || plan.extent.far_m <= 0) return plan.extent.far_m;
  double end_m = plan.extent.near_m;
  for (const auto& layer : plan.layers)
    if (layer.min_m.z < 0) end_m = std::max(end_m, layer.max_m.z);
  return std::min(end_m, 0.0);
}

}  // namespace

std::vector<double> quality_depths_m(const Plan& plan) {
  const auto& extent = plan.extent;
  std::vector<double> depths{extent.near_m};
  const double nearest_m = std::abs(extent.near_m);
  if (extent.far_m - extent.near_m > 1e-6 * nearest_m) depths.push_back(extent.far_m);
  const double deep_m = end_of_near_side_m(plan) - extent.near_m;
  depths.push_back(extent.near_m -
                   std::min(std::max(0.1 * deep_m, 0.01 * nearest_m), 0.5 * nearest_m));
  // No lens focuses on its own plane.
  for (double& depth : depths)
    if (std::abs(depth) < 1e-9) depth = plan.extent.closest_m;
  return depths;
}

glm::dvec2 PictureWindow::centred_size_m() const {
  return 2.0 * glm::max(glm::abs(low_m), glm::abs(high_m));
}

std::string PictureWindow::text() const {
  const auto size = 1e3 * size_m(), centre = glm::round(0.5e5 * (low_m + high_m)) / 100.0;
  const auto sides = format("%.3g x %.3g mm", size.x, size.y);
  if (glm::all(glm::lessThan(glm::abs(centre), 0.02 * size))) return sides;
  return sides + format(" around (%.3g, %.3g) mm", centre.x, centre.y);
}

PictureWindow quality_window(const Plan& plan, const FrontView& view, double blur_m) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  PictureWindow window{glm::dvec2(infinity), glm::dvec2(-infinity)};
  const float brightest = *std::ranges::max_element(view.radiance);
  const auto depths_m = quality_depths_m(plan);
  view.for_surfaces([&](int x, int y, std::size_t cell, double) {
    if (!(view.radiance[cell] > least_light * brightest)) return;
    for (const double z_m : depths_m) {
      window.low_m = glm::min(window.low_m, view.place_m(x, y, z_m));
      window.high_m = glm::max(window.high_m, view.place_m(x, y, z_m));
    }
  });
  if (is_near_hologram(plan) || !(window.low_m.x <= window.high_m.x))
    return PictureWindow::around_axis(plan.window_m() * glm::dvec2(plan.grid));
  const auto margin_m =
      margin_in_blurs * blur_m + double(picture_border_px) * plan.hologram.pitch_m;
  window = {window.low_m - margin_m, window.high_m + margin_m};
  // Where the scene goes on beyond the lattice its light is not sampled: only what the WRPs cover
  // is judged, as sharp as it is
  double nearest_m = infinity;
  for (const double z_m : depths_m) nearest_m = std::min(nearest_m, std::abs(z_m - view.eye_z_m));
  const auto covered_m = glm::dvec2(view.size) * view.step * nearest_m;
  const auto blurred_m =
      plan.window_m() / 2.0 * ((plan.extent.far_m - plan.extent.near_m) / plan.extent.farthest_m());
  const auto edges = lit_edges(view);
  for (int axis = 0; axis < 2; ++axis) {
    const double low_m = view.low[axis] * nearest_m;
    if (edges.low[axis]) window.low_m[axis] = std::max(window.low_m[axis], low_m + blurred_m[axis]);
    if (edges.high[axis])
      window.high_m[axis] =
          std::min(window.high_m[axis], low_m + covered_m[axis] - blurred_m[axis]);
  }
  return window;
}

}  // namespace raywave
