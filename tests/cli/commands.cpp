// SPDX-License-Identifier: Apache-2.0
// reconstruct, plan, devices and selftest as a person runs them.
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/common/npy.hpp"
#include "host/scene/image.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Matchers::ContainsSubstring;
using Json = nlohmann::json;

TEST_CASE(
    "reconstruct shows field.npy and hologram.png at each depth, in any window, from any side") {
  const Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);
  const auto reconstruct = [&](const std::string& what, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"reconstruct", desk.out(what).string(), "-o",
                                       desk.file("views")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return desk.run(arguments);
  };
  const auto picture = [&](const std::string& name) {
    return load_grey(desk.folder() / "views" / name, "");
  };

  const auto both = reconstruct("field.npy", {"-z", "9.5mm", "-z", "10 mm"});
  CHECK(both.code == 0);
  CHECK_SAYS(both.err, "goes on beyond the hologram's size");  // 0.2 mm of 0.192 mm
  CHECK_SAYS(both.out, "reconstruction_9.5mm.png", "reconstruction_10mm.png");
  for (const char* name : {"reconstruction_9.5mm.png", "reconstruction_9.5mm.exr",
                           "reconstruction_10mm.png", "reconstruction_10mm.exr"}) {
    const auto image = picture(name);
    CHECK(image.width == 48);
    CHECK(image.height == 32);
    CHECK(*std::max_element(image.pixels.begin(), image.pixels.end()) > 0);
  }
  const auto from_field = picture("reconstruction_10mm.exr").pixels;
  const auto quiet = reconstruct("hologram.png", {"-z", "10mm", "--quiet"});
  CHECK(quiet.code == 0);
  CHECK(quiet.out.empty());
  CHECK(picture("reconstruction_10mm.exr").pixels != from_field);  // amplitude is lost

  REQUIRE(reconstruct("field.npy", {"-z", "10mm", "--window", "0.4mmx0.2mm"}).code == 0);
  const auto large = picture("reconstruction_10mm.exr");
  CHECK(large.width == 100);
  CHECK(large.height == 50);
  REQUIRE(reconstruct("field.npy", {"-z", "10mm", "--window", "0.2mm,0.4mm"}).code == 0);
  CHECK(picture("reconstruction_10mm.exr").height == 100);
  REQUIRE(reconstruct("field.npy", {"-z", "10mm", "--view", "0.5,0"}).code == 0);
  CHECK(picture("reconstruction_10mm.exr").pixels != from_field);
}

TEST_CASE("reconstruct says what it takes off, and that it shows the mean of several pictures") {
  const Desk desk;
  const auto notes_of = [&](const std::vector<std::string>& files) {
    std::vector<std::string> words{"reconstruct"};
    for (const auto& file : files) words.push_back(desk.out(file));
    words.insert(words.end(), {"-z", "10mm", "-o", desk.file("seen")});
    return desk.succeed(words).err;
  };
  REQUIRE(desk.render({"--quiet"}).code == 0);
  CHECK(notes_of({"report.json"}).find("taken off") == std::string::npos);
  CHECK(notes_of({"report.json"}).find("beside") == std::string::npos);
  const auto aside = [&](const std::string& centre) {
    return desk.run({"reconstruct", desk.out("report.json"), "-z", "10mm", "--window",
                     "0.2mmx0.2mm", "--centre", centre, "-o", desk.file("seen")});
  };
  CHECK_SAYS(aside("0mm,3mm").err, "objects lie beside these pictures", "--centre=0mm,0mm");
  CHECK(aside("0mm,3").code == 2);
  for (const auto* name : {"frame_00000.png", "frame_00001.png"})
    std::filesystem::copy_file(desk.out("hologram.png"), desk.out(name));
  CHECK(notes_of({"frame_00000.png"}).find("mean") == std::string::npos);
  CHECK_SAYS(notes_of({"frame_00000.png", "frame_00001.png"}), "the mean of these 2 holograms");
  REQUIRE(desk.render({"--quiet", "--set", "slm.shift=[0, \"50 um\"]", "--set",
                       "slm.shift_distance=10 mm"})
              .code == 0);
  CHECK_SAYS(notes_of({"report.json"}), "slm.shift is taken off",
             "(0 m, 50 um) from there at 10 mm");
  CHECK(notes_of({"field.npy"}).find("taken off") == std::string::npos);
}

TEST_CASE("reconstruct at 0 shows the field's own intensity, and says that phases have none") {
  const Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);
  const auto reconstruct = [&](const std::string& what) {
    return desk.run({"reconstruct", desk.out(what).string(), "-z", "0mm", "--frame", "hologram",
                     "-o", desk.file("views")});
  };
  REQUIRE(reconstruct("field.npy").code == 0);
  const auto shown = load_grey(desk.folder() / "views" / "reconstruction_0mm.exr", "");
  const auto field = load_npy(desk.out("field.npy"));
  REQUIRE(shown.pixels.size() == field.samples.size());
  double error = 0, all = 0;
  for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
    const double intensity = std::norm(std::complex<double>(field.samples[i]));
    error += std::pow(double{shown.pixels[i]} - intensity, 2);
    all += intensity * intensity;
  }
  CHECK(std::sqrt(error / all) < 1e-4);
  const auto phases = reconstruct("hologram.png");
  CHECK(phases.code == 0);
  CHECK_SAYS(phases.err, "reconstruction_0mm is evenly bright: light of phases alone");
}

TEST_CASE(
    "reconstruct takes an eyepiece that no report tells, and depths by the thin-lens formula") {
  const Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);
  const auto field = desk.out("field.npy").string();
  for (const auto& [eyepiece, distance_m] : {std::pair("120mm", 0.12), {"120mm,10cm", 0.1}}) {
    const auto seen = desk.succeed({"reconstruct", field, "-z", "-1D", "--eyepiece", eyepiece, "-o",
                                    desk.file("views"), "--json"});
    // 1 / (z + distance) = 1 / focal length + dioptres
    CHECK(Json::parse(seen.out).at("pictures").at(0).at("z_m").get<double>() ==
          Catch::Approx(1 / (1 / 0.12 - 1) - distance_m));
    CHECK(std::filesystem::exists(desk.file("views/reconstruction_-1D.exr")));
  }
}

TEST_CASE("--pupil looks through pupils, each in a picture of its own, and behind an eyepiece") {
  const Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);
  const auto pictures = [&](const std::vector<std::string>& more) {
    const auto told = desk.succeed({"reconstruct", desk.out("field.npy").string(), "-z", "10mm",
                                    "-o", desk.file("views"), "--json"},
                                   more);
    return Json::parse(told.out).at("pictures");
  };
  CHECK_FALSE(pictures({}).at(0).contains("pupil"));
  CHECK_FALSE(pictures({"--eyepiece", "50mm", "--pupil", "none"}).at(0).contains("pupil"));
  CHECK_FALSE(pictures({"--eyepiece", "50mm", "--view", "0.5,0"}).at(0).contains("pupil"));
  CHECK(pictures({"--eyepiece", "50mm"}).at(0).at("pupil").at("diameter_m") == 4e-3);
  const auto two = pictures({"--pupil", "3mm@1mm,0", "--pupil", "scene"});
  REQUIRE(two.size() == 2);
  // Pictures are seen by the viewer, who has -x at the right
  CHECK(two.at(0).at("pupil").at("position_m").at(0) == -1e-3);
  CHECK(two.at(1).at("pupil").at("position_m").at(0) == 0.0);
  CHECK(two.at(0).at("white") != two.at(1).at("white"));
  for (const char* white : {"1e-9", "1e9"}) {
    for (const auto& one :
         pictures({"--pupil", "3mm@1mm,0", "--pupil", "scene", "--white", white})) {
      CHECK(one.at("white") == std::stod(white));
      const auto codes = load_levels(one.at("png").get<std::string>(), "").pixels;
      CHECK(std::ranges::max(codes) == (std::stod(white) < 1 ? 1 : 0));
    }
  }
  CHECK(std::filesystem::exists(desk.file("views/reconstruction_10mm_eye2.exr")));
  for (const auto& [pupil, says] : {std::pair("3", "a unit is needed, as in 3mm"),
                                    {"3mm@1mm", "two parts"},
                                    {"0mm", "must be > 0"}})
    check_refused(desk.run({"reconstruct", desk.out("field.npy").string(), "-z", "10mm", "--pupil",
                            pupil, "-o", desk.file("views")}),
                  2, says);
}

TEST_CASE("a texture that is no picture is named, with what would be read") {
  Desk desk;
  desk.folder().write("notes.md", "# No picture\n");
  desk.scene("material = \"a\"\n[materials.a]\ntexture = \"notes.md\"\n");
  check_refused(desk.render(), 2, "notes.md\": is no picture of a known format, such as PNG");
  desk.folder().write("notes.png", "# No picture\n");
  desk.scene("material = \"a\"\n[materials.a]\ntexture = \"notes.png\"\n");
  check_refused(desk.render(), 2, "notes.png\": ");
}

TEST_CASE("reconstructions that cannot be are refused with one line") {
  const Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);
  const auto refused = [&](const std::string& file, const std::vector<std::string>& more,
                           const std::string& says) {
    std::vector<std::string> arguments{"reconstruct", file, "-o", desk.file("views")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    check_refused(desk.run(arguments), 2, says);
    CHECK_FALSE(std::filesystem::exists(desk.folder() / "views"));
  };
  const auto field = desk.out("field.npy").string();
  refused(field, {"-z", "1D"}, "reconstruct's --eyepiece 120mm");
  refused(field, {"-z", "1D", "--eyepiece", "120"}, "--eyepiece \"120\": a unit is needed");
  refused(field, {"-z", "1D", "--eyepiece", "120mm,-1mm"}, "must be >= 0");
  refused(field, {"-z", "far"}, "-z");
  refused(field, {"-z", "10"}, "a unit is needed, as in 10mm");
  refused(field, {"-z", "10mm", "-z", "1cm"}, "a second picture of 10mm would overwrite the first");
  refused(field, {"-z", "10mm", "--window", ""}, "--window: a value is needed");
  refused(field, {"-z", "10mm", "--pitch", "1e300mm"},
          "--pitch \"1e300mm\": must be 0.1 nm to 1 m");
  refused(field, {"-z", "10mm", "--pitch", "4"}, "a unit is needed, as in 4um");
  refused(field, {"-z", "10mm", "--wavelength", "532"}, "a unit is needed, as in 532nm");
  refused(field, {"-z", "10mm", "--wavelength", "1m"}, "must be 1 nm to 10 mm");
  refused(field, {"-z", "10mm", "--window", "3mm"}, "--window");
  refused(field, {"-z", "10mm", "--window", "5x4"},
          "--window \"5x4\": the width \"5\": a unit is needed, as in 5mm");
  refused(field, {"-z", "10mm", "--window", "5mmx4"},
          "--window \"5mmx4\": the height \"4\": a unit is needed, as in 4mm");
  refused(field, {"-z", "10mm", "--view", "2,0"}, "--view");
  refused(field, {"-z", "10mm", "--view", "nan,0"}, "--view");
  refused(field, {"-z", "10mm", "--percentile", "0"}, "--percentile");
  refused(field, {"-z", "10mm", "--white", "0"}, "--white: must be > 0");
  refused(field, {"-z", "400m"}, "-z 400 m: what the viewer makes out there is a blur of ");
  refused(desk.file("out"), {"-z", "10mm"}, "out\": is a folder; give its report.json, ");
  refused(desk.out("none.npy").string(), {"-z", "10mm"}, "none.npy");
  std::filesystem::copy(field, desk.file("alone.npy"));
  refused(desk.file("alone.npy"), {"-z", "10mm"}, "--pitch");
  desk.folder().write("damaged.npy", bytes_of(field).substr(0, 1000));
  refused(desk.file("damaged.npy"), {"-z", "10mm", "--pitch", "4um", "--wavelength", "638nm"},
          "damaged.npy");
}

TEST_CASE("plan says what would be computed without computing it") {
  const Desk desk;
  const auto text = desk.succeed({"plan", desk.file("scene.toml"), "--set", "wrp.grid=[2, 2]",
                                  "--set", "wrp.propagation=spectrum"});
  CHECK(text.err.empty());
  CHECK_SAYS(text.out, "48 x 32", "2 triangles", "2 x 2");
  CHECK_SAYS(text.out, "precision float (auto), predicted phase error");
  const auto strict = desk.run({"plan", desk.file("scene.toml"), "--set",
                                "accuracy.precision=float", "--set", "accuracy.phase=1e-9"})
                          .out;
  CHECK_SAYS(strict, "precision float, predicted phase error", "NOT below 1e-09");
  const auto json = Json::parse(desk.run({"plan", desk.file("scene.toml"), "--json"}).out);
  CHECK(json["triangles"] == 2);
  CHECK(json["plan"]["wrps"].size() >= 1);
  check_refused(desk.run({"plan", desk.file("none.toml")}), 2, "none.toml");
}

TEST_CASE("render follows the plan of the same goal, and unknown goals are refused") {
  const Desk desk;
  const auto scene = desk.file("scene.toml");
  const auto plan = Json::parse(
      desk.run({"plan", scene, "--preset", "draft", "--json", "--set", "sampling.pitch=auto"}).out);
  REQUIRE(desk.render({"--preset", "draft", "--set", "sampling.pitch=auto", "--quiet"}).code == 0);
  std::ifstream file(desk.out("report.json"));
  const auto report = Json::parse(file);
  for (const char* section : {"wrp", "sampling"})
    CHECK(report["scene"][section] == plan["scene"][section]);
  CHECK(report["plan"] == plan["plan"]);
  check_refused(desk.run({"plan", scene, "--preset", "best"}), 2,
                "there are draft, balanced, accurate and reference");
  check_refused(desk.run({"plan", scene, "--budget", "0 ms"}), 2, "must be a time such as");
  check_refused(desk.run({"plan", scene, "--budget", "1 s", "--psnr", "30"}), 2, "at most 1");
  check_refused(desk.run({"plan", scene, "--rate", "30", "--psnr", "30"}), 2, "at most 1");
  check_refused(desk.run({"plan", scene, "--rate", "nan"}), 2, "--rate must be");
  check_refused(desk.run({"plan", scene, "--psnr", "nan"}), 2,
                "--psnr must be 0 to 200, got \"nan\"");
  check_refused(desk.render({"--preset", "draft", "--method", "points"}), 2,
                "plan --method wrp alone");
}

TEST_CASE("devices lists every device with what it can do, one of them the default") {
  const Desk desk;
  const auto text = desk.succeed({"devices"});
  CHECK(text.err.empty());
  CHECK_SAYS(text.out, "(default)", "fp64", "driver", "FFT");
  const auto list = Json::parse(desk.run({"devices", "--json"}).out);
  REQUIRE(list.size() >= 1);
  CHECK(std::count_if(list.begin(), list.end(),
                      [](const Json& d) { return d["default"].get<bool>(); }) == 1);
  const auto one =
      Json::parse(desk.run({"devices", "--device", list.back()["index"], "--json"}).out);
  REQUIRE(one.size() == 1);
  CHECK(one[0] == list.back());
  check_refused(desk.run({"devices", "--device", "no such"}), 3, "no such device");
}

TEST_CASE("selftest says by its exit code whether every row passed, and writes the table as JSON") {
  const Desk desk;
  const auto good = desk.run({"selftest", "--only", "phase ", "--json", desk.file("table.json")});
  INFO(good.out << good.err);
  CHECK(good.code == 0);
  CHECK(good.err.empty());
  CHECK_THAT(good.out, ContainsSubstring("driver") && ContainsSubstring("pass  phase") &&
                           !ContainsSubstring("FAIL"));
  const auto table = Json::parse(bytes_of(desk.file("table.json")));
  CHECK(table["passed"] == true);
  CHECK(table["rows"].size() >= 1);

  const auto bad = desk.run(
      {"selftest", "--only", "phase ", "--strict", "1000", "--json", desk.file("table.json")});
  CHECK(bad.code == 1);
  CHECK(bad.err.empty());
  CHECK_SAYS(bad.out, "FAIL  phase");
  CHECK(Json::parse(bytes_of(desk.file("table.json")))["passed"] == false);

  check_refused(desk.run({"selftest", "--only", "no such row"}), 2, "no such row");
  check_refused(desk.run({"selftest", "--strict", "0"}), 2, "--strict");
  check_refused(desk.run({"selftest", "--device", "no such device"}), 3, "no such device");
}

}  // namespace
}  // namespace raywave
