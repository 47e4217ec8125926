// SPDX-License-Identifier: Apache-2.0
// The commands that make pictures for SLMs and look at them, as a person runs them.
#include <nlohmann/json.hpp>

#include "host/scene/image.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using Catch::Approx;
using Json = nlohmann::json;
using namespace test;

const std::string slm_text = R"([slm]
encoding = "double-phase"
levels_per_turn = 254
invert = true
carrier = [0.05, -0.1]
flip = "x"
rotate = 90
stop = 0.5
)";

TEST_CASE("encode makes of a render's field the pictures that the render made, bit by bit") {
  for (const auto& more : {std::string(), slm_text,
                           std::string("[slm]\nencoding = \"phase\"\nlevels = 4\nlens = \"1 m\"\n"),
                           std::string("[slm]\nband = [0.6, 0.8]\nclip = 0.8\n")}) {
    INFO(more);
    Desk desk;
    desk.scene(more);
    REQUIRE(desk.render({"--set", "sampling.frames=2", "--quiet"}).code == 0);
    // Beside the field, report.json describes the SLM.
    const auto again =
        desk.run({"encode", desk.out("field.npy").string(), "-o", desk.file("again"), "--quiet"});
    INFO(again.err);
    REQUIRE(again.code == 0);
    CHECK(again.out.empty());
    for (const char* name : {"hologram.png", "hologram_2.png"})
      CHECK(bytes_of(desk.folder() / "again" / name) == bytes_of(desk.out(name)));
    // Of one laser, report.json stands for the field beside it.
    const auto by_report =
        desk.run({"encode", desk.out("report.json").string(), "-o", desk.file("by_report")});
    INFO(by_report.err);
    CHECK(by_report.code == 0);
    CHECK_SAYS(by_report.out, "48 x 32 pixels, 2 frames, by ");
    CHECK(bytes_of(desk.folder() / "by_report" / "hologram_2.png") ==
          bytes_of(desk.out("hologram_2.png")));
    if (more != slm_text) continue;
    // Extensions are the same in capitals.
    std::filesystem::copy(desk.out("field.npy"), desk.out("FIELD.NPY"));
    desk.succeed({"encode", desk.out("FIELD.NPY").string(), "-o", desk.file("capitals")});
    CHECK(bytes_of(desk.folder() / "capitals" / "hologram.png") ==
          bytes_of(desk.out("hologram.png")));
    // So does a file of its own.
    desk.folder().write("bench.toml", slm_text);
    desk.succeed({"encode", desk.out("field.npy").string(), "--slm", desk.file("bench.toml"), "-o",
                  desk.file("by_file")});
    CHECK(bytes_of(desk.folder() / "by_file" / "hologram.png") ==
          bytes_of(desk.out("hologram.png")));
    desk.succeed({"encode", desk.out("field.npy").string(), "--slm", desk.file("bench.toml"),
                  "--set", "slm.invert=false", "-o", desk.file("changed")});
    CHECK(bytes_of(desk.folder() / "changed" / "hologram.png") !=
          bytes_of(desk.out("hologram.png")));
  }
}

TEST_CASE("encode for another SLM keeps the encoding that the render chose, and the viewer") {
  const Desk desk;
  desk.folder().write("bench.toml", "[slm]\ninvert = true\n");
  for (const std::string encoding : {"phase", "double-phase"}) {
    const auto rendered =
        desk.run({"render", desk.file("scene.toml"), "--set", "slm.encoding=" + encoding, "--set",
                  "viewer.eyepiece=50 mm", "-o", desk.file(encoding), "--quiet"});
    INFO(rendered.err);
    REQUIRE(rendered.code == 0);
    const auto encoded =
        desk.succeed({"encode", desk.file(encoding + "/report.json"), "--slm",
                      desk.file("bench.toml"), "-o", desk.file(encoding + "_again")});
    CHECK_SAYS(encoded.out, "1 frame, by " + encoding + "\n");
    const auto report = Json::parse(bytes_of(desk.file(encoding + "_again/report.json")));
    CHECK(report["scene"]["slm"]["invert"] == true);
    CHECK(report["scene"]["viewer"]["eyepiece_m"] == 0.05);
    desk.succeed({"reconstruct", desk.file(encoding + "_again/report.json"), "-z", "2D", "-o",
                  desk.file("seen"), "--quiet"});
  }
}

TEST_CASE("a picture beyond the hologram's size, or where nothing of the scene lies, is said to") {
  const Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);  // 0.2 mm of 0.192 mm x 0.128 mm
  const auto told = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{
        "reconstruct", desk.out("report.json").string(), "-z", "10mm", "-o", desk.file("seen")};
    words.insert(words.end(), more.begin(), more.end());
    return desk.run(words).err;
  };
  const auto said = [&](const std::vector<std::string>& more) {
    return told(more).find("goes on beyond the hologram's size") != std::string::npos;
  };
  CHECK_SAYS(told({}), "--window 0.3mmx0.3mm shows all of the scene");
  CHECK_SAYS(told({"-z", "30mm"}),
             "nothing of the scene is sharp at 30 mm: it lies 10 mm to 10 mm");
  CHECK(told({"-z", "10.5mm"}).find("is sharp at") == std::string::npos);
  // Without -z the scene's middle is shown
  const auto look = [&](const std::string& file) {
    return desk.run({"reconstruct", file, "-o", desk.file("seen")});
  };
  CHECK_SAYS(look(desk.out("report.json").string()).out, "reconstruction_10mm.png");
  desk.folder().write("alone.png", bytes_of(desk.out("hologram.png")));
  check_refused(look(desk.file("alone.png")), 2, "-z is required");
  CHECK_FALSE(said({"--window", "0.1mmx0.1mm"}));
  REQUIRE(desk.render({"--quiet", "--set", "object.0.width=40 um"}).code == 0);
  CHECK_FALSE(said({}));
}

TEST_CASE("reconstruct shows of report.json the mean of its frames, one by one, in any format") {
  Desk desk;
  desk.scene(slm_text);
  REQUIRE(desk.render({"--set", "sampling.frames=3", "--quiet"}).code == 0);
  const auto seen = [&](const std::vector<std::string>& holograms, const std::string& folder) {
    desk.succeed({"reconstruct", "-z", "10mm", "-o", desk.file(folder), "--quiet"}, holograms);
    return load_grey(desk.folder() / folder / "reconstruction_10mm.exr", "").pixels;
  };
  const auto all = seen({desk.out("report.json").string()}, "all");
  std::vector<double> mean(all.size());
  for (const char* name : {"hologram.png", "hologram_2.png", "hologram_3.png"}) {
    const auto one = seen({desk.out(name).string()}, "one");
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += one[i] / 3.0;
  }
  const double peak = *std::max_element(mean.begin(), mean.end());
  for (std::size_t i = 0; i < mean.size(); ++i)
    CHECK(all[i] == Approx(mean[i]).margin(1e-5 * peak));
  CHECK(seen({desk.out("hologram.png").string(), desk.out("hologram_2.png").string(),
              desk.out("hologram_3.png").string()},
             "named") == all);

  for (const char* format : {"png16", "bmp", "tiff"}) {
    INFO(format);
    const auto folder = desk.file(format);
    desk.succeed({"encode", desk.out("field.npy").string(), "--format", format, "-o", folder});
    CHECK(seen({folder + "/report.json"}, std::string(format) + "_seen") == all);
  }
  for (const char* format : {"npy", "exr"}) {
    const auto folder = desk.file(format);
    desk.succeed({"encode", desk.out("field.npy").string(), "--format", format, "-o", folder});
    check_refused(
        desk.run({"reconstruct", folder + "/report.json", "-z", "10mm", "-o", desk.file("none")}),
        2, "which is not read again; encode with --format png");
  }
  // Beside MATLAB's matrix, the configuration of the program that reads it
  const auto mat = desk.run(
      {"encode", desk.out("field.npy").string(), "--format", "mat", "-o", desk.file("mat")});
  if (mat.code == 0) {
    CHECK_SAYS(mat.out, "hologram_3.mat", "_nrsh.txt");
    CHECK_SAYS(bytes_of(desk.folder() / "mat" / "hologram_nrsh.txt"),
               "wlen            : 6.38e-07\npixel_pitch     : ");
  } else {
    check_refused(mat, 2, "built without libmatio");
  }
  check_refused(desk.run({"encode", desk.out("field.npy").string(), "--format", "rgb-24x1", "-o",
                          desk.file("none")}),
                2, "give slm.levels = 2");
  check_refused(desk.run({"encode", desk.out("field.npy").string(), "--format", "jpeg", "-o",
                          desk.file("none")}),
                2, "--format jpeg: unknown");
  check_refused(desk.run({"encode", desk.out("hologram.png").string(), "-o", desk.file("none")}), 2,
                "encode takes the complex field");
  CHECK_FALSE(std::filesystem::exists(desk.folder() / "none"));
}

TEST_CASE("mistakes in [slm] get one line and exit code 2 from every command that reads it") {
  Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);
  std::filesystem::rename(desk.out(""), desk.folder() / "good");
  const auto field = desk.file("good/field.npy");
  save_picture(desk.folder() / "flat.png", 2, 2, std::vector<std::uint8_t>(4));
  std::string turns_back;
  for (int i = 0; i < 256; ++i) turns_back += std::to_string(i % 128) + "\n";
  desk.folder().write("lut.txt", turns_back);
  const auto refused = [&](const std::string& keys, const std::string& says) {
    INFO(keys);
    const auto slm = "[slm]\n" + keys + "\n";
    desk.folder().write("bench.toml", slm);
    check_refused(
        desk.run({"encode", field, "--slm", desk.file("bench.toml"), "-o", desk.file("out")}), 2,
        says);
    check_refused(desk.run({"pattern", "lens", "--slm", desk.file("bench.toml"), "--size", "64x64",
                            "--pitch", "4um", "--wavelength", "638nm", "-o", desk.file("out")}),
                  2, says);
    desk.scene(slm);
    check_refused(desk.render(), 2, says);
    check_refused(desk.run({"plan", desk.file("scene.toml")}), 2, says);
    desk.scene("");
    CHECK_FALSE(desk.has_output());
  };
  refused("encoding = \"kinoform\"", "encoding must be \"phase\" or \"double-phase\"");
  refused("lut = \"lut.txt\"", "lut must rise or fall from level to level; level 128 shows 0");
  refused("flatness = \"flat.png\"", "flatness: the picture is 2 x 2, the SLM ");
  refused("carrier = [0.7, 0]", "carrier[0] must be -0.5 to 0.5");
  refused("shift = [\"90 mm\", 0]", "slm.shift: 90 mm, 0 m at 100 mm needs a carrier of ");
  desk.scene("[slm]\nstop = 0.05\nstop_centre = [0.4, 0]\n");
  for (const auto& outcome : {desk.render(), desk.run({"plan", desk.file("scene.toml")})})
    check_refused(outcome, 2, "slm.stop passes none of the scene's light");
}

TEST_CASE("of LUTs by wavelength, every command takes the one of its hologram's wavelength") {
  Desk desk;
  const auto lut = [](double step) {
    std::string text;
    for (int i = 0; i < 256; ++i) text += std::to_string(i * step) + "\n";
    return text;
  };
  desk.folder().write("red.txt", lut(1 / 250.0));
  desk.folder().write("green.txt", lut(1 / 300.0));
  const std::string both =
      "[slm]\nencoding = \"phase\"\n"
      "lut = { \"638 nm\" = \"red.txt\", \"532 nm\" = \"green.txt\" }\n";
  desk.folder().write("bench.toml", both);
  desk.scene(both);
  REQUIRE(desk.render({"--set", "hologram.wavelength=\"532 nm\"", "--quiet"}).code == 0);
  // report.json keeps the LUT that was taken, and no other.
  const auto last_of = [&](const std::filesystem::path& report) {
    const auto json = Json::parse(bytes_of(report));
    REQUIRE(json["scene"]["slm"]["lut"].size() == 256);
    return json["scene"]["slm"]["lut"][255].get<double>();
  };
  CHECK(last_of(desk.out("report.json")) == Approx(255 / 300.0));
  // encode knows the wavelength by --wavelength, else by report.json beside the field.
  const auto encoded = [&](std::vector<std::string> more) {
    std::vector<std::string> line{"encode", desk.out("field.npy").string(), "-o",
                                  desk.file("encoded"), "--quiet"};
    line.insert(line.end(), more.begin(), more.end());
    return desk.run(line);
  };
  const auto picture = [&] { return bytes_of(desk.folder() / "encoded" / "hologram.png"); };
  REQUIRE(encoded({"--slm", desk.file("bench.toml")}).code == 0);
  CHECK(picture() == bytes_of(desk.out("hologram.png")));
  REQUIRE(encoded({"--slm", desk.file("bench.toml"), "--wavelength", "638nm"}).code == 0);
  CHECK(last_of(desk.folder() / "encoded" / "report.json") == Approx(255 / 250.0));
  CHECK(picture() != bytes_of(desk.out("hologram.png")));
  const auto missing =
      "bench.toml:3: slm: lut has \"532 nm\", \"638 nm\", none within 1 nm of 450 nm; add one "
      "of \"450 nm\"";
  check_refused(encoded({"--slm", desk.file("bench.toml"), "--wavelength", "450nm"}), 2, missing);
  const auto pattern = [&](const std::string& wavelength) {
    return desk.run({"pattern", "ramp", "--slm", desk.file("bench.toml"), "--size", "64x64",
                     "--pitch", "4um", "--wavelength", wavelength, "-o", desk.file("pattern")});
  };
  REQUIRE(pattern("638.5nm").code == 0);
  CHECK(last_of(desk.folder() / "pattern" / "report.json") == Approx(255 / 250.0));
  check_refused(pattern("450nm"), 2, missing);
}

TEST_CASE("a hologram of 10 bits is encoded, described by its report and seen again") {
  Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);
  desk.folder().write("wide.toml", "[slm]\nbits = 10\nencoding = \"phase\"\n");
  desk.folder().write("bench.toml", "[slm]\nencoding = \"phase\"\n");
  const auto encoded = [&](const std::string& slm, const std::string& format) {
    return desk.run({"encode", desk.out("field.npy").string(), "--slm", desk.file(slm), "--format",
                     format, "-o", desk.file(format)});
  };
  const auto seen = [&](const std::string& folder) {
    desk.succeed({"reconstruct", desk.file(folder + "/report.json"), "-z", "10mm", "-o",
                  desk.file("seen"), "--quiet"});
    return load_grey(desk.folder() / "seen" / "reconstruction_10mm.exr", "").pixels;
  };
  REQUIRE(encoded("wide.toml", "png16").code == 0);
  REQUIRE(encoded("bench.toml", "png").code == 0);
  CHECK(Json::parse(bytes_of(desk.folder() / "png16" / "report.json"))["scene"]["slm"]["bits"] ==
        10);
  const auto wide = seen("png16"), narrow = seen("png");
  CHECK(wide != narrow);
  // Levels a quarter as far apart change the picture by little.
  double apart = 0, all = 0;
  for (std::size_t i = 0; i < wide.size(); ++i) {
    apart += std::pow(wide[i] - narrow[i], 2);
    all += std::pow(narrow[i], 2);
  }
  CHECK(apart < 1e-3 * all);
  REQUIRE(encoded("wide.toml", "red-blue").code == 0);
  check_refused(encoded("wide.toml", "png"), 2, "give --format png16, npy or red-blue");
  check_refused(encoded("bench.toml", "red-blue"), 2, "give slm.bits = 10");
  desk.succeed({"pattern", "ramp", "--slm", desk.file("wide.toml"), "--size", "64x64", "--pitch",
                "4um", "--wavelength", "532nm", "-o", desk.file("pattern")});
  // refine works with 8 bits, and says so before it computes, whoever asks for 10.
  const auto refined = [&](const std::string& field, const std::vector<std::string>& more) {
    std::vector<std::string> line{"refine",           field, "--targets",
                                  desk.folder() / "", "-o",  desk.file("refined")};
    line.insert(line.end(), more.begin(), more.end());
    return desk.run(line);
  };
  const auto refusal = "slm.bits is 10: this takes levels of 8 bits";
  check_refused(refined(desk.out("field.npy"), {"--slm", desk.file("wide.toml")}), 2, refusal);
  std::filesystem::copy(desk.out("field.npy"), desk.folder() / "field.npy");
  std::filesystem::copy(desk.folder() / "png16" / "report.json", desk.folder() / "report.json");
  check_refused(refined(desk.file("field.npy"), {}), 2, refusal);
  desk.scene("[slm]\nbits = 10\n");
  for (const auto& outcome : {desk.render(), desk.run({"plan", desk.file("scene.toml")})})
    check_refused(outcome, 2, "slm: bits must be 8 in a scene");
}

TEST_CASE("plan states what the stop passes and where the undiffracted light falls") {
  Desk desk;
  desk.scene("[slm]\nstop = 0.02\ncarrier = [0.2, 0]\n");
  const auto text = desk.succeed({"plan", desk.file("scene.toml")});
  CHECK_SAYS(text.out, "SLM       double-phase, its stop passes ", ", stopped",
             "cut off by slm.stop");
  const auto json =
      Json::parse(desk.run({"plan", desk.file("scene.toml"), "--json"}).out)["prediction"];
  const auto& light = json["slm_light"];
  CHECK(light["through_stop"].get<double>() < 0.99);
  CHECK(light["zero_order"]["stopped"] == true);
  // 10 mm times the tangent of the angle of 0.2 cycles per 4 um
  const double sine = 0.2 * 638e-9 / 4e-6;
  CHECK(light["zero_order"]["centre_m"][0].get<double>() ==
        Approx(10e-3 * sine / std::sqrt(1 - sine * sine)));
}

TEST_CASE("patterns are written with a report, and what they show is said") {
  Desk desk;
  desk.folder().write("bench.toml", slm_text);
  const auto pattern = [&](std::vector<std::string> more) {
    more.insert(more.begin(), "pattern");
    for (const char* word : {"--size", "96x64", "--pitch", "4um", "--wavelength", "532nm"})
      more.emplace_back(word);
    more.insert(more.end(), {"-o", desk.file("patterns")});
    return desk.run(more);
  };
  const auto lens = pattern({"lens", "--focal", "20mm"});
  INFO(lens.err);
  CHECK(lens.code == 0);
  CHECK_SAYS(lens.out, "lens shows a spot 20 mm after the SLM", "pattern_lens.png");
  const auto blaze = pattern({"blaze", "--to", "up", "--slm", desk.file("bench.toml"), "--json"});
  CHECK(blaze.code == 0);
  const auto json = Json::parse(blaze.out);
  CHECK(json["pattern"]["name"] == "blaze");
  CHECK(json["pattern"]["slope"].get<double>() == Approx(532e-9 / 64e-6).epsilon(1e-4));
  CHECK(json["scene"]["slm"]["encoding"] == "phase");
  CHECK(json["scene"]["slm"]["invert"] == true);
  const auto picture = load_levels(desk.folder() / "patterns" / "pattern_blaze.png", "");
  CHECK(picture.width == 64);  // turned
  CHECK(picture.height == 96);
  for (const char* name : {"checker", "ramp"}) CHECK(pattern({name}).code == 0);
  for (const char* name :
       {"pattern_lens.png", "pattern_checker.png", "pattern_ramp.png", "report.json"})
    CHECK(std::filesystem::exists(desk.folder() / "patterns" / name));
  // A diverging lens seems to shine from before the SLM: reconstruct looks there.
  REQUIRE(pattern({"lens", "--focal", "-20mm"}).code == 0);
  desk.succeed(
      {"reconstruct", desk.file("patterns/report.json"), "-z", "20mm", "-o", desk.file("seen")});
  const auto seen = load_grey(desk.folder() / "seen" / "reconstruction_20mm.exr", "");
  const auto brightest =
      std::max_element(seen.pixels.begin(), seen.pixels.end()) - seen.pixels.begin();
  CHECK(std::abs(static_cast<int>(brightest % 96) - 48) <= 1);
  CHECK(std::abs(static_cast<int>(brightest / 96) - 32) <= 1);

  check_refused(pattern({"grid"}), 2, "there are lens, blaze, checker and ramp");
  check_refused(pattern({"lens", "--focal", "1mm"}), 2, "too strong a lens");
  check_refused(pattern({"blaze", "--period", "1"}), 2, "period 1: ");
  check_refused(pattern({"blaze", "--to", "east"}), 2, "there are right, left, up and down");
  check_refused(pattern({"blaze", "--set", "slm.invert=true"}), 2, "--slm, which is not given");
  check_refused(desk.run({"pattern", "lens", "--size", "64", "--pitch", "4um", "--wavelength",
                          "532nm", "-o", desk.file("none")}),
                2, "--size \"64\": two values with 'x' between them");
}

TEST_CASE("compare takes pictures as intensities, amplitudes or as a screen shows them") {
  const Desk desk;
  std::vector<float> a(64), b(64);
  for (std::size_t i = 0; i < 64; ++i) {
    a[i] = static_cast<float>(i * i) / 4096;
    b[i] = static_cast<float>(i * i) / 2048 + 0.01f;
  }
  save_picture(desk.folder() / "a.exr", 8, 8, a);
  save_picture(desk.folder() / "b.exr", 8, 8, b);
  const auto psnr = [&](const std::vector<std::string>& more) {
    std::vector<std::string> line{"compare", desk.file("a.exr"), desk.file("b.exr"), "--json"};
    line.insert(line.end(), more.begin(), more.end());
    const auto json = Json::parse(desk.run(line).out);
    if (!more.empty()) CHECK(json["domain"] == more.back());
    return json["psnr_db"].get<double>();
  };
  CHECK(psnr({}) == psnr({"--domain", "intensity"}));
  CHECK(psnr({"--domain", "amplitude"}) < psnr({}) - 3);
  CHECK(psnr({"--domain", "srgb"}) < psnr({}) - 3);
  check_refused(desk.run({"compare", desk.file("a.exr"), desk.file("b.exr"), "--domain", "log"}), 2,
                "there are intensity, amplitude and srgb");
}

}  // namespace
}  // namespace raywave
