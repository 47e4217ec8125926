// SPDX-License-Identifier: Apache-2.0
#include "host/refine/refine.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_set.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/stage_clock.hpp"
#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/refinement.hpp"
#include "host/evaluate/report.hpp"
#include "host/forecast/tuning.hpp"
#include "host/plan/message_text.hpp"
#include "host/planning/make_plan.hpp"
#include "host/refine/scene_keys.hpp"
#include "host/render.hpp"
#include "host/scene/image.hpp"
#include "host/scene/units.hpp"

namespace raywave::cli {

namespace {

struct RefineArguments : SceneArguments {
  std::string targets, start, out, blur, budget;
  DepthOptions depths;
  FrameOption frame;
  PixelOptions pixels;
  int iterations = 0;
  std::optional<int> views;
  int lens_points = RefineSettings{}.lens_points;
  int border_px = picture_border_px;
  bool is_brighter = false, table = true;

  std::optional<double> budget_s() const {
    if (budget.empty()) return std::nullopt;
    return given_duration_s(budget, "--budget");
  }
};

/// The hologram of a laser, what it should show, and what it is judged by.
struct Task {
  FieldStack field;  // as traced, or what was given
  HologramSpec hologram;
  SlmSpec slm;  // as the scene describes it
  double blur_m = 0, middle_m = 0;
  Refined refined;
  std::vector<std::vector<std::uint8_t>> levels;  // of the refined phases
  std::shared_ptr<const Panel> panel;             // that they are for
  std::vector<JudgedKey> judged;
  RefinementFigures figures;
};

/// What is refined: a hologram, or in colour that of each laser.
struct Work {
  std::vector<Task> tasks;
  std::vector<double> powers;  // of the lasers, Rendered::powers; none: one wavelength
  Json report;

  bool is_colour() const { return !powers.empty(); }
  Json& report_of(std::size_t laser) {
    return is_colour() ? report["colour"]["lasers"][laser]["report"] : report;
  }
  /// "_638nm" in the names of a laser's files.
  std::string suffix_of(std::size_t laser) const {
    return is_colour() ? "_" + laser_name(tasks[laser].hologram.wavelength_m) : "";
  }
};

double blur_of(const RefineArguments& options, const HologramSpec& hologram, double otherwise_m) {
  if (options.blur.empty()) return otherwise_m;
  const auto blur = parse_blur(options.blur);
  return blur.in_pixels ? blur.value * hologram.pitch_m.x : blur.value;
}

/// Refuses at once what the table would refuse in the end.
void require_border(const RefineArguments& options, glm::ivec2 resolution) {
  const int widest = (std::min(resolution.x, resolution.y) - 1) / 2;
  if (options.table && options.depths.window.empty() &&
      (options.border_px < 0 || options.border_px > widest))
    throw InputError("--border " + std::to_string(options.border_px) + ": must be 0 to " +
                     std::to_string(widest) + " for a hologram of " + std::to_string(resolution.x) +
                     " x " + std::to_string(resolution.y) + " pixels, or give --no-table");
}

std::shared_ptr<const Panel> panel_of(const SlmSpec& slm, const HologramSpec& hologram) {
  return std::make_shared<const Panel>(slm, hologram.resolution, hologram.pitch_m,
                                       hologram.wavelength_m);
}

void require_phases(const SlmSpec& slm) {
  if (shows_amplitude(slm.encoding))
    throw InputError(std::string("slm.encoding = \"") + name_of(slm.encoding) +
                     "\": refine changes phases; give an SLM of phase, encoding = \"phase\"");
}

/// All of the hologram; behind an eyepiece through a pupil.
KeyPlace whole_at(double z_m, const std::optional<Pupil>& pupil) {
  return {z_m, {0, 0}, {1, 1}, 1, 0, pupil};
}

/// Depths between those that are optimised, and views from elsewhere: what tells whether the
/// refinement carries over.
///
/// pupils  that are looked through; none: parts of the hologram are
std::vector<std::pair<KeyRole, KeyPlace>> unseen_places(std::vector<double> depths_m, double near_m,
                                                        const std::vector<Pupil>& pupils) {
  std::vector<std::pair<KeyRole, KeyPlace>> places;
  std::sort(depths_m.begin(), depths_m.end());
  const auto first = pupils.empty() ? std::nullopt : std::optional(pupils.front());
  for (std::size_t i = 1; i < depths_m.size(); ++i)
    places.push_back({KeyRole::held_out, whole_at((depths_m[i - 1] + depths_m[i]) / 2, first)});
  for (std::size_t i = 1; i < pupils.size(); ++i) {
    auto between = pupils[i];
    between.centre_m = (between.centre_m + pupils[i - 1].centre_m) / 2.0;
    places.push_back({KeyRole::unseen_view, whole_at(near_m, between)});
    places.push_back({KeyRole::unseen_view, whole_at(near_m, pupils[i])});
  }
  if (!pupils.empty()) return places;
  for (const glm::dvec2 view : {glm::dvec2(-0.5, 0), {0.5, 0}, {0.25, 0.25}, {-0.35, -0.1}})
    places.push_back({KeyRole::unseen_view, {near_m, view, {0.5, 0.5}}});
  return places;
}

/// The scene's settings, or the defaults, with what the options change.
///
/// share  of the budget, which is for all lasers
RefineSettings settings_of(const RefineArguments& options, const Scene& scene, double share) {
  auto settings = scene.refine.value_or(RefineSettings{});
  if (options.iterations > 0) settings.iterations = options.iterations;
  if (options.views) settings.views = *options.views;
  if (options.is_brighter) settings.brightness = brighter;
  if (!options.depths.z.empty()) settings.depths_m = options.depths.depths_m();
  if (!options.depths.window.empty()) settings.window_m = options.depths.window_m();
  if (!options.blur.empty()) settings.blur_m = blur_of(options, scene.hologram, 0);
  if (options.lens_points != RefineSettings{}.lens_points)
    settings.lens_points = options.lens_points;
  settings.budget_s = options.budget_s();
  if (settings.budget_s) *settings.budget_s *= share;
  return settings;
}

/// The phases of --start, of each laser: a refined.npy, or of several lasers those that an earlier
/// report.json names. None where it is not given.
std::vector<FieldStack> starts_of(const std::string& start, const std::vector<Scene>& scenes) {
  if (start.empty()) return {};
  const auto what = "--start " + in_quotes(start);
  const bool is_report = extension_of(start) == ".json";
  if (scenes.size() == 1) {
    if (is_report)
      throw InputError(what +
                       ": one laser goes on from refined.npy, or refined_638nm.npy or the "
                       "like of several");
    return {load_npy(start)};
  }
  if (!is_report)
    throw InputError(what +
                     ": several lasers go on from the report.json beside their "
                     "refined_638nm.npy and the like");
  const std::filesystem::path report(start);
  const auto reported = lasers_of_report(report);
  if (!reported) throw InputError(what + ": is of one wavelength; the scene has several lasers");
  if (reported->lasers.count() != scenes.size())
    throw InputError(what + ": is of " + std::to_string(reported->lasers.count()) +
                     " lasers, the scene of " + std::to_string(scenes.size()));
  std::vector<FieldStack> starts;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const double wavelength_m = scenes[i].hologram.wavelength_m;
    if (reported->lasers.wavelengths_m[i] != wavelength_m)
      throw InputError(what + ": has no laser of " + length_text(wavelength_m) + " in place " +
                       std::to_string(i) + "; give the scene the same hologram.wavelength");
    const auto& name = reported->files[i].refined;
    if (name.empty())
      throw InputError(what + ": names no refined phases; give the report of a refined scene");
    const auto file = report.parent_path() / std::filesystem::path(name).filename();
    require_of_report(report, {file});
    starts.push_back(load_npy(file));
  }
  return starts;
}

/// Renders the scene, refined, and makes the pictures that tell whether it carries over.
Work work_of_scene(const RefineArguments& options, const cl::Device& device, ProgressBar& bar) {
  Work work;
  auto scenes = options.scene.load_all(options.report);
  const bool is_colour = scenes.size() > 1;
  require_border(options, scenes[0].hologram.resolution);
  for (auto& scene : scenes)
    scene.refine = settings_of(options, scene, 1 / static_cast<double>(scenes.size()));
  RenderOptions how;
  how.refine_starts = starts_of(options.start, scenes);
  how.fft = options.device.backend(device.info());
  how.progress = [&](const std::string& what, double share) { bar.show(what, share); };
  std::vector<Planned> planned;
  how.planned = notes_of_render(bar, device.info(), scenes.size(), planned);
  bar.show("meshes", 0);
  const auto world = build_world(scenes[0]);
  if (const auto goal = options.goal.goal(); goal.any()) {
    planned = plan_scenes(scenes, world, figures_of(device.info()), goal);
    for (std::size_t i = 0; i < scenes.size(); ++i) scenes[i] = planned[i].scene;
  }
  const auto warning = colour_warning(scenes, world);
  auto rendered = render(device, scenes, world, how);
  if (!warning.empty())
    for (auto& laser : rendered.lasers) laser.notes.push_back(warning);
  if (is_colour) work.powers = rendered.powers;
  std::vector<LaserFiles> files;
  for (const auto& laser : rendered.lasers)
    files.push_back(files_of_laser(
        laser, laser_suffix(laser.plan.hologram.wavelength_m, scenes.size()), false, true));
  work.report = report_json(scenes, rendered, files, device.info(), how.fft);
  work.report["set"] = options.scene.set;
  for (const auto& note : notes_of(rendered.lasers)) options.report.note(note);

  std::optional<DeviceScene> arrays;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    auto& laser = rendered.lasers[i];
    auto& task = work.tasks.emplace_back();
    const auto& plan = laser.plan;
    const auto& settings = plan.refine.value();
    task.hologram = scenes[i].hologram;
    auto unrefined = scenes[i];
    unrefined.refine = std::nullopt;
    task.slm = make_plan(unrefined, world).slm;
    task.blur_m = settings.blur_m.value();
    task.middle_m = (plan.extent.near_m + plan.extent.far_m) / 2;
    task.field = std::move(laser.field);
    task.refined = std::move(laser.refined.value());
    task.levels = std::move(laser.levels);
    task.panel = laser.panel;
    if (!options.table) continue;

    std::vector<double> depths_m;
    std::vector<std::pair<KeyRole, KeyPlace>> unseen;
    const auto pupils =
        settings.viewer.eyepiece_m ? pupils_of(settings.viewer) : std::vector<Pupil>();
    const auto first = pupils.empty() ? std::nullopt : std::optional(pupils.front());
    for (std::size_t k = 0; k < task.refined.keys.size(); ++k) {
      const auto& key = task.refined.keys[k];
      if (key.samples || key.pupil) {  // the whole hologram at the depths of its parts
        if (std::find(depths_m.begin(), depths_m.end(), key.z_m) != depths_m.end()) continue;
        unseen.push_back({KeyRole::optimised, whole_at(key.z_m, first)});
      } else if (key.aperture == glm::dvec2(1, 1)) {
        task.judged.push_back({KeyRole::optimised, key});
      } else {
        continue;
      }
      depths_m.push_back(key.z_m);
    }
    std::sort(depths_m.begin(), depths_m.end());
    for (const auto& place : unseen_places(depths_m, plan.extent.near_m, pupils))
      unseen.push_back(place);
    if (arrays)
      arrays->show(plan);
    else
      arrays.emplace(device, world, plan);
    double done = 0;
    for (const auto& [role, place] : unseen) {
      bar.show("lens at " + length_text(place.z_m), done++ / static_cast<double>(unseen.size()));
      task.judged.push_back(
          {role, lens_key(device, plan, *arrays, place, task.blur_m, key_pictures(settings))});
    }
  }
  return work;
}

/// Reads a field and the pictures that `raywave lens` has written, and refines towards them.
Work work_of_field(const RefineArguments& options, const cl::Device& device, ProgressBar& bar) {
  const std::filesystem::path file(options.scene.file), folder(options.targets);
  Work work;
  auto& task = work.tasks.emplace_back();
  task.field = load_npy(file);
  task.hologram = options.pixels.spec(file, {task.field.nx, task.field.ny});
  task.slm = options.pixels.slm_spec(file, options.scene.set);
  require_phases(task.slm);
  require_border(options, task.hologram.resolution);
  task.blur_m = blur_of(options, task.hologram, 4 * task.hologram.pitch_m.x);

  std::error_code error;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const auto name = entry.path().filename().string();
    if (name.starts_with("lens_") && name.ends_with("mm.exr")) files.push_back(entry.path());
  }
  if (files.empty())
    throw InputError("--targets " + in_quotes(options.targets) +
                     ": no pictures named as raywave lens writes them, such as lens_18.55mm.exr" +
                     (error ? " (" + error.message() + ")" : ""));
  std::sort(files.begin(), files.end());
  for (const auto& picture : files) {
    const auto name = picture.filename().string();
    const auto depth = name.substr(5, name.size() - 9);  // between lens_ and .exr
    RefineKey key;
    key.z_m = positive_length_m(depth, in_quotes(picture.string()) + ": the depth");
    key.picture = in_frame(load_grey(picture, picture.string()), options.frame.frame());
    key.pixel_m = task.hologram.pitch_m;
    task.refined.keys.push_back(key);
    if (options.table) task.judged.push_back({KeyRole::optimised, key});
    task.middle_m += key.z_m / static_cast<double>(files.size());
  }

  RefineSettings settings;
  if (options.iterations > 0) settings.iterations = options.iterations;
  if (options.is_brighter) settings.brightness = brighter;
  settings.blur_m = task.blur_m;
  settings.budget_s = options.budget_s();
  auto spec = refine_spec(settings, task.slm, task.hologram.resolution, task.hologram.pitch_m,
                          task.hologram.wavelength_m, task.refined.keys);
  spec.progress = [&](const std::string& what, double share) { bar.show(what, share); };
  auto refined =
      refine(device, options.device.backend(device.info()), task.field, task.refined.keys, spec);
  task.refined.phases = std::move(refined.field);
  task.refined.figures = refined.figures;
  auto slm = task.slm;
  slm.encoding = Encoding::phase;
  task.panel = panel_of(slm, task.hologram);
  Encoder encoder(device, task.panel);
  task.levels = encode(device, encoder, task.refined.phases);
  work.report = encoded_report(task.hologram, slm, task.field.frames, PictureFormat::png, {});
  work.report["refine"]["blur_m"] = task.blur_m;
  work.report["refine"]["brightness"] = settings.brightness;
  return work;
}

void run_refine(const RefineArguments& options) {
  const bool is_field = extension_of(options.scene.file) == ".npy";
  if (is_field && options.targets.empty())
    throw InputError("refine " + in_quotes(options.scene.file) +
                     ": a field needs --targets, the folder of what raywave lens has written");
  if (!is_field && !options.targets.empty())
    throw InputError("--targets belongs to a field.npy; a scene makes its own pictures");
  if (!is_field && options.pixels.any())
    throw InputError(
        "--pitch, --wavelength and --slm belong to a field.npy; a scene says them itself");
  if (is_field &&
      (options.views.value_or(0) > 0 || !options.depths.z.empty() || !options.start.empty()))
    throw InputError("--views, -z and --start belong to a scene; a field takes all of --targets");

  if (options.iterations > 0 && !options.budget.empty())
    throw InputError("--iterations and --budget: at most 1 of them can be given");

  const cl::Device device(options.device.info());
  OutputSet out(options.out);
  Work work;
  {
    ProgressBar bar(options.report.quiet);
    work = is_field ? work_of_field(options, device, bar) : work_of_scene(options, device, bar);
    double done = 0;
    Forecast forecast;
    for (auto& task : work.tasks) {
      if (task.judged.empty()) continue;
      Encoder encoder(device, panel_of(task.slm, task.hologram));
      task.figures = judge_refinement(
          device, options.device.backend(device.info()), task.hologram,
          {task.field, shown_field(encoder.panel(), encode(device, encoder, task.field)),
           shown_field(*task.panel, task.levels)},
          task.judged, task.blur_m, options.border_px, task.middle_m, [&](double share) {
            const auto lasers = static_cast<double>(work.tasks.size());
            bar.show("pictures", (done + share) / lasers);
            if (const auto seconds = forecast.add(done + share, lasers))
              say_time(bar, *seconds, "the table", "--no-table leaves it out");
          });
      ++done;
    }
  }

  std::vector<std::string> pictures;
  for (std::size_t i = 0; i < work.tasks.size(); ++i) {
    auto& task = work.tasks[i];
    for (std::size_t frame = 0; frame < task.levels.size(); ++frame)
      pictures.push_back(save_hologram(out.folder(), frame, task.panel->slm(),
                                       task.hologram.resolution, task.levels[frame],
                                       "hologram" + work.suffix_of(i)));
    const auto& phases = task.refined.phases;
    const auto name = "refined" + work.suffix_of(i) + ".npy";
    save_npy(out.folder() / name, phases.nx, phases.ny, phases.frames, phases.samples);
    out.add(name);
    work.report_of(i)["refine"].update(refinement_json(task.figures, task.refined.figures));
  }
  for (const auto& name : pictures) out.add(name);
  if (is_field) work.report["pictures"] = pictures;
  const auto report = out.finish(std::move(work.report), options.report);

  if (options.report.prints_text()) {
    for (std::size_t i = 0; i < work.tasks.size(); ++i) {
      const auto& task = work.tasks[i];
      if (work.is_colour())
        std::printf("%s%s: power %.3f\n", i == 0 ? "" : "\n",
                    length_text(task.hologram.wavelength_m).c_str(), work.powers[i]);
      std::fputs(refinement_text(task.figures, task.refined.figures).c_str(), stdout);
    }
    out.print();
  }
  options.report.write(report);
}

}  // namespace

void add_refine(CLI::App& app) {
  auto* command =
      add_command(app, section::make, "refine",
                  "Change a hologram's phases until its pictures are what a lens sees",
                  "build/raywave refine data/study.toml -o out --set sampling.frames=4\n"
                  "build/raywave lens data/study.toml -z 18.55mm -z 19.5mm -o lens\n"
                  "build/raywave refine out/refined.npy --targets lens -o further");
  const auto options = arguments_of(*command, run_refine);
  options->scene
      .add_to(*command, "Scene file (TOML), which is rendered first; or field.npy, with --targets")
      ->required();
  options->goal.add_preset_to(*command);
  option(*command, "--iterations", options->iterations, "N", group::refinement,
         "Iterations per frame; as many as the pictures need when not given")
      ->check(CLI::Range(1, RefineSettings::most_iterations));
  option(*command, "--views", options->views, "N", group::refinement,
         "Also refine this many views through quarters of the hologram: 24, which bring views to "
         "within 0.5 dB of the traced field's and above; 0 with --iterations, --budget or -z")
      ->check(CLI::Range(0, RefineSettings::most_views));
  option(*command, "--budget", options->budget, "TIME", group::refinement,
         "Time for the iterations of all frames and lasers, e.g. 5s; it decides their number");
  flag(*command, "--brighter", options->is_brighter, group::refinement,
       "Bring 0.93 of the light into the picture instead of 0.85, for 1 to 6 dB");
  option(*command, "--start", options->start, "FILE", group::refinement,
         "Begin with the phases of this field instead of the rendered one: goes on where "
         "an earlier refined.npy ended; of several lasers, an earlier report.json");
  option(*command, "--targets", options->targets, "FOLDER", group::refinement,
         "Folder of the pictures that a field is refined towards, as raywave lens writes "
         "them (lens_18.55mm.exr)");
  options->frame.add_to(*command, "From where the pictures of --targets are seen");
  flag(*command, "--table,!--no-table", options->table, group::refinement,
       "Compare field, phase and levels with the lens afterwards");
  options->depths.add_to(*command, "through the scene and a little beyond", "what the WRPs cover");
  options->pixels.add_to(*command);
  add_blur(*command, options->blur, "0.6 sampling.pitch, for a field 4px");
  add_border(*command, options->border_px);
  add_lens_points(*command, options->lens_points);
  options->device.add_to(*command);
  add_output(*command, options->out,
             "hologram.png, refined.npy and report.json; of several lasers hologram_638nm.png ...")
      ->required();
  options->report.add_to(*command, "report.json");
}

}  // namespace raywave::cli
