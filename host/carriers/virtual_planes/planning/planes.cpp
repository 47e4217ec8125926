// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/virtual_planes/planning/planes.hpp"

#include <algorithm>
#include <cmath>
#include <glm/vector_relational.hpp>

#include "host/common/fft_backend.hpp"

namespace raywave {
namespace {

/// Size of the virtual plane over the tile's, at least (docs/accuracy.md): more brings nothing once
/// the window is divided out.
constexpr double guard = 16.0 / 15;

/// Strength of the window, and pixels that footprints then reach beyond their rays; as many times
/// that where light is rough.
constexpr double window_strength = 9, footprint_margin = 4, rough_margins = 2;

/// The plane has room for a footprint and its tails, however small the hologram.
constexpr int least_size = 64;

}  // namespace

double WindowFunction::operator()(double at) const {
  const double inside = 1 - at * at / (reach * reach);
  return inside < 0 ? 0 : std::exp(strength * (std::sqrt(inside) - 1));
}

WindowFunction window_function(const Plan& plan, int axis) {
  const auto& plane = *plan.virtual_planes();
  return {plane.window_strength, 2.0 * plane.size[axis] / plan.tiling.tile_size[axis] - 1};
}

glm::dvec2 origin_of_tile(const Plan& plan, const Tile& tile) {
  const auto off_middle =
      glm::dvec2(plan.tiling.tile_size / 2) - glm::dvec2(plan.tiling.tile_size - 1) / 2.0;
  return tile.centre_m + off_middle * plan.hologram.pitch_m * glm::dvec2(1, -1);
}

VirtualPlanes virtual_planes_of(const Plan& plan, const WrpSpec& wanted) {
  VirtualPlanes plane;
  for (int axis = 0; axis < 2; ++axis)
    plane.size[axis] = static_cast<int>(next_fast_size(static_cast<std::size_t>(std::max<double>(
        least_size,
        std::ceil(wanted.guard.value_or(guard) * plan.tiling.tile_size[axis] - 1e-9)))));
  plane.window_strength = wanted.bell.value_or(window_strength);
  plane.margin_px = wanted.margin_px.value_or(footprint_margin);
  plane.rough_margin_px = rough_margins * plane.margin_px;
  plane.lines = wanted.lines.value_or(plane.lines);
  return plane;
}

std::string why_not_virtual_planes(const Scene& scene) {
  if (scene.sampling.mode != SamplingMode::aimed)
    return "rays of a fan start at places in space, which a virtual plane has not";
  return "";
}

std::string key_of_wrps(const Scene& scene) {
  const SamplingSpec sampling;
  for (const auto& [key, is_changed] :
       {std::pair("wrp.padding", scene.wrp.padding != WrpSpec{}.padding),
        {"sampling.cone", scene.sampling.cone != sampling.cone},
        {"sampling.apodization", scene.sampling.apodization != sampling.apodization}})
    if (is_changed || scene.given.contains(key)) return key;
  return "";
}

bool is_wider_than_light(const Plan& plan, glm::ivec2 tile_size) {
  const auto window_m = glm::dvec2(tile_size) * plan.hologram.pitch_m;
  return std::ranges::any_of(plan.layers, [&](const DepthLayer& layer) {
    return glm::any(glm::greaterThan(
        window_m, plan.hologram.wavelength_m * std::abs(layer.distance_m) / plan.hologram.pitch_m));
  });
}

Shortfall shortfall_of(const Plan& plan) {
  const auto& plane = *plan.virtual_planes();
  if (is_wider_than_light(plan, plan.tiling.tile_size)) return Shortfall::width;
  if (plane.error() <= most_virtual_plane_error) return Shortfall::none;
  return plane.window_error > plane.lines_error ? Shortfall::depth : Shortfall::width;
}

void place_virtual_planes(Plan& plan) {
  for (auto& layer : plan.layers) layer.grid = {1, 1};
  plan.wrps.clear();
  for (std::size_t tile = 0; tile < plan.tiling.tiles.size(); ++tile) {
    for (std::size_t layer = 0; layer < plan.layers.size(); ++layer)
      plan.wrps.push_back(
          {.centre_m = {plan.tiling.tiles[tile].centre_m, plan.layers[layer].distance_m},
           .layer = layer,
           .tile = tile});
  }
}

}  // namespace raywave
