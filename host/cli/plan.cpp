// SPDX-License-Identifier: Apache-2.0
#include "host/plan/plan.hpp"

#include <nlohmann/json.hpp>

#include "host/animate/hologram_tiles.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/cli/parts.hpp"
#include "host/evaluate/report.hpp"
#include "host/forecast/tuning.hpp"

namespace raywave::cli {
namespace {

struct PlanArguments : SceneArguments {
  bool tiles = false;
};

/// A plan needs no device. Where there is one, its rates and sizes count.
DeviceFigures figures(const DeviceOptions& options) {
  if (options.device.empty() && cl::list_devices().empty()) return {};
  return figures_of(options.info());
}

void run_plan(const PlanArguments& options) {
  const auto scenes = options.scene.load_all(options.report);
  const auto world = build_world(scenes[0]);
  if (options.tiles) require_one_laser(scenes);
  const auto planned = plan_scenes(scenes, world, figures(options.device), options.goal.goal(),
                                   {.field = !options.tiles, .by_tile = options.tiles});
  if (options.tiles) require_tiles(planned[0].plan);
  options.report.print(plan_report_text(planned, world));
  options.report.write(plan_report_json(planned, world));
}

}  // namespace

void add_plan(CLI::App& app) {
  auto* command = add_command(app, section::make, "plan",
                              "Show how a scene is read, what would be computed, what to expect",
                              "build/raywave plan data/teapot.toml --preset balanced");
  const auto options = arguments_of(*command, run_plan);
  options->scene.add_to(*command)->required();
  options->goal.add_to(*command);
  options->device.add_device_to(*command);
  flag(*command, "--tiles", options->tiles, group::plan,
       "As render --tiles computes it: one tile in memory");
  options->report.add_to(*command, "the plan");
}

}  // namespace raywave::cli
