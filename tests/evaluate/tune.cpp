// SPDX-License-Identifier: Apache-2.0
// How work is shared out among work-items: that it changes no result, and how `raywave tune`
// chooses and keeps it.
#include "host/evaluate/tune.hpp"

#include <sys/stat.h>

#include "host/trace/work_shape.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using cl::WorkShape;
using test::mm;
using test::um;

/// A shiny ball before a wall, 10 mm from a hologram of 150 x 83 pixels of 4 um, in two frames.
Scene ball_scene(const Folder& folder) {
  auto scene = test::ball_and_wall(folder, {150, 83}, 10 * um, 6, 0.15 * mm,
                                   {20 * um, 10 * um, 9.8 * mm}, 0.4 * mm, 10 * mm);
  scene.sampling.frames = 2;
  return scene;
}

TEST_CASE("fields do not depend on the work shape beyond rounding") {
  const Folder folder;
  const auto scene = ball_scene(folder);
  for (const auto& device : cl::list_devices()) {
    auto as_gpu = device;
    as_gpu.kind = cl::DeviceKind::gpu;
    as_gpu.float_lanes = 1;
    for (auto info : {device, as_gpu}) {
      const auto by_kind = work_shape(info);
      const auto expected = render(cl::Device(info), scene);
      std::vector<WorkShape> shapes{{1, 2, 0}, {1, 5, 0}};
      if (by_kind.lanes > 1)
        shapes = {{by_kind.lanes, 32, 8},
                  {by_kind.lanes, 6, 3},
                  {by_kind.lanes == 4 ? 8 : by_kind.lanes / 2, 16, 1}};
      for (const auto& shape : shapes) {
        CAPTURE(info.name, shape.lanes, shape.tile_rows, shape.strip_tiles);
        REQUIRE(why_unfit(shape, info).empty());
        info.work = shape;
        const auto result = render(cl::Device(info), scene);
        CHECK(result.samples == expected.samples);
        CHECK(result.hidden_samples == expected.hidden_samples);
        CHECK(test::relative_l2(result.field.samples, expected.field.samples) <= 1e-5);
      }
    }
  }
}

cl::DeviceInfo processor() {
  return cl::DeviceInfo{.name = "a processor", .kind = cl::DeviceKind::cpu, .float_lanes = 8};
}

TEST_CASE("shapes by kind fit their devices, and what a device cannot do is said") {
  auto gpu = processor();
  gpu.kind = cl::DeviceKind::gpu;
  gpu.float_lanes = 1;
  CHECK(work_shape(processor()).lanes == 8);
  CHECK(work_shape(gpu) == WorkShape{1, 1, 0});
  for (const auto& info : {processor(), gpu}) CHECK(why_unfit(work_shape(info), info).empty());
  CHECK(why_unfit({3, 16, 8}, processor()) == "lanes: must be 4, 8 or 16, got 3");
  CHECK_SAYS(why_unfit({1, 16, 8}, processor()), "lanes");
  CHECK(why_unfit({8, 65, 8}, processor()) == "tile_rows: must be 2 to 64, got 65");
  CHECK_SAYS(why_unfit({8, 16, 0}, processor()), "strip_tiles");
  CHECK_SAYS(why_unfit({16, 1, 0}, gpu), "lanes");
  CHECK_SAYS(why_unfit({1, 0, 0}, gpu), "tile_rows");
  CHECK_SAYS(why_unfit({1, 1, 8}, gpu), "strip_tiles");
  CHECK(rows_of_tile({16, 16, 8}, 1) == 16);
  CHECK(rows_of_tile({16, 16, 8}, 4) == 4);
  CHECK(rows_of_tile({16, 16, 8}, 16) == 2);
  CHECK(rows_of_tile({1, 1, 0}, 16) == 1);
}

/// Runs that take as long as `seconds` says of their shape, give or take a share of it.
auto runs_of(const std::function<double(const WorkShape&)>& seconds, double scatter) {
  return [=](const WorkShape& best, const WorkShape& tried) {
    const auto runs = [&](const WorkShape& shape) {
      ShapeRuns all;
      for (int i = -4; i <= 4; ++i) all.push_back(seconds(shape) * (1 + scatter * i / 4));
      return all;
    };
    return std::pair(runs(best), runs(tried));
  };
}

TEST_CASE("a shape is kept when it is faster by more than a twentieth and than runs scatter") {
  std::vector<ShapeTrial> trials;
  const auto tell = [&](const ShapeTrial& trial) { trials.push_back(trial); };
  // Half the rows: 0.81 of the time
  const auto rows_cost = [](const WorkShape& shape) { return std::pow(shape.tile_rows, 0.3); };

  CHECK(choose_work(processor(), runs_of(rows_cost, 0), tell) == WorkShape{8, 2, 8});
  REQUIRE(trials.size() == 7);  // 4 and 16 lanes; 8, 4, 2 rows; strips of 4 and 16
  CHECK(std::count_if(trials.begin(), trials.end(), [](const auto& trial) { return trial.kept; }) ==
        3);
  CHECK(choose_work(processor(), runs_of(rows_cost, 0.5), tell) == WorkShape{8, 16, 8});
  CHECK(choose_work(
            processor(),
            runs_of([](const WorkShape& shape) { return std::pow(shape.tile_rows, 0.05); }, 0),
            tell) == WorkShape{8, 16, 8});
  CHECK(choose_work(processor(),
                    runs_of([](const WorkShape& shape) { return 1.0 / shape.strip_tiles; }, 0.1),
                    tell)
            .strip_tiles == 1024);
}

TEST_CASE(
    "a shape that the device refuses is passed over, and a measured shape does not become the "
    "measure") {
  std::vector<ShapeTrial> trials;
  auto info = processor();
  info.work = WorkShape{4, 2, 1};
  const auto run = [](const WorkShape&, const WorkShape& tried) -> std::pair<ShapeRuns, ShapeRuns> {
    if (tried.lanes == 16) throw cl::DeviceError("out of registers");
    return {{1, 1, 1}, {1, 1, 1}};
  };
  CHECK(choose_work(info, run, [&](const ShapeTrial& trial) { trials.push_back(trial); }) ==
        WorkShape{8, 16, 8});
  CHECK(std::count_if(trials.begin(), trials.end(),
                      [](const auto& trial) { return trial.refused == "out of registers"; }) == 1);
}

TEST_CASE("a device that nobody has tuned takes rates of its kind, by its compute units") {
  const Folder folder;
  const test::Environment cache("RAYWAVE_CACHE_DIR", (folder / "").string());
  auto info = processor();
  const auto ray_s = [&](cl::DeviceKind kind, unsigned units) {
    info.kind = kind;
    info.compute_units = units;
    CHECK_FALSE(figures_of(info).rates.is_measured);
    return figures_of(info).rates.ray_s;
  };
  CHECK(ray_s(cl::DeviceKind::cpu, 2) == default_rates().ray_s);
  CHECK(ray_s(cl::DeviceKind::cpu, 16) == default_rates().ray_s / 8);
  CHECK(ray_s(cl::DeviceKind::gpu, 132) == gpu_rates().ray_s);
  CHECK(ray_s(cl::DeviceKind::gpu, 66) == 2 * gpu_rates().ray_s);
  CHECK(ray_s(cl::DeviceKind::gpu, 0) == default_rates().ray_s);
  store_tuning(info, {{info.name, true, 1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-9, 7e-9}, {4, 32, 2}});
  CHECK(figures_of(info).rates.is_measured);
}

TEST_CASE("what is found out is kept per device and read back; renders work in that shape") {
  const Folder folder;
  const test::Environment cache("RAYWAVE_CACHE_DIR", (folder / "").string());
  const auto info = processor();
  CHECK_FALSE(load_tuning(info).has_value());
  CHECK_FALSE(tuned(info).work.has_value());
  store_tuning(info, {{"a processor", true, 1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-9, 7e-9}, {4, 32, 2}});
  const auto stored = load_tuning(info);
  REQUIRE(stored.has_value());
  CHECK(stored->rates.pair_s == 4e-9);
  CHECK(stored->rates.level_s == 7e-9);
  CHECK(work_shape(tuned(info)) == WorkShape{4, 32, 2});
  auto other = info;
  other.driver = "another";
  CHECK_FALSE(load_tuning(other).has_value());
  // By another version of raywave
  folder.write(tuning_file(info).filename().string(), "{\"ray_s\": 1e-9}");
  CHECK_FALSE(load_tuning(info).has_value());
  // A pipe, whose other end nobody opens
  std::filesystem::remove(tuning_file(info));
  REQUIRE(mkfifo(tuning_file(info).c_str(), 0600) == 0);
  CHECK_FALSE(load_tuning(info).has_value());
}

TEST_CASE("a damaged or absurd file is refused with its name and key") {
  const Folder folder;
  const test::Environment cache("RAYWAVE_CACHE_DIR", (folder / "").string());
  const auto info = processor();
  store_tuning(info, {{"a processor", true, 1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-9, 7e-9}, {8, 16, 8}});
  const auto name = tuning_file(info).filename().string(), whole = bytes_of(tuning_file(info));
  const auto message_with = [&](const std::string& from, const std::string& to) {
    auto text = whole;
    const auto at = text.find(from);
    REQUIRE(at != std::string::npos);
    folder.write(name, text.replace(at, from.size(), to));
    return input_error_of([&] { load_tuning(info); });
  };
  CHECK_SAYS(message_with("\"lanes\": 8", "\"lanes\": 3"),
             name + ": work.lanes: must be 4, 8 or 16, got 3; raywave tune writes it anew");
  CHECK_SAYS(message_with("\"tile_rows\": 16", "\"tile_rows\": 1000000"), "work.tile_rows");
  CHECK_SAYS(message_with("\"strip_tiles\": 8", "\"strip_tiles\": -1"), "work.strip_tiles");
  CHECK_SAYS(message_with("\"strip_tiles\"", "\"strips\""), "'strip_tiles' not found");
  CHECK_SAYS(message_with("\"pair_s\": 4e-09", "\"pair_s\": -1"), "rates.pair_s: must be seconds");
  CHECK_SAYS(message_with("\"pair_s\": 4e-09", "\"pair_s\": \"fast\""), "type must be number");
  CHECK_SAYS(message_with("\"rates\"", "rates"), "line 5");
  CHECK_SAYS(message_with(whole, ""), "parse error");
  CHECK_SAYS(message_with(whole, "[]"), name);
}

}  // namespace
}  // namespace raywave
