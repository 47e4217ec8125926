// SPDX-License-Identifier: Apache-2.0
#include "host/common/text.hpp"

#include "host/common/memory_need.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/german.hpp"

namespace raywave {

TEST_CASE("numbers in texts are those of C, whatever locale the program has set") {
  const auto texts = [] {
    auto stream = text_stream();
    stream << 1234567 << ' ' << 0.5;
    return stream.str() + ' ' + format("%.3f %g %d", 1234.5, 1e6 + 0.5, 1000000) + ' ' +
           format_bytes(3'000'000) + ' ' + number_text(1234.5) + ' ' + length_text(0.00192) + ' ' +
           percent_text(0.0123) + ' ' + duration_text(1.5);
  };
  const auto before = texts();
  CHECK(before.substr(0, 40) == "1234567 0.5 1234.500 1e+06 1000000 2.9 M");
  const test::German german;
  CHECK(format("%g", 0.5) == "0.5");
  CHECK(texts() == before);
}

TEST_CASE("durations have few digits, in the unit that suits them") {
  CHECK(duration_text(1e-6) == "1 us");
  CHECK(duration_text(0.0125) == "12.5 ms");
  CHECK(duration_text(150) == "2.5 minutes");
  CHECK(duration_text(630) == "11 minutes");
  CHECK(duration_text(two_digits(37.98)) == "38 s");
}

TEST_CASE("rounding noise and negative zero are told as 0, and what a user gave is told as given") {
  CHECK(millimetres(-0.0) == "0 mm");
  CHECK(millimetres(1.388e-17) == "0 mm");
  CHECK(millimetres(-1.388e-17, 4) == "0 mm");
  CHECK(millimetres(1e-10) == "1e-07 mm");  // the smallest pitch
  CHECK(millimetres(-0.0123456789, 4) == "-12.35 mm");
  CHECK(number_text(-0.0) == "0");
  CHECK(length_text(1e-13) == "1e-13 m");
}

TEST_CASE("words of a command line are in quotes where a shell needs them") {
  CHECK(shell_word("out/a_b-1.toml") == "out/a_b-1.toml");
  CHECK(shell_word("my pot (1).ply") == "'my pot (1).ply'");
  CHECK(shell_word("it's") == R"('it'\''s')");
}

}  // namespace raywave
