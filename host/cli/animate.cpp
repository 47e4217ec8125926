// SPDX-License-Identifier: Apache-2.0
#include "host/animate/animate.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "cl/compile_ahead.hpp"
#include "host/animate/videos.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/helpers.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_set.hpp"
#include "host/cli/parts.hpp"
#include "host/cli/progress.hpp"
#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/report.hpp"
#include "host/forecast/warnings.hpp"
#include "host/plan/message_text.hpp"
#include "host/scene/scene_json.hpp"

namespace raywave::cli {

namespace {

constexpr const char *video_name = "holograms.mkv", *preview_name = "preview.mp4";

struct AnimateArguments : PartsArguments {
  bool stream = false, restart = false, no_video = false, no_preview = false;

  FrameStorage storage() const { return stream ? FrameStorage::stream : FrameStorage::pngs; }
};

/// The videos with the digests that the report names. Others are damaged or of other pictures: they
/// go, and it is said of those that are not made again.
///
/// all_there  no picture is made
Json keep_videos(const AnimateArguments& options, bool all_there, bool is_part) {
  const std::filesystem::path folder(options.out);
  const auto report = read_report(folder / "report.json");
  auto kept = Json::object();
  std::string gone;
  for (const auto& [name, left_out] :
       {std::pair(video_name, options.no_video), std::pair(preview_name, options.no_preview)}) {
    const Json::json_pointer place(std::string("/animation/videos/") + name);
    std::error_code ignored;
    if (all_there && report.contains(place) && report[place] == digest_of_file(folder / name))
      kept[name] = report[place];
    else if (std::filesystem::remove(folder / name, ignored) && (left_out || is_part))
      gone += (gone.empty() ? "" : ", ") + std::string(name);
  }
  if (!gone.empty()) options.report.note("removed " + gone + ": damaged, or of other pictures");
  return kept;
}

/// report.json, which lets reconstruct and encode read the holograms; of any part the same.
void write_report(const std::filesystem::path& folder, const Scene& scene, const Animator& animator,
                  FrameStorage storage, const std::string& run, const Json& videos,
                  const std::vector<std::string>& notes) {
  const auto& schedule = animator.schedule();
  auto hologram = scene.hologram;
  hologram.resolution = animator.plan().hologram.size;
  const bool is_stream = storage == FrameStorage::stream;
  const auto json_of = [&](std::size_t laser) {
    const auto& plan = animator.plan(laser);
    auto spec = hologram;
    spec.wavelength_m = plan.hologram.wavelength_m;
    return numbered_report(spec, plan.slm, scene.viewer, schedule.holograms());
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
  if (!videos.empty()) json["animation"]["videos"] = videos;
  json["notes"] = notes;
  write_text(folder / "report.json", json.dump(2) + "\n");
}

/// Makes the videos that are missing.
///
/// there  of keep_videos
void write_videos(const AnimateArguments& options, const cl::Device& device, cl::FftBackend fft,
                  const Animator& animator, const StoredHolograms& holograms, double rate_per_s,
                  const Json& there) {
  const bool wants_video = !options.no_video && !there.contains(video_name),
             wants_preview = !options.no_preview && !there.contains(preview_name);
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
  const auto& folder = holograms.folder;
  const auto report = [&](const char* name) {
    auto json = read_report(folder / "report.json");
    json["animation"]["videos"][name] = digest_of_file(folder / name);
    write_text(folder / "report.json", json.dump(2) + "\n");
  };
  if (wants_video) {
    bar.show(video_name, 0);
    write_hologram_video(*ffmpeg, holograms, folder / video_name);
    report(video_name);
  }
  if (wants_preview) {
    write_preview(*ffmpeg, device, fft, animator, holograms, folder / preview_name, rate_per_s,
                  [&](double share) { bar.show(preview_name, share); });
    report(preview_name);
  }
}

std::vector<Scene> load_moving(const SceneOptions& options, const ReportOptions& report) {
  auto scenes = options.load_all(report);
  if (!scenes[0].animation)
    throw InputError(one_line(scenes[0].file.string()) +
                     ": nothing moves: add [animation] with frames = 240 and [[animation.track]], "
                     "or use raywave render");
  return scenes;
}

void help_animate(const AnimateArguments& options) {
  end_with_parent();
  auto scenes = load_moving(options.scene, options.report);
  const cl::Device device(options.device.info());
  choose(options.goal.goal(), scenes, device);
  help(Animator(device, scenes, options.device.backend(device.info()), options.out), options.out,
       options.storage());
}

/// Of the command that helpers are given.
std::vector<std::string> words_of(const AnimateArguments& options) {
  auto words = words_of("animate", options);
  if (options.stream) words.emplace_back("--stream");
  words.insert(words.end(), {"-o", options.out, "--pictures"});
  return words;
}

void run_animate(const AnimateArguments& options) {
  if (options.parts == from_queue) return help_animate(options);
  std::optional<cl::CompileAhead> ahead;
  if (!options.device.names_several())
    ahead.emplace([&] {
      auto moving = load_moving(options.scene, options.report);
      auto info = options.device.info();
      const auto waves = options.device.waves(info);
      const cl::Device device(info);
      choose(options.goal.goal(), moving, device);
      Animator(device, moving, options.device.backend(waves.value_or(info)), {}, waves)
          .make_first();
    });
  auto scenes = load_moving(options.scene, options.report);
  const auto wanted =
      range_of("--pictures", options.parts, "picture", scenes[0].animation->pictures);
  auto devices = options.device.all();
  const auto waves = options.device.waves(devices[0]);
  if (devices.size() > 1 && waves)
    throw InputError("--waves-on is beside one device: give --device one, not several");
  const cl::Device device(devices[0]);
  const auto fft = options.device.backend(waves.value_or(devices[0]));
  const bool is_part = wanted.end - wanted.first < scenes[0].animation->pictures;
  if (is_part && options.restart)
    throw InputError(
        "--restart removes all pictures of the folder: give it without --pictures, or remove the "
        "folder before the first part");
  const HeldFolder held(options.out, is_part);
  const std::filesystem::path folder(options.out);
  const auto storage = options.storage();

  AnimateResult made;
  std::optional<Animator> animator;
  std::vector<std::string> notes, said;
  StoredHolograms stored;
  Json videos;
  int found = 0;
  {
    ProgressBar bar(options.report.quiet);
    bar.show("plan of all pictures", 0);
    const auto [planned, of_colour] = choose(options.goal.goal(), scenes, device);
    animator.emplace(device, scenes, fft, folder, waves);
    notes = animator->notes(
        [&, &planned = planned](const Scene& scene, const World& world, const Plan& plan) {
          return render_warnings(planned, scene, world, plan);
        });
    if (const auto [picture, near_m] = animator->nearest(); picture > 0)
      if (const auto text = eye_distance_warning(scenes[0].viewer, near_m); !text.empty())
        notes.push_back("picture " + std::to_string(picture) + ": " + text);
    if (!of_colour.empty()) notes.push_back(of_colour);
    const auto run = animator->run_name(storage);
    if (is_part) said = said_by_parts(folder, "animation", run);
    say(options.report, notes, said);
    if (options.restart) FrameFiles::remove(folder);
    FrameFiles files(folder, storage, run, animator->schedule(), animator->stored_size(),
                     animator->laser_names(), wanted);
    found = files.pictures();
    videos = keep_videos(options, found == wanted.end - wanted.first, is_part);
    write_report(folder, scenes[0], *animator, storage, run, videos, notes);
    add_to_end_at_signals("; the same command goes on with the pictures that are missing");
    const auto progress = [&](const std::string& what, double share) { bar.show(what, share); };
    made = devices.size() > 1 ? make_on(devices, words_of(options), files, progress)
                              : animator->make_frames(files, progress);
    add_to_end_at_signals(nullptr);
    stored = {folder,
              storage,
              animator->stored_size(),
              animator->schedule().holograms() * static_cast<int>(animator->lasers()),
              animator->schedule().slm_rate_per_s() * static_cast<double>(animator->lasers()),
              animator->laser_names()};
  }
  add_lines(notes, made.notes);
  const auto goal = options.goal.goal();
  if (const double pictures_per_s = (made.pictures - 1) / std::max(made.seconds, 1e-9);
      goal.rate_per_s && made.pictures > 1 && pictures_per_s < *goal.rate_per_s)
    notes.push_back(number_text(pictures_per_s) + " pictures a second were computed, where " +
                    number_text(*goal.rate_per_s) + " were asked for");
  say(options.report, notes, said);
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
      std::printf(" on %s\n", devices_text(device.info(), made).c_str());
    }
  }
  if (!is_part)
    write_videos(options, device, fft, *animator, stored, scenes[0].animation->rate_per_s, videos);
  else if (options.report.prints_text())
    std::printf("pictures %d to %d, of 0 to %d; videos are made of all of them\n", wanted.first,
                wanted.end - 1, animator->schedule().pictures() - 1);
  options.report.write(Json{{"pictures_found", found},
                            {"pictures", made.pictures},
                            {"holograms", made.holograms},
                            {"seconds", made.seconds},
                            {"holograms_per_s", per_s},
                            {"processor_seconds", made.processor_seconds},
                            {"by_device", made.by_device},
                            {"notes", notes}});
}

}  // namespace

void add_animate(CLI::App& app) {
  auto* command =
      add_command(app, section::make, "animate", "Compute the holograms of a scene that moves",
                  "build/raywave animate data/turntable.toml -o out");
  const auto options = arguments_of(*command, run_animate);
  options->scene.add_to(*command, "Scene file (TOML) with [animation]")->required();
  options->goal.add_to(*command);
  options->device.add_to(*command, /*takes_several=*/true);
  options->device.add_waves_to(*command);
  add_output(*command, options->out,
             "frame_00000.png ..., report.jsonl, report.json, holograms.mkv and preview.mp4")
      ->required();
  option(*command, "--pictures", options->parts, "N", group::pictures,
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
}

}  // namespace raywave::cli
