// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/presets.hpp"

#include <cstdlib>

#include "host/carriers/wrps/planning/padding_errors.hpp"
#include "host/common/error.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/planning/make_plan.hpp"
#include "host/planning/memory_needs.hpp"
#include "host/planning/tiles.hpp"
#include "host/render.hpp"
#include "host/trace/device_scene.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/plans.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Approx;

Scene data_scene(const std::string& name, const std::vector<std::string>& set = {}) {
  return load_scene(std::filesystem::path(RAYWAVE_DATA_DIR) / name, set);
}

Plan plan_of(const Scene& scene, const World& world) { return make_plan(scene, world); }

Planned planned(const Scene& scene, const Goal& goal = {}) {
  return plan_scene(scene, build_world(scene), {}, goal);
}

/// The same with light over WRPs.
Scene over_wrps(const std::string& name, std::vector<std::string> set = {}) {
  set.push_back("wrp.propagation=spectrum");
  return data_scene(name, set);
}

/// Squares of 2 mm that face the hologram, centred at these places.
World squares_at(const std::vector<glm::dvec2>& centres_m, double z_m = 100 * mm) {
  std::vector<Square> squares;
  for (const auto& centre : centres_m) squares.push_back({2 * mm, {centre, z_m}});
  return world_of_squares(squares, true);
}

Scene glowing_scene() {
  Scene scene;
  scene.file = "scene.toml";
  scene.wrp.propagation = WrpPropagation::spectrum;
  scene.lights.emplace_back();
  scene.materials = {glowing()};
  scene.objects = {object_at("", 1, {})};
  return scene;
}

bool warns(const Planned& p, const std::string& text) {
  return std::any_of(p.warnings.begin(), p.warnings.end(),
                     [&](const auto& w) { return w.find(text) != std::string::npos; });
}

TEST_CASE("a corner of the grid without light gets no WRP") {
  const auto scene = glowing_scene();
  const auto all = plan_of(
      scene,
      squares_at({{-5 * mm, -3 * mm}, {5 * mm, -3 * mm}, {-5 * mm, 3 * mm}, {5 * mm, 3 * mm}}));
  REQUIRE(all.grid == glm::ivec2(2, 2));
  CHECK(all.wrps.size() == 4);
  const auto l_shaped =
      plan_of(scene, squares_at({{-5 * mm, -3 * mm}, {5 * mm, -3 * mm}, {-5 * mm, 3 * mm}}));
  REQUIRE(l_shaped.grid == glm::ivec2(2, 2));
  REQUIRE(l_shaped.wrps.size() == 3);
  for (const auto& wrp : l_shaped.wrps) CHECK_FALSE((wrp.centre_m.x > 0 && wrp.centre_m.y > 0));
}

TEST_CASE("a corner that a triangle's bounding box reaches, but not its light, gets no WRP") {
  const auto scene = glowing_scene();
  World world = squares_at({{0, 0}});
  world.positions = {{-9 * mm, -5 * mm, 0.1},
                     {9 * mm, -5 * mm, 0.1},
                     {-9 * mm, 5 * mm, 0.1},
                     {-9 * mm, 5 * mm, 0.1}};
  world.triangles = {{0, 1, 2}};
  world.triangle_object = {0};
  world.min_m = {-9 * mm, -5 * mm, 0.1};
  world.max_m = {9 * mm, 5 * mm, 0.1};
  const auto plan = plan_of(scene, world);
  REQUIRE(plan.grid == glm::ivec2(3, 3));
  CHECK(plan.wrps.size() == 8);  // the one farthest from the long side is dark
}

DEVICE_TEST("leaving out WRPs without light does not change the hologram") {
  auto scene = glowing_scene();
  scene.hologram.resolution = {192, 160};
  scene.sampling.pitch_m = 60 * um;
  World world = squares_at({{-0.5 * mm, -0.4 * mm}});
  for (auto& p : world.positions)
    p = {(p.x + 0.5 * mm) * 0.2 - 0.5 * mm, (p.y + 0.4 * mm) * 0.2 - 0.4 * mm, 0.02};
  world.min_m = world.positions[0];
  world.max_m = world.positions[2];
  scene.wrp.distances_m = {19.9 * mm};
  scene.wrp.grid = glm::ivec2(1, 1);
  const auto one = render(device, scene, world);
  scene.wrp.grid = glm::ivec2(3, 3);  // the one in the middle stands where the one alone does
  const auto nine = render(device, scene, world);
  REQUIRE(nine.plan.wrps.size() == 1);
  CHECK(nine.field.samples == one.field.samples);
}

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
    "and reference keeps the whole wave") {
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
  PictureModel model{.wavelength_m = 1e-6, .window_m = {1e-3, 1e-3}, .cone = cone};
  model.spot_m = {100e-6, 100e-6};  // 0.1 m away
  model.resolution_m = blur * 100e-6 / blur_of_resolution;
  PictureRow row{.z_m = 0.1};
  row.layers = {{defocus, 1}};  // wavelength / window^2 is 1 per metre
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
}

TEST_CASE("the predicted PSNR reaches the goal, and a lower goal never takes longer") {
  const auto scene = data_scene("teapot.toml");
  const auto world = build_world(scene);
  double before = 0;
  for (const double psnr_db : {24.0, 26.0, 28.0, 29.5}) {
    const auto p = plan_scene(scene, world, {}, {{}, {}, psnr_db});
    CHECK(p.prediction.pictures->mean_psnr_db >= psnr_db - 0.05);
    CHECK(p.prediction.times.total_s() >= before * 0.98);
    before = p.prediction.times.total_s();
  }
  CHECK(warns(plan_scene(scene, world, {}, {{}, {}, 120.0}), "nothing reaches"));
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
  CHECK(refined.prediction.times.refine_s > 10 * refined.prediction.times.trace_s);
  // What cannot be refined stays as it is.
  auto amplitudes = scene;
  amplitudes.slm.encoding = Encoding::off_axis;
  const auto p = plan_scene(amplitudes, world, {}, {{}, {}, 60.0});
  CHECK_FALSE(p.scene.refine);
  CHECK(warns(p, "nothing reaches"));
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

TEST_CASE("kernels are built without features that no object of the scene needs") {
  auto scene = data_scene("ball_rough.toml");
  // The ball alone: no highlight; the card's texture stays among the materials
  scene.objects.resize(1);
  const auto plan = plan_of(scene, build_world(scene));
  const auto plain = kernel_options(plan);
  for (const auto& off :
       {option::textures, option::highlights, option::sharp, option::shadows, option::bounces})
    CHECK(plain.at(off) == "0");
  CHECK(plain.at(option::lights) == "1");

  auto rich = data_scene("ball_smooth.toml", {"trace.shadows=true", "trace.depth=2",
                                              "materials.ball.reflectivity=0.3"});
  const auto all = kernel_options(plan_of(rich, build_world(rich)));
  CHECK(all.at(option::textures) == "1");
  CHECK(all.at(option::highlights) == "1");
  CHECK(all.at(option::sharp) == "0");  // an exponent of 60
  CHECK(all.at(option::shadows) == "1");
  CHECK(all.at(option::bounces) == "2");

  rich.materials[rich.objects[0].material].reflectivity = 0;
  CHECK(kernel_options(plan_of(rich, build_world(rich))).at(option::bounces) == "0");
  rich.materials[rich.objects[0].material].shininess = 1e3;
  CHECK(kernel_options(plan_of(rich, build_world(rich))).at(option::sharp) == "1");
  rich.lights = {Light{LightType::ambient, {}, {}, 1}};
  CHECK(kernel_options(plan_of(rich, build_world(rich))).at(option::shadows) == "0");
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

TEST_CASE("warnings name settings that the user may not have meant", "[slow]") {
  const auto with = [](const std::vector<std::string>& set) {
    return planned(data_scene("teapot.toml", set));
  };
  CHECK_FALSE(warns(with({}), "wavelength"));
  CHECK(warns(with({"hologram.wavelength=638 um"}), "no visible light"));
  CHECK_REFUSED(data_scene("teapot.toml", {"hologram.wavelength=638"}),
                "wavelength must be 1 nm to 10 mm");
  auto metres = glowing_scene();
  metres.hologram.wavelength_m = 638;  // as code may set it
  metres.hologram.pitch_m = {638, 638};
  metres.sampling.pitch_m = 1;
  CHECK(warns(plan_scene(metres, squares_at({{0, 0}}), {}, {}), "no visible light"));
  CHECK(warns(
      with({"hologram.pitch=3.74 mm", "object.0.position=[0, 0, '100 m']", "wrp.grid=[1, 1]"}),
      "unlike any SLM"));
  CHECK(warns(with({"sampling.pitch=0.3 mm"}), "single dots"));
  // Dots that a camera sees: only where nobody chose them
  const std::string unchosen = "sampling.pitch 100 um (default) is for a bare eye";
  CHECK(warns(with({}), unchosen));
  CHECK(warns(with({"sampling.pitch=auto"}), unchosen));
  CHECK_FALSE(warns(with({"sampling.pitch=0.1 mm"}), "single dots"));
  CHECK_FALSE(warns(planned(data_scene("teapot.toml"), {Preset::balanced, {}, {}}), unchosen));
  // An eye at the eyepiece is nearer, whatever viewer.distance says
  const auto magnified = with({"viewer.eyepiece=50 mm", "viewer.eyepiece_distance=40 mm"});
  const double middle_m = (magnified.plan.extent.near_m + magnified.plan.extent.far_m) / 2;
  CHECK(magnified.prediction.resolution_m ==
        Catch::Approx((0.04 + middle_m) * std::numbers::pi / 180 / 60));
  CHECK(warns(magnified, "sampling.pitch 100 um shows single dots: the viewer makes out 4"));
  CHECK(warns(with({"sampling.pitch=5 um"}), "finer than what the hologram resolves"));
  CHECK(warns(with({"sampling.mode=fan"}), "alias"));
  CHECK(warns(with({"materials.china.reflectivity=0.2", "trace.depth=0"}), "trace.depth is 0"));
  CHECK_FALSE(warns(with({}), "replicas"));
  CHECK(warns(with({"object.0.width=20 mm", "wrp.grid=auto"}), "replicas"));
  CHECK(warns(with({"object.0.width=20 mm", "wrp.grid=auto"}), "steeper than the pixels can show"));
  CHECK(warns(with({"wrp.grid=[1, 1]", "wrp.propagation=spectrum"}), "passes beside the WRPs"));
  CHECK(warns(with({"wrp.grid=[1, 1]"}), "beside what wrp.grid lets in"));
  CHECK_FALSE(warns(with({}), "beside what wrp.grid lets in"));
  CHECK_FALSE(warns(with({}), "passes beside the WRPs"));
  CHECK(warns(with({}), "undiffracted"));
  CHECK_FALSE(warns(with({"object.0.position=['0 mm', '9 mm', '150 mm']"}), "undiffracted"));
}

TEST_CASE("a goal for a fan, whose pictures cannot be predicted, is refused") {
  CHECK_REFUSED(
      planned(data_scene("teapot.toml", {"sampling.mode=fan"}), Goal{Preset::draft, {}, {}}),
      "cannot be predicted");
}

DeviceFigures small_device() {
  DeviceFigures small;
  small.name = "small";
  small.memory.device_bytes = 64 << 20;
  small.memory.largest_buffer_bytes = 16 << 20;
  small.fft = cl::FftBackend::clfft;
  return small;
}

TEST_CASE("a plan warns of memory that the device does not have, with what needs less") {
  const auto scene = over_wrps("teapot.toml", {"hologram.tiles=[1, 1]"});
  const auto p = plan_scene(scene, build_world(scene), small_device(), {});
  CHECK(warns(p,
              "padded plane: 63.3 MiB in one buffer, small allows 16.0 MiB; a smaller "
              "hologram.resolution or wrp.padding, or more "
              "hologram.tiles, needs less"));
  CHECK(warns(p, "small has 64.0 MiB"));
}

TEST_CASE(
    "a hologram too large for the device is planned in the fewest tiles that fit, and the plan "
    "says why") {
  auto small = small_device();
  const auto scene = over_wrps("teapot.toml");
  const auto world = build_world(scene);
  const auto needs_of = [&](const Plan& plan) {
    return memory_needs(world, plan, {Method::wrp, small.fft}, small.memory.largest_buffer_bytes);
  };
  const auto p = plan_scene(scene, world, small);
  CHECK(p.plan.tiling.grid == glm::ivec2(3, 2));
  CHECK(p.plan.tiling.tile_size == glm::ivec2(640, 540));
  CHECK(p.plan.tiling.why ==
        "in one piece padded plane 63.3 MiB in one buffer, the device allows 16.0 MiB");
  CHECK(std::any_of(p.reasons.begin(), p.reasons.end(), [](const auto& r) {
    return r.starts_with("hologram.tiles 3 x 2: in one piece");
  }));
  for (const auto& need : needs_of(p.plan).device)
    CHECK(need.bytes <= small.memory.largest_buffer_bytes);
  CHECK(needs_of(p.plan).device_bytes() <= small.memory.device_bytes);
  CHECK_FALSE(warns(p, "small allows"));
  CHECK_FALSE(warns(p, "small has"));

  small.memory.largest_buffer_bytes = 1 << 30;
  const auto by_total = plan_scene(scene, world, small).plan;
  CHECK(by_total.tiling.grid == glm::ivec2(3, 2));
  CHECK(by_total.tiling.why.find("the device has 64.0 MiB") != std::string::npos);
  small.memory.device_bytes = 1 << 30;
  CHECK(plan_scene(scene, world, small).plan.tiling.grid == glm::ivec2(1, 1));
  small.memory.host_bytes = 90 << 20;  // 18 MiB of field and levels, planes of 158 MiB
  CHECK(plan_scene(scene, world, small).plan.tiling.grid == glm::ivec2(2, 2));
  // Memory of results does not depend on tiles: the plan stays in one piece, and says so
  small.memory.host_bytes = 1 << 20;
  const auto none = plan_scene(scene, world, small);
  CHECK(none.plan.tiling.grid == glm::ivec2(1));
  CHECK(warns(none, "there are 1.0 MiB"));
}

TEST_CASE(
    "nothing is chosen for pictures that the machine cannot hold, and a line says what would") {
  DeviceFigures small;
  small.memory.host_bytes = 8 << 20;  // 16 MiB of field, 2 MiB of levels
  const auto advice_of = [&](const std::vector<std::string>& set, bool keep_field) {
    const auto scene = over_wrps("teapot.toml", set);
    const auto p =
        plan_scene(scene, build_world(scene), small, {Preset::balanced, {}, {}}, keep_field);
    const auto found = std::find_if(p.warnings.begin(), p.warnings.end(), [](const auto& warning) {
      return warning.find("for them alone, there are 8.0 MiB; ") != std::string::npos;
    });
    if (found == p.warnings.end()) return std::string("fits");
    CHECK(p.scene.sampling.pitch_m == scene.sampling.pitch_m);
    CHECK(std::any_of(p.reasons.begin(), p.reasons.end(),
                      [](const auto& r) { return r.find("(default)") != std::string::npos; }));
    const auto start = found->find("hologram.resolution") + 19;
    return found->substr(start);
  };
  CHECK(advice_of({}, true) == ", or keep no field (--no-field)");
  CHECK(advice_of({}, false) == "fits");
  CHECK(advice_of({"sampling.frames=5"}, false) == "");  // levels alone are too much
  CHECK(advice_of({"slm.band=[0.5, 0.5]"}, false) == "");
  // In tiles, amplitudes are scaled over all of them
  small.memory.largest_buffer_bytes = 8 << 20;
  CHECK(advice_of({}, false) == ", or slm.encoding = \"phase\" and no field (--no-field)");
  CHECK(advice_of({}, true) == ", or slm.encoding = \"phase\" and no field (--no-field)");
  CHECK(advice_of({"slm.encoding=phase"}, false) == "fits");
}

/// Squares of 2 mm side by side, this far from the hologram.
World squares_in_depth(int count, double z_m) {
  std::vector<glm::dvec2> centres_m;
  for (int i = 0; i < count; ++i) centres_m.emplace_back((i - (count - 1) / 2.0) * 10e-3, 0);
  return squares_at(centres_m, z_m);
}

TEST_CASE("one plan serves a pose that needs WRPs and another that needs more memory") {
  auto scene = glowing_scene();
  scene.wrp.propagation = WrpPropagation::automatic;
  scene.sampling.frames = 4;
  World world;
  const auto move_to = [&](int pose) {
    world = pose == 1 ? squares_in_depth(1, 3 * mm) : squares_in_depth(3, 100 * mm);
  };
  const MemoryUse use{Method::wrp, FftBackend::clfft, false};
  move_to(0);
  CHECK(plan_of(scene, world).virtual_planes());
  move_to(1);
  CHECK_FALSE(plan_of(scene, world).virtual_planes());
  for (const std::uint64_t mib : {80, 100, 120, 160, 200, 240}) {
    INFO(mib << " MiB");
    MemoryLimits limits{.device_bytes = mib << 20};
    const auto base = fitting_plan_of_poses(scene, world, 2, move_to, limits, use);
    CHECK_FALSE(base.virtual_planes());
    for (const int pose : {0, 1}) {
      move_to(pose);
      const auto plan = make_plan(scene, world, Method::wrp, 100, false, &base);
      CHECK(plan.tiling.grid == base.tiling.grid);
      CHECK_FALSE(plan.virtual_planes());
      CHECK(memory_needs(world, plan, use, limits.largest_buffer_bytes).device_bytes() <=
            limits.device_bytes);
    }
  }

  // Whatever layers the poses before had, each has its own here
  scene.wrp.propagation = WrpPropagation::spectrum;
  const auto ask_for_layers = [&](int pose) { scene.wrp.layers = 1 + pose; };
  CHECK_REFUSED(fitting_plan_of_poses(scene, world, 2, ask_for_layers, MemoryLimits{}, use),
                "no plan serves all 2 pictures: that of picture 1 has other tiles");
}

TEST_CASE("a second buffer of grey levels is counted where there is a second frame or tile") {
  const auto buffers_of = [](const std::vector<std::string>& set) {
    const auto scene = data_scene("teapot.toml", set);
    const auto world = build_world(scene);
    const auto plan = fitting_plan(scene, world, {});
    const auto needs = memory_needs(world, plan, {}, MemoryLimits::none);
    return std::count_if(needs.device.begin(), needs.device.end(), [&](const auto& need) {
      return need.name == "hologram levels" &&
             need.bytes ==
                 static_cast<std::uint64_t>(plan.tiling.tile_size.x * plan.tiling.tile_size.y);
    });
  };
  CHECK(buffers_of({}) == 1);
  CHECK(buffers_of({"sampling.frames=2"}) == 2);
  CHECK(buffers_of({"hologram.tiles=[2, 2]"}) == 2);
}

TEST_CASE(
    "plans for virtual planes have one plane for all WRPs of a layer, few scan lines, an error of "
    "two per cent, and goals as others have") {
  const auto compact = [](const std::string& name, std::vector<std::string> set = {}) {
    set.push_back("wrp.propagation=compact");
    return data_scene(name, set);
  };
  const auto teapot = planned(compact("teapot.toml"));
  REQUIRE(teapot.plan.virtual_planes());
  CHECK(teapot.plan.virtual_planes()->size == glm::ivec2(2048, 1152));
  CHECK(teapot.plan.virtual_planes()->lines == 4);
  CHECK(teapot.plan.wrps.size() == 1);
  CHECK(cone_error_of(teapot.plan) == 0);
  CHECK(teapot.prediction.field_error < 0.02);
  CHECK(teapot.prediction.device_bytes < 24u * 1920 * 1080);
  // Objects 50 mm apart: footprints on a plane between them would be too long
  CHECK(warns(planned(compact("apart.toml", {"wrp.layers=1"})), "virtual planes bring an error"));
  const auto apart = planned(compact("apart.toml", {"wrp.layers=2"}));
  CHECK(apart.plan.wrps.size() == 2);
  CHECK(apart.prediction.field_error < 0.02);
  CHECK(planned(compact("teapot.toml", {"hologram.tiles=[2, 1]"})).plan.wrps.size() == 2);

  Goal goal{.preset = Preset::balanced};
  const auto balanced = planned(compact("teapot.toml"), goal),
             wrps = planned(over_wrps("teapot.toml"), goal);
  CHECK(balanced.prediction.field_error < 0.1 * wrps.prediction.field_error);
  CHECK(balanced.prediction.times.total_s() < wrps.prediction.times.total_s());

  const auto fan = compact("teapot.toml", {"sampling.mode=fan"});
  CHECK_REFUSED(plan_of(fan, build_world(fan)), "wrp.propagation \"compact\"", "give \"spectrum\"");
}

}  // namespace
}  // namespace raywave
