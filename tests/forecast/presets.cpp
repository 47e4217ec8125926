// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/presets.hpp"

#include "host/carriers/wrps/planning/padding_errors.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/forecast/candidates.hpp"
#include "host/plan/key_places.hpp"
#include "tests/forecast/data_scenes.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Approx;

TEST_CASE("a teapot in one corner costs at most 0.4 of four teapots that fill 2 x 2 WRPs") {
  const auto filled = over_wrps("teapot_four.toml");
  auto alone = filled;
  alone.objects.resize(1);
  const auto four = planned(filled), one = planned(alone);
  REQUIRE(four.plan.wrps.size() == 4);
  REQUIRE(one.plan.wrps.size() == 1);
  CHECK(one.prediction.times.total_s() <= 0.4 * four.prediction.times.total_s());
  CHECK(one.prediction.work.butterflies <= 0.4 * four.prediction.work.butterflies);
}

TEST_CASE("values that the scene file gives are kept with every goal", "[slow]") {
  const std::vector<std::string> all{"sampling.pitch=83 um", "sampling.frames=5",
                                     "wrp.padding=1.75",     "wrp.layers=3",
                                     "sampling.cone=1.05",   "sampling.apodization=0.25"};
  const auto world = build_world(data_scene("teapot.toml"));
  const auto check = [&](const std::vector<std::string>& values, const Goal& goal) {
    const auto fixed = data_scene("teapot.toml", values);
    CHECK(fixed.given.size() >= values.size());
    const auto p = plan_scene(fixed, world, {}, goal);
    const auto keeps = [&](const char* key, bool kept) {
      INFO(key);
      CHECK((!fixed.given.contains(key) || kept));
    };
    keeps("sampling.pitch", p.scene.sampling.pitch_m == 83 * um);
    keeps("sampling.frames", p.scene.sampling.frames == 5);
    keeps("wrp.padding", p.scene.wrp.padding == 1.75);
    keeps("wrp.layers", p.scene.wrp.layers == 3);
    keeps("sampling.cone", p.scene.sampling.cone == 1.05);
    keeps("sampling.apodization", p.scene.sampling.apodization == 0.25);
  };
  const Goal goals[] = {
      {Preset::draft, {}, {}}, {Preset::accurate, {}, {}}, {{}, 0.2, {}}, {{}, {}, 38}};
  for (const Goal& goal : goals) check(all, goal);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto key = all[i].substr(0, all[i].find('='));
    INFO(key);
    CHECK(data_scene("teapot.toml", {all[i]}).given.contains(key));
    CHECK_FALSE(data_scene("teapot.toml", {key + "=auto"}).given.contains(key));
    check({all[i]}, goals[i % 4]);
  }
}

TEST_CASE("without a goal the scene's values are kept") {
  const auto scene = data_scene("teapot.toml");
  const auto p = planned(scene);
  CHECK(p.scene.sampling.pitch_m == scene.sampling.pitch_m);
  CHECK(p.scene.sampling.frames == scene.sampling.frames);
  CHECK(p.scene.wrp.padding == scene.wrp.padding);
  CHECK(p.scene.sampling.cone == scene.sampling.cone);
  CHECK(p.scene.sampling.apodization == scene.sampling.apodization);
}

TEST_CASE(
    "presets for pictures leave out the edge of the wave within the cone error that they state, "
    "and reference keeps the whole wave",
    "[slow]") {
  const auto scene = over_wrps("teapot.toml");
  const auto world = build_world(scene);
  const auto plan_for = [&](const Goal& goal) { return plan_scene(scene, world, {}, goal); };
  for (const auto& goal : {Goal{Preset::draft, {}, {}}, Goal{Preset::balanced, {}, {}},
                           Goal{{}, 0.2, {}}, Goal{{}, {}, 38.0}}) {
    const auto p = plan_for(goal);
    CHECK(cone_error_of(p.plan) > 0);
    CHECK(cone_error_of(p.plan) <= largest_cone_error(goal));
    CHECK(p.prediction.field_error >= cone_error_of(p.plan));
  }
  CHECK(cone_error_of(plan_for({Preset::accurate, {}, {}}).plan) <= 0.06);
  CHECK(cone_error_of(plan_for({Preset::reference, {}, {}}).plan) == 0);
}

TEST_CASE("the error of a cone equals the closed form for its cubic apodization") {
  // e^2 (3 - 2 e) and its square, integrated from 0 to e.
  const auto first = [](double e) { return std::pow(e, 3) - std::pow(e, 4) / 2; };
  const auto second = [](double e) {
    return 9.0 / 5 * std::pow(e, 5) - 2 * std::pow(e, 6) + 4.0 / 7 * std::pow(e, 7);
  };
  for (const Cone& cone : {Cone{1.1, 0.3}, Cone{1.2, 0.3}, Cone{1.2, 0.4}, Cone{1.0, 0.2}}) {
    INFO(cone.half_width << ", " << cone.apodization);
    const double at_rim = (cone.half_width - 1) / cone.apodization;
    // 1 up to half_width - apodization, then the cubic from 1 down to at_rim.
    const double a =
        cone.half_width - cone.apodization + cone.apodization * (first(1) - first(at_rim));
    const double b =
        cone.half_width - cone.apodization + cone.apodization * (second(1) - second(at_rim));
    // The mean of (1 - a(x) a(y))^2.
    CHECK(cone.field_error() == Approx(std::sqrt(1 - 2 * a * a + b * b)).margin(1e-4));
  }
  CHECK(Cone{1.2, 0.2}.field_error() == 0);
  CHECK(Cone{1, 0}.field_error() == 0);
  CHECK(Cone{0.5, 0}.field_error() == Approx(std::sqrt(0.75)));
}

/// One layer out of focus by `defocus` squared spots, samples `pitch` spots apart, a blur of `blur`
/// spots; alike along both axes.
LatticePattern pattern_of(const Cone& cone, double pitch, double blur, double defocus) {
  PictureModel model{.cone = cone};
  model.resolution_m = blur * 100e-6 / blur_of_resolution;
  PictureRow row{.spot_m = {100e-6, 100e-6}};
  row.layers = {{glm::dvec2(defocus), 1}};
  model.rows = {row};
  return lattice_pattern(model, pitch * 100e-6);
}

/// The same speckle from the spots themselves, added up in space: for each pair of samples, the
/// product of their waves is blurred and squared.
double speckle_of_spots(const Cone& cone, double pitch, double blur, double defocus) {
  using Complex = std::complex<double>;
  constexpr double pi = 3.14159265358979323846, step = 0.2, reach = 120;
  constexpr int count = static_cast<int>(2 * reach / step), waves = 400;
  std::vector<Complex> spot(count);
  for (int i = 0; i < count; ++i) {
    for (int wave = 0; wave < waves; ++wave) {
      const double u = (wave + 0.5) / waves - 0.5;
      spot[i] += cone.passed(2 * u) / waves *
                 std::polar(1.0, 2 * pi * u * (i * step - reach) + pi * defocus * u * u);
    }
  }
  const int half = static_cast<int>(4 * blur / step);
  std::vector<double> kernel(2 * half + 1);
  for (int i = -half; i <= half; ++i)
    kernel[i + half] =
        step / (blur * std::sqrt(2 * pi)) * std::exp(-0.5 * std::pow(i * step / blur, 2));
  double mean = 0, pairs = 0, alone = 0;
  for (const auto& value : spot) mean += std::norm(value) * step / pitch;
  for (int k = 0; k * pitch < reach; ++k) {
    const int apart = static_cast<int>(std::lround(k * pitch / step));
    std::vector<Complex> product(count);
    for (int i = apart; i < count; ++i) product[i] = spot[i] * std::conj(spot[i - apart]);
    double squares = 0;
    for (int i = half; i + half < count; ++i) {
      Complex blurred = 0;
      for (int j = -half; j <= half; ++j) blurred += kernel[j + half] * product[i + j];
      squares += std::norm(blurred) * step / pitch;
    }
    if (k == 0) alone = squares;
    pairs += k == 0 ? squares : 2 * squares;
  }
  return (pairs * pairs - alone * alone) / std::pow(mean, 4);
}

TEST_CASE(
    "predicted speckle equals a direct sum over overlapping spots for every cone, lattice and "
    "defocus") {
  for (const auto& cone : {Cone{1.2, 0.2}, Cone{1.1, 0.3}, Cone{1.0, 0.2}}) {
    for (const double pitch : {0.8, 1.4, 2.6, 3.0}) {
      for (const double defocus : {0.0, 6.0}) {
        CAPTURE(cone.half_width, cone.apodization, pitch, defocus);
        const double expected = speckle_of_spots(cone, pitch, 1.8, defocus);
        // Beyond the reach of the sum over spots, whose light falls with the square of the
        // distance, lies 1 / (pi^2 120 pitch).
        CHECK(pattern_of(cone, pitch, 1.8, defocus).speckle.at(0) ==
              Approx(expected).epsilon(0.02).margin(5e-4));
      }
    }
  }
}

TEST_CASE(
    "in focus, samples a whole number of spots apart interfere least, and apodization reduces "
    "interference") {
  const auto speckle = [](const Cone& cone, double pitch) {
    return pattern_of(cone, pitch, 6, 0).speckle.at(0);
  };
  const Cone all{1.2, 0.2}, soft{1.1, 0.3};
  for (const double pitch : {2.0, 3.0, 4.0}) {
    CHECK(speckle(all, pitch) < 0.7 * speckle(all, pitch - 0.5));
    CHECK(speckle(all, pitch) < 0.7 * speckle(all, pitch + 0.5));
  }
  for (const double pitch : {2.5, 3.5, 5.5})
    CHECK(speckle(soft, pitch) < 0.7 * speckle(all, pitch));
}

TEST_CASE(
    "the predicted time keeps the budget, and a larger budget never lowers the predicted PSNR",
    "[slow]") {
  const auto scene = data_scene("ball_textured.toml");
  const auto world = build_world(scene);
  double before = -1e9;
  for (const double budget_s : {0.5, 0.7, 1.0, 1.5, 3.0, 30.0}) {
    const auto p = plan_scene(scene, world, {}, {{}, budget_s, {}});
    // The lattice is rounded to whole cells
    CHECK(p.prediction.times.total_s() <= budget_s * 1.02);
    CHECK(p.prediction.pictures->mean_psnr_db >= before - 1e-6);
    before = p.prediction.pictures->mean_psnr_db;
  }
  CHECK(warns(plan_scene(scene, world, {}, {{}, 1e-6, {}}), "nothing keeps"));
  for (const auto& [grid, what] :
       {std::pair("[1, 1]", "; a smaller hologram.resolution needs less"),
        {"[2, 2]", "resolution or wrp.grid needs less"}})
    CHECK(
        warns(planned(over_wrps("teapot.toml", {std::string("wrp.grid=") + grid}), {{}, 1e-6, {}}),
              what));
}

/// Of the choices that take no longer and no more frames, the largest PSNR: of all of them.
double best_within(const Scene& scene, const World& world, double seconds, double frames) {
  double best_db = -1e9;
  for (const auto& c : choices(scene, world, {}))
    if (c.seconds <= seconds && c.frames <= frames &&
        c.cone.field_error() <= largest_cone_error({}))
      best_db = std::max(best_db, c.psnr_db);
  return best_db;
}

TEST_CASE(
    "a rate takes the most accurate of the plans that keep a picture's time and the panel's "
    "frames, and says what the best of all would have") {
  auto scene = data_scene("teapot.toml", {"slm.rate=120"});
  scene.slm.encoding = Encoding::burckhardt;  // which is not refined
  const auto world = build_world(scene);
  for (const double rate_per_s : {0.5, 2.0, 60.0, 100.0}) {
    CAPTURE(rate_per_s);
    const double frames = std::floor(120 / rate_per_s);
    const auto p = plan_scene(scene, world, {}, {.rate_per_s = rate_per_s});
    CHECK(p.scene.sampling.frames <= frames);
    const double best_db = best_within(scene, world, 1 / rate_per_s, frames);
    if (best_db < 0) {
      CHECK(warns(p, "nothing keeps " + duration_text(1 / rate_per_s)));
    } else {
      CHECK(p.prediction.times.total_s() <= 1.02 / rate_per_s);
      CHECK(p.prediction.pictures->mean_psnr_db == Approx(best_db).margin(0.3));
    }
    // Without the goal, an eye's 30 pictures a second
    const double all_db = best_within(scene, world, 1e9, std::max(frames, 4.0));
    const bool has_lost = all_db > std::max(best_db, p.prediction.pictures->mean_psnr_db) + 0.1;
    CHECK(has_lost == (rate_per_s > 10));
    CHECK(says(p.reasons, "which has " + number_text(std::round(all_db * 10) / 10) + " dB") ==
          has_lost);
  }
}

TEST_CASE("frames that the planner chooses are those that the panel shows in a picture") {
  const auto frames = [](std::vector<std::string> set,
                         const Goal& goal = {Preset::reference, {}, {}}) {
    return planned(data_scene("teapot.toml", set), goal).scene.sampling.frames;
  };
  CHECK(frames({}) > 4);
  CHECK(frames({"slm.rate=120"}) <= 4);  // 30 pictures a second
  CHECK(frames({"slm.rate=60"}) == 2);
  CHECK(frames({"slm.rate=1"}) == 1);
  // The lasers take turns
  const auto scenes = load_scenes(std::filesystem::path(RAYWAVE_DATA_DIR) / "colour.toml",
                                  {"slm.rate=180", "sampling.frames=auto", "sampling.pitch=auto",
                                   "hologram.resolution=[480, 270]"});
  const auto world = build_world(scenes[0]);
  for (const auto& laser : plan_scenes(scenes, world, {}, {Preset::reference, {}, {}}))
    CHECK(laser.scene.sampling.frames <= 2);
  for (const auto& laser : plan_scenes(scenes, world, {}, {.rate_per_s = 60.0})) {
    CHECK(laser.scene.sampling.frames == 1);
    CHECK_FALSE(warns(laser, "sampling.pitch 100 um (default)"));
  }
  CHECK(warns(plan_scenes(scenes, world, {})[1], "sampling.pitch 100 um (default)"));
  for (const auto& laser : plan_scenes(scenes, world, {}, {.rate_per_s = 90.0}))
    CHECK(warns(laser, "1 frame of each of 3 lasers takes 16.7 ms on a panel of 180 frames/s"));
}

TEST_CASE("more frames than the panel shows are given a line, in an animation at its rate") {
  const std::vector<std::string> eight{"sampling.frames=8", "slm.rate=60"};
  CHECK(warns(planned(data_scene("teapot.toml", eight)), "give 2 at most"));
  CHECK_FALSE(
      warns(planned(data_scene("teapot.toml", {"sampling.frames=2", "slm.rate=60"})), "slm.rate"));
  CHECK(warns(planned(data_scene("turntable.toml", {"animation.subframes=3", "slm.rate=60"})),
              "3 frames take 50 ms on a panel of 60 frames/s (slm.rate), a picture of 24 a second "
              "has 41.7 ms: give 2 at most"));
  CHECK(warns(planned(data_scene("teapot.toml", {"slm.rate=20"})),
              "1 frame takes 50 ms on a panel of 20 frames/s (slm.rate), a picture of 30 a second "
              "has 33.3 ms: it flickers, a faster panel would not"));
}

TEST_CASE("the predicted PSNR reaches the goal, and a lower goal never takes longer", "[slow]") {
  const auto rising = [](const Scene& scene, std::initializer_list<double> goals_db) {
    const auto world = build_world(scene);
    double before = 0;
    for (const double psnr_db : goals_db) {
      const auto p = plan_scene(scene, world, {}, {{}, {}, psnr_db});
      CAPTURE(psnr_db, before);
      CHECK(p.prediction.pictures->mean_psnr_db >= psnr_db - 0.05);
      CHECK(p.prediction.times.total_s() >= before * 0.98);
      before = p.prediction.times.total_s();
    }
    CHECK(warns(plan_scene(scene, world, {}, {{}, {}, 120.0}), "nothing reaches"));
  };
  rising(data_scene("teapot.toml"), {24.0, 26.0, 28.0, 29.5});
  // Where one frame refined towards a lens takes less than many refined towards samples
  rising(
      data_scene("ball_smooth.toml", {"hologram.resolution=[1920, 1200]", "hologram.pitch=8 um",
                                      "wrp.grid=auto", "hologram.wavelength=532 nm",
                                      "object.0.width=5.8 mm", "object.0.position=[0, 0, '320 mm']",
                                      "object.1.width=8 mm", "object.1.position=[0, 0, '324 mm']"}),
      {36.0, 37.0, 38.0, 40.0, 42.0, 44.0});
}

TEST_CASE("a PSNR that no encoding reaches is reached by refinement, at its price") {
  const auto scene = data_scene("teapot.toml");
  const auto world = build_world(scene);
  const auto levels = plan_scene(scene, world, {}, {{}, {}, 28.0});
  CHECK_FALSE(levels.scene.refine);
  CHECK(levels.prediction.times.refine_s == 0);
  const auto refined = plan_scene(scene, world, {}, {{}, {}, 40.0});
  CHECK(refined.scene.refine);
  CHECK(refined.prediction.pictures->mean_psnr_db >= 39.95);
  CHECK(refined.prediction.times.refine_s > 5 * refined.prediction.times.trace_s);
  // What cannot be refined stays as it is.
  auto amplitudes = scene;
  amplitudes.slm.encoding = Encoding::off_axis;
  const auto p = plan_scene(amplitudes, world, {}, {{}, {}, 60.0});
  CHECK_FALSE(p.scene.refine);
  CHECK(warns(p, "nothing reaches"));
}

TEST_CASE(
    "refinement that knows crosstalk is dearer by what pixels and neighbours take each time") {
  const auto butterflies = [](const char* crosstalk, const char* iterations, const char* frames) {
    return planned(data_scene("teapot.toml", {"hologram.resolution=[240, 136]",
                                              std::string("slm.crosstalk=") + crosstalk,
                                              std::string("refine.iterations=") + iterations,
                                              std::string("sampling.frames=") + frames}))
        .prediction.work.refine_butterflies;
  };
  const auto dearer = [&](const char* crosstalk, const char* iterations, const char* frames) {
    return butterflies(crosstalk, iterations, frames) - butterflies("0", iterations, frames);
  };
  const double narrow = dearer("1.87 um", "4", "1");  // 5 x 5 weights
  CHECK(narrow > 240 * 136 * 4);
  CHECK(dearer("1.87 um", "8", "1") == Catch::Approx(2 * narrow));
  // Between frames, what the panel shows of one is added to the picture
  CHECK(dearer("1.87 um", "4", "3") == Catch::Approx(14 / 4.0 * narrow));
  const double wide = dearer("3.74 um", "4", "1"), wider = dearer("7.48 um", "4", "1");
  CHECK(wider - wide == Catch::Approx((17 * 17 - 9 * 9) / (9 * 9 - 5 * 5.0) * (wide - narrow)));
  CHECK(wide > narrow);
}

TEST_CASE("refinement of what WRPs cannot bring is refused, and chosen by no goal") {
  auto scene =
      data_scene("teapot.toml", {"hologram.resolution=[1280, 800]", "hologram.pitch=8 um",
                                 "hologram.wavelength=532 nm", "wrp.grid=auto",
                                 "object.0.width=2 mm", "object.0.position=[0, 0, '12 mm']"});
  const auto world = build_world(scene);
  for (const auto preset : {Preset::draft, Preset::reference})
    CHECK_FALSE(plan_scene(scene, world, {}, Goal{preset}).scene.refine);
  scene.refine.emplace();
  const auto refused = Catch::Matchers::ContainsSubstring("no refinement finds the pictures");
  CHECK_THROWS_WITH(make_plan(scene, world), refused);
  CHECK_THROWS_WITH(plan_scene(scene, world, {}, Goal{Preset::balanced}), refused);
}

TEST_CASE("a scene that says refine.iterations = 0 is not refined for a goal") {
  const auto scene = data_scene("teapot.toml", {"refine.iterations=0"});
  const auto world = build_world(scene);
  for (const Goal& goal : {Goal{{}, {}, 60.0}, Goal{{}, 30.0}, Goal{Preset::reference}}) {
    const auto p = plan_scene(scene, world, {}, goal);
    CHECK_FALSE(p.scene.refine);
    CHECK(p.prediction.times.refine_s == 0);
    CHECK(warns(p, "nothing reaches") == goal.psnr_db.has_value());
  }
}

TEST_CASE("a PSNR is aimed at from above, as far as predictions may be wrong, or a line says so") {
  const auto scene = data_scene("study.toml", {"viewer.resolution=100 um"});
  const auto world = build_world(scene);
  for (const double asked_db : {36.0, 41.0, 50.0, 60.0, 63.0}) {
    CAPTURE(asked_db);
    const auto p = plan_scene(scene, world, {}, {{}, {}, asked_db});
    const double predicted_db = p.prediction.pictures->mean_psnr_db;
    const double surely_db = p.prediction.pictures->sure_db() + 1;
    CHECK(warns(p, "nothing reaches") == (predicted_db < asked_db - 0.05));
    CHECK(warns(p, "may be missed") ==
          (predicted_db >= asked_db - 0.05 && surely_db < asked_db - 0.05));
    CHECK((p.scene.refine.has_value() || surely_db >= asked_db - 0.05));
  }
}

TEST_CASE("a budget leaves out views where whole pictures gain more than 3 dB by it") {
  const auto scene = data_scene("teapot.toml", {"viewer.resolution=100 um"});
  const auto world = build_world(scene);
  for (const double budget_s : {5.0, 100.0}) {
    const auto p = plan_scene(scene, world, {}, {{}, budget_s, {}});
    REQUIRE(p.scene.refine);
    CHECK_FALSE(refines_samples(p.plan));
    CHECK(p.scene.refine->views.value_or(24) == (budget_s < 50 ? 0 : 24));
    CHECK(p.prediction.times.total_s() <= budget_s * 1.02);
  }
}

TEST_CASE(
    "less is likely of highlights, by its square, where a lattice is coarser than the viewer "
    "sees") {
  const auto left_out = [](const char* pitch) {
    return planned(data_scene("teapot.toml",
                              {"viewer.resolution=100 um", std::string("sampling.pitch=") + pitch}))
        .prediction.pictures.value()
        .left_out;
  };
  CHECK(left_out("60 um") == left_out("100 um"));
  CHECK(left_out("200 um") == Catch::Approx(4 * left_out("100 um")));
}

TEST_CASE("38 dB are not promised of samples that miss detail: rays to a lens are taken") {
  // Refined towards samples, in 0.1 s, it has 36.4
  const auto vase =
      planned(data_scene("teapot.toml", {"viewer.resolution=100 um", "sampling.pitch=auto",
                                         "object.0.mesh=vase.glb", "object.0.width=8 mm"}),
              {{}, {}, 38.0});
  REQUIRE(vase.scene.refine);
  CHECK_FALSE(refines_samples(vase.plan));
}

TEST_CASE("presets take more time and reach more PSNR from draft to reference", "[slow]") {
  for (const char* name : {"teapot.toml", "study.toml", "plane.toml"}) {
    INFO(name);
    const auto scene =
        data_scene(name, {"sampling.pitch=auto", "sampling.frames=auto", "wrp.padding=auto"});
    const auto world = build_world(scene);
    double seconds = 0, psnr_db = 0, cone_error = 1;
    for (const auto preset :
         {Preset::draft, Preset::balanced, Preset::accurate, Preset::reference}) {
      const auto p = plan_scene(scene, world, {}, {preset, {}, {}});
      CHECK(p.prediction.times.total_s() >= seconds * 0.98);
      CHECK(cone_error_of(p.plan) <= cone_error);
      // Pictures of one cone
      if (cone_error_of(p.plan) == cone_error)
        CHECK(p.prediction.pictures->mean_psnr_db >= psnr_db - 1e-6);
      CHECK_FALSE(warns(p, "single dots"));
      seconds = p.prediction.times.total_s();
      psnr_db = p.prediction.pictures->mean_psnr_db;
      cone_error = cone_error_of(p.plan);
      if (preset == Preset::reference) CHECK(p.scene.accuracy.phase_turns == 0.001);
    }
  }
}

TEST_CASE(
    "two objects far apart get WRPs at each and take less than 0.3 of the time of one layer") {
  const auto scene = over_wrps("apart.toml");
  const auto world = build_world(scene);
  const auto p = plan_scene(scene, world, {}, {Preset::balanced, {}, {}});
  CHECK(p.scene.wrp.layers == 2);
  REQUIRE(p.plan.layers.size() == 2);
  CHECK(p.plan.layers[0].distance_m == Approx(75 * mm).margin(2 * mm));     // a ball of 4 mm
  CHECK(p.plan.layers[1].distance_m == Approx(125 * mm).margin(2.5 * mm));  // a teapot 5 mm deep
  auto one = p.scene;
  one.wrp.layers = 1;
  one.given.insert("wrp.layers");
  CHECK(p.prediction.times.total_s() < 0.3 * plan_scene(one, world, {}).prediction.times.total_s());
  CHECK(std::any_of(p.reasons.begin(), p.reasons.end(), [](const auto& r) {
    return r.find("layers of depth: predicted 1 takes") == 0;
  }));
}

TEST_CASE(
    "scenes that gain nothing from layers have one, as every scene over WRPs without a goal") {
  for (const char* name : {"study.toml", "teapot.toml", "wire.toml"}) {
    const std::vector<std::string> open{"sampling.pitch=auto", "sampling.frames=auto",
                                        "wrp.distance=auto"};
    for (const auto& scene : {data_scene(name, open), over_wrps(name, open)})
      CHECK(planned(scene, {Preset::balanced, {}, {}}).plan.layers.size() == 1);
  }
  CHECK(planned(over_wrps("apart.toml")).plan.layers.size() == 1);
}

TEST_CASE(
    "the resolution is the coarsest of what the viewer wants, what the eye sees and what the "
    "hologram resolves") {
  auto scene = data_scene("teapot.toml");
  const auto plan = plan_of(scene, build_world(scene));
  const double limit = 638e-9 * plan.lattice.full_z_m / (1080 * 3.74 * um);
  scene.viewer.distance_m = 0.25;
  CHECK(wanted_resolution_m(scene, plan) ==
        Approx((0.25 + plan.lattice.full_z_m) * std::atan(1.0) / 45 / 60));
  scene.viewer.resolution_m = 40 * um;
  CHECK(wanted_resolution_m(scene, plan) == Approx(40 * um));
  scene.viewer.resolution_m = 1 * um;
  CHECK(wanted_resolution_m(scene, plan) == Approx(limit));
}

/// The teapot, `width` wide and `z` from the hologram.
Scene teapot_at(const std::string& z, const std::string& width, const std::string& resolution,
                std::vector<std::string> more = {}) {
  more.insert(more.end(), {"object.0.position=[0, 0, '" + z + "']", "object.0.width=" + width,
                           "hologram.resolution=" + resolution, "wrp.grid=auto"});
  return data_scene("teapot.toml", more);
}

TEST_CASE("a scene that touches or crosses the hologram's plane is planned for every goal",
          "[slow]") {
  for (const auto& [z, width, resolution] : {std::tuple{"1 mm", "12.5 mm", "[480, 270]"},
                                             {"0 mm", "1.5 mm", "[480, 270]"},
                                             {"0 mm", "6 mm", "[1920, 1080]"},
                                             {"4.53 mm", "12.5 mm", "[1920, 1080]"},
                                             {"-60 mm", "12.5 mm", "[1920, 1080]"}}) {
    const auto scene = teapot_at(z, width, resolution);
    const auto world = build_world(scene);
    CAPTURE(z, width, resolution, world.min_m.z, world.max_m.z);
    REQUIRE(world.min_m.z < 0);
    const auto draft = plan_scene(scene, world, {}, {Preset::draft, {}, {}}),
               reference = plan_scene(scene, world, {}, {Preset::reference, {}, {}}),
               fast = plan_scene(scene, world, {}, {{}, 1.0, {}}),
               never = plan_scene(scene, world, {}, {{}, {}, 80.0});
    for (const auto* planned : {&draft, &reference, &fast, &never})
      CHECK(planned->prediction.pictures.has_value());
    const auto psnr_db = [](const Planned& p) { return p.prediction.pictures->mean_psnr_db; };
    CHECK(draft.scene.sampling.pitch_m > never.scene.sampling.pitch_m);
    CHECK(psnr_db(draft) <= psnr_db(reference));
    CHECK(psnr_db(reference) <= psnr_db(never));
    CHECK((fast.prediction.times.total_s() <= 1.02 || warns(fast, "nothing keeps")));
    CHECK(warns(never, "nothing reaches"));
    if (world.max_m.z >= 0) CHECK_FALSE(never.scene.refine);  // which knows one side alone
  }
}

TEST_CASE("goals do not refine what is given double phase") {
  const Goal accurate{Preset::accurate, {}, {}};
  const auto sets = [](const std::string& encoding) {
    return std::vector<std::string>{"hologram.resolution=[960, 540]", "sampling.pitch=auto",
                                    "object.0.width=10 mm", "slm.encoding=" + encoding};
  };
  CHECK(planned(data_scene("teapot.toml", sets("auto")), accurate).scene.refine);
  const auto kept = planned(data_scene("teapot.toml", sets("double-phase")), accurate);
  CHECK_FALSE(kept.scene.refine);
  CHECK(kept.plan.slm.encoding == Encoding::double_phase);
}

TEST_CASE("a goal for a fan, whose pictures cannot be predicted, is refused") {
  CHECK_REFUSED(
      planned(data_scene("teapot.toml", {"sampling.mode=fan"}), Goal{Preset::draft, {}, {}}),
      "cannot be predicted");
}

}  // namespace
}  // namespace raywave
