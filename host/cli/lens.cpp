// SPDX-License-Identifier: Apache-2.0
#include "host/view/lens.hpp"

#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/forecast.hpp"
#include "host/planning/make_plan.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave::cli {

namespace {

struct LensArguments {
  SceneOptions scene;
  DepthOptions depths;
  ViewOptions view;
  DeviceOptions device;
  ReportOptions report;
  int lens_points = LensSpec{}.points;
};

void run_lens(const LensArguments& options) {
  const auto scenes = options.scene.load_all(options.report);
  LensSpec what;
  what.window_m = options.depths.window_m();
  what.view = options.view.view();
  what.aperture = options.view.aperture();
  what.points = options.lens_points;
  options.view.check_percentile();
  const auto depths_m = options.depths.depths_m([&] { return scenes[0].viewer; });

  const cl::Device device(options.device.info());
  const auto world = build_world(scenes[0]);
  std::vector<Plan> plans;
  for (const auto& scene : scenes) plans.push_back(make_plan(scene, world));
  DeviceScene arrays(device, world, plans[0]);
  auto pictures = nlohmann::ordered_json::array();
  Forecast forecast;
  const auto all = static_cast<double>(plans.size());
  for (const double z_m : depths_m) {
    what.z_m = z_m;
    const auto name = name_at_depth("lens", z_m);
    std::vector<Image> images;
    {
      ProgressBar bar(options.report.quiet);
      for (const auto& plan : plans) {
        if (plans.size() > 1) arrays.show(plan);
        const auto done = static_cast<double>(images.size()),
                   before = static_cast<double>(pictures.size()) * all;
        images.push_back(lens_picture(device, plan, arrays, what, [&](double share) {
          bar.show(name, (done + share) / all);
          if (const auto seconds =
                  forecast.add(before + done + share, all * static_cast<double>(depths_m.size())))
            say_time(bar, *seconds, "this", "fewer --lens-points or a smaller --window take less");
        }));
      }
    }
    pictures.push_back(
        plans.size() == 1
            ? options.view.save(images, name, z_m, "radiance", options.report)
            : options.view.save(picture_of_lasers(scenes[0].colour->lasers, images).channels, name,
                                z_m, "radiance", options.report));
  }
  options.report.write(nlohmann::ordered_json{{"pictures", pictures}});
}

}  // namespace

void add_lens(CLI::App& app) {
  auto* command = add_command(
      app, section::look, "lens", "Show what an ideal lens in the hologram's place sees",
      "build/raywave lens data/study.toml -z 18.55mm -o out --lens-points 8");
  auto options = std::make_shared<LensArguments>();
  options->scene.add_to(*command)->required();
  options->depths.add_to(*command, "", "the hologram's");
  add_lens_points(*command, options->lens_points);
  options->device.add_device_to(*command);
  options->view.add_to(*command);
  options->report.add_to(*command, "the list of pictures");
  command->callback([options] { run_lens(*options); });
}

}  // namespace raywave::cli
