// SPDX-License-Identifier: Apache-2.0
#include "host/animate/animate.hpp"

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/animate/video_program.hpp"
#include "host/animate/videos.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/digest.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/report.hpp"
#include "host/trace/tuning.hpp"

namespace raywave::cli {

namespace {

constexpr const char *video_name = "holograms.mkv", *preview_name = "preview.mp4";

struct AnimateArguments {
  SceneOptions scene;
  GoalOptions goal;
  DeviceOptions device;
  ReportOptions report;
  std::string out;
  bool stream = false, restart = false, no_video = false, no_preview = false;
};

/// All keys of a scene as they are in effect; names of files are no part of it.
std::string keys_of(Scene scene) {
  scene.file.clear();
  scene.slm.flatness.picture = {};
  for (auto& object : scene.objects) object.mesh.clear();
  for (auto& light : scene.lights) light.picture.clear();
  for (auto& material : scene.materials) material.texture.reset();
  return scene_json(scene);
}

/// Chooses what the scene leaves open for a goal, by the scene at rest.
Scene scene_for(const Goal& goal, Scene scene, const cl::Device& device,
                const ReportOptions& report) {
  if (!goal.any()) return scene;
  const auto world = build_world(scene);
  auto planned = plan_scene(scene, world, figures_of(device.info()), goal, false);
  for (const auto& warning : planned.warnings) report.note(warning);
  planned.scene.digest = hash_name(scene.digest + keys_of(planned.scene));
  return std::move(planned.scene);
}

/// report.json, which lets reconstruct and encode read the holograms.
void write_report(const std::filesystem::path& folder, const Scene& scene, const Animator& animator,
                  FrameStorage storage, const std::string& run) {
  const auto& schedule = animator.schedule();
  auto hologram = scene.hologram;
  hologram.resolution = animator.plan().size;
  auto json =
      encoded_report(hologram, animator.plan().slm, schedule.holograms(),
                     storage == FrameStorage::pngs ? PictureFormat::png : PictureFormat::npy, {});
  json.erase("format");
  json.erase("pictures");
  const auto size = animator.stored_size();
  json["animation"] = {
      {"run", run},
      {"pictures", schedule.pictures()},
      {"rate", scene.animation.value().rate_per_s},
      {"holograms", schedule.holograms()},
      {"slm_rate", schedule.slm_rate_per_s()},
      {"files", storage == FrameStorage::pngs ? FrameFiles::png_pattern : FrameFiles::stream_name},
      {"shape", {schedule.holograms(), size.y, size.x}},
      {"lines", FrameFiles::report_name}};
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

void run_animate(const AnimateArguments& options) {
  auto scene = options.scene.load(options.report);
  if (!scene.animation)
    throw InputError(one_line(scene.file.string()) +
                     ": nothing moves: add [animation] with frames = 240 and [[animation.track]], "
                     "or use raywave render");
  const cl::Device device(options.device.info());
  const auto fft = options.device.backend(device.info());
  const HeldFolder held(options.out);
  const std::filesystem::path folder(options.out);
  const auto storage = options.stream ? FrameStorage::stream : FrameStorage::pngs;

  AnimateResult made;
  std::optional<Animator> animator;
  StoredHolograms stored;
  int found = 0;
  {
    ProgressBar bar(options.report.quiet);
    bar.show("plan of all pictures", 0);
    scene = scene_for(options.goal.goal(), std::move(scene), device, options.report);
    animator.emplace(device, scene, fft);
    if (options.restart) FrameFiles::remove(folder);
    const auto run = animator->run_name(storage);
    FrameFiles files(folder, storage, run, animator->stored_size());
    found = files.pictures();
    if (found < animator->schedule().pictures()) {
      std::error_code ignored;
      for (const auto* name : {video_name, preview_name})
        std::filesystem::remove(folder / name, ignored);
    }
    write_report(folder, scene, *animator, storage, run);
    made = animator->make_frames(
        files, [&](const std::string& what, double share) { bar.show(what, share); });
    stored = {folder, storage, animator->stored_size(), files.holograms(),
              animator->schedule().slm_rate_per_s()};
  }
  for (const auto& note : made.notes) options.report.note(note);
  const double per_s = made.seconds > 0 ? made.timed_holograms / made.seconds : 0;
  if (options.report.prints_text()) {
    if (found > 0) std::printf("%d pictures were there\n", found);
    if (made.pictures > 0)
      std::printf("%d pictures, %d holograms of %d x %d in %s/%s, %.3g holograms a second on %s\n",
                  made.pictures, made.holograms, stored.size_px.x, stored.size_px.y,
                  options.out.c_str(),
                  storage == FrameStorage::pngs ? FrameFiles::png_pattern : FrameFiles::stream_name,
                  per_s, device.info().name.c_str());
  }
  write_videos(options, device, fft, *animator, stored, scene.animation->rate_per_s);
  options.report.write(nlohmann::ordered_json{{"pictures_found", found},
                                              {"pictures", made.pictures},
                                              {"holograms", made.holograms},
                                              {"seconds", made.seconds},
                                              {"holograms_per_s", per_s},
                                              {"processor_seconds", made.processor_seconds},
                                              {"notes", made.notes}});
}

}  // namespace

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
  const auto flag = [&](const char* name, bool& value, const char* help) {
    command->add_flag(name, value, help)->group(group::output);
  };
  flag("--stream", options->stream,
       "Write frames.raw, all holograms one after another, a byte for each pixel, instead of PNGs");
  flag("--restart", options->restart,
       "Make all holograms anew; else those that an earlier run has made are kept");
  flag("--no-video", options->no_video, "Make no holograms.mkv (lossless FFV1, needs ffmpeg)");
  flag("--no-preview", options->no_preview,
       "Make no preview.mp4, what a viewer sees (needs ffmpeg)");
  options->report.add_to(*command, "what was made, and how fast");
  command->callback([options] { run_animate(*options); });
}

}  // namespace raywave::cli
