// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/virtual_planes/planning/scan_lines.hpp"

#include <algorithm>

#include "host/carriers/virtual_planes/planning/errors.hpp"
#include "kernels/gather/compact_layout.h"

namespace raywave {
namespace {

/// Of the scan lines, too: footprints that are cut off are no reason for fewer.
constexpr double largest_window_error = 0.03;

/// As few scan lines as add little to what the window leaves wrong, where they do at all.
void choose_fewest_lines(const Plan& plan, VirtualPlanes& planes) {
  const double enough = 0.5 * std::min(planes.window_error, largest_window_error);
  planes.lines_tolerance = enough;
  const auto error = [&](int lines) { return predicted_lines_error(plan, lines); };
  planes.lines_error = error(planes.lines);
  while (planes.lines_error > enough && planes.lines < COMPACT_MOST_LINES)
    planes.lines_error = error(++planes.lines);
  // A scan line less has four times the error, and more: no need to look closer at every frame
  while (planes.lines > 1 && planes.lines_error <= enough / 4) {
    const double fewer = error(planes.lines - 1);
    if (fewer > enough) break;
    --planes.lines;
    planes.lines_error = fewer;
  }
}

/// Light that is the scene's sharpest highlights alone may be off by this between scan lines.
constexpr double most_highlights_error = 0.01;

/// Highlights that change as much over half a tile need room for their diffraction.
constexpr double sharp_highlight = 0.25;

/// Scan lines and margin of samples with highlights.
void choose_for_highlights(const Plan& plan, bool lines_are_given, VirtualPlanes& planes) {
  const double sharpness = sharpest_highlight(plan);
  planes.highlight_margin_px =
      sharpness > sharp_highlight ? planes.rough_margin_px : planes.margin_px;
  planes.highlight_lines = lines_are_given ? planes.lines : 1;
  const auto error = [&] {
    return sharpness > 0 ? predicted_highlights_error(plan, planes.highlight_lines) : 0;
  };
  planes.highlights_error = error();
  while (!lines_are_given && planes.highlights_error > most_highlights_error &&
         planes.highlight_lines < COMPACT_MOST_LINES) {
    ++planes.highlight_lines;
    planes.highlights_error = error();
  }
}

}  // namespace

void choose_lines(Plan& plan, bool lines_are_given, const Plan* moved_from) {
  auto& planes = std::get<VirtualPlanes>(plan.carrier);
  if (const auto* before = moved_from ? moved_from->virtual_planes() : nullptr) {
    planes = *before;
    planes.window_error = std::max(planes.window_error, predicted_cut_error(plan));
  } else {
    planes.window_error = predicted_window_error(plan);
  }
  if (lines_are_given)
    planes.lines_error = predicted_lines_error(plan, planes.lines);
  else
    choose_fewest_lines(plan, planes);
  choose_for_highlights(plan, lines_are_given, planes);
}

}  // namespace raywave
