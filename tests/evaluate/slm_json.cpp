// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "host/evaluate/report.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"

namespace raywave {
namespace {

using Json = nlohmann::json;

std::filesystem::path report_of(const Folder& folder, const SlmSpec& slm) {
  Json report;
  report["scene"]["slm"] = json_of(slm);
  return folder.write("report.json", report.dump());
}

TEST_CASE("an SLM comes back from its report as it was, whatever it is") {
  const Folder folder;
  save_picture(folder / "flat.png", 2, 1, std::vector<std::uint8_t>{10, 20});
  SlmSpec slm{.clip = 0.75,
              .band = {0.5, 0.25},
              .levels = 16,
              .levels_per_turn = 254,
              .offset_turns = 1.0 / 3};
  for (int i = 0; i < 256; ++i) slm.lut.values.push_back(i / 254.0);
  slm.flatness.file = folder / "flat.png";
  slm.flatness.picture = load_levels(slm.flatness.file, "");
  slm.flatness.centre = true;
  slm.zernike = {{4, 0.1}, {11, -1.0 / 7}};
  slm.carrier = {0.1, -1.0 / 3};
  slm.shift_distance_m = 0.3;
  slm.lens_m = -0.25;
  slm.stop = StopSpec{{0.3, 0.4}, {0.01, -0.02}};
  slm.fill = {0.9, 0.8};
  slm.undiffracted = 0.02;
  slm.crosstalk = {0, {3, 1}, {0.25, 0.5, 0.25}};
  slm.illumination.profile.diameter_m = {6e-3, 4e-3};
  slm.illumination.source_size_rad = 0.3e-3;
  slm.illumination.bandwidth_m = 2e-9;
  // Each report that names a flatness picture has it read again, by another process.
  const auto flatness = std::exchange(slm.flatness, {});
  for (const auto encoding : {Encoding::phase, Encoding::double_phase, Encoding::off_axis,
                              Encoding::burckhardt, Encoding::lee}) {
    for (const int rotate : {0, 90, 180, 270}) {
      for (const bool flip_x : {false, true}) {
        for (const bool flip_y : {false, true}) {
          slm.encoding = encoding;
          slm.rotate_deg = rotate;
          slm.flip_x = flip_x;
          slm.flip_y = flip_y;
          const auto back = slm_of_report(report_of(folder, slm));
          CHECK(back.encoding == encoding);
          CHECK(back.rotate_deg == rotate);
          CHECK(back.flip_x == flip_x);
          CHECK(back.flip_y == flip_y);
        }
      }
    }
  }
  slm.flatness = flatness;
  const auto back = slm_of_report(report_of(folder, slm));
  CHECK(back.clip == slm.clip);
  CHECK(back.band == slm.band);
  CHECK(back.levels == slm.levels);
  CHECK(back.levels_per_turn == slm.levels_per_turn);
  CHECK(back.offset_turns == slm.offset_turns);
  CHECK(back.lut == slm.lut);
  CHECK(back.flatness.file == slm.flatness.file);
  CHECK(back.flatness.picture.pixels == slm.flatness.picture.pixels);
  CHECK_FALSE(back.flatness.in_nm);
  CHECK(back.flatness.centre);
  REQUIRE(back.zernike.size() == 2);
  CHECK(back.zernike[1].noll == 11);
  CHECK(back.zernike[1].turns == slm.zernike[1].turns);
  CHECK(back.carrier == slm.carrier);
  CHECK(back.shift_distance_m == slm.shift_distance_m);
  CHECK(back.lens_m == slm.lens_m);
  CHECK(back.stop.value().size == slm.stop->size);
  CHECK(back.stop.value().centre == slm.stop->centre);
  CHECK(back.fill == slm.fill);
  CHECK(back.undiffracted == slm.undiffracted);
  CHECK(back.crosstalk.weights == slm.crosstalk.weights);
  CHECK(back.illumination == slm.illumination);
  // And every other key that there may be
  CHECK(json_of(back) == json_of(slm));
  CHECK(json_of(slm_of_report(report_of(folder, SlmSpec{}))) == json_of(SlmSpec{}));
  slm.bits = 10;
  slm.levels = 1024;
  // What is not beside the LUT and the carrier
  slm.encoding = Encoding::phase;
  slm.lut = {{3, 7, 200}, {0, 0.4, 0.9}, {1, 0.5, 0.75}};
  CHECK(slm_of_report(report_of(folder, slm)).lut == slm.lut);
  slm.crosstalk = {.sigma_m = 1e-6};
  slm.illumination.profile = {};
  slm.illumination.profile.file = folder / "flat.png";
  slm.illumination.profile.picture = std::make_shared<Image>(load_grey(folder / "flat.png", ""));
  CHECK(slm_of_report(report_of(folder, slm)).illumination.profile.picture->pixels ==
        slm.illumination.profile.picture->pixels);
  slm.lut = {};
  slm.invert = true;
  slm.carrier = {0, 0};
  slm.shift_m = {1e-3, -2e-3};
  CHECK(json_of(slm_of_report(report_of(folder, slm))) == json_of(slm));
}

TEST_CASE("a report names its flatness picture so that it is found from any folder") {
  SlmSpec slm;
  slm.flatness.file = "flat.png";
  slm.flatness.picture = {1, 1, {0}};
  const auto file = json_of(slm)["flatness"]["file"].get<std::string>();
  CHECK(std::filesystem::path(file) == std::filesystem::current_path() / "flat.png");
}

TEST_CASE("a damaged report is refused with one line") {
  const Folder folder;
  const auto refusal = [&](const std::string& text) {
    return input_error_of([&] { slm_of_report(folder.write("report.json", text)); });
  };
  Json good;
  good["scene"]["slm"] = json_of(SlmSpec{});
  const auto with = [&](const char* key, const Json& value) {
    auto report = good;
    report["scene"]["slm"][key] = value;
    return refusal(report.dump());
  };
  CHECK(with("levels", 16).empty());
  for (const auto& [key, value] : {std::pair<const char*, Json>{"levels", 0},
                                   {"levels", 300},
                                   {"bits", 9},
                                   {"bits", 64},
                                   {"levels_per_turn", 1},
                                   {"rotate_deg", 45},
                                   {"lut", Json::array({1})},
                                   {"clip", "much"},
                                   {"carrier", 3},
                                   {"encoding", "kinoform"},
                                   {"stop", Json::array()}}) {
    INFO(key << " " << value);
    const auto said = with(key, value);
    CHECK_SAYS(said, "report.json: ");
    CHECK(said.find('\n') == std::string::npos);
  }
  CHECK_SAYS(refusal("{"), "not a report of raywave: parse error at line 1");
  CHECK_REFUSED(slm_of_report(folder / "none.json"), "none.json: not found");
}

}  // namespace
}  // namespace raywave
