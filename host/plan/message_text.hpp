// SPDX-License-Identifier: Apache-2.0
/// Messages of planning, and the numbers in them.
#pragma once

#include <algorithm>
#include <sstream>
#include <string>
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

/// Adds lines that are not there.
inline void add_lines(std::vector<std::string>& lines, const std::vector<std::string>& more) {
  for (const auto& line : more)
    if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(line);
}

}  // namespace raywave
