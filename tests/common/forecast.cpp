// SPDX-License-Identifier: Apache-2.0
#include "host/common/stage_clock.hpp"
#include "tests/support/catch.hpp"

namespace raywave {
namespace {

TEST_CASE("a forecast is the time of all steps at the rate of the first, told once") {
  // A step takes 16 s, and its first quarter one second: 7 steps less what the first call found
  Forecast uneven;
  CHECK_FALSE(uneven.add(0.25, 7, 1001));
  CHECK_FALSE(uneven.add(0.8, 7, 1012));
  const auto told = uneven.add(1, 7, 1016);
  REQUIRE(told);
  CHECK(*told == Catch::Approx(6.75 * 15 / 0.75));
  CHECK_FALSE(uneven.add(1.5, 7, 1024));

  // Short steps: after ten seconds. Long ones: after thirty, where they are then
  Forecast quick, slow, stuck;
  for (int i = 0; i < 10; ++i) {
    CHECK_FALSE(quick.add(2 * i, 100, i));
    CHECK_FALSE(slow.add(0.01 * i, 4, 3 * i));
    CHECK_FALSE(stuck.add(0, 4, 30 * i));
  }
  CHECK(quick.add(20, 100, 10).value() == Catch::Approx(50));
  CHECK(slow.add(0.1, 4, 30).value() == Catch::Approx(1200));
}

}  // namespace
}  // namespace raywave
