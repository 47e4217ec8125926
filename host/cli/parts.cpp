// SPDX-License-Identifier: Apache-2.0
#include "host/cli/parts.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "host/animate/hologram_tiles.hpp"
#include "host/cli/helpers.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/output_set.hpp"
#include "host/cli/progress.hpp"
#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/json.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/report.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/forecast/tuning.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/message_text.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene_json.hpp"

namespace raywave::cli {

std::string count_text(int count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

PictureRange range_of(const std::string& option, const std::string& text, const char* what,
                      int count) {
  if (text.empty() || text == "all") return {0, count};
  const auto fail = [&](const std::string& why) {
    throw InputError(option + " " + in_quotes(text) + ": " + why);
  };
  const auto number = [&](std::string_view digits) {
    int value = 0;
    const auto end = digits.data() + digits.size();
    const auto [rest, error] = std::from_chars(digits.data(), end, value);
    if (error == std::errc::invalid_argument || rest != end || value < 0)
      fail("a number, or two with .. between them, is needed, as in 12 or 10..20");
    if (error != std::errc() || value >= count)
      fail("there are " + count_text(count, what) + ", 0 to " + std::to_string(count - 1));
    return value;
  };
  const std::string_view view(text);
  const auto dots = view.find("..");
  const int first = number(view.substr(0, dots)),
            last = dots == view.npos ? first : number(view.substr(dots + 2));
  if (last < first) fail("the last one comes before the first");
  return {first, last + 1};
}

namespace {

/// All keys of a scene as they are in effect; names of files are no part of it.
std::string keys_of(Scene scene) {
  scene.file.clear();
  scene.slm.flatness.picture = {};
  for (auto& object : scene.objects) object.mesh.clear();
  for (auto& light : scene.lights) light.picture.clear();
  for (auto& material : scene.materials) material.texture.reset();
  return json_of(scene).dump();
}

}  // namespace

std::pair<std::vector<Planned>, std::string> choose(const Goal& goal, std::vector<Scene>& scenes,
                                                    const cl::Device& device, bool by_tile) {
  if (!goal.any() && scenes.size() == 1) return {};
  const auto world = build_world(scenes[0]);
  std::vector<Planned> planned;
  if (goal.any())
    planned = plan_scenes(scenes, world, figures_of(device.info()), goal,
                          {.field = false, .by_tile = by_tile});
  for (std::size_t i = 0; i < planned.size(); ++i) {
    planned[i].scene.digest = hash_name(scenes[i].digest + keys_of(planned[i].scene));
    scenes[i] = planned[i].scene;
  }
  return {std::move(planned), colour_warning(scenes, world)};
}

std::vector<std::string> said_by_parts(const std::filesystem::path& folder, const char* kind,
                                       const std::string& run) {
  auto said = FrameFiles::notes(folder);
  const auto report = read_report(folder / "report.json");
  const Json::json_pointer place("/" + std::string(kind) + "/run");
  if (report.contains(place) && report[place] == run)
    for (const auto& note : report.value("notes", Json::array()))
      if (note.is_string()) said.push_back(note);
  return said;
}

void say(const ReportOptions& report, const std::vector<std::string>& notes,
         std::vector<std::string>& said) {
  for (const auto& note : notes) {
    if (std::ranges::find(said, note) != said.end()) continue;
    report.note(note);
    said.push_back(note);
  }
}

void require_one_laser(const std::vector<Scene>& scenes) {
  if (scenes.size() == 1) return;
  throw InputError(one_line(scenes[0].file.string()) +
                   ": tiles are made for one laser at a time; give one: --set colour.only=" +
                   laser_name(scenes[0].hologram.wavelength_m));
}

namespace {

/// report.json, by which reconstruct finds the tiles; of any part the same.
void write_manifest(const std::filesystem::path& folder, const HologramTiles& of,
                    const std::string& run, const std::vector<std::string>& set,
                    const std::vector<std::string>& notes) {
  const auto& plan = of.plan();
  auto hologram = of.scene().hologram;
  hologram.resolution = plan.hologram.size;
  auto json = numbered_report(hologram, plan.slm, of.scene().viewer, plan.hologram.frames);
  const auto& [grid, size, tiles, why, cone, apodization] = plan.tiling;
  auto columns = Json::array(), rows = Json::array();
  for (int x = 0; x < grid.x; ++x) columns.push_back(tiles[static_cast<std::size_t>(x)].first.x);
  for (int y = 0; y < grid.y; ++y)
    rows.push_back(tiles[static_cast<std::size_t>(y * grid.x)].first.y);
  json["tiles"] = {
      {"run", run},      {"size_px", {size.x, size.y}},       {"columns_px", columns},
      {"rows_px", rows}, {"files", FrameFiles::tile_pattern}, {"lines", FrameFiles::report_name}};
  json["plan"] = plan_json(plan);
  json["set"] = set;
  json["notes"] = notes;
  write_text(folder / "report.json", json.dump(2) + "\n");
}

void help_tiles(const PartsArguments& options) {
  end_with_parent();
  auto scenes = options.scene.load_all(options.report);
  const cl::Device device(options.device.info());
  choose(options.goal.goal(), scenes, device, /*by_tile=*/true);
  help(HologramTiles(device, scenes.at(0), options.device.backend(device.info()), options.out),
       options.out, FrameStorage::tiles);
}

}  // namespace

void run_tiles(const PartsArguments& options) {
  if (options.parts == from_queue) return help_tiles(options);
  auto scenes = options.scene.load_all(options.report);
  require_one_laser(scenes);
  const auto devices = options.device.all();
  const cl::Device device(devices[0]);
  const auto fft = options.device.backend(device.info());
  const std::filesystem::path folder(options.out);
  std::optional<ProgressBar> bar(options.report.quiet);
  bar->show("plan", 0);
  const auto planned = choose(options.goal.goal(), scenes, device, /*by_tile=*/true).first;
  const HologramTiles hologram(device, scenes[0], fft, folder);
  const auto notes = hologram.notes([&](const Scene& scene, const World& world, const Plan& plan) {
    return render_warnings(planned, scene, world, plan);
  });
  const auto run = hologram.run_name(FrameStorage::tiles);
  const int count = hologram.schedule().pictures();
  const auto wanted = range_of("--tiles", options.parts, "tile", count);
  const bool is_part = wanted.end - wanted.first < count;
  auto said = is_part ? said_by_parts(folder, "tiles", run) : std::vector<std::string>();
  say(options.report, notes, said);
  if (options.goal.psnr_db)
    options.report.note("--psnr is not checked: no tile shows a whole picture");
  const auto& tiling = hologram.plan().tiling;
  const HeldFolder held(folder, is_part);
  FrameFiles files(folder, FrameStorage::tiles, run, hologram.schedule(), tiling.tile_size, {},
                   wanted);
  const int found = files.pictures();
  write_manifest(folder, hologram, run, options.scene.set, notes);
  add_to_end_at_signals("; the same command goes on with the tiles that are missing");
  const Stopwatch watch;
  const auto progress = [&](const std::string& what, double share) { bar->show(what, share); };
  auto words = words_of("render", options);
  words.insert(words.end(), {"-o", options.out, "--tiles"});
  const auto made = devices.size() > 1 ? make_on(devices, words, files, progress)
                                       : hologram.make_frames(files, progress);
  add_to_end_at_signals(nullptr);
  bar.reset();
  auto all_notes = notes;
  add_lines(all_notes, made.notes);
  say(options.report, all_notes, said);
  if (options.report.prints_text()) {
    if (found > 0)
      std::printf("%s there\n",
                  found == 1 ? "1 tile was" : (std::to_string(found) + " tiles were").c_str());
    if (made.pictures > 0)
      std::printf("%s of %d x %d as %s/tile_00000.png ... in %s on %s\n",
                  count_text(made.pictures, "tile").c_str(), tiling.tile_size.x, tiling.tile_size.y,
                  options.out.c_str(), duration_text(watch.wall_s()).c_str(),
                  devices_text(device.info(), made).c_str());
    std::printf("tiles %d to %d, of 0 to %d, %d x %d, row by row from the top left\n", wanted.first,
                wanted.end - 1, count - 1, tiling.grid.x, tiling.grid.y);
  }
  options.report.write(Json{{"tiles_found", found},
                            {"tiles", made.pictures},
                            {"seconds", watch.wall_s()},
                            {"processor_seconds", made.processor_seconds},
                            {"by_device", made.by_device},
                            {"notes", all_notes}});
}

}  // namespace raywave::cli
