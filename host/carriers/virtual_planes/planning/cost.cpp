// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/virtual_planes/planning/cost.hpp"

#include <algorithm>
#include <cmath>

#include "host/carriers/virtual_planes/planning/errors.hpp"
#include "kernels/gather/compact_layout.h"

namespace raywave {
namespace {

/// On virtual planes, in nodes: placing a sample; a node where light is cut off, beside the node; a
/// light's highlight on a line; a pixel of a line, and of each frame where there are several.
constexpr double nodes_of_sample = 14, nodes_of_cut = 0.6, nodes_of_highlight = 1.4,
                 nodes_of_pixel = 0.016, nodes_of_frame_pixel = 0.045;

/// Half tiles before the pixels' limit in which light fades out.
constexpr double cut_before = COMPACT_EDGE * (1 - COMPACT_EDGE_BEYOND);

/// Pixels along a footprint, of a sample's light on a virtual plane.
double footprint_side(const VirtualPlanes& planes, const Plan& plan, int axis, double z_m,
                      double z0_m, double margin_px) {
  const double half_m = plan.tile_window_m()[axis] / 2,
               guard = static_cast<double>(planes.size[axis]) / plan.tiling.tile_size[axis];
  const double fresnel =
      half_m * half_m * std::abs(z_m - z0_m) / (plan.hologram.wavelength_m * std::abs(z_m * z0_m));
  return std::min({4 * guard * fresnel + 2 * margin_px, static_cast<double>(planes.size[axis]),
                   static_cast<double>(COMPACT_WIDEST)});
}

double in_packets(double count) { return 16 * std::ceil(count / 16); }

}  // namespace

Nodes nodes_of(const VirtualPlanes& planes, const Plan& plan, const FrontView& view) {
  constexpr double most_looks = 2e4;
  Nodes all{0, 0};
  const auto half_m = plan.tile_window_m() / 2.0;
  const auto tiles = static_cast<double>(plan.tiling.tiles.size());
  const int step =
      std::max(1, static_cast<int>(std::sqrt(tiles * view.size.x * view.size.y / most_looks)));
  const auto lights = static_cast<double>(
      directions_of(plan.lighting.lights, [](const Light& light) { return light.highlights; }));
  const auto add = [&](int x, int y, std::size_t cell, double z_m) {
    const double weight = static_cast<double>(step) * step * view.sources[cell];
    const double z0_m = plan.layer_at(z_m).distance_m;
    const bool hidden = view.partly_hidden[cell];
    for (const auto& tile : plan.tiling.tiles) {
      const glm::dvec2 at_m = view.place_m(x, y, z_m) - tile.centre_m;
      bool cut = false;
      for (int axis = 0; axis < 2 && plan.beyond_diffraction; ++axis) {
        const double across = std::abs(at_m[axis]) + half_m[axis];
        cut |= across > plan.hologram.largest_sine[axis] * std::hypot(across, z_m) -
                            cut_before * half_m[axis];
      }
      const double margin = hidden || cut      ? planes.rough_margin_px
                            : view.shiny[cell] ? planes.highlight_margin_px
                                               : planes.margin_px;
      const double lines =
          hidden ? plan.samples.visibility_parts + 4
                 : scan_lines_of(plan, view.shiny[cell] ? planes.most_lines() : planes.lines,
                                 {at_m.x, -at_m.y, z_m}, z0_m);
      glm::dvec2 sides;
      double nodes = 0;
      for (int axis = 0; axis < 2; ++axis) {
        sides[axis] = footprint_side(planes, plan, axis, z_m, z0_m, margin);
        nodes += in_packets((sides[axis] + COMPACT_SPARE_NODES + COMPACT_STEP / 2) / 2);
      }
      const double pixels = (sides.x + COMPACT_BIN) * sides.y;
      all.nodes += weight * (nodes_of_sample +
                             lines * (nodes * (cut ? 1 + nodes_of_cut : 1) +
                                      (view.shiny[cell] ? nodes_of_highlight * lights : 0) +
                                      nodes_of_pixel * pixels));
      all.frame_nodes += weight * nodes_of_frame_pixel * pixels;
    }
  };
  view.for_surfaces(add, step);
  return all;
}

}  // namespace raywave
