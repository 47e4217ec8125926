// SPDX-License-Identifier: Apache-2.0
#include "host/scene/units.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "host/animate/animate.hpp"
#include "host/animate/hologram_tiles.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/helpers.hpp"
#include "host/cli/options.hpp"
#include "host/cli/parts.hpp"
#include "host/common/child_program.hpp"
#include "host/common/error.hpp"
#include "host/common/json.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/stopwatch.hpp"

namespace raywave::cli {

namespace {

struct UnitsArguments : SceneArguments {
  std::string each = "10s", openjd;
};

/// How a part is asked for, and the whole.
struct PartWords {
  const char *command, *option, *what;
};

/// What one unit takes, measured here.
struct UnitCost {
  double begin_s = 0, picture_s = 0;
  std::uint64_t resident_bytes = 0;
};

/// Makes small parts in a folder of its own, which goes again: the first finds what parts share.
///
/// Whole     Animator or HologramTiles
/// scene     of one, scenes of the other
/// loaded_s  that it took to begin until here
template <class Whole>
std::pair<Schedule, UnitCost> cost_of(const auto& scene, const cl::Device& device,
                                      cl::FftBackend fft, FrameStorage storage, double loaded_s) {
  struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("raywave-units-" + std::to_string(getpid()));
    // Removes it at the end of this process, also by a signal
    ChildProgram remover{"/bin/sh",
                         {"-c", "trap '' INT TERM HUP; cat; rm -rf -- \"$0\"", path.string()},
                         ".",
                         ChildProgram::Held::input};
    std::error_code ignored{};
    Folder() { std::filesystem::create_directory(path, ignored); }
    ~Folder() { remover.end(); }
  } folder;
  std::optional<Schedule> schedule;
  const auto made = [&](bool is_first, int count) {
    const Whole whole(device, scene, fft, folder.path);
    schedule = whole.schedule();
    const int all = schedule->pictures(), first = is_first ? 0 : all / 2;
    if (all / 2 < 2)
      throw InputError(count_text(all, storage == FrameStorage::tiles ? "tile" : "picture") +
                       ": these are too few to be divided" +
                       (storage == FrameStorage::tiles
                            ? "; give more, such as --set hologram.tiles=[6,6]"
                            : ""));
    FrameFiles files(folder.path, storage, whole.run_name(storage), whole.schedule(),
                     whole.stored_size(), whole.laser_names(),
                     PictureRange{first, std::min(first + count, all)});
    return whole.make_frames(files, {});
  };
  const auto warm = made(true, 2);
  UnitCost cost;
  const Stopwatch watch;
  const auto part = made(false, warm.seconds > 0.5 ? 2 : 10);
  cost.begin_s = loaded_s + watch.wall_s() - part.seconds;
  cost.picture_s = std::max(part.seconds / std::max(part.pictures - 1, 1), 1e-4);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  cost.resident_bytes = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
  return {*schedule, cost};
}

/// A job of Open Job Description, version 2023-09, https://github.com/OpenJobDescription. Places of
/// scene and output are parameters, which engines map to where files are on a worker.
///
/// command  of words_of, and the device
Json openjd_template(const PartWords& of, std::vector<std::string> command,
                     const std::filesystem::path& file, const std::vector<std::string>& units) {
  const auto program = command.front();
  const auto path = [](const char* name, const char* type, const char* flow,
                       const std::string& value) {
    return Json{{"name", name},
                {"type", "PATH"},
                {"objectType", type},
                {"dataFlow", flow},
                {"default", value}};
  };
  // Relative ones count from the template
  const auto scene =
      std::filesystem::proximate(command.at(2), std::filesystem::absolute(file).parent_path());
  command.erase(command.begin());
  command.at(1) = "{{Param.Scene}}";
  command.insert(command.end(), {"-o", "{{Param.Output}}"});
  const auto script = [&](const std::vector<std::string>& words) {
    return Json{{"actions", {{"onRun", {{"command", program}, {"args", words}}}}}};
  };
  auto part = command;
  part.insert(part.end(), {"--quiet", of.option, "{{Task.Param.Part}}"});
  command.insert(command.end(), {of.option, "all"});
  const Json parts{{"name", "Parts"},
                   {"parameterSpace",
                    {{"taskParameterDefinitions",
                      Json::array({{{"name", "Part"}, {"type", "STRING"}, {"range", units}}})}}},
                   {"script", script(part)}};
  const Json whole{{"name", "Whole"},
                   {"dependencies", Json::array({{{"dependsOn", "Parts"}}})},
                   {"script", script(command)}};
  return {{"specificationVersion", "jobtemplate-2023-09"},
          {"name", std::string("raywave ") + of.command},
          {"parameterDefinitions", Json::array({path("Scene", "FILE", "IN", scene.string()),
                                                path("Output", "DIRECTORY", "OUT", "out")})},
          {"steps", Json::array({parts, whole})}};
}

void run_units(const UnitsArguments& options) {
  const Stopwatch watch;
  auto scenes = options.scene.load_all(options.report);
  const bool moves = scenes[0].animation.has_value();
  const PartWords words = moves ? PartWords{"animate", "--pictures", "picture"}
                                : PartWords{"render", "--tiles", "tile"};
  if (!moves) require_one_laser(scenes);
  const double each_s = given_duration_s(options.each, "--each");
  const cl::Device device(options.device.info());
  choose(options.goal.goal(), scenes, device, /*by_tile=*/!moves);
  const auto fft = options.device.backend(device.info());
  const auto [schedule, cost] =
      moves ? cost_of<Animator>(scenes, device, fft, FrameStorage::pngs, watch.wall_s())
            : cost_of<HologramTiles>(scenes[0], device, fft, FrameStorage::tiles, watch.wall_s());
  const int all = schedule.pictures(),
            most = static_cast<int>(
                std::clamp((each_s - cost.begin_s) / cost.picture_s, 1.0, double(all)));
  // As even as they can be
  const int count = (all + most - 1) / most;
  std::vector<std::string> units;
  auto list = Json::array();
  for (int i = 0; i < count; ++i) {
    const int first = static_cast<int>(std::int64_t{all} * i / count),
              end = static_cast<int>(std::int64_t{all} * (i + 1) / count);
    const double seconds = cost.begin_s + (end - first) * cost.picture_s;
    const auto& name = units.emplace_back(std::to_string(first) + ".." + std::to_string(end - 1));
    list.push_back({{"part", name},
                    {"seconds", seconds},
                    {"holograms", {schedule.first_of(first), schedule.first_of(end) - 1}}});
    if (options.report.prints_text()) std::printf("%s  %.1f s\n", name.c_str(), seconds);
  }
  auto command = words_of(words.command, options);
  if (!options.device.device.empty())
    command.insert(command.end(), {"--device", options.device.device});
  if (!options.openjd.empty())
    write_text(options.openjd,
               openjd_template(words, command, options.openjd, units).dump(2) + "\n");
  options.report.note(count_text(count, "unit") + " of up to " +
                      count_text((all + count - 1) / count, words.what) + ": " +
                      format("%.3g s to begin, %.3g s each %s, %.0f MiB resident, measured on ",
                             cost.begin_s, cost.picture_s, words.what,
                             static_cast<double>(cost.resident_bytes) / (1 << 20)) +
                      device.info().name);
  options.report.write(Json{{"command", command},
                            {"part", words.option},
                            {"begin_s", cost.begin_s},
                            {words.what + std::string("_s"), cost.picture_s},
                            {"resident_bytes", cost.resident_bytes},
                            {"device", device.info().name},
                            {"units", list}});
}

}  // namespace

void add_units(CLI::App& app) {
  auto* command =
      add_command(app, section::make, "units",
                  "Divide an animation, or a hologram in tiles, among machines: the parts, "
                  "and their time",
                  "build/raywave units data/turntable.toml --each 5s");
  const auto options = arguments_of(*command, run_units);
  options->scene.add_to(*command, "Scene file (TOML) with [animation] or hologram.tiles")
      ->required();
  options->goal.add_to(*command);
  options->device.add_to(*command);
  option(
      *command, "--each", options->each, "TIME", group::pictures,
      "How long a part may take on this machine, which makes a few pictures, or tiles, to know it")
      ->capture_default_str();
  option(*command, "--openjd", options->openjd, "FILE", group::output,
         "Also write a job template of Open Job Description");
  options->report.add_to(*command, "the parts");
}

}  // namespace raywave::cli
