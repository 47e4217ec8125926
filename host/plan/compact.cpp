// SPDX-License-Identifier: Apache-2.0
#include "host/plan/compact.hpp"

#include <algorithm>
#include <cmath>
#include <glm/vector_relational.hpp>

#include "host/common/fft_backend.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

/// Size of the virtual plane over the tile's, at least (docs/accuracy.md): more brings nothing once
/// the bell is divided out.
constexpr double guard = 16.0 / 15;

/// Strength of the bell, and pixels that footprints then reach beyond their rays; as many times
/// that where light is rough.
constexpr double bell_strength = 9, footprint_margin = 4, rough_margins = 2;

/// The plane has room for a footprint and its tails, however small the hologram.
constexpr int least_size = 64;

}  // namespace

double Bell::operator()(double at) const {
  const double inside = 1 - at * at / (reach * reach);
  return inside < 0 ? 0 : std::exp(strength * (std::sqrt(inside) - 1));
}

Bell bell_of(const Plan& plan, int axis) {
  const auto& plane = plan.compact.value();
  return {plane.bell, 2.0 * plane.size[axis] / plan.tile_size[axis] - 1};
}

glm::dvec2 origin_of_tile(const Plan& plan, const Tile& tile) {
  const auto off_middle = glm::dvec2(plan.tile_size / 2) - glm::dvec2(plan.tile_size - 1) / 2.0;
  return tile.centre_m + off_middle * plan.pitch_m * glm::dvec2(1, -1);
}

CompactPlane compact_plane(const Plan& plan, const WrpSpec& wanted) {
  CompactPlane plane;
  for (int axis = 0; axis < 2; ++axis)
    plane.size[axis] = static_cast<int>(next_fast_size(static_cast<std::size_t>(std::max<double>(
        least_size, std::ceil(wanted.guard.value_or(guard) * plan.tile_size[axis] - 1e-9)))));
  plane.bell = wanted.bell.value_or(bell_strength);
  plane.margin_px = wanted.margin_px.value_or(footprint_margin);
  plane.rough_margin_px = rough_margins * plane.margin_px;
  plane.lines = wanted.lines.value_or(plane.lines);
  return plane;
}

std::string why_not_compact(const Scene& scene) {
  if (scene.sampling.mode != SamplingMode::aimed)
    return "rays of a fan start at places in space, which a virtual plane has not";
  return "";
}

std::string key_of_wrps(const Scene& scene) {
  const WrpSpec wrp;
  const SamplingSpec sampling;
  if (scene.wrp.padding != wrp.padding || scene.given.contains("wrp.padding")) return "wrp.padding";
  if (scene.sampling.cone != sampling.cone || scene.given.contains("sampling.cone"))
    return "sampling.cone";
  if (scene.sampling.apodization != sampling.apodization ||
      scene.given.contains("sampling.apodization"))
    return "sampling.apodization";
  return "";
}

bool is_wider_than_light(const Plan& plan, glm::ivec2 tile_size) {
  const auto window_m = glm::dvec2(tile_size) * plan.pitch_m;
  return std::any_of(plan.layers.begin(), plan.layers.end(), [&](const DepthLayer& layer) {
    return glm::any(
        glm::greaterThan(window_m, plan.wavelength_m * std::abs(layer.distance_m) / plan.pitch_m));
  });
}

CompactShortfall shortfall_of(const Plan& plan) {
  const auto& plane = plan.compact.value();
  if (is_wider_than_light(plan, plan.tile_size)) return CompactShortfall::width;
  if (plane.error() <= most_compact_error) return CompactShortfall::none;
  return plane.window_error > plane.lines_error ? CompactShortfall::depth : CompactShortfall::width;
}

std::vector<std::string> compact_warnings(const Plan& plan) {
  constexpr double largest_error = 0.1, largest_highlights_error = 0.05;
  std::vector<std::string> warnings;
  if (!plan.compact) return warnings;
  if (plan.compact->error() > largest_error)
    warnings.push_back("virtual planes bring an error of " + percent_text(plan.compact->error()) +
                       " of the field: more wrp.layers or hologram.tiles bring less, a "
                       "wrp.distance amid the scene, or wrp.propagation \"spectrum\"");
  if (shortfall_of(plan) == CompactShortfall::width && plan.compact->error() <= most_compact_error)
    warnings.push_back(
        "the hologram is wider than what one of its pixels lights, wavelength z / pitch: light "
        "comes round on the virtual plane; more hologram.tiles, or wrp.propagation \"spectrum\", "
        "keep it apart");
  if (plan.compact->highlights_error > largest_highlights_error)
    warnings.push_back("the sharpest highlights change faster than " +
                       std::to_string(plan.compact->highlight_lines) +
                       " scan lines follow: their light is off by " +
                       percent_text(plan.compact->highlights_error) +
                       "; a smaller shininess, or more hologram.tiles, brings less");
  return warnings;
}

void place_compact(Plan& plan) {
  for (auto& layer : plan.layers) layer.grid = {1, 1};
  plan.wrps.clear();
  for (std::size_t tile = 0; tile < plan.tiles.size(); ++tile) {
    for (std::size_t layer = 0; layer < plan.layers.size(); ++layer) {
      Wrp wrp;
      wrp.centre_m = {plan.tiles[tile].centre_m, plan.layers[layer].distance_m};
      wrp.layer = layer;
      wrp.tile = tile;
      plan.wrps.push_back(std::move(wrp));
    }
  }
}

}  // namespace raywave
