// SPDX-License-Identifier: Apache-2.0
#include "host/display/edid.hpp"

#include <numeric>

#include "tests/support/catch.hpp"
#include "tests/support/edids.hpp"
#include "tests/support/files.hpp"

namespace raywave {
namespace {

std::optional<Edid> edid_in(const std::string& bytes) {
  return read_edid({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

TEST_CASE("an EDID tells maker, product, serial and name") {
  const auto edid = edid_in(test::edid("HOL", 0x6013, 70000, "PLUTO-2.1", ""));
  REQUIRE(edid);
  CHECK(edid->maker == "HOL");
  CHECK(edid->product == 0x6013);
  CHECK(edid->serial == "70000");
  CHECK(edid->name == "PLUTO-2.1");
  CHECK(edid->id() == "HOL-6013-70000");
  // The text counts before the number
  CHECK(edid_in(test::edid("AAZ", 1, 5, "", "SN 00123"))->id() == "AAZ-0001-SN 00123");
  CHECK(edid_in(test::edid("AAZ", 1, 0, "", ""))->id() == "AAZ-0001");
  CHECK(edid_in(test::edid("HOL", 1, 0, "a\x1b[31m", ""))->name == "a?[31m");
}

TEST_CASE("a damaged EDID is none") {
  const auto whole = test::edid("HOL", 0x6013, 70000, "PLUTO-2.1", "A1");
  CHECK_FALSE(edid_in(""));
  CHECK_FALSE(edid_in(whole.substr(0, 127)));
  CHECK(edid_in(whole + std::string(128, 'x')));  // extensions are not read
  for (std::size_t at = 0; at < whole.size(); ++at) {
    auto bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    CHECK_FALSE(edid_in(bytes));  // by its sum
  }
  CHECK_FALSE(edid_in(test::edid("HO[", 1, 0, "", "")));  // no letter, and the right sum
}

}  // namespace
}  // namespace raywave
