// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/trade/trade.hpp"

#include <nlohmann/json.hpp>

#include "host/forecast/tuning.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using Json = nlohmann::json;

/// A square of 0.2 mm before 48 x 32 pixels; `fixed` are lines of [sampling]. Knobs that want
/// kernels of their own are fixed, but for one test.
std::filesystem::path small_scene(
    const Folder& folder,
    const std::string& fixed = "antialias = 4\nvisibility = 8\nmode = \"aimed\"\n",
    const std::string& width = "0.1 mm") {
  folder.write("square.obj", test::square_obj());
  return folder.write(
      "scene.toml",
      "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n[viewer]\nresolution = \"60 "
      "um\"\n[accuracy]\n"
      "precision = \"float\"\n[sampling]\n" +
          fixed +
          "[[light]]\ndirection = [0, 0, 1]\n[[object]]\nmesh = \"square.obj\"\nwidth = \"" +
          width + "\"\nposition = [0, 0, \"10 mm\"]\n");
}

TradeSpec small_spec() {
  TradeSpec spec;
  spec.quick = true;
  spec.fft = cl::FftBackend::host;
  spec.renders = 1;
  spec.pictures.border_px = 2;
  spec.pictures.lens_points = 4;
  spec.pictures.views = false;
  return spec;
}

void nothing() {}

TradeRow row(double time_s, double psnr_db) {
  TradeRow row;
  row.renders = 1;
  row.time_s = time_s;
  row.pictures = {{"whole", 0.1, psnr_db, 1, 0, 0, 0}};
  return row;
}

TEST_CASE("the frontier holds every row that no other beats in both time and PSNR, and no other") {
  std::vector<TradeRow> rows;
  for (int i = 0; i < 60; ++i) rows.push_back(row(1 + (i * 37) % 61, 20 + (i * i * 7) % 23));
  rows.push_back(row(1000, 30));
  rows[7].renders = 0;  // not measured
  rows[7].time_s = 0;
  const auto frontier = trade_frontier(rows);
  const std::set<std::size_t> on(frontier.begin(), frontier.end());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].renders == 0) {
      CHECK_FALSE(on.contains(i));
      continue;
    }
    const bool beaten = std::any_of(rows.begin(), rows.end(), [&](const TradeRow& other) {
      return other.renders > 0 && other.time_s <= rows[i].time_s &&
             other.psnr_db() >= rows[i].psnr_db() &&
             (other.time_s < rows[i].time_s || other.psnr_db() > rows[i].psnr_db());
    });
    INFO("row " << i);
    CHECK(on.contains(i) == !beaten);
  }
  CHECK(std::is_sorted(frontier.begin(), frontier.end(),
                       [&](auto a, auto b) { return rows[a].time_s < rows[b].time_s; }));
}

TEST_CASE("the fastest row as accurate as a row is as accurate and faster, or the row itself") {
  const std::vector<TradeRow> rows{row(5, 30), row(1, 20), row(3, 31), row(4, 35), row(2, 29.9)};
  CHECK(fastest_as_accurate(rows, 0) == 2);
  CHECK(fastest_as_accurate(rows, 1) == 1);
  CHECK(fastest_as_accurate(rows, 3) == 3);
}

TEST_CASE("a PSNR is the mean over the whole views, and the sides' that over the sides") {
  TradeRow r;
  r.pictures = {{"whole", 0.1, 30, 0.5, 0.2, 0, 0},
                {"whole", 0.2, 40, 0.7, 0.1, 0, 0},
                {"left", 0.1, 20, 0, 0, 0, 0},
                {"top", 0.1, 22, 0, 0, 0, 0}};
  CHECK(r.psnr_db() == 35);
  CHECK(r.psnr_db(true) == 21);
  CHECK(r.mean(&TradePicture::ssim) == Catch::Approx(0.6));
  CHECK(r.mean(&TradePicture::flip) == Catch::Approx(0.15));
}

/// Number of knobs that differ.
int differing(const TradeKnobs& a, const TradeKnobs& b) {
  return (a.pitch_m != b.pitch_m) + (a.frames != b.frames) + (a.propagation != b.propagation) +
         (a.padding != b.padding) + (a.layers != b.layers) + (a.antialias != b.antialias) +
         (a.visibility != b.visibility) + (a.mode != b.mode) + (a.cone != b.cone) +
         (a.apodization != b.apodization) + (a.precision != b.precision) + (a.fft != b.fft) +
         (a.iterations != b.iterations) + (a.encoding != b.encoding) + (a.bounces != b.bounces) +
         (a.lines != b.lines) + (a.margin_px != b.margin_px) + (a.light_samples != b.light_samples);
}

TEST_CASE("a knob alone changes one value of balanced's, and no configuration is there twice") {
  const Folder folder;
  auto spec = small_spec();
  spec.quick = false;
  spec.fft = {};
  const std::vector<const char*> always{
      "sampling.pitch",      "sampling.frames", "wrp.layers",  "sampling.antialias",
      "sampling.visibility", "sampling.mode",   "slm.encoding"},
      over_wrps{"wrp.padding", "sampling.cone", "sampling.apodization"};
  for (const auto& device : test::all_devices()) {
    for (const std::string propagation : {"auto", "spectrum"}) {
      INFO(device.info().name << ", " << propagation);
      const TradeBench bench(
          device,
          {load_scene(small_scene(folder, ""),
                      {"accuracy.precision=auto", "wrp.propagation=" + propagation})},
          spec);
      const auto& trade = bench.trade();
      REQUIRE(trade.presets.size() == 4);
      CHECK(trade.base == trade.presets[1].row);
      std::set<std::string> knobs;
      for (const auto& step : trade.steps) {
        INFO(step.knob << " = " << step.value);
        const auto &one = trade.rows[step.row].knobs, &base = trade.rows[trade.base].knobs;
        // Fans have no virtual planes
        const bool by_fan = one.mode == SamplingMode::fan && base.propagation != one.propagation;
        // Refined pictures have an encoding of their own
        const bool unrefined = one.encoding != base.encoding && base.iterations > 0;
        CHECK(differing(one, base) == 1 + by_fan + unrefined);
        knobs.insert(step.knob);
      }
      for (const char* knob : always) CHECK(knobs.contains(knob));
      for (const char* knob : over_wrps) CHECK(knobs.contains(knob) == (propagation != "auto"));
      CHECK(knobs.contains("wrp.propagation") == (propagation == "auto"));
      CHECK(knobs.contains("fft") == (test::backends_of(device).size() > 1));
      for (std::size_t i = 0; i < trade.rows.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) CHECK_FALSE(trade.rows[i].knobs == trade.rows[j].knobs);
      }
    }
  }
}

TEST_CASE("what the scene fixes is kept in every configuration") {
  const Folder folder;
  const auto device = test::all_devices().front();
  const auto scene = load_scene(
      small_scene(folder),
      {"sampling.pitch=21 um", "sampling.frames=3", "wrp.padding=1.3", "sampling.apodization=0.1"});
  for (const bool exhaustive : {false, true}) {
    auto spec = small_spec();
    spec.exhaustive = exhaustive;
    const TradeBench bench(device, {scene}, spec);
    CHECK_FALSE(bench.trade().steps.empty());  // sampling.cone
    for (const auto& r : bench.trade().rows) {
      CHECK(r.knobs.pitch_m == 21 * test::um);
      CHECK(r.knobs.frames == 3);
      CHECK(r.knobs.padding == 1.3);
      CHECK(r.knobs.apodization == 0.1);
      CHECK(r.knobs.antialias == 4);
    }
  }
}

TEST_CASE(
    "an exhaustive trade holds every choice but those that another is predicted to beat by far") {
  const Folder folder;
  auto spec = small_spec();
  spec.quick = false;
  spec.exhaustive = true;
  const auto device = test::all_devices().front();
  const auto scene = load_scene(small_scene(folder));
  const TradeBench bench(device, {scene}, spec);
  const auto& trade = bench.trade();
  const auto all = choices(scene, build_world(scene), figures_of(device.info()));
  std::size_t held = 0;
  for (const auto& c : all) {
    const bool beaten = std::any_of(all.begin(), all.end(), [&](const Choice& b) {
      return b.psnr_db >= c.psnr_db && b.seconds * 1.3 < c.seconds;
    });
    const auto is_it = [&](std::size_t i) {
      const auto& k = trade.rows[i].knobs;
      return k.pitch_m == c.pitch_m && k.padding == c.padding && k.frames == c.frames &&
             k.layers == c.layers && k.propagation == c.propagation &&
             k.iterations == c.iterations &&
             (c.propagation == WrpPropagation::compact || Cone{k.cone, k.apodization} == c.cone);
    };
    const auto finishes = std::count_if(trade.together.begin(), trade.together.end(), is_it);
    CHECK(finishes == (beaten ? 0 : 1));  // the scene gives antialias and visibility
    held += !beaten;
  }
  CHECK(held > 4);
  CHECK(trade.together.size() == held);
}

TEST_CASE(
    "quality is that of raywave quality at the same settings, and JSON and CSV say the same") {
  const Folder folder;
  for (const auto& device : test::all_devices()) {
    INFO(device.info().name);
    auto spec = small_spec();
    spec.pictures.against_points = true;
    spec.pictures.views = true;
    const auto scene = load_scene(small_scene(folder),
                                  {"sampling.pitch=30 um", "sampling.cone=1.2", "wrp.padding=1.5"});
    TradeBench bench(device, {scene}, spec);
    bench.measure(nothing);
    const auto& trade = bench.trade();
    REQUIRE(trade.rows.size() >= 4);

    // Frames of one configuration are looked at together; alone they show the same.
    for (const auto& row : {trade.rows.front(), trade.rows[trade.presets.back().row]}) {
      auto what = trade.pictures;
      const auto alone =
          assess(device, with_knobs({scene}, row.knobs), build_world(scene), {}, what);
      REQUIRE(row.pictures.size() == alone.rows.size());
      for (std::size_t i = 0; i < alone.rows.size(); ++i) {
        CHECK(row.pictures[i].view == alone.rows[i].view);
        CHECK(row.pictures[i].psnr_db ==
              Catch::Approx(alone.rows[i].figures.luminance.psnr_db).margin(1e-3));
      }
      REQUIRE(row.correlation);
      CHECK(*row.correlation == Catch::Approx(alone.against_points->correlation).margin(1e-6));
    }

    const auto json = Json::parse(trade_json(trade));
    std::istringstream csv(trade_csv(trade));
    std::string line;
    std::getline(csv, line);
    const auto cells_of = [](const std::string& text) {
      std::vector<std::string> cells{""};
      bool within = false;
      for (const char c : text) {
        if (c == '"') within = !within;
        if (c == ',' && !within)
          cells.emplace_back();
        else if (c != '"')
          cells.back() += c;
      }
      return cells;
    };
    const auto heads = cells_of(line);
    const auto column = [&](const std::string& head) {
      const auto found = std::find(heads.begin(), heads.end(), head);
      REQUIRE(found != heads.end());
      return static_cast<std::size_t>(found - heads.begin());
    };
    REQUIRE(json["rows"].size() == trade.rows.size());
    for (const auto& j : json["rows"]) {
      REQUIRE(std::getline(csv, line));
      const auto cells = cells_of(line);
      REQUIRE(cells.size() == heads.size());
      CHECK(j["renders"] == 1);
      CHECK(Json::parse(cells[column("psnr_db")]) == j["psnr_db"]);
      CHECK(Json::parse(cells[column("time_s")]) == j["time_s"]);
      CHECK(Json::parse(cells[column("trace_wall_s")]) == j["stages"]["trace"]["wall_s"]);
      if (j.contains("against_points"))  // rows of several knobs are not looked at so closely
        CHECK(Json::parse(cells[column("points_correlation")]) ==
              j["against_points"]["correlation"]);
      for (const auto& [key, value] : j["knobs"].items())
        CHECK(cells[column(key)] == (value.is_string() ? value.get<std::string>() : value.dump()));
    }
    CHECK_FALSE(std::getline(csv, line));
    const auto sheet = bench.sheet();
    const auto columns = static_cast<int>(json["sheet"].size()) + 1,
               rows = static_cast<int>(json["pictures"]["depths_m"].size());
    CHECK((sheet.width + sheet_gap_px) % columns == 0);
    CHECK((sheet.height + sheet_gap_px) % rows == 0);
  }
}

TEST_CASE("a trade of several lasers is by the picture in colour, and by the time of all of them") {
  const Folder folder;
  const auto scenes =
      load_scenes(small_scene(folder), {"hologram.wavelength=[\"638 nm\", \"520 nm\", \"450 nm\"]",
                                        "sampling.pitch=30 um", "wrp.padding=1.5"});
  auto spec = small_spec();
  spec.presets = true;
  spec.pictures.against_points = true;
  for (const auto& device : test::all_devices()) {
    INFO(device.info().name);
    TradeBench bench(device, scenes, spec);
    bench.measure(nothing);
    const auto& trade = bench.trade();
    REQUIRE(trade.presets.size() == 4);
    for (const auto& row : trade.rows) {
      INFO(row.note);
      REQUIRE(row.renders == 1);
      // Rows of fewer frames are judged by the rendering with the most, whose scale they share
      const bool is_part =
          std::any_of(trade.rows.begin(), trade.rows.end(), [&](const TradeRow& other) {
            auto same = other.knobs;
            same.frames = row.knobs.frames;
            return same == row.knobs && other.knobs.frames > row.knobs.frames;
          });
      if (is_part) continue;
      const auto with = with_knobs(scenes, row.knobs);
      const auto seen = assess(device, with, build_world(scenes[0]), {}, trade.pictures);
      REQUIRE(row.pictures.size() == seen.rows.size());
      for (std::size_t i = 0; i < seen.rows.size(); ++i)
        CHECK(row.pictures[i].psnr_db ==
              Catch::Approx(seen.rows[i].figures.luminance.psnr_db).margin(1e-3));
      CHECK(row.correlation.value() ==
            Catch::Approx(seen.against_points->correlation).margin(1e-6));
      int samples = 0;
      for (const auto& laser : seen.render.lasers) samples += laser.samples;
      CHECK(row.samples == samples);
    }
    CHECK(bench.sheet().width > 0);
    TradeBench again(device, scenes, spec);
    CHECK(again.resume(trade_json(trade)) == static_cast<int>(trade.rows.size()));
    CHECK_FALSE(TradeBench(device, {scenes[1]}, spec).resume(trade_json(trade)));
  }
}

TEST_CASE("an interrupted trade goes on where it was; a changed scene starts anew") {
  const Folder folder;
  const auto device = test::all_devices().front();
  const std::vector<std::string> set{"sampling.pitch=30 um", "wrp.padding=1.5",
                                     "sampling.cone=1.2"};
  const auto scene = load_scene(small_scene(folder), set);
  struct Interrupted : std::runtime_error {
    using std::runtime_error::runtime_error;
  };
  std::string kept;
  {
    TradeBench bench(device, {scene}, small_spec());
    int times = 0;
    const auto keep = [&] {
      kept = trade_json(bench.trade());
      if (++times == 2) throw Interrupted("");
    };
    CHECK_THROWS_AS(bench.measure(keep), Interrupted);
  }
  const auto before = Json::parse(kept);
  TradeBench bench(device, {scene}, small_spec());
  const auto taken = bench.resume(kept);
  REQUIRE(taken);
  const auto is_measured = [](const Json& r) { return r["renders"] > 0; };
  CHECK(*taken == std::count_if(before["rows"].begin(), before["rows"].end(), is_measured));
  CHECK(*taken > 0);
  CHECK(*taken < static_cast<int>(before["rows"].size()));
  bench.measure(nothing);
  const auto after = Json::parse(trade_json(bench.trade()));
  REQUIRE(after["rows"].size() == before["rows"].size());
  for (std::size_t i = 0; i < before["rows"].size(); ++i) {
    CHECK(after["rows"][i]["knobs"] == before["rows"][i]["knobs"]);
    CHECK(is_measured(after["rows"][i]));
    if (is_measured(before["rows"][i])) CHECK(after["rows"][i] == before["rows"][i]);
  }

  TradeBench whole(device, {scene}, small_spec());  // never interrupted
  whole.measure(nothing);
  for (std::size_t i = 0; i < whole.trade().rows.size(); ++i) {
    CHECK(whole.trade().rows[i].psnr_db() == bench.trade().rows[i].psnr_db());
    CHECK(whole.trade().rows[i].samples == bench.trade().rows[i].samples);
  }

  CHECK_FALSE(TradeBench(device,
                         {load_scene(small_scene(folder, "mode = \"aimed\"\n", "0.11 mm"), set)},
                         small_spec())
                  .resume(kept));
  folder.write("square.obj", test::ball_obj(8, 4));  // the same scene file, another mesh
  CHECK_FALSE(TradeBench(device, {scene}, small_spec()).resume(kept));
  folder.write("square.obj", test::square_obj());
  CHECK_FALSE(TradeBench(device, {scene}, small_spec()).resume(kept.substr(0, kept.size() / 2)));
  CHECK(TradeBench(device, {scene}, small_spec()).resume(kept) == taken);
}

TEST_CASE("what cannot be computed says why, and the rest is measured") {
  const Folder folder;
  const auto device = test::all_devices().front();
  const auto scene = load_scene(
      small_scene(folder, "antialias = 4\nvisibility = 8\napodization = 0.2\ncone = 1.2\n"),
      // Fans cannot look back
      {"sampling.pitch=30 um", "wrp.padding=1.5", "wrp.distance=10.5 mm"});
  TradeBench bench(device, {scene}, small_spec());
  bench.measure(nothing);
  int refused = 0;
  for (const auto& r : bench.trade().rows) {
    INFO(r.note);
    CHECK(r.is_done());
    CHECK((r.knobs.mode == SamplingMode::fan) ==
          (r.note.find("behind the whole scene") != std::string::npos));
    CHECK((r.renders > 0) == r.note.empty());
    refused += !r.note.empty();
  }
  CHECK(refused == 1);
  for (const auto i : trade_frontier(bench.trade().rows)) CHECK(bench.trade().rows[i].renders > 0);
  // They are tried again.
  CHECK(TradeBench(device, {scene}, small_spec()).resume(trade_json(bench.trade())) ==
        static_cast<int>(bench.trade().rows.size()) - refused);
}

TEST_CASE("a trade of a fan is refused: nothing can be predicted of it") {
  const Folder folder;
  const auto scene = load_scene(small_scene(folder, "mode = \"fan\"\n"));
  CHECK_THROWS_AS(TradeBench(test::all_devices().front(), {scene}, small_spec()), InputError);
}

}  // namespace
}  // namespace raywave
