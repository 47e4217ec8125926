// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/virtual_planes/planning/facts.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/carriers/virtual_planes/planning/planes.hpp"
#include "host/common/text.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/plan/message_text.hpp"
#include "kernels/gather/compact_layout.h"

namespace raywave {

glm::ivec2 transformed_size(const VirtualPlanes& planes, const Plan&) { return planes.size; }

/// The host transforms only the columns of the tile; devices transform whole planes.
double transform_operations(const VirtualPlanes& planes, const Plan& plan, FftBackend fft) {
  const auto operations = [](double samples) { return 5 * samples * std::log2(samples); };
  const double across = planes.size.x, down = planes.size.y;
  return static_cast<double>(plan.wrps.size()) *
         (fft == FftBackend::host
              ? down * operations(across) + plan.tiling.tile_size.x * operations(down)
              : operations(across * down));
}

double propagation_error_of(const VirtualPlanes& planes, const Plan&) { return planes.error(); }

void add_transform_memory(const VirtualPlanes& planes, const Plan&, FftBackend fft,
                          MemoryNeeds& needs) {
  const auto bytes = 8 * area_of(planes.size);
  if (fft != FftBackend::host) needs.device.push_back({"virtual plane", bytes, advice_for_planes});
  if (fft == FftBackend::clfft)
    needs.device.push_back({"work space of the transform", bytes, advice_for_planes});
}

/// Footprints, what a tile sees of a sample, lists of the bins that it lights (about), and profiles
/// (about; other devices than processors make more of them together).
double gathering_bytes(const VirtualPlanes&, const Plan& plan, double samples) {
  constexpr double bins = 100, profiles = 250;
  const double seen = 4.0 * COMPACT_SEEN * (plan.precision == Precision::doubles ? 2 : 1);
  return samples * (sizeof(device::CompactFootprint) + seen + bins) +
         std::min(samples * profiles, double{most_cached_profile_bytes});
}

std::vector<std::pair<std::string, std::string>> report_rows(const VirtualPlanes& planes,
                                                             const Plan&) {
  const int lines = planes.most_lines();
  return {{"virtual", "planes of " + extent_text(planes.size) + ", " +
                          (planes.lines_tolerance > 0 && lines > 1 ? "up to " : "") +
                          std::to_string(lines) + (lines == 1 ? " scan line" : " scan lines") +
                          " of a sample; error predicted " + percent_text(planes.error())}};
}

nlohmann::ordered_json report_json(const VirtualPlanes& planes) {
  return {{"size", {planes.size.x, planes.size.y}},
          {"window_strength", planes.window_strength},
          {"margin_px", planes.margin_px},
          {"rough_margin_px", planes.rough_margin_px},
          {"lines", planes.lines},
          {"lines_tolerance", planes.lines_tolerance},
          {"window_error", planes.window_error},
          {"lines_error", planes.lines_error},
          {"highlight_lines", planes.highlight_lines},
          {"highlight_margin_px", planes.highlight_margin_px},
          {"highlights_error", planes.highlights_error}};
}

std::vector<std::string> warnings_of(const VirtualPlanes& planes, const Plan& plan) {
  constexpr double largest_error = 0.1, largest_highlights_error = 0.05;
  std::vector<std::string> warnings;
  if (planes.error() > largest_error)
    warnings.push_back("virtual planes bring an error of " + percent_text(planes.error()) +
                       " of the field: more wrp.layers or hologram.tiles bring less, a "
                       "wrp.distance amid the scene, or wrp.propagation \"spectrum\"");
  if (shortfall_of(plan) == Shortfall::width && planes.error() <= most_virtual_plane_error)
    warnings.push_back(
        "the hologram is wider than what one of its pixels lights, wavelength z / pitch: light "
        "wraps around on the virtual plane; more hologram.tiles, or wrp.propagation \"spectrum\", "
        "keep it apart");
  if (planes.highlights_error > largest_highlights_error)
    warnings.push_back(
        "the sharpest highlights change faster than " + std::to_string(planes.highlight_lines) +
        " scan lines follow: their light is off by " + percent_text(planes.highlights_error) +
        "; a smaller shininess, or more hologram.tiles, brings less");
  return warnings;
}

}  // namespace raywave
