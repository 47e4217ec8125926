// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include "host/cli/commands.hpp"
#include "host/cli/goal_options.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/report.hpp"
#include "host/trace/tuning.hpp"

namespace raywave::cli {

void GoalOptions::add_to(CLI::App& command) {
  auto* one = command.add_option_group(
      "goal", "What the planner aims at; values that the scene gives stay as they are");
  one->add_option("--quality", quality, "draft, balanced, accurate or reference");
  one->add_option("--budget", budget, "Time of a picture: 30ms, 2s");
  one->add_option("--psnr", psnr_db,
                  "PSNR of the pictures in dB, at the detail that the viewer makes out")
      ->check(CLI::Range(0.0, 200.0));
  one->require_option(0, 1);
}

Goal GoalOptions::goal() const {
  Goal goal;
  if (!quality.empty()) goal.preset = preset_of(quality);
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

}  // namespace

void add_plan(CLI::App& app) {
  auto* command = app.add_subcommand(
      "plan", "Show what a scene is understood as, what would be computed and what to expect");
  auto options = std::make_shared<Options>();
  command->add_option("scene", options->scene, "Scene file (TOML)")->required();
  command->add_option("--set", options->set, "Change a value of the scene: section.key=value")
      ->allow_extra_args(false);
  command->add_flag("--json", options->json, "Print JSON");
  options->goal.add_to(*command);
  options->device.add_device_to(*command);
  command->callback([options] {
    const auto scene = load_scene(options->scene, options->set);
    const auto world = build_world(scene);
    const auto planned = plan_scene(scene, world, figures(options->device), options->goal.goal());
    std::fputs((options->json ? plan_report_json(planned, world) : plan_report_text(planned, world))
                   .c_str(),
               stdout);
  });
}

}  // namespace raywave::cli
