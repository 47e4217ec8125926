// SPDX-License-Identifier: Apache-2.0
/// Text as std::printf makes it.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>

namespace raywave {

/// how  of the values, as std::printf takes it
template <class... Values>
std::string format(const char* how, Values... values) {
  std::string text(static_cast<std::size_t>(std::snprintf(nullptr, 0, how, values...)), '\0');
  std::snprintf(text.data(), text.size() + 1, how, values...);
  return text;
}

}  // namespace raywave
