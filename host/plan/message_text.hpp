// SPDX-License-Identifier: Apache-2.0
/// Numbers in the messages of planning.
#pragma once

#include <sstream>
#include <string>

namespace raywave {

/// Up to 6 digits: "3.74 mm".
inline std::string millimetres(double metres) {
  std::ostringstream text;
  text.precision(6);
  text << metres * 1e3 << " mm";
  return text.str();
}

/// All digits of a count, as long as they are few.
inline std::string count_text(double count) {
  std::ostringstream text;
  text.precision(count < 1e15 ? 15 : 3);
  text << count;
  return text.str();
}

}  // namespace raywave
