// SPDX-License-Identifier: Apache-2.0
/// Text as std::printf and streams make it, whatever locale the program has set.
#pragma once

#include <locale.h>

#include <clocale>
#include <cstddef>
#include <cstdio>
#include <locale>
#include <sstream>
#include <string>

namespace raywave {

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
