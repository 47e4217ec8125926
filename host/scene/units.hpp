// SPDX-License-Identifier: Apache-2.0
/// Numbers with units, as people type them.
#pragma once

#include <optional>
#include <string_view>

namespace raywave {

/// Metres from "3.74 um", "95mm", "0.1" ...: nm, um, mm, cm, m, km, or none for metres.
/// throws  InputError naming `what` when the text is no such length
double parse_length_m(std::string_view text, std::string_view what);

/// The number of a text without a unit; empty for any other text.
std::optional<double> bare_number(std::string_view text);

/// The unit in which people give what this key or option names: nm, um or mm.
///
/// what  "hologram: pitch", "--pitch" ...: its last word counts
const char* usual_unit(std::string_view what);

/// True where parse_length_m would take it.
bool is_length(std::string_view text);

/// Metres from a text with a unit, as the command line needs it; "0" needs none.
/// throws  InputError naming `what` when the text is no such length
double given_length_m(std::string_view text, std::string_view what);

/// "1.5 D" as 1.5; empty for what is no number of dioptres.
std::optional<double> dioptres_in(std::string_view text);

/// Seconds from "30 ms", "2s" ...: us, ms, s, min, h; >= 0, and "0" needs no unit.
/// throws  InputError naming `what` when the text is no such time
double given_moment_s(std::string_view text, std::string_view what);

/// The same, > 0.
double given_duration_s(std::string_view text, std::string_view what);

}  // namespace raywave
