// SPDX-License-Identifier: Apache-2.0
/// Numbers with units, as people type them.
#pragma once

#include <string_view>

namespace raywave {

/// Metres from "3.74 um", "95mm", "0.1" ...: nm, um, mm, cm, m, km, or none for metres.
/// throws  InputError naming `what` when the text is no such length
double parse_length_m(std::string_view text, std::string_view what);

/// True for a number other than 0 without a unit.
bool is_bare_number(std::string_view text);

/// Seconds from "30 ms", "2s", "0.5" ...: us, ms, s, or none for seconds; > 0.
/// throws  InputError naming `what` when the text is no such time
double parse_seconds(std::string_view text, std::string_view what);

}  // namespace raywave
