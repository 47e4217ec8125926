// SPDX-License-Identifier: Apache-2.0
#include "host/view/lens.hpp"

#include <functional>
#include <future>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/stage_clock.hpp"
#include "host/forecast/warnings.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/message_text.hpp"
#include "host/planning/make_plan.hpp"
#include "host/view/colour_picture.hpp"
#include "host/view/preview.hpp"

namespace raywave::cli {

namespace {

struct LensArguments : LookArguments {
  SceneOptions scene;
  int lens_points = LensSpec{}.points;
};

using Lasers = std::vector<Plan>;

Lasers plans_of(const std::vector<Scene>& scenes, const World& world) {
  Lasers plans;
  for (const auto& scene : scenes) plans.push_back(lens_plan(scene, world));
  return plans;
}

/// What a lens sees of a scene: the picture of each laser.
std::vector<Image> seen_by_lens(const cl::Device& device, const Lasers& plans, DeviceScene& arrays,
                                const LensSpec& what,
                                const std::function<void(double done)>& progress) {
  std::vector<Image> images;
  for (const auto& plan : plans) {
    if (plans.size() > 1) arrays.show(plan);
    const auto done = static_cast<double>(images.size());
    images.push_back(
        lens_picture(device, plan, arrays, what, [&](double share) { progress(done + share); }));
  }
  return images;
}

Json save(const LensArguments& options, const std::vector<Scene>& scenes,
          const std::vector<Image>& images, const std::string& name, const LensSpec& what) {
  const auto save_channels = [&](std::span<const Image> channels) {
    return options.view.save(channels, name, what.z_m, "radiance", options.report, 0, what.pupil);
  };
  return scenes.size() == 1
             ? save_channels(images)
             : save_channels(picture_of_lasers(scenes[0].colour->lasers, images).channels);
}

void run_lens(const LensArguments& options) {
  const auto scenes = options.scene.load_all(options.report);
  LensSpec what;
  what.window_m = options.depths.window_m();
  what.view = options.view.view();
  what.aperture = options.view.aperture();
  what.points = options.lens_points;
  options.view.check_exposure();
  const auto depths_m = options.depths.depths_m([&] { return scenes[0].viewer; });

  const cl::Device device(options.device.info());
  const auto world = build_world(scenes[0]);
  const auto plans = plans_of(scenes, world);
  DeviceScene arrays(device, world, plans[0], false);
  auto pictures = Json::array();
  Forecast forecast;
  const auto all = static_cast<double>(plans.size());
  const auto pupils = options.pupils(scenes[0].viewer, scenes[0].hologram);
  const std::size_t count = depths_m.size() * pupils.size();
  for (std::size_t picture = 0; picture < count; ++picture) {
    const std::size_t depth = picture / pupils.size(), number = picture % pupils.size();
    what.z_m = depths_m[depth];
    what.pupil = pupils[number];
    const auto name = name_at_depth("lens", options.depths.z[depth], what.z_m) +
                      name_of_pupil(number, pupils.size());
    std::vector<Image> images;
    {
      ProgressBar bar(options.report.quiet);
      images = seen_by_lens(device, plans, arrays, what, [&](double done) {
        bar.show(name, done / all);
        if (const auto seconds = forecast.add(static_cast<double>(picture) * all + done,
                                              all * static_cast<double>(count)))
          say_time(bar, *seconds, "this", "fewer --lens-points or a smaller --window take less");
      });
    }
    note_cut(options.report, images[0], what.window_m);
    pictures.push_back(save(options, scenes, images, name, what));
  }
  options.report.write(Json{{"pictures", pictures}});
}

/// As the eye sees it through the middle of the hologram, all depths in focus.
void run_preview(const LensArguments& options) {
  // First: drivers change the environment, which readers of files get
  const cl::Device device(options.device.info());
  const auto scenes = options.scene.load_all(options.report);
  const auto world = build_world(scenes[0]);
  const auto plans = plans_of(scenes, world);
  std::vector<std::pair<double, std::vector<std::string>>> warnings;
  for (std::size_t i = 0; i < plans.size(); ++i)
    warnings.emplace_back(plans[i].hologram.wavelength_m,
                          preview_warnings(scenes[i], world, plans[i]));
  for (const auto& line : lines_of_lasers(warnings)) options.report.note(line);
  options.view.check_exposure();
  const auto depths_m = options.depths.depths_m([&] { return scenes[0].viewer; });
  if (depths_m.size() > 1)
    throw InputError("-z: a preview shows all depths in focus, and measures one plane; give one");
  const auto z_m = depths_m.empty() ? std::nullopt : std::optional(depths_m[0]);
  const auto what = preview_spec(positions_now(world), plans[0], z_m, options.depths.window_m(),
                                 options.view.view(), scenes[0].viewer);
  // A kernel takes as long to load as the trees; by this thread, as LLVM leaves a signal stack
  auto placing =
      std::async(std::launch::async, [&] { return DeviceScene(device, world, plans[0], false); });
  load_lens(device, plans[0]);
  auto arrays = placing.get();
  const auto images = seen_by_lens(device, plans, arrays, what, [](double) {});
  const auto told = save(options, scenes, images, "preview", what);
  if (white_of(images, options.view.percentile) == 0)
    options.report.note(
        "nothing is seen in this picture: the scene lies outside its window, or gets no light on "
        "this side; a larger --window, another position or another [[light]] shows it");
  options.report.write(told);
}

}  // namespace

void add_lens(CLI::App& app) {
  auto* command = add_command(
      app, section::look, "lens", "Show what an ideal lens in the hologram's place sees",
      "build/raywave lens data/study.toml -z 18.55mm -o out --lens-points 8");
  const auto options = arguments_of(*command, run_lens);
  options->scene.add_to(*command)->required();
  options->depths.add_to(*command, "", "the hologram's");
  add_lens_points(*command, options->lens_points);
  options->device.add_device_to(*command);
  options->view.add_to(*command);
  options->pupil.add_to(*command);
  options->report.add_to(*command, "the list of pictures");
}

void add_preview(CLI::App& app) {
  auto* command = add_command(app, section::look, "preview",
                              "Show at once what a viewer will see, all depths in focus",
                              "build/raywave preview data/still_life.toml");
  const auto options = arguments_of(*command, run_preview);
  options->view.folder = ".";
  options->scene.add_to(*command)->required();
  options->depths.add_to(*command, "the scene's middle", "the scene's");
  options->device.add_device_to(*command);
  options->view.add_to(*command);
  options->report.add_to(*command, "what the picture is");
}

}  // namespace raywave::cli
