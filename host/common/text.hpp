// SPDX-License-Identifier: Apache-2.0
/// Pieces of error messages. A message is one line, whatever the user's input holds.
#pragma once

#include <string>
#include <string_view>

namespace raywave {

/// Control characters become '?', and what is longer than 160 characters is cut.
std::string one_line(std::string_view text);

/// The same, in double quotes.
std::string in_quotes(std::string_view text);

/// Up to 6 digits: "0.5", "1e+06".
std::string number_text(double value);

/// The date in UTC: "2026-11-21".
std::string today();

/// With the unit that suits: "3.74 um", "12.5 mm".
std::string length_text(double length_m);

}  // namespace raywave
