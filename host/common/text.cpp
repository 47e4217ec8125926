// SPDX-License-Identifier: Apache-2.0
#include "host/common/text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <ctime>
#include <numeric>
#include <utility>
#include <vector>

namespace raywave {

std::string one_line(std::string_view text) {
  constexpr std::size_t longest = 160;
  std::string line(text.substr(0, longest));
  for (char& c : line)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  // In UTF-8: control characters from U+0080, and what ends a line or turns its direction.
  const auto at = [&](std::size_t i) {
    return i < line.size() ? static_cast<unsigned char>(line[i]) : 0;
  };
  const auto within = [](int value, int low, int high) { return value >= low && value <= high; };
  for (std::size_t i = 0; i < line.size(); ++i) {
    const int a = at(i), b = at(i + 1), c = at(i + 2);
    if (a == 0xc2 && within(b, 0x80, 0x9f)) line.replace(i, 2, "?");
    if (a == 0xe2 && ((b == 0x80 && within(c, 0xa8, 0xae)) || (b == 0x81 && within(c, 0xa6, 0xa9))))
      line.replace(i, 3, "?");
  }
  return text.size() > longest ? line + "..." : line;
}

std::string json_reason(const std::exception& error) {
  std::string_view text = error.what();
  if (text.starts_with("[json.exception.")) text.remove_prefix(text.find("] ") + 2);
  return one_line(text);
}

std::string in_quotes(std::string_view text) { return '"' + one_line(text) + '"'; }

std::string shell_word(const std::string& text) {
  if (!text.empty() &&
      text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789"
                             "_-+=:,./@%") == text.npos)
    return text;
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? "'\\''" : std::string(1, c);
  return word + "'";
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j)
      diagonal = std::exchange(row[j + 1],
                               std::min({diagonal + (a[i] != b[j]), row[j] + 1, row[j + 1] + 1}));
  }
  return row.back();
}

std::string extension_of(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

std::string number_text(double value) {
  value += 0.0;  // of -0, 0
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                 std::chars_format::general, 6)
                       .ptr;
  return {digits.data(), end};
}

double two_digits(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

std::string percent_text(double share) {
  return number_text(share < 0.01  ? std::round(share * 1e4) / 100
                     : share < 0.1 ? std::round(share * 1e3) / 10
                                   : std::round(share * 100)) +
         " %";
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 16> text;
  std::strftime(text.data(), text.size(), "%Y-%m-%d", &utc);
  return text.data();
}

std::string length_text(double length_m) {
  constexpr std::array<std::pair<double, const char*>, 4> units{
      {{1, " m"}, {1e-3, " mm"}, {1e-6, " um"}, {1e-9, " nm"}}};
  if (length_m == 0) return "0 m";
  for (const auto& [unit_m, name] : units)
    if (std::abs(length_m) >= unit_m) return number_text(length_m / unit_m) + name;
  return std::abs(length_m) >= 1e-12 ? number_text(length_m * 1e9) + " nm"
                                     : number_text(length_m) + " m";
}

std::string millimetres(double length_m, int digits) {
  return format("%.*g mm", digits, std::abs(length_m) < 1e-12 ? 0.0 : length_m * 1e3);
}

std::string laser_name(double wavelength_m) {
  auto name = length_text(wavelength_m);
  std::erase(name, ' ');
  return name;
}

std::string duration_text(double seconds) {
  constexpr double minutes_from = 120, whole_minutes_from = 600, hours_from = 7200;
  if (seconds > 0 && seconds < 1e-3) return number_text(std::round(seconds * 1e7) / 10) + " us";
  if (seconds < 1) return number_text(std::round(seconds * 1e4) / 10) + " ms";
  if (seconds < minutes_from) return number_text(std::round(seconds * 100) / 100) + " s";
  if (seconds < whole_minutes_from) return number_text(std::round(seconds / 6) / 10) + " minutes";
  if (seconds < hours_from) return number_text(std::round(seconds / 60)) + " minutes";
  return number_text(std::round(seconds / 360) / 10) + " hours";
}

}  // namespace raywave
