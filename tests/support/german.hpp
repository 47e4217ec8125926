// SPDX-License-Identifier: Apache-2.0
/// A program whose locale writes 1.234,5.
#pragma once

#include <clocale>
#include <locale>
#include <string>

namespace raywave::test {

/// While it lives; C's own functions only where the system has such a locale.
class German {
public:
  German() : before_(std::locale::global(std::locale(std::locale(), new Punctuation))) {
    std::setlocale(LC_NUMERIC, "de_DE.UTF-8");
  }
  ~German() {
    std::locale::global(before_);
    std::setlocale(LC_ALL, "C");
  }
  German(const German&) = delete;
  German& operator=(const German&) = delete;

private:
  struct Punctuation : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  std::locale before_;
};

}  // namespace raywave::test
