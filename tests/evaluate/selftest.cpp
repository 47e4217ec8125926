// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/selftest/selftest.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/devices.hpp"

namespace raywave {
namespace {

SelfCheck check_of(double bound, std::function<Finding(const cl::Device&)> measure) {
  return {"test", "a claim", "relative L2", bound, std::move(measure)};
}

SelfCheck check_finding(double measured, double bound) {
  return check_of(bound, [=](const cl::Device&) { return Finding{measured, "so it is"}; });
}

DEVICE_TEST("the quick self-test passes on every device") {
  for (const auto& check : self_checks(device.info(), SelfTestSize::quick)) {
    const auto row = run(check, device);
    INFO(device.info().name << ": " << self_test_line(row));
    CHECK(row.passed);
  }
}

DEVICE_TEST(
    "every row has a name of its own, a quantity and a bound, and the full self-test has every "
    "part of the quick one") {
  std::set<std::string> parts[2];
  for (const auto size : {SelfTestSize::quick, SelfTestSize::full}) {
    std::set<std::string> names;
    for (const auto& check : self_checks(device.info(), size)) {
      INFO(check.part << ", " << check.claim);
      CHECK(names.insert(check.part + check.claim).second);
      CHECK(check.claim.size() <= 64);  // the column
      CHECK_FALSE(check.quantity.empty());
      CHECK(check.bound >= 0);
      CHECK(check.bound < 0.1);
      parts[size == SelfTestSize::full].insert(check.part);
    }
  }
  CHECK(parts[0] == parts[1]);
  CHECK(parts[0].size() >= 10);
}

TEST_CASE("a row passes up to its bound, and fails beyond it, on NaN, and when its check throws") {
  const auto device = test::all_devices().front();
  CHECK(run(check_finding(0, 0), device).passed);
  CHECK(run(check_finding(1e-6, 1e-6), device).passed);
  CHECK_FALSE(run(check_finding(1.1e-6, 1e-6), device).passed);
  CHECK_FALSE(run(check_finding(INFINITY, 1), device).passed);
  CHECK_FALSE(run(check_finding(NAN, 1), device).passed);
  const auto thrown =
      run(check_of(1, [](const cl::Device&) -> Finding { throw cl::DeviceError("out of memory"); }),
          device);
  CHECK_FALSE(thrown.passed);
  CHECK(std::isnan(thrown.measured));
  CHECK(thrown.note == "out of memory");
  CHECK(all_passed({run(check_finding(0, 0), device)}));
  CHECK_FALSE(all_passed({run(check_finding(0, 0), device), thrown}));
}

TEST_CASE("a refusal passes with the right words only, and a result in its place must be exact") {
  const auto refuse = [] { throw InputError("too far, much"); };
  const auto right = [] { return Finding{1e-7, ""}; };
  CHECK(selftest::exact_or_refused("too far", right).measured == 1e-7);
  CHECK(selftest::exact_or_refused("too far", [&] { return refuse(), right(); }).measured == 0);
  CHECK(selftest::exact_or_refused("too near", [&] { return refuse(), right(); }).measured > 0);
}

DEVICE_TEST("the table and its JSON tell device, driver, version, date, and every row") {
  const auto& info = device.info();
  CHECK_SAYS(self_test_header(info, SelfTestSize::quick), info.name, info.driver, info.version,
             "raywave ");
  const std::vector<SelfTestRow> rows{run(check_finding(1e-7, 1e-6), device),
                                      run(check_finding(NAN, 1e-6), device)};
  CHECK_SAYS(self_test_line(rows[0]), "pass  test", "1.0e-07 <= 1.0e-06");
  CHECK_SAYS(self_test_line(rows[1]), "FAIL  test", "so it is");
  const auto json = nlohmann::json::parse(self_test_json(info, SelfTestSize::full, rows));
  for (const char* key : {"raywave", "date", "size", "device", "passed", "rows"})
    CHECK(json.contains(key));
  CHECK(json["device"]["driver"] == info.driver);
  CHECK(json["passed"] == false);
  CHECK(json["rows"][0]["measured"] == 1e-7);
  CHECK(json["rows"][0]["passed"] == true);
  CHECK(json["rows"][1]["measured"].is_null());
  CHECK(json["rows"][1]["note"] == "so it is");
}

TEST_CASE("of each extreme, the carrier that planning takes and its margin are told") {
  const auto row = [](const char* part, const char* claim, double measured, const char* note) {
    return SelfTestRow{part, claim, "relative L2", 1e-4, measured, true, 0, note};
  };
  const std::vector<SelfTestRow> rows{
      row("WRPs", "wavelength 1 mm", 2e-6, ""),
      row("planes", "wavelength 1 mm, if planned", 0, "over WRPs: they are better here"),
      row("WRPs", "pitch 100 um", 3e-6, ""),
      row("planes", "pitch 100 um, if planned", 5e-6, "400 samples"),
      row("FFT", "clfft, if planned", 1e-7, "")};
  const auto extremes = extremes_of(rows);
  REQUIRE(extremes.size() == 2);
  CHECK(extremes[0].carrier == "WRPs");
  CHECK(extremes[0].measured == 2e-6);
  CHECK(extremes[1].carrier == "virtual planes");
  CHECK(extremes[1].measured == 5e-6);
  CHECK_SAYS(extremes_text(rows), "wavelength 1 mm", "2 % of the bound", "5 % of the bound");
  CHECK(nlohmann::json::parse(self_test_json({}, SelfTestSize::quick, rows))["extremes"].size() ==
        2);
  CHECK(extremes_text({}).empty());
}

}  // namespace
}  // namespace raywave
