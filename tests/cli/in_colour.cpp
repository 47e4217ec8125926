// SPDX-License-Identifier: Apache-2.0
// Scenes of several lasers, as a person computes and looks at them (docs/colour.md).
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "host/scene/image.hpp"
#include "host/view/colour_picture.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Matchers::ContainsSubstring;

const std::string three = "hologram.wavelength=[\"638 nm\", \"520 nm\", \"450 nm\"]";

/// A red card before the desk's scene, in colour.
void in_colour(Desk& desk) {
  desk.scene(
      "[materials.red]\nambient = [0.8, 0.1, 0.05]\ndiffuse = 0\n[[object]]\nmesh = "
      "\"square.obj\"\n"
      "width = \"0.12 mm\"\nposition = [0, 0, \"9 mm\"]\nmaterial = \"red\"\n");
}

TEST_CASE("render writes a hologram for each laser, which can be looked at together and alone") {
  Desk desk;
  in_colour(desk);
  const std::string scene = desk.file("scene.toml"), out = desk.out("").string();
  desk.succeed(
      {"render", scene, "--set", three, "--set", "slm.encoding=phase", "-o", out, "--rgb"});
  const auto report = nlohmann::json::parse(bytes_of(desk.out("report.json")));
  const auto& lasers = report.at("colour").at("lasers");
  REQUIRE(lasers.size() == 3);
  double power = 0;
  for (const auto& laser : lasers) {
    power += laser.at("power").get<double>();
    CHECK(laser.at("duty").get<double>() == Catch::Approx(1.0 / 3));
    CHECK(laser.at("report").at("scene").at("hologram").at("wavelength_m") ==
          laser.at("wavelength_m"));
    CHECK(std::filesystem::exists(desk.out(laser.at("field").get<std::string>())));
  }
  CHECK(power == Catch::Approx(1));
  CHECK(report.at("files").size() == 7);

  // The picture of all lasers holds the levels of each, the longest wavelength as red
  const auto packed = load_channels(desk.out("hologram_rgb.png"), "RGB", "");
  const char* names[] = {"hologram_638nm.png", "hologram_520nm.png", "hologram_450nm.png"};
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(packed[i].pixels == load_levels(desk.out(names[i]), "").pixels);

  // One laser alone: the same bits
  desk.succeed({"render", scene, "--set", three, "--set", "slm.encoding=phase", "--set",
                "colour.only=520 nm", "-o", desk.file("alone"), "--quiet"});
  CHECK(bytes_of(desk.file("alone/hologram.png")) == bytes_of(desk.out(names[1])));
  CHECK(bytes_of(desk.file("alone/field.npy")) == bytes_of(desk.out("field_520nm.npy")));

  // What they show, and what a lens sees, is red in the middle
  for (const char* flag : {"--quiet", "--field"})
    desk.succeed({"reconstruct", desk.out("report.json"), "-z", "9mm", "-o", desk.file("seen"),
                  flag, "--json", desk.file("seen.json")});
  desk.succeed(
      {"lens", scene, "--set", three, "-z", "9mm", "-o", desk.file("seen"), "--lens-points", "2"});
  const auto is_red = [&](const std::string& name) {
    const auto picture = load_rgb(desk.file(name), "");
    double sums[3] = {};
    for (int y = 12; y < 20; ++y)
      for (int x = 18; x < 30; ++x)
        for (std::size_t c = 0; c < 3; ++c)
          sums[c] += double{picture.channels[c].pixels[static_cast<std::size_t>(48 * y + x)]};
    return sums[0] > 2 * sums[1] && sums[0] > 2 * sums[2];
  };
  CHECK(is_red("seen/reconstruction_9mm.exr"));
  CHECK(is_red("seen/lens_9mm.exr"));
  const auto compared = desk.succeed({"compare", desk.file("seen/lens_9mm.exr"),
                                      desk.file("seen/reconstruction_9mm.exr"), "--blur", "3px"});
  CHECK_THAT(compared.out, ContainsSubstring("Delta E 2000       mean"));
  const auto itself =
      desk.run({"compare", desk.file("seen/lens_9mm.png"), desk.file("seen/lens_9mm.png")});
  CHECK_THAT(itself.out, ContainsSubstring("mean 0.000, median 0.000, 95 % within 0.000"));

  // A laser's own files, whose pitch and wavelength the report knows
  for (const char* file : {"hologram_450nm.png", "field_450nm.npy"}) {
    const auto one =
        desk.succeed({"reconstruct", desk.out(file), "-z", "9mm", "-o", desk.file("one")});
    CHECK(is_grey(load_rgb(desk.file("one/reconstruction_9mm.exr"), "")));
  }
  desk.shell("cp out/field_450nm.npy out/other.npy");
  check_refused(desk.run({"reconstruct", desk.out("other.npy"), "-z", "9mm", "-o", desk.file("x")}),
                2, "is of several lasers; give the file of one");
  // A hologram of another render is told
  desk.shell("cp alone/hologram.png out/hologram_638nm.png");
  check_refused(
      desk.run({"reconstruct", desk.out("report.json"), "-z", "9mm", "-o", desk.file("x")}), 2,
      "hologram_638nm.png");
}

void run_quietly(Desk& desk, std::vector<std::string> words) {
  words.emplace_back("--quiet");
  desk.succeed(words);
}

TEST_CASE("encode makes the holograms of three lasers of their fields, by one scale") {
  Desk desk;
  in_colour(desk);
  const auto run = [&](std::vector<std::string> words) { run_quietly(desk, std::move(words)); };
  const auto powers_in = [&](const std::string& name) {
    const auto report = nlohmann::json::parse(bytes_of(desk.file(name)));
    std::vector<double> powers;
    for (const auto& laser : report.at("colour").at("lasers")) powers.push_back(laser.at("power"));
    return powers;
  };
  // As render encodes them: a level that rounding decides may differ
  run({"render", desk.file("scene.toml"), "--set", three, "--set", "slm.encoding=double-phase",
       "--set", "sampling.frames=2", "-o", desk.out("")});
  run({"encode", desk.out("report.json"), "-o", desk.file("again")});
  // The scale is read of a field in other units
  CHECK_THAT(powers_in("again/report.json"),
             Catch::Matchers::Approx(powers_in("out/report.json")).epsilon(1e-6));
  for (const std::string name : {"638nm", "520nm", "450nm", "450nm_2"}) {
    const auto rendered = load_levels(desk.out("hologram_" + name + ".png"), "").pixels,
               encoded = load_levels(desk.file("again/hologram_" + name + ".png"), "").pixels;
    std::size_t differing = 0;
    for (std::size_t i = 0; i < rendered.size(); ++i)
      differing += std::lround(std::abs(rendered[i] - encoded[i]) * 255) % 255 > 1;
    CHECK(differing == 0);
  }
  run({"reconstruct", desk.file("again/report.json"), "-z", "9mm", "-o", desk.file("seen")});
  CHECK_FALSE(is_grey(load_rgb(desk.file("seen/reconstruction_9mm.exr"), "")));

  // Another SLM, with a LUT for each laser
  for (const auto* name : {"red", "green", "blue"}) {
    std::string lut;
    for (int i = 0; i < 256; ++i)
      lut += std::to_string((name[0] == 'r' ? 1.0 : name[0] == 'g' ? 1.2 : 1.4) * i / 255) + "\n";
    desk.folder().write(std::string(name) + ".txt", lut);
  }
  desk.folder().write("slm.toml",
                      "[slm]\nencoding = \"phase\"\n[slm.lut]\n\"638 nm\" = \"red.txt\"\n\"520 "
                      "nm\" = \"green.txt\"\n\"450 nm\" = \"blue.txt\"\n");
  run({"encode", desk.out("report.json"), "--slm", desk.file("slm.toml"), "-o", desk.file("luts")});
  for (const std::string name : {"638nm", "450nm"}) {
    run({"encode", desk.out("field_" + name + ".npy"), "--slm", desk.file("slm.toml"), "-o",
         desk.file("one")});
    CHECK(bytes_of(desk.file("one/hologram.png")) ==
          bytes_of(desk.file("luts/hologram_" + name + ".png")));
  }
  check_refused(desk.run({"encode", desk.out("report.json"), "--wavelength", "520nm", "-o",
                          desk.file("x"), "--quiet"}),
                2, "--wavelength is for one field");
  run({"encode", desk.out("report.json"), "--format", "exr", "-o", desk.file("exr")});
  check_refused(
      desk.run({"reconstruct", desk.file("exr/report.json"), "-z", "9mm", "-o", desk.file("x")}), 2,
      "which is not read again");
  run({"render", desk.file("scene.toml"), "--set", three, "--no-field", "-o", desk.file("bare")});
  check_refused(desk.run({"encode", desk.file("bare/report.json"), "-o", desk.file("x")}), 2,
                "its fields were not kept");
}

TEST_CASE("quality in colour has the figures of compare, of lens and reconstruction") {
  Desk desk;
  in_colour(desk);
  const auto run = [&](std::vector<std::string> words) { run_quietly(desk, std::move(words)); };
  const std::string scene = desk.file("scene.toml"), window = "0.16mmx0.12mm";
  const auto quality = desk.succeed({"quality", scene, "--set", three, "-z", "9mm", "--lens-points",
                                     "2", "--no-views", "--blur", "3px", "--border", "2",
                                     "--window", window, "--against-points", "-o", desk.file("q")});
  CHECK_THAT(quality.out, ContainsSubstring("Delta E mean"));
  run({"render", scene, "--set", three, "-o", desk.out("")});
  run({"reconstruct", desk.out("report.json"), "-z", "9mm", "--window", window, "-o",
       desk.file("seen")});
  run({"lens", scene, "--set", three, "-z", "9mm", "--lens-points", "2", "--window", window, "-o",
       desk.file("seen")});
  run({"compare", desk.file("seen/lens_9mm.exr"), desk.file("seen/reconstruction_9mm.exr"),
       "--blur", "3px", "--border", "2", "--domain", "srgb", "--json", desk.file("compared.json")});
  const auto compared = nlohmann::json::parse(bytes_of(desk.file("compared.json")));
  run({"compare", desk.file("seen/lens_9mm.exr"), desk.file("seen/reconstruction_9mm.exr"),
       "--blur", "3px", "--border", "2", "--json", desk.file("intensity.json")});
  const auto intensities = nlohmann::json::parse(bytes_of(desk.file("intensity.json")));
  const auto told = nlohmann::json::parse(bytes_of(desk.file("q/quality.json")));
  REQUIRE(told.at("rows").size() == 1);
  const auto& row = told["rows"][0];
  CHECK(row.at("view") == "whole");
  CHECK(row.at("scale").get<double>() ==
        Catch::Approx(intensities.at("scale").get<double>()).epsilon(1e-4));
  for (const auto* figure : {"psnr_db", "ssim", "flip"})
    CHECK(row.at(figure).get<double>() ==
          Catch::Approx(compared.at(figure).get<double>()).epsilon(1e-4));
  for (const auto* figure : {"mean", "median", "percentile_95", "largest"})
    CHECK(row.at("delta_e_2000").at(figure).get<double>() ==
          Catch::Approx(compared.at("delta_e_2000").at(figure).get<double>()).epsilon(1e-3));
  CHECK(row.at("delta_e_2000").at("mean").get<double>() > 0.1);
  CHECK(row.at("field").at("psnr_db").get<double>() > 10);
  CHECK(row.at("field").at("psnr_db") != row.at("psnr_db"));
  CHECK(told.at("render").at("colour").at("lasers").size() == 3);
  // Lens, hologram, difference; the middle of the first two is red
  const auto sheet = load_rgb(desk.file("q/quality.png"), "");
  const int cell = (sheet.width() - 8) / 3;
  for (int column = 0; column < 2; ++column) {
    const auto at = static_cast<std::size_t>(sheet.height() / 2 * sheet.width() +
                                             column * (cell + 4) + cell / 2);
    CHECK(sheet.channels[0].pixels[at] > 1.5f * sheet.channels[1].pixels[at]);
  }
  CHECK(row.at("light_share").get<double>() > 0);
  // Fields against those of the sum of all points, mean of the lasers
  CHECK(told.at("against_points").at("correlation").get<double>() > 0.5);
}

TEST_CASE("plan says what each laser needs and reaches, and where edges lose blue") {
  Desk desk;
  in_colour(desk);
  const auto scene = desk.file("scene.toml");
  const auto plan = desk.succeed({"plan", scene, "--set", three});
  CHECK_THAT(plan.out, ContainsSubstring("laser     638 nm: 0.479 of white's power"));
  CHECK_THAT(plan.out, ContainsSubstring("that the whole hologram shows with all lasers"));
  CHECK_THAT(plan.out, !ContainsSubstring("edges turn"));
  const auto wide = desk.run({"plan", scene, "--set", three, "--set", "object.0.width=3 mm"});
  CHECK_THAT(wide.out, ContainsSubstring("no light of 450 nm, and edges turn to the colour of"));
}

TEST_CASE("refine makes of three lasers what render makes of the same [refine], and goes on") {
  Desk desk;
  in_colour(desk);
  const auto scene = desk.file("scene.toml"), out = desk.out("").string();
  const std::vector<std::string> refined{"--set", three,
                                         "--set", "sampling.frames=2",
                                         "--set", "refine.lens_points=3",
                                         "--set", "refine.targets=lens"};
  const auto run = [&](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), refined.begin(), refined.end());
    return desk.succeed(words, more);
  };
  const auto report_in = [&](const std::string& folder) {
    return nlohmann::json::parse(bytes_of(desk.file(folder + "/report.json")));
  };
  run({"render", scene}, {"--set", "refine.iterations=4", "-o", desk.file("rendered")});
  const auto told = run({"refine", scene}, {"--iterations", "4", "--border", "2", "-o", out});
  const char* lasers[] = {"638nm", "520nm", "450nm"};
  for (const std::string laser : lasers) {
    for (const auto& name : {"hologram_" + laser + ".png", "hologram_" + laser + "_2.png",
                             "refined_" + laser + ".npy"}) {
      INFO(name);
      CHECK(bytes_of(desk.out(name)) == bytes_of(desk.file("rendered/" + name)));
    }
  }
  const auto report = report_in("out"), rendered = report_in("rendered");
  CHECK(report.at("files").size() == 9);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& laser = report.at("colour").at("lasers").at(i);
    CHECK(laser.at("power") == rendered.at("colour").at("lasers").at(i).at("power"));
    int better = 0;
    for (const auto& row : laser.at("report").at("refine").at("rows")) {
      if (row["role"] != "optimised") continue;
      CHECK(row["psnr_db"]["refined"] > row["psnr_db"]["unrefined"]);
      ++better;
    }
    CHECK(better >= 5);
  }
  for (const auto* text : {"638 nm: power 0.", "450 nm: power 0.", "held out", "4 iterations"})
    CHECK_THAT(told.out, ContainsSubstring(text));
  for (const auto* file : {"report.json", "refined_520nm.npy"})
    run_quietly(desk, {"reconstruct", desk.out(file), "-z", "9mm", "-o", desk.file("seen")});

  // Further: each laser as if it were alone
  run({"refine", scene},
      {"--start", out + "report.json", "--iterations", "3", "--no-table", "-o", desk.file("more")});
  run({"refine", scene}, {"--set", "colour.only=450 nm", "--start", out + "refined_450nm.npy",
                          "--iterations", "3", "--no-table", "-o", desk.file("alone")});
  CHECK(bytes_of(desk.file("more/refined_450nm.npy")) == bytes_of(desk.file("alone/refined.npy")));
  CHECK(bytes_of(desk.file("more/refined_450nm.npy")) != bytes_of(desk.out("refined_450nm.npy")));

  const auto refused = [&](const std::string& start, const std::string& wavelengths,
                           const std::string& says) {
    check_refused(desk.run({"refine", scene, "--set", wavelengths, "--set", "sampling.frames=2",
                            "--no-table", "--start", start, "-o", desk.file("x")}),
                  2, says);
  };
  refused(out + "refined_450nm.npy", three, "several lasers go on from the report.json");
  refused(desk.file("alone/report.json"), three, "is of one wavelength");
  refused(out + "report.json", "hologram.wavelength=[\"638 nm\", \"532 nm\", \"450 nm\"]",
          "has no laser of 532 nm");
  refused(out + "report.json", "hologram.wavelength=520 nm", "goes on from refined.npy");
  check_refused(desk.run({"encode", out + "report.json", "-o", desk.file("x")}), 2,
                "raywave refine keeps phases alone");
  desk.shell("cp more/refined_520nm.npy out/");
  refused(out + "report.json", three, "refined_520nm.npy");
}

TEST_CASE("two and four lasers do all that three do, but --rgb", "[slow]") {
  for (const std::vector<std::string>& lasers :
       {std::vector<std::string>{"638", "520"}, {"638", "589", "520", "450"}}) {
    Desk desk;
    in_colour(desk);
    std::string set = "hologram.wavelength=[";
    for (const auto& laser : lasers) set += "\"" + laser + " nm\", ";
    const auto scene = desk.file("scene.toml"), out = desk.out("").string();
    const auto run = [&](std::vector<std::string> words, bool reads_scene = true) {
      if (reads_scene) words.insert(words.end(), {"--set", set + "]"});
      return run_quietly(desk, std::move(words));
    };
    const auto lasers_in = [&](const std::string& folder) {
      auto told = nlohmann::json::parse(bytes_of(desk.file(folder + "/report.json")));
      REQUIRE(told.at("colour").at("lasers").size() == lasers.size());
      return told["colour"];
    };
    const auto plan = desk.run({"plan", scene, "--set", set + "]"});
    CHECK_THAT(plan.out, ContainsSubstring(std::to_string(lasers.size()) + " lasers in turn"));
    CHECK((plan.out.find("which is shown as (0.43") != std::string::npos) == (lasers.size() == 2));
    run({"render", scene, "-o", out, "--set", "sampling.frames=2"});
    run({"encode", out + "report.json", "-o", desk.file("again")}, false);
    const auto colour = lasers_in("out"), again = lasers_in("again");
    double power = 0;
    for (std::size_t i = 0; i < lasers.size(); ++i) {
      power += colour["lasers"][i]["power"].get<double>();
      CHECK(again["lasers"][i]["power"].get<double>() ==
            Catch::Approx(colour["lasers"][i]["power"].get<double>()).epsilon(1e-6));
      CHECK(std::filesystem::exists(desk.file("again/hologram_" + lasers[i] + "nm_2.png")));
    }
    CHECK(power == Catch::Approx(1));
    CHECK((colour["white_shown"]["delta_e_2000"].get<double>() < 1e-6) == (lasers.size() > 2));

    // The fields show what the lens sees: red
    run({"reconstruct", out + "report.json", "--field", "-z", "9mm", "-o", desk.file("seen")},
        false);
    run({"lens", scene, "-z", "9mm", "--lens-points", "2", "-o", desk.file("seen")});
    for (const auto* name : {"seen/lens_9mm.exr", "seen/reconstruction_9mm.exr"}) {
      const auto picture = load_rgb(desk.file(name), "");
      double sums[3] = {};
      for (std::size_t c = 0; c < 3; ++c)
        for (const float pixel : picture.channels[c].pixels) sums[c] += double{pixel};
      CHECK(sums[0] > 1.5 * sums[1]);
      CHECK(sums[0] > 1.5 * sums[2]);
    }
    run({"quality", scene, "-z", "9mm", "--lens-points", "2", "--no-views", "--border", "2", "-o",
         desk.file("q")});
    run({"bench", scene, "--frames", "1", "--lens-points", "2"});
    run({"refine", scene, "--iterations", "2", "--no-table", "-o", desk.file("refined")});
    run({"refine", scene, "--iterations", "2", "--no-table", "-o", desk.file("more"), "--start",
         desk.file("refined/report.json")});
    CHECK(bytes_of(desk.file("more/refined_520nm.npy")) !=
          bytes_of(desk.file("refined/refined_520nm.npy")));
    check_refused(desk.run({"refine", scene, "--set", three, "--no-table", "-o", desk.file("x"),
                            "--start", desk.file("refined/report.json")}),
                  2, "the scene of 3");
    run({"animate", scene, "-o", desk.file("moves"), "--set", "animation.frames=2", "--set",
         "animation.track=[{of = \"light.0.intensity\", at = [0, 1], values = [1, 0.5]}]"});
    lasers_in("moves");
    check_refused(desk.run({"render", scene, "--set", set + "]", "--rgb", "-o", desk.file("x")}), 2,
                  "--rgb packs the holograms of three lasers, and the scene has " +
                      std::to_string(lasers.size()));
  }
}

TEST_CASE("bench and trade take the scene of three lasers, and quality one laser of it", "[slow]") {
  Desk desk;
  in_colour(desk);
  const auto scene = desk.file("scene.toml");
  run_quietly(desk, {"bench", scene, "--set", three, "--frames", "1", "--lens-points", "2",
                     "--json", desk.file("bench.json")});
  const auto bench = nlohmann::json::parse(bytes_of(desk.file("bench.json"))).at("rows").at(0);
  CHECK(bench.at("note") == "");
  CHECK(bench.at("scene").at("holograms_per_frame") == 3);
  CHECK(bench.at("quality").at("psnr_db").get<double>() > 5);
  run_quietly(desk, {"trade", scene, "--set", three, "--presets", "--renders", "1", "--border", "2",
                     "--no-views", "--lens-points", "2", "-o", desk.file("trade")});
  const auto trade = nlohmann::json::parse(bytes_of(desk.file("trade/trade.json")));
  CHECK(trade.at("rows").at(0).at("psnr_db").get<double>() > 5);
  CHECK(trade.at("rows").at(0).at("against_points").at("correlation").get<double>() > 0.5);
  desk.succeed({"quality", scene, "--set", three, "--set", "colour.only=450 nm", "--no-views",
                "--lens-points", "2", "-z", "9mm", "-o", desk.file("x"), "--quiet"});
  check_refused(desk.run({"render", scene, "--rgb", "-o", desk.file("x")}), 2, "three lasers");
}

}  // namespace
}  // namespace raywave
