// SPDX-License-Identifier: Apache-2.0
/// Text for messages. A message is one line, whatever the user's input holds.
#pragma once

#include <locale.h>

#include <clocale>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <locale>
#include <sstream>
#include <string>
#include <string_view>

namespace raywave {

/// Replaces control characters, line separators and changes of direction by '?' and cuts the text
/// after 160 characters.
std::string one_line(std::string_view text);

/// The message of an exception of the JSON library, in one line and without the library's own name.
std::string json_reason(const std::exception& error);

/// one_line(text) in double quotes.
std::string in_quotes(std::string_view text);

/// A word of a command line, in quotes where a POSIX shell needs them.
std::string shell_word(const std::string& text);

/// Letters to insert, delete or replace to make one word from the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// Where a file's name ends, in lower case: ".npy".
std::string extension_of(const std::filesystem::path& file);

/// The number with up to 6 digits: "0.5", "1e+06".
std::string number_text(double value);

/// The number, > 0, rounded to two digits: 38 of 37.98.
double two_digits(double value);

/// A share as people say it: "0.83 %", "1.6 %", "24 %".
std::string percent_text(double share);

/// Today's date in UTC: "2026-11-21".
std::string today();

/// The length with a suitable unit: "3.74 um", "12.5 mm".
std::string length_text(double length_m);

/// "3.74 mm" with up to so many digits, of what is computed: below a picometre it is noise,
/// and 0.
std::string millimetres(double length_m, int digits = 6);

/// "638nm": a laser's wavelength in the names of its files.
std::string laser_name(double wavelength_m);

/// "1 us", "12.5 ms", "3.2 s" or "2.5 minutes", with two or three digits.
std::string duration_text(double seconds);

// Text as std::printf and streams make it, whatever locale the program has set.

/// The numbers of this thread are written as in C, while it lives.
class ClassicNumbers {
public:
  ClassicNumbers() : before_(uselocale(classic())) {}
  ~ClassicNumbers() { uselocale(before_); }
  ClassicNumbers(const ClassicNumbers&) = delete;
  ClassicNumbers& operator=(const ClassicNumbers&) = delete;

private:
  static locale_t classic() {
    static const locale_t c = newlocale(LC_ALL_MASK, "C", nullptr);
    return c;
  }
  locale_t before_;
};

inline std::ostringstream text_stream() {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  return text;
}

/// how  of the values, as std::printf takes it
template <class... Values>
std::string format(const char* how, Values... values) {
  const ClassicNumbers here;
  std::string text(static_cast<std::size_t>(std::snprintf(nullptr, 0, how, values...)), '\0');
  std::snprintf(text.data(), text.size() + 1, how, values...);
  return text;
}

}  // namespace raywave
