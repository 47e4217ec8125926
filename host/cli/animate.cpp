// SPDX-License-Identifier: Apache-2.0
#include "host/animate/animate.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/animate/videos.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/report.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/forecast/tuning.hpp"
#include "host/plan/message_text.hpp"
#include "host/scene/scene_json.hpp"
#include "host/scene/units.hpp"

namespace raywave::cli {

namespace {

constexpr const char *video_name = "holograms.mkv", *preview_name = "preview.mp4";

struct AnimateArguments {
  SceneOptions scene;
  GoalOptions goal;
  DeviceOptions device;
  ReportOptions report;
  std::string out, pictures;
  bool stream = false, restart = false, no_video = false, no_preview = false;
};

/// --pictures: "12", or "10..20" with both ends; all when it is empty.
PictureRange range_of(const std::string& text, int pictures) {
  if (text.empty()) return {0, pictures};
  const auto fail = [&](const std::string& why) {
    throw InputError("--pictures " + in_quotes(text) + ": " + why);
  };
  const auto number = [&](std::string_view digits) {
    int value = 0;
    const auto end = digits.data() + digits.size();
    const auto [rest, error] = std::from_chars(digits.data(), end, value);
    if (error == std::errc::invalid_argument || rest != end || value < 0)
      fail("a number, or two with .. between them, is needed, as in 12 or 10..20");
    if (error != std::errc() || value >= pictures)
      fail("the animation has " + std::to_string(pictures) + " pictures, 0 to " +
           std::to_string(pictures - 1));
    return value;
  };
  const std::string_view view(text);
  const auto dots = view.find("..");
  const int first = number(view.substr(0, dots)),
            last = dots == view.npos ? first : number(view.substr(dots + 2));
  if (last < first) fail("the last picture comes before the first");
  return {first, last + 1};
}

/// "1 picture", "2 pictures"
std::string count_text(int count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

/// All keys of a scene as they are in effect; names of files are no part of it.
std::string keys_of(Scene scene) {
  scene.file.clear();
  scene.slm.flatness.picture = {};
  for (auto& object : scene.objects) object.mesh.clear();
  for (auto& light : scene.lights) light.picture.clear();
  for (auto& material : scene.materials) material.texture.reset();
  return json_of(scene).dump();
}

/// Chooses what the scenes of the lasers leave open for a goal, by the scene at rest.
///
/// returns  the plans of the goal, or none; and a line on colours, or none
std::pair<std::vector<Planned>, std::string> choose(const Goal& goal, std::vector<Scene>& scenes,
                                                    const cl::Device& device) {
  if (!goal.any() && scenes.size() == 1) return {};
  const auto world = build_world(scenes[0]);
  std::vector<Planned> planned;
  if (goal.any()) planned = plan_scenes(scenes, world, figures_of(device.info()), goal, false);
  for (std::size_t i = 0; i < planned.size(); ++i) {
    planned[i].scene.digest = hash_name(scenes[i].digest + keys_of(planned[i].scene));
    scenes[i] = planned[i].scene;
  }
  return {std::move(planned), colour_warning(scenes, world)};
}

/// report.json, which lets reconstruct and encode read the holograms; of any part the same.
void write_report(const std::filesystem::path& folder, const Scene& scene, const Animator& animator,
                  FrameStorage storage, const std::string& run,
                  const std::vector<std::string>& notes) {
  const auto& schedule = animator.schedule();
  auto hologram = scene.hologram;
  hologram.resolution = animator.plan().hologram.size;
  const bool is_stream = storage == FrameStorage::stream;
  const auto json_of = [&](std::size_t laser) {
    const auto& plan = animator.plan(laser);
    auto spec = hologram;
    spec.wavelength_m = plan.hologram.wavelength_m;
    auto one = encoded_report(spec, plan.slm, schedule.holograms(), PictureFormat::png, {});
    one["scene"]["viewer"] = raywave::json_of(scene.viewer);
    one.erase("format");
    one.erase("pictures");
    return one;
  };
  const auto names = animator.laser_names();
  Json json;
  if (names.empty()) {
    json = json_of(0);
  } else {
    auto& colour = json["colour"];
    colour = colour_json(scene.colour.value(), {});
    for (std::size_t i = 0; i < names.size(); ++i) {
      auto& laser = colour["lasers"][i];
      laser["files"] = is_stream ? FrameFiles::stream_name : FrameFiles::png_pattern(names[i]);
      laser["report"] = json_of(i);
    }
  }
  const auto size = animator.stored_size();
  auto shape = Json::array({schedule.holograms(), size.y, size.x});
  if (!names.empty()) shape.insert(shape.begin() + 1, names.size());
  json["animation"] = {{"run", run},
                       {"pictures", schedule.pictures()},
                       {"rate", scene.animation.value().rate_per_s},
                       {"holograms", schedule.holograms()},
                       {"slm_rate", schedule.slm_rate_per_s()},
                       {"files", is_stream ? FrameFiles::stream_name
                                           : FrameFiles::png_pattern(names.empty() ? "" : "LASER")},
                       {"shape", shape},
                       {"lines", FrameFiles::report_name}};
  json["notes"] = notes;
  write_text(folder / "report.json", json.dump(2) + "\n");
}

/// Makes the videos that are missing.
void write_videos(const AnimateArguments& options, const cl::Device& device, cl::FftBackend fft,
                  const Animator& animator, const StoredHolograms& holograms, double rate_per_s) {
  const auto is_there = [&](const char* name) {
    std::error_code error;
    return std::filesystem::exists(holograms.folder / name, error);
  };
  const bool wants_video = !options.no_video && !is_there(video_name),
             wants_preview = !options.no_preview && !is_there(preview_name);
  if (!wants_video && !wants_preview) return;
  const auto ffmpeg = find_program("ffmpeg");
  if (!ffmpeg) {
    options.report.note(
        std::string("there is no program ffmpeg on PATH: ") + (wants_video ? video_name : "") +
        (wants_video && wants_preview ? " and " : "") + (wants_preview ? preview_name : "") +
        " are left out; install ffmpeg and run this again, which makes only them");
    return;
  }
  ProgressBar bar(options.report.quiet);
  if (wants_video) {
    bar.show(video_name, 0);
    write_hologram_video(*ffmpeg, holograms, holograms.folder / video_name);
  }
  if (wants_preview)
    write_preview(*ffmpeg, device, fft, animator, holograms, holograms.folder / preview_name,
                  rate_per_s, [&](double share) { bar.show(preview_name, share); });
}

std::vector<Scene> load_moving(const SceneOptions& options, const ReportOptions& report) {
  auto scenes = options.load_all(report);
  if (!scenes[0].animation)
    throw InputError(one_line(scenes[0].file.string()) +
                     ": nothing moves: add [animation] with frames = 240 and [[animation.track]], "
                     "or use raywave render");
  return scenes;
}

void run_animate(const AnimateArguments& options) {
  auto scenes = load_moving(options.scene, options.report);
  const auto wanted = range_of(options.pictures, scenes[0].animation->pictures);
  const cl::Device device(options.device.info());
  const auto fft = options.device.backend(device.info());
  const bool is_part = wanted.end - wanted.first < scenes[0].animation->pictures;
  if (is_part && options.restart)
    throw InputError(
        "--restart removes all pictures of the folder: give it without --pictures, or remove the "
        "folder before the first part");
  const HeldFolder held(options.out, is_part);
  const std::filesystem::path folder(options.out);
  const auto storage = options.stream ? FrameStorage::stream : FrameStorage::pngs;

  AnimateResult made;
  std::optional<Animator> animator;
  std::vector<std::string> notes;
  StoredHolograms stored;
  int found = 0;
  {
    ProgressBar bar(options.report.quiet);
    bar.show("plan of all pictures", 0);
    const auto [planned, of_colour] = choose(options.goal.goal(), scenes, device);
    animator.emplace(device, scenes, fft, folder);
    notes = animator->notes(
        [&, &planned = planned](const Scene& scene, const World& world, const Plan& plan) {
          return render_warnings(planned, scene, world, plan);
        });
    if (!of_colour.empty()) notes.push_back(of_colour);
    for (const auto& note : notes) options.report.note(note);
    if (options.restart) FrameFiles::remove(folder);
    const auto run = animator->run_name(storage);
    FrameFiles files(folder, storage, run, animator->schedule(), animator->stored_size(),
                     animator->laser_names(), wanted);
    found = files.pictures();
    if (found < wanted.end - wanted.first) {
      std::error_code ignored;
      for (const auto* name : {video_name, preview_name})
        std::filesystem::remove(folder / name, ignored);
    }
    write_report(folder, scenes[0], *animator, storage, run, notes);
    add_to_end_at_signals("; the same command goes on with the pictures that are missing");
    made = animator->make_frames(
        files, [&](const std::string& what, double share) { bar.show(what, share); });
    add_to_end_at_signals(nullptr);
    stored = {folder,
              storage,
              animator->stored_size(),
              animator->schedule().holograms() * static_cast<int>(animator->lasers()),
              animator->schedule().slm_rate_per_s() * static_cast<double>(animator->lasers()),
              animator->laser_names()};
  }
  const auto said = notes.size();
  add_lines(notes, made.notes);
  const auto goal = options.goal.goal();
  if (const double pictures_per_s = (made.pictures - 1) / std::max(made.seconds, 1e-9);
      goal.rate_per_s && made.pictures > 1 && pictures_per_s < *goal.rate_per_s)
    notes.push_back(number_text(pictures_per_s) + " pictures a second were computed, where " +
                    number_text(*goal.rate_per_s) + " were asked for");
  for (auto i = said; i < notes.size(); ++i) options.report.note(notes[i]);
  const double per_s = made.seconds > 0 ? made.timed_holograms / made.seconds : 0;
  if (options.report.prints_text()) {
    if (found > 0) std::printf("%d pictures were there\n", found);
    if (made.pictures > 0) {
      std::printf("%s, %s of %d x %d in %s/%s", count_text(made.pictures, "picture").c_str(),
                  count_text(made.holograms, "hologram").c_str(), stored.size_px.x,
                  stored.size_px.y, options.out.c_str(),
                  storage == FrameStorage::pngs
                      ? FrameFiles::png_pattern(stored.lasers.empty() ? "" : "LASER").c_str()
                      : FrameFiles::stream_name);
      if (per_s > 0) std::printf(", %.3g holograms a second", per_s);
      std::printf(" on %s\n", device.info().name.c_str());
    }
  }
  if (!is_part)
    write_videos(options, device, fft, *animator, stored, scenes[0].animation->rate_per_s);
  else if (options.report.prints_text())
    std::printf("pictures %d to %d, of 0 to %d; videos are made of all of them\n", wanted.first,
                wanted.end - 1, animator->schedule().pictures() - 1);
  options.report.write(Json{{"pictures_found", found},
                            {"pictures", made.pictures},
                            {"holograms", made.holograms},
                            {"seconds", made.seconds},
                            {"holograms_per_s", per_s},
                            {"processor_seconds", made.processor_seconds},
                            {"notes", notes}});
}

struct UnitsArguments {
  SceneOptions scene;
  GoalOptions goal;
  DeviceOptions device;
  ReportOptions report;
  std::string each = "10s", openjd;
};

/// What one unit takes, measured here.
struct UnitCost {
  double begin_s = 0, picture_s = 0;
  std::uint64_t resident_bytes = 0;
};

/// Makes small parts in a folder of its own, which goes again: the first finds what parts share.
///
/// loaded_s  that it took to begin until here
UnitCost cost_of(const std::vector<Scene>& scenes, const cl::Device& device, cl::FftBackend fft,
                 double loaded_s) {
  struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("raywave-units-" + std::to_string(getpid()));
    std::error_code ignored{};
    Folder() { std::filesystem::create_directory(path, ignored); }
    ~Folder() { std::filesystem::remove_all(path, ignored); }
  } folder;
  const auto made = [&](bool is_first, int count) {
    const Animator animator(device, scenes, fft, folder.path);
    const int all = animator.schedule().pictures(), first = is_first ? 0 : all / 2;
    if (all / 2 < 2)
      throw InputError("an animation of " + count_text(all, "picture") +
                       " is too short to be divided");
    FrameFiles files(folder.path, FrameStorage::pngs, animator.run_name(FrameStorage::pngs),
                     animator.schedule(), animator.stored_size(), animator.laser_names(),
                     PictureRange{first, std::min(first + count, all)});
    return animator.make_frames(files, {});
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
  return cost;
}

/// A job of Open Job Description, version 2023-09, https://github.com/OpenJobDescription. Places of
/// scene and output are parameters, which engines map to where files are on a worker.
///
/// command  of words_of
Json openjd_template(std::vector<std::string> command, const std::filesystem::path& file,
                     const std::vector<std::string>& units) {
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
  part.insert(part.end(), {"--quiet", "--pictures", "{{Task.Param.Pictures}}"});
  const Json parts{
      {"name", "Parts"},
      {"parameterSpace",
       {{"taskParameterDefinitions",
         Json::array({{{"name", "Pictures"}, {"type", "STRING"}, {"range", units}}})}}},
      {"script", script(part)}};
  const Json whole{{"name", "Whole"},
                   {"dependencies", Json::array({{{"dependsOn", "Parts"}}})},
                   {"script", script(command)}};
  return {{"specificationVersion", "jobtemplate-2023-09"},
          {"name", "raywave animate"},
          {"parameterDefinitions", Json::array({path("Scene", "FILE", "IN", scene.string()),
                                                path("Output", "DIRECTORY", "OUT", "out")})},
          {"steps", Json::array({parts, whole})}};
}

/// Words of a command line that makes the animation; of the place of files, as they are given.
std::vector<std::string> words_of(const UnitsArguments& options) {
  std::vector<std::string> words{"raywave", "animate", options.scene.file};
  const auto add = [&](const char* name, const std::string& value) {
    if (value.empty()) return;
    words.push_back(name);
    words.push_back(value);
  };
  for (const auto& set : options.scene.set) add("--set", set);
  add("--preset", options.goal.preset);
  add("--budget", options.goal.budget);
  if (options.goal.psnr_db) add("--psnr", format("%.17g", *options.goal.psnr_db));
  if (options.goal.rate_per_s) add("--rate", format("%.17g", *options.goal.rate_per_s));
  add("--device", options.device.device);
  add("--fft", options.device.fft);
  return words;
}

void run_units(const UnitsArguments& options) {
  const Stopwatch watch;
  auto scenes = load_moving(options.scene, options.report);
  const double each_s = given_duration_s(options.each, "--each");
  const cl::Device device(options.device.info());
  choose(options.goal.goal(), scenes, device);
  const auto cost = cost_of(scenes, device, options.device.backend(device.info()), watch.wall_s());
  const Schedule schedule(*scenes[0].animation, scenes[0].sampling.frames);
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
    list.push_back({{"pictures", name},
                    {"seconds", seconds},
                    {"holograms", {schedule.first_of(first), schedule.first_of(end) - 1}}});
    if (options.report.prints_text()) std::printf("%s  %.1f s\n", name.c_str(), seconds);
  }
  const auto command = words_of(options);
  if (!options.openjd.empty())
    write_text(options.openjd, openjd_template(command, options.openjd, units).dump(2) + "\n");
  options.report.note(
      count_text(count, "unit") + " of up to " + count_text((all + count - 1) / count, "picture") +
      ": " +
      format("%.3g s to begin, %.3g s each picture, %.0f MiB resident, measured on ", cost.begin_s,
             cost.picture_s, static_cast<double>(cost.resident_bytes) / (1 << 20)) +
      device.info().name);
  options.report.write(Json{{"command", command},
                            {"begin_s", cost.begin_s},
                            {"picture_s", cost.picture_s},
                            {"resident_bytes", cost.resident_bytes},
                            {"device", device.info().name},
                            {"units", list}});
}

}  // namespace

void add_units(CLI::App& app) {
  auto* command = add_command(app, section::make, "units",
                              "Divide an animation among machines: the parts, and their time",
                              "build/raywave units data/turntable.toml --each 5s");
  auto options = std::make_shared<UnitsArguments>();
  options->scene.add_to(*command, "Scene file (TOML) with [animation]")->required();
  options->goal.add_to(*command);
  options->device.add_to(*command);
  option(*command, "--each", options->each, "TIME", group::pictures,
         "How long a part may take on this machine, which makes a few pictures to know it")
      ->capture_default_str();
  option(*command, "--openjd", options->openjd, "FILE", group::output,
         "Also write a job template of Open Job Description");
  options->report.add_to(*command, "the parts");
  command->callback([options] { run_units(*options); });
}

void add_animate(CLI::App& app) {
  auto* command =
      add_command(app, section::make, "animate", "Compute the holograms of a scene that moves",
                  "build/raywave animate data/turntable.toml -o out");
  auto options = std::make_shared<AnimateArguments>();
  options->scene.add_to(*command, "Scene file (TOML) with [animation]")->required();
  options->goal.add_to(*command);
  options->device.add_to(*command);
  add_output(*command, options->out,
             "frame_00000.png ..., report.jsonl, report.json, holograms.mkv and preview.mp4")
      ->required();
  option(*command, "--pictures", options->pictures, "N", group::pictures,
         "Only these pictures, counted from 0: 12, or 10..20 with both ends; several programs may "
         "each make some in one folder; without --pictures, what is missing is made");
  flag(*command, "--stream", options->stream, group::output,
       "Write frames.raw, all holograms one after another, a byte for each pixel, instead of PNGs");
  flag(*command, "--restart", options->restart, group::output,
       "Make all holograms anew; else those that an earlier run has made are kept");
  flag(*command, "--no-video", options->no_video, group::output,
       "Make no holograms.mkv (lossless FFV1, needs ffmpeg)");
  flag(*command, "--no-preview", options->no_preview, group::output,
       "Make no preview.mp4, what a viewer sees (needs ffmpeg)");
  options->report.add_to(*command, "what was made, and how fast");
  command->callback([options] { run_animate(*options); });
}

}  // namespace raywave::cli
