// SPDX-License-Identifier: Apache-2.0
/// Plans fit the scene and the device: WRPs, kernels, memory, and what is warned of.
#include "host/carriers/planning/facts.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/report.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/planning/memory_needs.hpp"
#include "host/planning/tiles.hpp"
#include "host/render.hpp"
#include "host/trace/device_scene.hpp"
#include "tests/forecast/data_scenes.hpp"
#include "tests/support/devices.hpp"

namespace raywave {
namespace {

using namespace test;

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
  CHECK(all.at(option::sharp) == "0");     // an exponent of 60
  CHECK(all.at(option::shadows) == "16");  // of a light without a size
  CHECK(all.at(option::bounces) == "2");

  rich.materials[rich.objects[0].material].reflectivity = 0;
  CHECK(kernel_options(plan_of(rich, build_world(rich))).at(option::bounces) == "0");
  rich.materials[rich.objects[0].material].shininess = 1e3;
  CHECK(kernel_options(plan_of(rich, build_world(rich))).at(option::sharp) == "1");
  rich.lights = {Light{LightType::ambient, {}, {}, 1}};
  CHECK(kernel_options(plan_of(rich, build_world(rich))).at(option::shadows) == "0");
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
  CHECK(warns(with({"light.0.intensity=0"}), "faces a light"));
  CHECK(warns(with({"light.0.direction=[0, 0, -1]"}), "faces a light"));
  CHECK_FALSE(warns(with({}), "faces a light"));
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
  auto unsized = data_scene("teapot.toml", {"hologram.resolution=[240, 136]"});
  unsized.objects[0].width_m.reset();
  CHECK(warns(planned(unsized), " m, for it has no width, and a unit of its mesh is 1 m: give a"));
  unsized.objects[0].unit_m = 1 * mm;
  CHECK_FALSE(warns(planned(unsized), "has no width"));
}

TEST_CASE(
    "plans say what share of the light few levels, or less than a turn, put into the picture") {
  const auto with = [](std::vector<std::string> set) {
    set.insert(set.end(), {"hologram.resolution=[240, 136]", "slm.encoding=phase"});
    return planned(data_scene("teapot.toml", set));
  };
  const auto says = [](double share) {
    return "the phases that the SLM shows put " + percent_text(share) + " of the light into";
  };
  // sinc^2(1 / L) of L even levels
  const auto of_levels = [](double levels) {
    return std::pow(std::sin(std::numbers::pi / levels) * levels / std::numbers::pi, 2);
  };
  CHECK(warns(with({"slm.levels=2"}), "slm.levels: " + says(of_levels(2))));
  CHECK(warns(with({"slm.levels=3"}), "slm.levels: " + says(of_levels(3))));
  CHECK_FALSE(warns(with({"slm.levels=8"}), "put"));
  CHECK_FALSE(warns(with({}), "put"));
  // Phases beyond the span s go to the nearer end: s + sin(pi (1 - s)) / pi, squared
  const double span = 0.6, sum = span + std::sin(std::numbers::pi * (1 - span)) / std::numbers::pi;
  CHECK(warns(with({"slm.levels_per_turn=425"}), "slm.levels_per_turn: " + says(sum * sum)));
  std::string lut;
  for (int level = 0; level < 256; ++level)
    lut += (level > 0 ? ", " : "") + number_text(level * span / 255);
  CHECK(warns(with({"slm.lut=[" + lut + "]"}), "slm.lut: " + says(sum * sum)));
}

TEST_CASE("a plan warns of a real image that reaches behind the viewer's eye, and by how much") {
  const auto with = [](const std::string& distance) {
    return planned(data_scene(
        "teapot.toml", {"hologram.resolution=[240, 136]", "object.0.position=[0, 0, '-150 mm']",
                        "viewer.distance=" + distance}));
  };
  const auto near = with("100 mm");
  CHECK(warns(near, "behind the viewer's eye: give a viewer.distance of more than " +
                        length_text(-near.plan.extent.near_m)));
  CHECK_FALSE(warns(with("200 mm"), "behind the viewer's eye"));
  const auto close = with("200 mm");
  CHECK(warns(close, "nearer than eyes focus: a viewer.distance of 260 mm is seen sharp"));
  CHECK_FALSE(warns(with("260 mm"), "nearer than eyes focus"));
}

TEST_CASE(
    "a scene smaller than what the viewer makes out is a dot, and its PSNR no lower than black") {
  const auto dot = planned(data_scene(
      "teapot.toml", {"hologram.resolution=[240, 136]", "object.0.position=[0, 0, '150 m']"}));
  CHECK(warns(dot, "looks like a dot: check the units"));
  CHECK(dot.prediction.pictures.value().mean_psnr_db > 0);
}

TEST_CASE("a user who says that nothing is left undiffracted is not warned of it") {
  const auto told = [](std::vector<std::string> sets) {
    return warns(planned(data_scene("teapot.toml", sets)), "undiffracted");
  };
  CHECK(told({}));
  CHECK_FALSE(told({"slm.undiffracted=0"}));
  CHECK(told({"slm.undiffracted=0.01"}));
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
  const auto scene = over_wrps("teapot.toml", {"slm.encoding=double-phase"});
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
  small.memory.host_bytes = 100 << 20;  // 18 MiB of field and levels, planes of 158 MiB
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
    const auto p = plan_scene(scene, build_world(scene), small, {Preset::balanced, {}, {}},
                              {.field = keep_field});
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
  const std::string by_tile = ", or let render write a file of each tile (--tiles all)";
  CHECK(advice_of({}, true) == ", or keep no field (--no-field)" + by_tile);
  CHECK(advice_of({}, false) == "fits");
  CHECK(advice_of({"sampling.frames=5"}, false) == by_tile);  // levels alone are too much
  CHECK(advice_of({"slm.band=[0.5, 0.5]"}, false) == "");
  // In tiles, amplitudes are scaled over all of them
  small.memory.largest_buffer_bytes = 8 << 20;
  for (const bool keep_field : {false, true})
    CHECK(advice_of({"slm.encoding=double-phase"}, keep_field) ==
          ", or slm.encoding = \"phase\" and no field (--no-field)" + by_tile);
  CHECK(advice_of({"slm.encoding=phase"}, false) == "fits");
}

TEST_CASE("tiles that are files of their own divide what memory does not hold of the whole") {
  const auto scene = over_wrps("teapot.toml", {"slm.encoding=double-phase"});
  const auto world = build_world(scene);
  constexpr auto fft = FftBackend::host;
  const MemoryUse whole{Method::wrp, fft, false}, by_tile{Method::wrp, fft, false, true};
  MemoryLimits limits;
  limits.host_bytes = 17 << 20;  // 18 MiB of field and levels
  const auto refused = fitting_plan(scene, world, limits, whole);
  CHECK_FALSE(
      results_shortage(refused, memory_needs(world, refused, whole, limits.none), whole, limits)
          .empty());
  limits.host_bytes = 64 << 20;
  const auto plan = fitting_plan(scene, world, limits, by_tile);
  REQUIRE(plan.tiling.tiles.size() > 1);
  const auto needs = memory_needs(world, plan, by_tile, limits.none);
  const auto size = plan.tiling.tile_size;
  CHECK(needs.results_bytes == static_cast<std::uint64_t>(size.x * size.y));
  CHECK(results_shortage(plan, needs, by_tile, limits).empty());
  CHECK(host_shortage(plan, needs, limits).empty());
}

TEST_CASE("a wide hologram has as many tiles as virtual planes need, and is told what it hides") {
  const std::vector<std::string> wide{"hologram.resolution=[65536,65536]",
                                      "hologram.pitch=1 um",
                                      "wrp.grid=auto",
                                      "slm.encoding=phase",
                                      "object.0.width=40 mm",
                                      "object.0.position=['0 mm','0 mm','300 mm']"};
  const auto with = [&](const std::string& key) {
    auto keys = wide;
    keys.push_back(key);
    return planned(data_scene("teapot.toml", keys));
  };
  const auto p = planned(data_scene("teapot.toml", wide));
  REQUIRE(p.plan.virtual_planes());
  CHECK(p.plan.virtual_planes()->error() <= 0.05);
  CHECK(p.plan.tiling.grid.x > 4);
  CHECK(std::min(p.plan.tiling.tile_size.x, p.plan.tiling.tile_size.y) >= 2048);
  const auto text = plan_report_text({p}, build_world(data_scene("teapot.toml", wide)));
  CHECK(text.find("and " + std::to_string(p.plan.wrps.size() - 16) + " more\n") !=
        std::string::npos);
  const std::string hides = "what hides what is known of parts of the hologram 8.19 mm wide";
  CHECK(warns(p, hides));
  CHECK_FALSE(warns(with("sampling.visibility=16"), hides.substr(0, 24)));
  CHECK_FALSE(warns(with("sampling.visibility=0"), hides.substr(0, 24)));
  CHECK_FALSE(warns(planned(data_scene("teapot.toml")), hides.substr(0, 24)));
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
  scene.wrp.lines = 1;
  World world;
  const auto move_to = [&](int pose) {
    world = pose == 1 ? squares_in_depth(1, 30 * mm) : squares_in_depth(3, 100 * mm);
  };
  const MemoryUse use{Method::wrp, FftBackend::clfft, false};
  move_to(0);
  CHECK(plan_of(scene, world).virtual_planes());
  move_to(1);
  CHECK_FALSE(plan_of(scene, world).virtual_planes());
  for (const std::uint64_t mib : {80, 100, 120, 160, 200, 240}) {
    INFO(mib << " MiB");
    MemoryLimits limits{.device_bytes = mib << 20};
    std::vector<int> poses{0, 0, 1, 0, 1};
    const auto base = fitting_plan_of_poses(scene, world, poses, move_to, limits, use);
    CHECK_FALSE(base.virtual_planes());
    // The poses that it needs make it again
    CHECK(poses.front() == 0);
    CHECK(poses.size() < 5);
    const auto again = fitting_plan_of_poses(scene, world, poses, move_to, limits, use);
    CHECK(again.tiling.grid == base.tiling.grid);
    CHECK(again.most_layers == base.most_layers);
    CHECK(propagation_of(again) == propagation_of(base));
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
  std::vector<int> both{0, 1};
  CHECK_REFUSED(fitting_plan_of_poses(scene, world, both, ask_for_layers, MemoryLimits{}, use),
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
  CHECK(teapot.prediction.device_bytes < 25u * 1920 * 1080);
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
