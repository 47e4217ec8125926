// SPDX-License-Identifier: Apache-2.0
#include "host/scene/units.hpp"

#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <string>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

struct Unit {
  std::string_view name;
  double in_base;
};

/// Blanks in place of those that word processors put between number and unit: no-break spaces,
/// U+00A0 and U+202F, and thin ones, U+2009.
std::string with_blanks(std::string_view text) {
  std::string plain(text);
  for (const std::string_view blank : {"\u00a0", "\u202f", "\u2009"})
    for (std::size_t at; (at = plain.find(blank)) != std::string::npos;)
      plain.replace(at, blank.size(), " ");
  return plain;
}

/// "3.74 um" as 3.74e-6; empty when the unit is not among `units`.
std::optional<double> in_base_unit(std::string_view given, std::span<const Unit> units) {
  const std::string text = with_blanks(given);
  const auto trim = [](std::string_view s) {
    const auto first = s.find_first_not_of(' ');
    return first == std::string_view::npos ? std::string_view{}
                                           : s.substr(first, s.find_last_not_of(' ') - first + 1);
  };
  const std::string_view trimmed = trim(text);
  double number = 0;
  const auto [end, error] =
      std::from_chars(trimmed.data(), trimmed.data() + trimmed.size(), number);
  if (error != std::errc() || !std::isfinite(number)) return {};
  const std::string_view unit =
      trim(trimmed.substr(static_cast<std::size_t>(end - trimmed.data())));
  for (const auto& one : units)
    if (one.name == unit) return number * one.in_base;
  return {};
}

// With the micro sign, U+00B5, and the Greek letter, U+03BC
constexpr Unit length_units[] = {{"", 1},      {"km", 1e3},       {"m", 1},
                                 {"cm", 1e-2}, {"mm", 1e-3},      {"um", 1e-6},
                                 {"nm", 1e-9}, {"\u00b5m", 1e-6}, {"\u03bcm", 1e-6}};
constexpr Unit time_units[] = {{"", 1},           {"s", 1},          {"ms", 1e-3}, {"us", 1e-6},
                               {"\u00b5s", 1e-6}, {"\u03bcs", 1e-6}, {"min", 60},  {"h", 3600}};

/// Refuses numbers other than 0 that have no unit.
void require_unit(std::string_view text, std::string_view what, const char* example) {
  const auto number = bare_number(text);
  if (number && *number != 0)
    throw InputError(std::string(what) + " " + in_quotes(text) + ": a unit is needed, as in " +
                     one_line(text) + example);
}

[[noreturn]] void fail(std::string_view text, std::string_view what, const char* must_be) {
  throw InputError(std::string(what) + " must be " + must_be + ", got " + in_quotes(text));
}

[[noreturn]] void fail_time(std::string_view text, std::string_view what) {
  fail(text, what, "a time such as \"30 ms\" (units: us, ms, s, min, h)");
}

}  // namespace

std::optional<double> bare_number(std::string_view text) {
  constexpr Unit none[] = {{"", 1}};
  return in_base_unit(text, none);
}

const char* usual_unit(std::string_view what) {
  what.remove_prefix(what.rfind(' ') + 1);
  const auto has = [&](std::string_view word) { return what.find(word) != what.npos; };
  if (has("wavelength") || has("bandwidth") || what == "only") return "nm";  // colour.only
  return has("pitch") || has("resolution") || has("blur") || has("crosstalk") ? "um" : "mm";
}

bool is_length(std::string_view text) { return in_base_unit(text, length_units).has_value(); }

double parse_length_m(std::string_view text, std::string_view what) {
  if (const auto length = in_base_unit(text, length_units)) return *length;
  fail(text, what, "a length such as \"3.74 um\" (units: nm, um, mm, cm, m, km; none for metres)");
}

std::optional<double> dioptres_in(std::string_view text) {
  constexpr Unit dioptre[] = {{"D", 1}};
  return in_base_unit(text, dioptre);
}

double given_length_m(std::string_view text, std::string_view what) {
  require_unit(text, what, usual_unit(what));
  if (const auto length = in_base_unit(text, length_units)) return *length;
  fail(text, what, "a length such as \"3.74 um\" (units: nm, um, mm, cm, m, km)");
}

double given_moment_s(std::string_view text, std::string_view what) {
  require_unit(text, what, "ms");
  if (const auto time = in_base_unit(text, time_units); time && *time >= 0) return *time;
  fail_time(text, what);
}

double given_duration_s(std::string_view text, std::string_view what) {
  const double time = given_moment_s(text, what);
  if (time == 0) fail_time(text, what);
  return time;
}

}  // namespace raywave
