// SPDX-License-Identifier: Apache-2.0
// What plan promises or warns of, other commands keep or say.
#include <nlohmann/json.hpp>

#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Matchers::ContainsSubstring;
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

TEST_CASE("plan states the memory that a render's process holds, within 1.25 of what it took",
          "[slow]") {
  Desk desk;
  const auto scene = desk.file("scene.toml");
  const std::vector<std::string> usual{"--set", "hologram.resolution=[2600, 1800]",
                                       "--set", "object.0.position=[0, 0, '120 mm']",
                                       "--set", "object.0.width=3 mm",
                                       "--set", "sampling.pitch=60 um"};
  const std::string three = R"(hologram.wavelength=["638 nm", "520 nm", "450 nm"])";
  for (const auto& set :
       std::vector<std::vector<std::string>>{{"sampling.frames=1"},
                                             {"sampling.frames=6", "slm.encoding=phase"},
                                             {three},
                                             {"hologram.tiles=[2, 2]", "slm.lens=1 m"},
                                             {"wrp.propagation=spectrum", "wrp.padding=1.5"}}) {
    auto with = usual;
    for (const auto& value : set) with.insert(with.end(), {"--set", value});
    const auto run = [&](std::vector<std::string> arguments) {
      arguments.insert(arguments.end(), with.begin(), with.end());
      auto outcome = desk.run(arguments);
      INFO(outcome.err);
      REQUIRE(outcome.code == 0);
      return outcome;
    };
    const std::vector<std::string> render{"render", scene, "-o", desk.file("out")};
    run(render);  // has the kernels compiled
    const auto plan = Json::parse(run({"plan", scene, "--json"}).out);
    double predicted = 0;
    const auto add = [&](const Json& of_laser) {
      predicted = std::max(predicted, of_laser["prediction"]["host_bytes"].get<double>());
    };
    if (plan.contains("colour"))
      for (const auto& laser : plan["colour"]["lasers"]) add(laser["plan"]);
    else
      add(plan);
    const auto peak = static_cast<double>(run(render).peak_bytes);
    INFO(set[0] << ": " << peak << " bytes, " << predicted << " predicted");
    CHECK(predicted < 1.25 * peak);
#ifndef __SANITIZE_ADDRESS__
    CHECK(peak < 1.25 * predicted);  // sanitizers keep what is freed
#endif
  }
  CHECK_SAYS(desk.run({"plan", scene}).out, "on the device; render holds ",
             " of the host's memory at most");
}

TEST_CASE("quality says before its pictures how long they take, and how far it is in all") {
  const Desk desk;
  const auto outcome = desk.shell(
      "$RAYWAVE quality scene.toml -o out --lens-points 3000 --border 0 2> err & "
      "i=0; until grep -q 'will take about' err || [ $i -gt 1200 ]; do sleep 0.1; i=$((i+1)); "
      "done; kill $!; cat err");
  CHECK_SAYS(outcome.out, "raywave: the comparison will take about ", "fewer --lens-points");
}

TEST_CASE("animate --rate says how many pictures a second it computed where it kept fewer") {
  Desk desk;
  desk.scene(
      "[animation]\nframes = 3\n[[animation.track]]\nof = \"object.0.rotation\"\nat = [0, 1]\n"
      "values = [[0, 0, 0], [0, 5, 0]]\n");
  const std::string says = "pictures a second were computed, where ";
  for (const auto& [rate, is_kept] : {std::pair("200000", false), {"0.001", true}}) {
    const auto folder = std::string("moving") + rate;
    const auto outcome = desk.succeed({"animate", desk.file("scene.toml"), "-o", desk.file(folder),
                                       "--no-video", "--no-preview", "--rate", rate});
    CHECK((outcome.err.find(says) == std::string::npos) == is_kept);
  }
}

TEST_CASE("animate warns of the picture that comes nearest, behind the viewer's eye") {
  Desk desk;
  desk.scene(
      "[animation]\nframes = 4\n[[animation.track]]\nof = \"object.0.position\"\nat = [0, 2]\n"
      "values = [[0, 0, \"10 mm\"], [0, 0, \"-500 mm\"]]\n");
  const auto outcome = desk.run({"animate", desk.file("scene.toml"), "-o", desk.file("moving"),
                                 "--no-video", "--no-preview"});
  CHECK_SAYS(outcome.err, "picture 2: the picture reaches to -500 mm, behind the viewer's eye");
}

TEST_CASE("drivers that compile clFFT's kernels print nothing of their own", "[slow]") {
  const Desk desk;
  REQUIRE(desk.render().code == 0);
  const auto outcome =
      desk.run({"reconstruct", desk.out("report.json").string(), "-z", "10 mm", "-o",
                desk.file("seen"), "--fft", "clfft"},
               {"RAYWAVE_CACHE_DIR=" + desk.file("cache"), "POCL_CACHE_DIR=" + desk.file("pocl")});
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK(has_notes_alone(outcome.err));
}

TEST_CASE("render --psnr says what it reached, as quality measures it on finer pixels", "[slow]") {
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

/// Rows of a quality.json.
Json rows_of(const Desk& desk) { return report_of(desk, "out/quality.json")["rows"]; }

TEST_CASE("quality judges the files of a render as it judges the scene", "[slow]") {
  Desk desk;
  const auto scene = desk.file("scene.toml");
  const auto colours = GENERATE(false, true);
  const auto keeps_field = GENERATE(true, false);
  CAPTURE(colours, keeps_field);
  std::vector<std::string> set{"--set", "sampling.frames=2",        "--set", "sampling.pitch=80 um",
                               "--set", "slm.encoding=double-phase"};
  if (colours)
    set.insert(set.end(), {"--set", R"(hologram.wavelength=["638 nm", "520 nm", "450 nm"])"});
  const auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), set.begin(), set.end());
    desk.succeed(arguments);
  };
  const std::vector<std::string> judge{"-o", desk.file("out"), "--lens-points",
                                       "2",  "--border",       "0"};
  const auto judge_of = [&](const std::string& what) {
    auto arguments = judge;
    arguments.insert(arguments.begin(), {"quality", what});
    return arguments;
  };
  with(judge_of(scene));
  const auto wanted = rows_of(desk);
  auto render = std::vector<std::string>{"render", scene, "-o", desk.file("out")};
  if (!keeps_field) render.emplace_back("--no-field");
  with(render);
  desk.succeed(judge_of(desk.file("out/report.json")));
  const auto rows = rows_of(desk);
  REQUIRE(rows.size() == wanted.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const auto* key : {"z_m", "psnr_db", "ssim", "light_share"})
      CHECK(rows[i][key].get<double>() ==
            Catch::Approx(wanted[i][key].get<double>()).epsilon(1e-6));
    CHECK(rows[i].contains("field") == keeps_field);
  }

  // Its levels are judged, not a new render's
  const auto picture = desk.file(colours ? "out/hologram_638nm.png" : "out/hologram.png");
  std::filesystem::copy_file(desk.file(colours ? "out/hologram_638nm_2.png" : "out/hologram_2.png"),
                             picture, std::filesystem::copy_options::overwrite_existing);
  CHECK_SAYS(desk.run(judge_of(desk.file("out/report.json"))).err, "is not the picture that");
  desk.scene("[viewer]\ndistance = \"0.3 m\"\n");
  CHECK_SAYS(desk.run(judge_of(desk.file("out/report.json"))).err,
             "was changed after it was rendered");
}

TEST_CASE("quality of a report says whether the goal that was asked for is reached") {
  const Desk desk;
  const auto judge = [&](std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"quality", desk.file("out/report.json"), "-o", desk.file("out"),
                               "--no-views", "--lens-points", "6"});
    return desk.run(more);
  };
  const auto render = [&](std::vector<std::string> goal) {
    goal.insert(goal.begin(), {"render", desk.file("scene.toml"), "-o", desk.file("out"), "--set",
                               "sampling.pitch=auto", "--set", "hologram.resolution=[240, 160]",
                               "--set", "object.0.rotation=[0, 0, 17]"});
    desk.succeed(goal);
  };
  render({"--psnr", "20"});
  CHECK_SAYS(judge().out, "where 20 were asked for", "the goal is reached");
  const auto told = report_of(desk)["goal"], judged = report_of(desk, "out/quality.json")["goal"];
  CHECK(judged["window_m"] == told["window_m"]);
  CHECK(judged["measured_psnr_db"].get<double>() ==
        Catch::Approx(told["measured_psnr_db"].get<double>()).margin(0.5));
  CHECK_THAT(judge({"-z", "12mm"}).out,
             !ContainsSubstring("predicted") && !ContainsSubstring("the goal is"));
  CHECK_SAYS(judge({"--psnr", "90"}).out, "where 90 were asked for", "the goal is not reached");
  CHECK_SAYS(judge({"--budget", "1us"}).out, "a picture took", "the goal is not reached");
  CHECK_SAYS(judge({"--rate", "1000"}).out, "where 1 ms were asked for", "is not reached");
  CHECK_SAYS(judge({"--preset", "draft"}).err, "was not rendered with --preset draft");
  render({"--preset", "draft"});
  CHECK(report_of(desk)["goal"]["preset"] == "draft");
  CHECK_THAT(judge().out,
             ContainsSubstring("by the preset draft, ") && !ContainsSubstring("the goal is"));
  CHECK_FALSE(report_of(desk, "out/quality.json")["goal"].contains("kept"));
  render({"--psnr", "20", "--set", "hologram.wavelength=['638 nm', '520 nm', '450 nm']"});
  CHECK_SAYS(judge().out, "the longest wavelength alone", "the goal is reached");
  CHECK(report_of(desk, "out/quality.json")["goal"]["measured_psnr_db"].get<double>() ==
        Catch::Approx(report_of(desk)["goal"]["measured_psnr_db"].get<double>()).margin(1e-3));
}

}  // namespace
}  // namespace raywave
