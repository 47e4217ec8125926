// SPDX-License-Identifier: Apache-2.0
/// Names of files as URIs have them. In a header, for readers link nothing of raywave.
#pragma once

#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>

namespace raywave {

/// "a b" for "a%20b" (RFC 3986).
inline std::string without_escapes(std::string_view escaped) {
  std::string text;
  for (std::size_t i = 0; i < escaped.size(); ++i) {
    const auto is_digit = [&](std::size_t at) {
      return at < escaped.size() && std::isxdigit(static_cast<unsigned char>(escaped[at]));
    };
    const bool is_escape = escaped[i] == '%' && is_digit(i + 1) && is_digit(i + 2);
    text += is_escape
                ? static_cast<char>(std::stoi(std::string(escaped.substr(i + 1, 2)), nullptr, 16))
                : escaped[i];
    if (is_escape) i += 2;
  }
  return text;
}

}  // namespace raywave
