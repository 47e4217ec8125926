// SPDX-License-Identifier: Apache-2.0
#include "host/view/lens.hpp"

#include <memory>

#include "host/cli/commands.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/progress.hpp"

namespace raywave::cli {

namespace {

struct Options {
  std::string scene;
  std::vector<std::string> set;
  PictureOptions picture;
  DeviceOptions device;
  int rays = LensSpec{}.points;
  bool quiet = false;
};

void run(const Options& options) {
  const auto scene = load_scene(options.scene, options.set);
  LensSpec what;
  what.window_m = options.picture.window_m();
  what.view = options.picture.view();
  what.aperture = options.picture.aperture();
  what.points = options.rays;
  options.picture.check_percentile();
  const auto depths_m = options.picture.depths_m();

  const cl::Device device(options.device.info());
  const auto world = build_world(scene);
  const auto plan = make_plan(scene, world);
  const DeviceScene arrays(device, world, plan);
  for (const double z_m : depths_m) {
    what.z_m = z_m;
    const auto name = name_at_depth("lens", z_m);
    Image image;
    {
      ProgressBar bar(options.quiet);
      image =
          lens_picture(device, plan, arrays, what, [&](double share) { bar.show(name, share); });
    }
    options.picture.save(image, name, "radiance", options.quiet);
  }
}

}  // namespace

void add_lens(CLI::App& app) {
  auto* command = app.add_subcommand(
      "lens", "Show what an ideal lens in the hologram's place sees at given depths");
  auto options = std::make_shared<Options>();
  command->add_option("scene", options->scene, "Scene file (TOML)")->required();
  options->picture.add_to(*command);
  command->add_option("--rays", options->rays,
                      "Rays per pixel and axis, from a grid of points on the lens (24)");
  command->add_option("--set", options->set, "Change a value of the scene: section.key=value")
      ->allow_extra_args(false);
  command->add_flag("--quiet", options->quiet, "Print nothing but errors");
  options->device.add_device_to(*command);
  command->callback([options] { run(*options); });
}

}  // namespace raywave::cli
