// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/trade/trade.hpp"

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"

namespace raywave::cli {
namespace {

struct TradeArguments {
  SceneOptions scene;
  TradeSpec trade;
  DepthOptions depths;
  DeviceOptions device;
  ReportOptions report;
  std::string out = ".";
  std::optional<bool> against_points;
};

TradeSpec spec_of(const TradeArguments& options, const Scene& scene, const cl::DeviceInfo& device) {
  auto spec = options.trade;
  auto& pictures = spec.pictures;
  pictures.depths_m = options.depths.depths_m();
  if (const auto size_m = options.depths.window_m())
    pictures.window = PictureWindow::around_axis(*size_m);
  pictures.against_points = options.against_points.value_or(has_few_pixels(scene));
  if (!options.device.fft.empty()) spec.fft = options.device.backend(device);
  return spec;
}

void run_trade(const TradeArguments& options) {
  const auto scenes = options.scene.load_all(options.report);
  const cl::Device device(options.device.info());
  TradeBench bench(device, scenes, spec_of(options, scenes[0], device.info()));

  const std::filesystem::path out(options.out);
  {
    ProgressBar bar(options.report.quiet);
    measure_in(
        bench, out, [&](const std::string& line) { options.report.note(line); },
        [&](const std::string& what, double share) { bar.show(what, share); });
  }
  options.report.write(trade_json(bench.trade()));
  if (!options.report.prints_text()) return;
  std::fputs(trade_text(bench.trade()).c_str(), stdout);
  std::printf(
      "\n%s  pictures along the frontier; rows: depths, columns: lens, then the fastest first; "
      "trade.json and trade.csv beside it\n",
      (out / "trade.png").c_str());
}

}  // namespace

void add_trade(CLI::App& app) {
  auto* command = add_command(app, section::measure, "trade",
                              "Measure what each setting of a scene costs in time and accuracy",
                              "build/raywave trade data/study.toml -o out --quick");
  const auto options = arguments_of(*command, run_trade);
  auto& trade = options->trade;
  trade.pictures.lens_points = 8;
  options->scene
      .add_to(*command,
              "Scene file (TOML); settings that it gives stay as they are, --set KEY=auto frees "
              "them")
      ->required();
  flag(*command, "--quick", trade.quick, group::measurement, "Fewer values of each setting");
  auto* presets = flag(*command, "--presets", trade.presets, group::measurement,
                       "Only draft, balanced, accurate and reference, beside what plans predict");
  flag(*command, "--exhaustive", trade.exhaustive, group::measurement,
       "All combinations that plans choose among, except those predicted to be far from "
       "the frontier (hours; with --quick, fewer)")
      ->excludes(presets);
  option(*command, "--renders", trade.renders, "N", group::measurement,
         "Renders timed per configuration; 3 to 15 in a second when not given")
      ->check(CLI::Range(1, 1000));
  options->depths.add_to(*command, "nearest and farthest surface and a little in front",
                         "what the WRPs cover");
  add_views(*command, trade.pictures.views,
            "Presets and single settings also through the sides of the hologram");
  add_border(*command, trade.pictures.border_px);
  add_lens_points(*command, trade.pictures.lens_points);
  command
      ->add_flag_function(
          "--against-points,!--no-against-points",
          [options](std::int64_t count) { options->against_points = count > 0; },
          "Compare presets and single settings with the sum of all points, or not (slow); up to "
          "512 x 512 pixels they are when not given")
      ->group(group::pictures);
  options->device.add_to(*command);
  add_output(*command, options->out,
             "trade.json, trade.csv and trade.png; goes on where an earlier run there stopped");
  options->report.add_to(*command, "trade.json");
}

}  // namespace raywave::cli
