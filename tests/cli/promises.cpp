// SPDX-License-Identifier: Apache-2.0
// What plan promises or warns of, other commands keep or say.
#include <nlohmann/json.hpp>

#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;
using Json = nlohmann::json;

Json report_of(const Desk& desk, const std::string& file = "out/report.json") {
  return Json::parse(bytes_of(desk.file(file)));
}

TEST_CASE("what plan warns of is said by render, quality and animate, and is in their reports") {
  Desk desk;
  desk.scene(
      "[animation]\nframes = 2\n[[animation.track]]\nof = \"object.0.rotation\"\nat = [0, 1]\n"
      "values = [[0, 0, 0], [0, 5, 0]]\n");
  const std::vector<std::string> set{"--set", "sampling.pitch=80 um", "--set",
                                     "hologram.wavelength=900 nm"};
  const auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), set.begin(), set.end());
    return desk.run(arguments);
  };
  const auto scene = desk.file("scene.toml");
  const auto warnings = Json::parse(with({"plan", scene, "--json"}).out)["warnings"];
  REQUIRE(warnings.size() >= 3);
  const auto check = [&](const Outcome& outcome, const Json& notes) {
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    for (const auto& warning : warnings) {
      const auto line = warning.get<std::string>();
      const auto first = outcome.err.find(line);
      CHECK(first != std::string::npos);
      CHECK(outcome.err.find(line, first + 1) == std::string::npos);  // once
      CHECK(std::count(notes.begin(), notes.end(), warning) == 1);
    }
  };
  auto outcome = with({"render", scene, "-o", desk.file("out")});
  check(outcome, report_of(desk)["notes"]);
  for (const char* method : {"points", "rays"})
    CHECK(with({"render", scene, "-o", desk.file("out"), "--method", method}).code == 0);
  outcome = with({"quality", scene, "-o", desk.file("out"), "--no-views", "--lens-points", "2",
                  "--border", "0"});
  check(outcome, report_of(desk, "out/quality.json")["render"]["notes"]);
  outcome = with({"animate", scene, "-o", desk.file("moving"), "--no-video", "--no-preview"});
  check(outcome, report_of(desk, "moving/report.json")["notes"]);
}

TEST_CASE("render --psnr says what it reached, as quality measures it on finer pixels") {
  const Desk desk;
  for (const auto& [asked_db, set] : {std::pair(20, "sampling.pitch=auto"), {70, "slm.bits=8"}}) {
    const std::vector<std::string> goal{
        "--psnr", std::to_string(asked_db),         "--set", set,
        "--set",  "hologram.resolution=[240, 160]", "--set", "object.0.rotation=[0, 0, 17]"};
    const auto with = [&](std::vector<std::string> arguments) {
      arguments.insert(arguments.end(), goal.begin(), goal.end());
      return desk.run(arguments);
    };
    const auto outcome = with({"render", desk.file("scene.toml"), "-o", desk.file("out")});
    INFO(outcome.out << outcome.err);
    REQUIRE(outcome.code == 0);
    const auto told = report_of(desk)["goal"];
    const bool is_kept = asked_db == 20;
    CHECK(told["kept"] == is_kept);
    CHECK(told["asked_psnr_db"] == asked_db);
    CHECK_SAYS(is_kept ? outcome.out : outcome.err, "dB measured in",
               "where " + std::to_string(asked_db) + " were asked for");
    CHECK((outcome.err.find("nothing reaches 70 dB") == std::string::npos) == is_kept);
    REQUIRE(with({"quality", desk.file("scene.toml"), "-o", desk.file("out"), "--no-views"}).code ==
            0);
    const auto judged = report_of(desk, "out/quality.json");
    CHECK(judged["window_m"] == told["window_m"]);
    double mean_db = 0;
    for (const auto& row : judged["rows"])
      mean_db += row["psnr_db"].get<double>() / static_cast<double>(judged["rows"].size());
    CHECK(told["measured_psnr_db"].get<double>() == Catch::Approx(mean_db).margin(0.5));
  }
}

}  // namespace
}  // namespace raywave
