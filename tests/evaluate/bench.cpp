// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/bench/bench.hpp"

#include <nlohmann/json.hpp>

#include "tests/support/devices.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

BenchOptions brief(const cl::Device& device) {
  BenchOptions options;
  options.fft = cl::default_backend(device.info());
  options.frames = 3;
  options.lens_points = 3;
  options.quick = true;
  return options;
}

BenchCase small_case(const test::Desk& desk) {
  BenchCase c;
  c.group = "test";
  c.name = "a square";
  c.scenes = {load_scene(desk.file("scene.toml"))};
  c.target = {20, 60};
  return c;
}

/// Checks that a row has three frames, and that their stages add up to them and none is negative.
void check_frames(const BenchRow& row) {
  REQUIRE(row.frames.size() == 3);
  for (const auto& frame : row.frames) {
    double sum = 0;
    for (const auto& [stage, seconds] : frame.stages_s) {
      INFO(stage);
      CHECK(seconds >= -1e-6);
      sum += seconds;
    }
    CHECK_THAT(sum, WithinRel(frame.wall_s, 1e-9));
  }
}

BenchRow row_of(const std::string& name, double wall_s, double processor_s) {
  BenchRow row;
  row.name = name;
  row.frames = {{wall_s, processor_s, {}}};
  return row;
}

DEVICE_TEST(
    "stages of every frame add up to it, none is negative, and quality is finite, on every "
    "device") {
  const test::Desk desk;
  Bench bench(device.info(), brief(device));
  CHECK(bench.limits().bytes_per_s > 0);
  CHECK(bench.limits().operations_per_s > 0);
  const auto row = bench.run(small_case(desk));
  INFO(device.info().name << ": " << row.note);
  check_frames(row);
  for (const auto& frame : row.frames) {
    CHECK(frame.processor_s >= 0);
    for (const char* stage : {"tree", "samples", "trace", "propagate", "encode", "rest"})
      CHECK(frame.stages_s.contains(stage));
  }
  REQUIRE(row.quality);
  CHECK(std::isfinite(row.quality->psnr_db));
  CHECK_THAT(row.quality->z_m, WithinRel(10e-3, 1e-9));
  CHECK(row.triangles == 2);
  CHECK(row.samples > 0);
  CHECK(row.device_peak_bytes > 8 * 48 * 32);
  CHECK(row.resident_bytes > 0);
  CHECK(row.first_frame_s > 0);
}

TEST_CASE("cases of one scene whose pictures have windows of their own are all judged") {
  const test::Desk desk;
  const auto device = test::all_devices().front();
  Bench bench(device.info(), brief(device));
  auto one = small_case(desk);
  for (const double pitch_m : {0.2e-3, 0.05e-3}) {
    one.scenes[0].sampling.pitch_m = pitch_m;
    const auto row = bench.run(one);
    INFO(pitch_m << " m: " << row.note);
    REQUIRE(row.quality);
    CHECK(std::isfinite(row.quality->psnr_db));
  }
}

DEVICE_TEST(
    "a frame of several lasers is that of all, and its quality that of the colour picture") {
  const test::Desk desk;
  Bench bench(device.info(), brief(device));
  const auto alone = bench.run(small_case(desk));
  auto c = small_case(desk);
  c.scenes = load_scenes(desk.file("scene.toml"),
                         {"hologram.wavelength=[\"638 nm\", \"520 nm\", \"450 nm\"]"});
  const auto row = bench.run(c);
  INFO(device.info().name << ": " << row.note);
  check_frames(row);
  CHECK(row.holograms() == 3);
  CHECK_THAT(row.per_second(), WithinRel(3 / row.wall_s().median, 1e-9));
  CHECK(row.samples == 3 * alone.samples);
  CHECK(row.work.at("encode").bytes == 3 * alone.work.at("encode").bytes);
  QualitySpec what;
  what.depths_m = {10e-3};
  what.views = false;
  what.lens_points = 3;
  what.blur_m = blur_of_resolution * c.scenes[0].sampling.pitch_m;
  RenderOptions how;
  how.fft = bench.options().fft;
  const auto seen = assess(device, c.scenes, build_world(c.scenes[0]), how, what);
  REQUIRE(row.quality);
  CHECK_THAT(row.quality->psnr_db, WithinRel(seen.rows.at(0).figures.luminance.psnr_db, 1e-6));
}

TEST_CASE("meshes that no file holds are measured, and they move in every frame") {
  const test::Desk desk;
  const auto device = test::all_devices().front();
  auto c = small_case(desk);
  c.scenes[0].objects[0].mesh = "missing.obj";
  Mesh triangle;
  triangle.positions = {{-0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}};
  triangle.normals.assign(3, glm::dvec3(0, 0, -1));
  triangle.uvs.assign(3, glm::dvec2(0));
  triangle.triangles.emplace_back(0, 1, 2);
  c.meshes =
      std::make_shared<const Meshes>(Meshes{{finish_mesh(triangle, Normals::file)}, {false}, {0}});
  const auto row = Bench(device.info(), brief(device)).run(c);
  INFO(row.note);
  REQUIRE(row.frames.size() == 3);
  CHECK(row.triangles == 1);
  // A renderer that had nothing to do would have no tree to fit.
  for (const auto& frame : row.frames) CHECK(frame.stages_s.at("tree") > 0);
}

TEST_CASE("a strip of the hologram is scaled to all of it and not judged") {
  const test::Desk desk;
  const auto device = test::all_devices().front();
  auto c = small_case(desk);
  c.method = Method::points;
  c.share = 4;
  const auto row = Bench(device.info(), brief(device)).run(c);
  INFO(row.note);
  check_frames(row);
  CHECK_FALSE(row.quality);
  CHECK_SAYS(bench_line(row, BenchStyle::aligned), "(1/4, scaled)");
}

TEST_CASE("what cannot be computed is a row with its reason") {
  const test::Desk desk;
  const auto device = test::all_devices().front();
  auto c = small_case(desk);
  c.scenes[0].objects[0].mesh = "missing.obj";
  Bench bench(device.info(), brief(device));
  const auto row = bench.run(c);
  CHECK(row.frames.empty());
  CHECK_SAYS(row.note, "missing.obj");
  CHECK_SAYS(bench_line(row, BenchStyle::aligned), "missing.obj");
  CHECK(nlohmann::json::parse(bench_json(bench, "test", {row}, {}))["rows"][0]["frames"] == 0);
}

TEST_CASE("the JSON holds device, rates, and every figure of a row") {
  const test::Desk desk;
  const auto device = test::all_devices().front();
  Bench bench(device.info(), brief(device));
  const auto row = bench.run(small_case(desk));
  const auto json = nlohmann::json::parse(
      bench_json(bench, "test", {row}, fill_ratios({{"itself", row.name, row.name, 1, 0}}, {row})));
  for (const char* key : {"raywave", "date", "suite", "device", "rates", "rows", "ratios"})
    CHECK(json.contains(key));
  for (const char* key : {"index", "name", "platform", "version", "driver", "fft"})
    CHECK(json["device"].contains(key));
  for (const char* key : {"copy_bytes_per_s", "multiply_add_operations_per_s"})
    CHECK(json["rates"][key] > 0);
  const auto& r = json["rows"][0];
  for (const char* key :
       {"group", "name", "note", "scene", "scaled_from_one_in", "frames", "wall_s", "processor_s",
        "first_frame_s", "holograms_per_s", "required_per_s", "aim_per_s", "stages", "quality",
        "memory", "others_share_of_processors"}) {
    INFO(key);
    CHECK(r.contains(key));
  }
  CHECK(r["frames"] == 3);
  CHECK(r["required_per_s"] == 20);
  CHECK(r["wall_s"]["low"] <= r["wall_s"]["median"]);
  CHECK(r["wall_s"]["median"] <= r["wall_s"]["high"]);
  CHECK(r["stages"]["propagate"]["operations"] > 0);
  CHECK(r["stages"]["encode"]["bytes"] == 11 * 48 * 32);
  CHECK(std::isfinite(r["quality"]["psnr_db"].get<double>()));
  CHECK(json["ratios"][0]["wall"] == 1.0);
}

TEST_CASE("quartiles lie where they do, and ratios want both rows") {
  CHECK(spread_of({}).median == 0);
  CHECK(spread_of({7}).low == 7);
  const auto spread = spread_of({5, 1, 3, 2, 4});
  CHECK_THAT(spread.low, WithinAbs(2, 1e-12));
  CHECK_THAT(spread.median, WithinAbs(3, 1e-12));
  CHECK_THAT(spread.high, WithinAbs(4, 1e-12));
  CHECK_THAT(spread_of({1, 2}).median, WithinAbs(1.5, 1e-12));

  const std::vector<BenchRow> rows{row_of("fast", 1, 2), row_of("slow", 4, 6)};
  const auto ratios =
      fill_ratios({{"fast over slow", "fast", "slow"}, {"fast over none", "fast", "none"}}, rows);
  REQUIRE(ratios.size() == 1);
  CHECK_THAT(ratios[0].wall, WithinRel(0.25, 1e-12));
  CHECK_THAT(ratios[0].processor, WithinRel(1.0 / 3, 1e-12));
}

TEST_CASE("the parts of stages add up to the median frame, where medians of stages do not") {
  BenchRow row;
  row.frames = {{3, 0, {{"tree", 2}, {"rest", 1}}},
                {4, 0, {{"tree", 1}, {"rest", 3}}},
                {5, 0, {{"tree", 4}, {"rest", 1}}},
                {9, 0, {{"tree", 1}, {"rest", 8}}}};
  CHECK_THAT(row.part_s("tree") + row.part_s("rest"), WithinRel(row.wall_s().median, 1e-12));
  CHECK_THAT(row.part_s("tree"), WithinRel(4.5 * 5 / 9, 1e-12));
  CHECK(row.part_s("trace") == 0);
  row.frames.resize(2);
  CHECK_THAT(row.part_s("tree") + row.part_s("rest"), WithinRel(row.wall_s().median, 1e-12));
}

TEST_CASE("rows of another program come back as it printed them, and its failure is told") {
  const Folder folder;
  auto row = row_of("a peer", 0.5, 0.75);
  row.frames[0].stages_s["trace"] = 0.25;
  const auto printed = folder.write("rows.json", peer_json({row}));
  const auto rows = run_peer("/bin/cat", {printed.string()});
  REQUIRE(rows.size() == 1);
  CHECK(rows[0].name == "a peer");
  CHECK(rows[0].peer);
  CHECK(rows[0].frames.at(0).wall_s == 0.5);
  CHECK(rows[0].frames.at(0).processor_s == 0.75);
  CHECK(rows[0].frames.at(0).stages_s.at("trace") == 0.25);
  CHECK_REFUSED(run_peer("/bin/false", {}), "/bin/false");
  CHECK_REFUSED(run_peer("/bin/echo", {"no JSON"}), "printed no rows");
  CHECK_REFUSED(run_peer((folder / "missing").string(), {}), "missing");
}

TEST_CASE("every suite names its rows apart, and its ratios name rows of it or of a peer") {
  for (const char* name : {"cpu", "gpu", "paper", "scaling"}) {
    INFO(name);
    const auto suite = bench_suite(name, RAYWAVE_DATA_DIR);
    std::set<std::string> names;
    for (const auto& c : suite.cases) {
      INFO(c.name);
      CHECK(names.insert(c.name).second);
      CHECK(c.name.size() <= 50);  // the column
    }
    for (const auto& ratio : suite.ratios) {
      INFO(ratio.name << ": " << ratio.row << ", " << ratio.base);
      CHECK((names.contains(ratio.row) || ratio.row.starts_with("propagation, ")));
      CHECK((names.contains(ratio.base) || ratio.base.starts_with("plain FFTW") ||
             ratio.base.starts_with("Embree")));
    }
  }
  CHECK_SAYS(input_error_of([] { bench_suite("fpga", RAYWAVE_DATA_DIR); }),
             "cpu, gpu, paper and scaling");
}

TEST_CASE(
    "bench measures a scene of the user's, as a table and as JSON, and refuses what it does not "
    "know") {
  const test::Desk desk;
  const auto json = desk.file("bench.json");
  for (const bool markdown : {false, true}) {
    std::vector<std::string> words{
        "bench", desk.file("scene.toml"), "--frames", "3", "--lens-points", "3", "--json", json};
    if (markdown) words.emplace_back("--markdown");
    const auto outcome = desk.succeed(words);
    CHECK_SAYS(outcome.out, markdown ? "| scene |" : "propagate");
    CHECK(nlohmann::json::parse(bytes_of(json))["rows"][0]["name"] == "scene");
  }
  test::check_refused(desk.run({"bench", "--suite", "fpga"}), 2, "cpu, gpu, paper and scaling");
  test::check_refused(desk.run({"bench", desk.file("missing.toml")}), 2, "missing.toml");
  test::check_refused(desk.run({"bench", "--suite", "cpu", "--only", "nothing of the kind",
                                "--peers", desk.file("none")}),
                      2, "no row's name");
}

}  // namespace
}  // namespace raywave
