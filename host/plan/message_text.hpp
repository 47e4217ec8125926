// SPDX-License-Identifier: Apache-2.0
/// Messages of planning, and the numbers in them.
#pragma once

#include <algorithm>
#include <glm/vec2.hpp>
#include <string>
#include <utility>
#include <vector>

#include "host/common/text.hpp"

namespace raywave {

/// All digits of a count, as long as they are few.
inline std::string count_text(double count) {
  auto text = text_stream();
  text.precision(count < 1e15 ? 15 : 3);
  text << count;
  return text.str();
}

/// "1920 x 1080"
inline std::string extent_text(glm::ivec2 size) {
  return std::to_string(size.x) + " x " + std::to_string(size.y);
}

/// Adds lines that are not there.
inline void add_lines(std::vector<std::string>& lines, const std::vector<std::string>& more) {
  for (const auto& line : more)
    if (std::ranges::find(lines, line) == lines.end()) lines.push_back(line);
}

/// Lines of several lasers, each once; what not all of them have comes after the wavelength.
///
/// lasers  wavelength in metres, and its lines
inline std::vector<std::string> lines_of_lasers(
    const std::vector<std::pair<double, std::vector<std::string>>>& lasers) {
  std::vector<std::string> all;
  for (const auto& [wavelength_m, lines] : lasers) {
    for (const auto& line : lines) {
      const bool is_common = std::ranges::all_of(lasers, [&](const auto& other) {
        return std::ranges::find(other.second, line) != other.second.end();
      });
      add_lines(all, {is_common ? line : length_text(wavelength_m) + ": " + line});
    }
  }
  return all;
}

}  // namespace raywave
