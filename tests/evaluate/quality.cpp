// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/quality.hpp"

#include <nlohmann/json.hpp>

#include "host/forecast/presets.hpp"
#include "host/planning/make_plan.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

constexpr double um = 1e-6, mm = 1e-3;
constexpr int border = 6;

/// The study's scene made six times smaller: 64 x 64 pixels see the same angles.
Scene small_study(const std::string& sphere_x = "0",
                  const std::string& more = "sampling.frames=16") {
  return load_scene(
      std::filesystem::path(RAYWAVE_DATA_DIR) / "study.toml",
      {"hologram.resolution=[64, 64]", "wrp.distance=2.99 mm", "sampling.pitch=6 um",
       "object.0.width=0.15 mm", "object.0.position=['" + sphere_x + "', 0, '3.175 mm']",
       "object.1.width=0.2 mm", "object.1.position=[0, 0, '3.25 mm']", more});
}

QualitySpec small_spec() {
  QualitySpec what;
  what.blur_m = 15 * um;  // diffraction, which the lens does not know, spreads light over 8 um
  what.border_px = border;
  what.lens_points = 12;
  what.window = PictureWindow::around_axis(glm::dvec2(64 * 3.74 * um));
  return what;
}

QualityResult assessed(const cl::Device& device, const Scene& scene, const QualitySpec& what) {
  return assess(device, {scene}, build_world(scene), {}, what);
}

QualityResult assessed(const cl::Device& device, const Scene& scene, const Rendered& rendered,
                       const QualitySpec& what) {
  LensPictures lens;
  return assess(device, {scene}, build_world(scene), rendered, {}, what, lens);
}

TEST_CASE("pictures through the hologram's plane have the PSNR that is predicted, within 2 dB") {
  for (const char* z : {"0", "0.1 mm"}) {
    const auto scene =
        load_scene(std::filesystem::path(RAYWAVE_DATA_DIR) / "teapot.toml",
                   {"hologram.resolution=[160, 120]", "object.0.width=0.4 mm", "wrp.grid=auto",
                    "object.0.position=[0, 0, '" + std::string(z) + "']", "sampling.pitch=8 um",
                    "viewer.resolution=16 um"});
    const auto predicted =
        plan_scenes({scene}, build_world(scene), {}, {})[0].prediction.pictures.value();
    QualitySpec what;
    what.blur_m = blur_of_resolution * 16 * um;
    what.lens_points = 12;
    what.views = false;
    for (const auto& device : test::all_devices()) {
      const auto result = assessed(device, scene, what);
      REQUIRE(result.rows.size() == predicted.psnr_db.size());
      for (std::size_t i = 0; i < result.rows.size(); ++i) {
        CAPTURE(z, result.rows[i].z_m);
        CHECK(result.rows[i].figures.luminance.psnr_db ==
              Catch::Approx(predicted.psnr_db[i]).margin(2));
      }
    }
  }
}

DEVICE_TEST(
    "a hologram shows what the lens sees, at every depth and from every side, and a shifted "
    "sphere's does not") {
  const auto good = assessed(device, small_study(), small_spec());
  const auto bad = assessed(device, small_study(),
                            {{render(device, small_study("0.03 mm"))}, {}, {}}, small_spec());
  REQUIRE(good.rows.size() == 7);
  REQUIRE(bad.rows.size() == 7);
  for (std::size_t i = 0; i < good.rows.size(); ++i) {
    const auto &row = good.rows[i], &shifted = bad.rows[i];
    const bool whole = row.view == "whole";  // measured 30.5 to 31.3 dB
    INFO(row.view << " at " << row.z_m / mm << " mm: " << row.figures.luminance.psnr_db
                  << " dB, SSIM " << row.figures.luminance.ssim << "; shifted "
                  << shifted.figures.luminance.psnr_db << " dB, SSIM "
                  << shifted.figures.luminance.ssim);
    CHECK(row.figures.luminance.psnr_db > (whole ? 29 : 24));
    CHECK(row.figures.luminance.psnr_db > shifted.figures.luminance.psnr_db + 5);
    CHECK(row.figures.luminance.ssim > shifted.figures.luminance.ssim + 0.05);
    CHECK(row.field_figures.luminance.contrast_b ==
          Catch::Approx(row.figures.luminance.contrast_a).epsilon(0.1));
    // Levels spread haze over the dark.
    CHECK(row.figures.luminance.contrast_b ==
          Catch::Approx(row.figures.luminance.contrast_a).epsilon(0.15));
  }
}

TEST_CASE("rows are the depths through the whole hologram, then the sides at the first depth") {
  const auto device = test::all_devices().front();
  auto what = small_spec();
  what.depths_m = {3.2 * mm, 3.1 * mm};
  what.against_points = true;
  const auto scene = small_study("0", "sampling.frames=2");
  const auto result = assessed(device, scene, what);
  std::vector<std::pair<std::string, double>> rows;
  for (const auto& row : result.rows) rows.emplace_back(row.view, row.z_m);
  CHECK(rows == std::vector<std::pair<std::string, double>>{{"whole", 3.2 * mm},
                                                            {"whole", 3.1 * mm},
                                                            {"left", 3.2 * mm},
                                                            {"right", 3.2 * mm},
                                                            {"top", 3.2 * mm},
                                                            {"bottom", 3.2 * mm}});
  REQUIRE(result.against_points);
  CHECK(result.against_points->correlation > 0.85);  // measured 0.90

  const auto json = quality_json({scene}, result, device.info(), {}, what);
  REQUIRE(json["rows"].size() == 6);
  CHECK(json["rows"][2]["view"] == "left");
  CHECK(json["rows"][2]["psnr_db"] == result.rows[2].figures.luminance.psnr_db);
  CHECK(json["frames"] == 2);
  CHECK(json["against_points"]["correlation"] == result.against_points->correlation);
  CHECK(json["render"]["scene"]["sampling"]["frames"] == 2);
}

TEST_CASE(
    "depths not given are the nearest and the farthest surface, and one in front by a tenth of the "
    "range or 1 %") {
  Plan plan;
  plan.extent.near_m = 0.09;
  plan.extent.far_m = 0.11;
  CHECK(quality_depths_m(plan) == std::vector<double>{0.09, 0.11, 0.09 - 0.1 * (0.11 - 0.09)});
  plan.extent.far_m = plan.extent.near_m;
  CHECK(quality_depths_m(plan) == std::vector<double>{0.09, 0.09 - 0.01 * 0.09});
}

TEST_CASE("out of focus is near the surfaces before the hologram, however far others lie beyond") {
  Plan plan;
  plan.extent.near_m = -0.12;
  plan.extent.far_m = 0.12;
  plan.layers.resize(2);
  plan.layers[0].min_m.z = -0.12, plan.layers[0].max_m.z = -0.10;
  plan.layers[1].min_m.z = plan.layers[1].max_m.z = 0.12;
  const auto depths_m = quality_depths_m(plan);
  REQUIRE(depths_m.size() == 3);
  CHECK(depths_m[2] == Catch::Approx(-0.122));
}

Image flat(int width, int height, float value) {
  return {width, height, std::vector<float>(std::size_t{1} * width * height, value)};
}

TEST_CASE(
    "the sheet has a row of three cells for each row of the table, with one exposure and grey "
    "between them") {
  QualityResult result;
  result.rows.resize(2);
  result.rows[0].lens = {flat(5, 3, 1.0f)};
  result.rows[0].hologram = {flat(5, 3, 0.5f)};
  result.rows[0].difference = flat(5, 3, -0.5f);  // beyond a quarter of white: full blue
  result.rows[1].lens = {flat(5, 3, 0.0f)};
  result.rows[1].hologram = {flat(5, 3, 0.25f)};
  result.rows[1].difference = flat(5, 3, 0.0f);
  const auto sheet = contact_sheet(result);
  REQUIRE(sheet.width == 3 * 5 + 2 * sheet_gap_px);
  REQUIRE(sheet.height == 2 * 3 + sheet_gap_px);
  REQUIRE(sheet.rgb.size() == std::size_t{3} * sheet.width * sheet.height);

  using Rgb = std::array<int, 3>;
  // sRGB codes of 1/2 and 1/4 are 188 and 137.
  const std::vector<std::vector<Rgb>> cells{{{255, 255, 255}, {188, 188, 188}, {33, 102, 172}},
                                            {{0, 0, 0}, {137, 137, 137}, {255, 255, 255}}};
  int wrong = 0;
  for (int y = 0; y < sheet.height; ++y) {
    for (int x = 0; x < sheet.width; ++x) {
      const int column = x / (5 + sheet_gap_px), row = y / (3 + sheet_gap_px);
      const bool gap = x % (5 + sheet_gap_px) >= 5 || y % (3 + sheet_gap_px) >= 3;
      const auto* got = &sheet.rgb[std::size_t{3} * (y * sheet.width + x)];
      wrong += Rgb{got[0], got[1], got[2]} != (gap ? Rgb{128, 128, 128} : cells[row][column]);
    }
  }
  CHECK(wrong == 0);
}

TEST_CASE("the contact sheet shows each picture as an eye sees it, or as the arrays are") {
  QualityResult result;
  result.rows.resize(1);
  auto& row = result.rows[0];
  row.lens = {flat(4, 2, 0.0f)};
  row.lens[0].pixels[0] = 1;  // top left
  row.hologram = row.lens;
  row.difference = row.lens[0];
  const auto eye = contact_sheet(result), along_light = contact_sheet(result, Frame::hologram);
  const auto differs = [](const Sheet& sheet, int x) {
    return !std::equal(&sheet.rgb[3 * x], &sheet.rgb[3 * x + 3],
                       &sheet.rgb[3 * (x == 0 ? 1 : x - 1)]);
  };
  for (int cell = 0; cell < 3; ++cell) {
    const int left = cell * (4 + sheet_gap_px);
    CHECK(!std::equal(&along_light.rgb[3 * left], &along_light.rgb[3 * left + 3],
                      &along_light.rgb[3 * left + 3]));
    CHECK(differs(eye, left + 3));
    CHECK(std::equal(&eye.rgb[3 * left], &eye.rgb[3 * left + 3], &eye.rgb[3 * left + 3]));
  }
}

TEST_CASE("the window that is judged lies close around what the lens sees, on and off the axis") {
  const auto device = test::all_devices().front();
  for (const char* x : {"0", "0.02 mm"}) {
    auto scene = small_study(x, "sampling.frames=1");
    scene.objects.resize(1);  // the sphere
    QualitySpec what;
    what.views = false;
    what.blur_m = 4 * um;
    what.lens_points = 4;
    const auto world = build_world(scene);
    const auto plan = make_plan(scene, world);
    const auto result = assessed(device, scene, what);
    const auto [low_m, high_m] = result.window;
    INFO(result.window.text());
    const auto off_px = glm::dvec2(result.picture_size) - (high_m - low_m) / (3.74 * um);
    CHECK(std::max(std::abs(off_px.x), std::abs(off_px.y)) <= 1);
    // The sphere, seen in perspective, a margin of 4 blurs, and the border
    const double margin_m = 4 * 4 * um + picture_border_px * 3.74 * um;
    for (int axis = 0; axis < 2; ++axis) {
      CHECK(low_m[axis] == Catch::Approx(world.min_m[axis] - margin_m).margin(8 * um));
      CHECK(high_m[axis] == Catch::Approx(world.max_m[axis] + margin_m).margin(8 * um));
    }
    CHECK(result.window == quality_window(plan, front_view(scene, world, plan), 4 * um));
    // Pixels beyond the sphere's light are as dark as those at the edge of a larger picture
    auto wide = what;
    wide.window = PictureWindow::around_axis(glm::dvec2(0.5 * mm));
    const auto sum = [](const Image& image) {
      return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0);
    };
    wide.border_px = what.border_px = 0;
    CHECK(sum(assessed(device, scene, what).rows[0].lens[0]) ==
          Catch::Approx(sum(assessed(device, scene, wide).rows[0].lens[0])).epsilon(2e-3));
  }
}

TEST_CASE("wide pictures are made smaller for the sheet by averaging") {
  const auto device = test::all_devices().front();
  const auto scene = small_study("0", "sampling.frames=1");
  QualitySpec what;
  what.depths_m = {3.1 * mm};
  what.views = false;
  what.window = PictureWindow::around_axis(glm::dvec2(1400, 70) * 3.74 * um);
  what.border_px = 0;
  what.lens_points = 2;
  const auto result = assessed(device, scene, what);
  REQUIRE(result.rows.size() == 1);
  const auto& row = result.rows[0];
  const auto &lens = row.lens.at(0), &hologram = row.hologram.at(0);
  CHECK(result.picture_size == glm::ivec2(1400, 70));
  CHECK(lens.width == 467);  // squares of 3 pixels, the last one cut off
  CHECK(lens.height == 24);
  CHECK(contact_sheet(result).width == 3 * 467 + 2 * sheet_gap_px);
  double worst = 0;
  for (std::size_t i = 0; i < lens.pixels.size(); ++i)
    worst = std::max(
        worst, std::abs(1.0 * hologram.pixels[i] - lens.pixels[i] - row.difference.pixels[i]));
  CHECK(worst < 1e-5);
  CHECK(*std::max_element(lens.pixels.begin(), lens.pixels.end()) > 0.3f);
}

TEST_CASE("pictures that cannot be compared are refused") {
  const auto device = test::all_devices().front();
  const auto scene = small_study("0", "sampling.frames=1");
  const Rendered rendered{{render(device, scene)}, {}, {}};
  const auto refused = [&](auto&& change) {
    auto what = small_spec();
    change(what);
    CHECK_THROWS_AS(assessed(device, scene, rendered, what), InputError);
  };
  refused([](QualitySpec& s) { s.depths_m = {0}; });
  refused([](QualitySpec& s) { s.border_px = 32; });
  refused([](QualitySpec& s) { s.blur_m = -1 * um; });
  refused([](QualitySpec& s) { s.lens_points = 0; });
  refused([](QualitySpec& s) { s.window = PictureWindow::around_axis({0, 1 * mm}); });
}

}  // namespace
}  // namespace raywave
