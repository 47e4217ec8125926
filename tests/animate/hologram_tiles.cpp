// SPDX-License-Identifier: Apache-2.0
// Holograms that are made tile by tile: the same bits as in one piece, and what is seen of parts.
#include "host/animate/hologram_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/scene/image.hpp"
#include "tests/animate/films.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;

/// 130 x 97 pixels in tiles that overlap, at odd places, too.
constexpr const char* tiled = "hologram.resolution=[130,97]";
constexpr const char* six = "hologram.tiles=[3,2]";

AnimateResult run(const HologramTiles& tiles, const std::filesystem::path& folder,
                  std::optional<PictureRange> wanted = {}) {
  FrameFiles files(folder, FrameStorage::tiles, tiles.run_name(FrameStorage::tiles),
                   tiles.schedule(), tiles.stored_size(), {}, wanted);
  return tiles.make_frames(files, {});
}

/// The tiles of a folder in their places; later ones lie over earlier ones, as render has it.
std::vector<std::vector<std::uint8_t>> put_together(const Plan& plan,
                                                    const std::filesystem::path& folder) {
  const auto size = plan.hologram.size;
  std::vector<std::vector<std::uint8_t>> frames(
      plan.hologram.frames, std::vector<std::uint8_t>(std::size_t{1} * size.x * size.y));
  int number = 0;
  for (const auto& tile : plan.tiling.tiles)
    for (auto& frame : frames) {
      const auto image = load_levels(folder / FrameFiles::tile_name(number++), "");
      REQUIRE(glm::ivec2(image.width, image.height) == plan.tiling.tile_size);
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
          frame[std::size_t{1} * (tile.first.y + y) * size.x + tile.first.x + x] =
              static_cast<std::uint8_t>(
                  std::lround(255 * image.pixels[std::size_t{1} * y * image.width + x]));
    }
  return frames;
}

TEST_CASE("a hologram that is made tile by tile, in any parts, has the bits of one in one piece") {
  const Desk desk;
  for (const auto& device : all_devices())
    for (const auto& keys : std::vector<std::vector<std::string>>{
             {"slm.encoding=phase", "sampling.frames=2", "slm.carrier=[0.05,-0.1]"},
             {"slm.encoding=phase", "slm.lens=30 mm", "wrp.propagation=spectrum"},
             {"slm.encoding=double-phase", "sampling.frames=2"},
             {"slm.encoding=off-axis", "slm.carrier=[0.2,0.1]"}}) {
      INFO(keys[0] << ", " << keys[1]);
      auto all = keys;
      all.insert(all.end(), {tiled, six});
      const auto scene = load_scene(desk.file("scene.toml"), all);
      const Folder whole, parts;
      const HologramTiles tiles(device, scene, cl::FftBackend::host, parts / "");
      CHECK(run(tiles, whole / "").pictures == 6);
      CHECK(run(tiles, parts / "", PictureRange{3, 5}).pictures == 2);
      const auto shared = bytes_of(parts / FrameFiles::shared_name);
      CHECK(run(tiles, parts / "", PictureRange{0, 4}).pictures == 3);
      parts.write(FrameFiles::tile_name(0), "no picture");
      CHECK(run(tiles, parts / "").pictures == 2);  // what is missing, and what was damaged
      CHECK((files_of(whole / "") == files_of(parts / "")));

      RenderOptions how;
      how.keep_field = false;
      if (!shared.empty()) how.clip = nlohmann::json::parse(shared).at("clip").get<double>();
      CHECK(how.clip.has_value() == (keys[0] != "slm.encoding=phase"));
      const auto rendered = render(device, scene, how);
      REQUIRE(rendered.plan.tiling.grid == glm::ivec2(3, 2));
      CHECK((put_together(rendered.plan, whole / "") == rendered.levels));
    }
}

TEST_CASE("reconstruct shows of tiles what it shows of the whole through the same part") {
  const Desk desk;
  const auto render = [&](const std::string& out, std::vector<std::string> more) {
    desk.succeed({"render", desk.file("scene.toml"), "-o", desk.file(out), "--quiet", "--set",
                  tiled, "--set", six, "--set", "slm.encoding=phase", "--set", "slm.lens=50 mm",
                  "--set", "slm.carrier=[0.05,-0.1]", "--set", "sampling.frames=2"},
                 more);
  };
  render("whole", {"--no-field"});
  render("tiles", {"--tiles", "all"});
  const auto seen = [&](const std::string& of, std::vector<std::string> more) {
    desk.succeed(
        {"reconstruct", desk.file(of + "/report.json"), "-z", "10mm", "-o", desk.file("seen_" + of),
         "--window", "0.3mmx0.2mm", "--centre=0.02mm,-0.03mm", "--frame", "hologram", "--quiet"},
        more);
    return load_grey(desk.file("seen_" + of + "/reconstruction_10mm.exr"), "").pixels;
  };
  for (const auto& part : std::vector<std::vector<std::string>>{
           {},
           {"--view=0.5,-0.25", "--aperture", "0.5"},
           {"--view=-0.3,0.4", "--aperture", "0.6", "--pupil", "0.2mm@0.05mm,-0.1mm"}}) {
    const auto wanted = seen("whole", part), found = seen("tiles", part);
    REQUIRE(found.size() == wanted.size());
    double error = 0, all = 0;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      error += std::pow(double{found[i]} - wanted[i], 2);
      all += std::pow(double{wanted[i]}, 2);
    }
    CHECK(all > 0);
    CHECK(std::sqrt(error / all) < 5e-3);  // the propagated planes are smaller
  }

  // Only what a part needs has to be there, and what is not is named
  std::filesystem::remove(desk.file("tiles/" + FrameFiles::tile_name(9)));
  desk.folder().write("tiles/" + FrameFiles::tile_name(10), "no picture");
  CHECK_FALSE(seen("tiles", {"--view=-0.9,0.9", "--aperture", "0.1"}).empty());
  const auto refused = [&](const char* file, const std::vector<std::string>& more,
                           const std::string& says) {
    std::vector<std::string> words{"reconstruct", desk.file(file),  "-z", "10mm",
                                   "-o",          desk.file("none")};
    words.insert(words.end(), more.begin(), more.end());
    check_refused(desk.run(words), 2, says);
  };
  refused("tiles/report.json", {}, "missing or damaged: 4..5");
  refused("tiles/report.json", {"--view", "1,1", "--aperture", "0.001"},
          "no pixel of the hologram");
  refused("tiles/tile_00000.png", {}, "is a tile of a hologram; give ");
  auto report = nlohmann::json::parse(bytes_of(desk.file("tiles/report.json")));
  for (const auto& [key, value] :
       std::vector<std::pair<std::string, nlohmann::json>>{{"columns_px", {0, 43}},
                                                           {"rows_px", {0, 2'000'000'000}},
                                                           {"size_px", {-1, 49}},
                                                           {"size_px", {44, 2'147'483'647}}}) {
    auto damaged = report;
    damaged["tiles"][key] = value;
    desk.folder().write("tiles/report.json", damaged.dump());
    refused("tiles/report.json", {}, "do not make up its hologram");
  }
  desk.folder().write("tiles/report.json", report.dump());
  check_refused(desk.run({"encode", desk.file("tiles/report.json"), "-o", desk.file("none")}), 2,
                "in tiles");
}

TEST_CASE("render --tiles makes parts and then the rest, and refuses what needs the whole") {
  const Desk desk;
  const auto tiles = [&](const std::string& which, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"render", desk.file("scene.toml"), "-o", desk.file("out"), "--set",
                               "hologram.tiles=[2,2]", "--tiles", which});
    return desk.run(more);
  };
  const auto first = tiles("1");
  CHECK_SAYS(first.out, "1 tile of 24 x 16", "tiles 1 to 1, of 0 to 3, 2 x 2");
  CHECK_SAYS(first.err, "sampling.pitch 20 um is finer");
  CHECK(tiles("2").err.empty());  // what the first has said
  CHECK_SAYS(tiles("all").out, "2 tiles were there", "2 tiles of 24 x 16");
  CHECK_SAYS(tiles("3").out, "1 tile was there");
  CHECK(std::filesystem::exists(desk.out("tile_00003.png")));
  CHECK_FALSE(std::filesystem::exists(desk.out("report_00001_00001.jsonl")));

  check_refused(tiles("4"), 2, "there are 4 tiles, 0 to 3");
  check_refused(tiles("2..1"), 2, "the last one comes before the first");
  check_refused(tiles("all", {"--set", "sampling.seed=5"}), 2, "another scene");
  check_refused(tiles("all", {"--set", "hologram.tiles=[1,1]"}), 2, "hologram.tiles");
  check_refused(tiles("all", {"--set", "slm.band=0.5"}), 2, "slm.band");
  check_refused(tiles("all", {"--set", "refine.iterations=2", "--set", "slm.encoding=phase"}), 2,
                "[refine]");
  check_refused(tiles("all", {"--set", "slm.flip=x"}), 2, "slm.flip");
  check_refused(
      tiles("all", {"--set", "slm.encoding=double-phase", "--set", "illumination.diameter=0.1 mm"}),
      2, "illumination");
  check_refused(tiles("all", {"--set", "hologram.wavelength=[638e-9,520e-9]"}), 2, "one laser");
  check_refused(tiles("all", {"--save-wrps"}), 2, "--save-wrps");
  check_refused(desk.render(), 2, "holds a hologram in tiles; add --tiles");
  check_refused(desk.run({"show", desk.file("out")}), 2,
                "show one of them, such as tile_00000.png");
}

TEST_CASE("plan --tiles plans what render --tiles makes, which needs memory for one tile") {
  const Desk desk;
  const std::vector<std::string> scene{desk.file("scene.toml"),
                                       "--set",
                                       "hologram.resolution=[16384,16384]",
                                       "--set",
                                       "hologram.pitch=1 um",
                                       "--set",
                                       "hologram.tiles=[4,4]",
                                       "--set",
                                       "object.0.position=['0 mm','0 mm','300 mm']"};
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.begin() + 1, scene.begin(), scene.end());
    return desk.succeed(words).out;
  };
  const auto whole = nlohmann::json::parse(run({"plan", "--quiet", "--json", "-"})),
             tiles = nlohmann::json::parse(run({"plan", "--tiles", "--quiet", "--json", "-"}));
  run({"render", "--tiles", "0", "--quiet", "-o", desk.file("out")});
  const auto made = nlohmann::json::parse(bytes_of(desk.out("report.json")));
  CHECK(tiles.at("plan") == made.at("plan"));
  CHECK(tiles.at("prediction").at("host_bytes").get<double>() <
        0.5 * whole.at("prediction").at("host_bytes").get<double>());
}

TEST_CASE("units divides a hologram in tiles, and what it names makes all of it") {
  const Desk desk;
  const auto outcome = desk.succeed({"units", desk.file("scene.toml"), "--each", "1ms", "--set",
                                     "hologram.tiles=[3,2]", "--json", "-"});
  CHECK_SAYS(outcome.err, "each tile");
  const auto json = nlohmann::json::parse(outcome.out);
  REQUIRE(json.at("units").size() == 6);
  CHECK(json["units"][5].at("part") == "5..5");
  CHECK(json.at("tile_s").get<double>() > 0);
  CHECK(json.at("command").at(1) == "render");
  check_refused(desk.run({"units", desk.file("scene.toml"), "--quiet"}), 2, "hologram.tiles");
}

TEST_CASE("units leaves no folder behind, whatever ends it") {
  const Desk desk;
  const auto folder = desk.folder() / "temporary";
  std::filesystem::create_directory(folder);
  const auto is_there = [&] {
    return std::ranges::any_of(std::filesystem::directory_iterator(folder), [](const auto& entry) {
      return entry.path().filename().string().starts_with("raywave-units-");
    });
  };
  for (const int signal : {SIGTERM, SIGKILL}) {
    const auto program =
        desk.start({"units", desk.file("scene.toml"), "--quiet", "--set", "hologram.tiles=[6,6]"},
                   {"TMPDIR=" + folder.string()});
    CHECK(waits_for(is_there));
    kill(program, signal);
    CHECK(desk.outcome_of(program).code == -1);
    CHECK(waits_for([&] { return !is_there(); }));
  }
}

TEST_CASE("a hologram of 65,536 x 65,536 pixels is made in tiles, in the memory of one") {
  const Desk desk;
  const std::vector<std::string> words{"render",     desk.file("scene.toml"),
                                       "-o",         desk.file("out"),
                                       "--no-field", "--quiet",
                                       "--set",      "hologram.resolution=[65536,65536]",
                                       "--set",      "hologram.pitch=1 um",
                                       "--set",      "hologram.tiles=[64,64]",
                                       "--set",      "slm.encoding=phase",
                                       "--set",      "object.0.width=8 mm",
                                       "--set",      "object.0.position=['0 mm','0 mm','300 mm']",
                                       "--set",      "sampling.pitch=0.2 mm"};
  auto part = words;
  part.insert(part.end(), {"--tiles", "2079"});  // beside the middle
  const auto outcome = desk.succeed(part);
  CHECK(outcome.peak_bytes < 1'000'000'000);
  const auto tile = load_levels(desk.out("tile_02079.png"), "");
  CHECK(tile.width == 1024);
  CHECK_FALSE(std::ranges::all_of(tile.pixels, [&](float p) { return p == tile.pixels[0]; }));
}

}  // namespace
}  // namespace raywave
