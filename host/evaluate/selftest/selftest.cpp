// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/selftest/selftest.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/common/text.hpp"
#include "host/evaluate/report.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

const char* name_of(SelfTestSize size) { return size == SelfTestSize::full ? "full" : "quick"; }

/// The value with two digits; whole numbers with all digits.
std::string figure(double value) {
  return format(value == std::round(value) && std::abs(value) < 1e6 ? "%.0f" : "%.1e", value);
}

}  // namespace

std::vector<SelfCheck> self_checks(const cl::DeviceInfo& device, SelfTestSize size) {
  auto all = selftest::part_checks(device, size);
  for (auto& check : selftest::scene_checks()) all.push_back(std::move(check));
  return all;
}

SelfTestRow run(const SelfCheck& check, const cl::Device& device) {
  SelfTestRow row{check.part, check.claim, check.quantity, check.bound, NAN, false, 0, ""};
  const Stopwatch watch;
  try {
    auto finding = check.measure(device);
    row.measured = finding.measured;
    row.passed = finding.measured <= check.bound;
    row.note = std::move(finding.note);
  } catch (const std::exception& error) {
    row.note = error.what();
  }
  row.seconds = watch.wall_s();
  return row;
}

bool all_passed(const std::vector<SelfTestRow>& rows) {
  return std::ranges::all_of(rows, [](const auto& row) { return row.passed; });
}

std::string self_test_header(const cl::DeviceInfo& device, SelfTestSize size) {
  return std::string("raywave ") + version + ", " + name_of(size) + " self-test, " + today() +
         "\ndevice   " + device.index + " " + device.name + "\nplatform " + device.platform +
         "\nversion  " + device.version + ", driver " + device.driver + "\n";
}

std::string self_test_line(const SelfTestRow& row) {
  return format("%s  %-11s %-64s %8s <= %-8s %-14s %6.2f s\n", row.passed ? "pass" : "FAIL",
                row.part.c_str(), row.claim.c_str(),
                std::isnan(row.measured) ? "-" : figure(row.measured).c_str(),
                figure(row.bound).c_str(), row.quantity.c_str(), row.seconds) +
         (row.passed || row.note.empty() ? "" : "      " + row.note + "\n");
}

std::vector<Extreme> extremes_of(const std::vector<SelfTestRow>& rows) {
  std::vector<Extreme> extremes;
  for (const auto& row : rows) {
    if (row.part != "planes" || !row.claim.ends_with(selftest::if_planned)) continue;
    const auto name = row.claim.substr(0, row.claim.size() - selftest::if_planned.size());
    const bool over_planes = !row.note.starts_with(selftest::not_over_planes);
    const auto served =
        over_planes ? &row : std::find_if(rows.data(), rows.data() + rows.size(), [&](auto& other) {
          return other.part == "WRPs" && other.claim == name;
        });
    if (served != rows.data() + rows.size())
      extremes.push_back(
          {name, over_planes ? "virtual planes" : "WRPs", served->measured, served->bound});
  }
  return extremes;
}

std::string extremes_text(const std::vector<SelfTestRow>& rows) {
  std::string text;
  for (const auto& extreme : extremes_of(rows))
    text += format("%-32s %-14s %8s  %s of the bound\n", extreme.name.c_str(),
                   extreme.carrier.c_str(), figure(extreme.measured).c_str(),
                   percent_text(extreme.measured / extreme.bound).c_str());
  return text.empty() ? "" : "extreme                          carrier           error\n" + text;
}

std::string self_test_json(const cl::DeviceInfo& device, SelfTestSize size,
                           const std::vector<SelfTestRow>& rows) {
  Json j;
  j["raywave"] = version;
  j["date"] = today();
  j["size"] = name_of(size);
  j["device"] = json_of(device);
  j["passed"] = all_passed(rows);
  j["rows"] = Json::array();
  for (const auto& row : rows) {
    j["rows"].push_back({{"part", row.part},
                         {"claim", row.claim},
                         {"quantity", row.quantity},
                         {"measured", row.measured},  // null for NaN and infinity
                         {"bound", row.bound},
                         {"passed", row.passed},
                         {"seconds", row.seconds},
                         {"note", row.note}});
  }
  for (const auto& extreme : extremes_of(rows))
    j["extremes"].push_back({{"extreme", extreme.name},
                             {"carrier", extreme.carrier},
                             {"measured", extreme.measured},
                             {"bound", extreme.bound}});
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace raywave
