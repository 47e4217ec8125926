// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include "host/cli/commands.hpp"
#include "host/cli/goal_options.hpp"
#include "host/error.hpp"
#include "host/report.hpp"
#include "host/text.hpp"

namespace raywave::cli {

void GoalOptions::add_to(CLI::App& command) {
  auto* one = command.add_option_group("goal", "What the planner aims at; values that the scene gives stay as they are");
  one->add_option("--quality", quality, "draft, balanced, accurate or reference");
  one->add_option("--budget", budget, "Time of a picture: 30ms, 2s");
  one->add_option("--psnr", psnr_db, "PSNR of the pictures in dB, at the detail that the viewer makes out")->check(CLI::Range(0.0, 200.0));
  one->require_option(0, 1);
}

Goal GoalOptions::goal() const {
  Goal goal;
  if (!quality.empty()) goal.quality = quality_of(quality);
  if (!budget.empty()) goal.budget_s = parse_seconds(budget, "--budget");
  if (psnr_db) goal.psnr_db = *psnr_db;
  return goal;
}

namespace {

struct Options {
  std::string scene;
  std::vector<std::string> set;
  DeviceOptions device;
  GoalOptions goal;
  bool json = false;
};

/// A plan needs no device; where there is one, its rates and sizes count.
DeviceFigures figures(const DeviceOptions& options) {
  if (options.device.empty() && cl::list_devices().empty()) return {};
  return figures_of(options.info());
}

void tune(const DeviceOptions& options, bool json) {
  const auto info = options.info();
  const auto rates = measure_rates(info, options.backend(info));
  store_rates(info, rates);
  if (json) {
    std::printf("{\"device\": \"%s\", \"ray_s\": %.4g, \"pair_s\": %.4g, \"pixel_s\": %.4g, \"butterfly_s\": %.4g, \"level_s\": %.4g}\n",
                rates.device.c_str(), rates.ray_s, rates.pair_s, rates.pixel_s, rates.butterfly_s, rates.level_s);
    return;
  }
  std::printf(
      "%s\n  rays        %.3g ns a level of the tree\n  pairs       %.3g ns\n  pixels      %.3g ns\n  transforms  %.3g ns a butterfly\n  "
      "levels      %.3g ns\n  %s\n",
      rates.device.c_str(), rates.ray_s * 1e9, rates.pair_s * 1e9, rates.pixel_s * 1e9, rates.butterfly_s * 1e9, rates.level_s * 1e9,
      rates_file(info).c_str());
}

}  // namespace

void add_plan(CLI::App& app) {
  auto* command = app.add_subcommand("plan", "Show what a scene is understood as, what would be computed and what to expect");
  auto options = std::make_shared<Options>();
  command->add_option("scene", options->scene, "Scene file (TOML)")->required();
  command->add_option("--set", options->set, "Change a value of the scene: section.key=value")->allow_extra_args(false);
  command->add_flag("--json", options->json, "Print JSON");
  options->goal.add_to(*command);
  options->device.add_device_to(*command);
  command->callback([options] {
    const auto scene = load_scene(options->scene, options->set);
    const auto world = build_world(scene);
    const auto planned = plan_scene(scene, world, figures(options->device), options->goal.goal());
    std::fputs((options->json ? plan_report_json(planned, world) : plan_report_text(planned, world)).c_str(), stdout);
  });
}

void add_tune(CLI::App& app) {
  auto* command =
      app.add_subcommand("tune", "Measure a device's rates, for the times that plans predict (some seconds; kept in the cache folder)");
  auto device = std::make_shared<DeviceOptions>();
  auto json = std::make_shared<bool>(false);
  device->add_to(*command);
  command->add_flag("--json", *json, "Print JSON");
  command->callback([device, json] { tune(*device, *json); });
}

}  // namespace raywave::cli
