// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/tune.hpp"

#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/evaluate/bench/bench.hpp"
#include "host/evaluate/report.hpp"
#include "host/forecast/tuning.hpp"
#include "host/trace/work_shape.hpp"

namespace raywave::cli {
namespace {

/// "lanes 16, tile_rows 16, strip_tiles 8"
std::string text_of(const cl::WorkShape& shape) {
  std::string text;
  for (const auto& knob : work_knobs)
    text += (text.empty() ? "" : ", ") + std::string(knob.name) + " " +
            std::to_string(shape.*knob.value);
  return text;
}

void print_trial(const ShapeTrial& trial) {
  if (!trial.refused.empty()) {
    std::printf("  %-38s  refused: %s\n", text_of(trial.shape).c_str(),
                trial.refused.substr(0, trial.refused.find('\n')).c_str());
    return;
  }
  const auto tried = spread_of(trial.tried), best = spread_of(trial.best);
  std::printf("  %-38s  %6.2f ms (%.2f - %.2f), best so far %6.2f (%.2f - %.2f)%s\n",
              text_of(trial.shape).c_str(), 1e3 * tried.median, 1e3 * tried.low, 1e3 * tried.high,
              1e3 * best.median, 1e3 * best.low, 1e3 * best.high, trial.kept ? ": kept" : "");
  std::fflush(stdout);
}

Json json_of(const ShapeTrial& trial) {
  Json j{{"knob", trial.knob}, {"work", raywave::json_of(trial.shape)}, {"kept", trial.kept}};
  if (!trial.refused.empty()) {
    j["refused"] = trial.refused;
  } else {
    j["seconds"] = trial.tried;
    j["best_seconds"] = trial.best;
  }
  return j;
}

struct TuneArguments {
  DeviceOptions device;
  ReportOptions report;
};

void run_tune(const TuneArguments& options) {
  // Not tuned(info): what is stored of the device is measured anew.
  auto info = options.device.found();
  const auto backend = options.device.backend(info);
  const auto start = std::chrono::steady_clock::now();
  const bool text = options.report.prints_text();
  auto trials = Json::array();
  if (text)
    std::printf("%s\nsamples and gathering of a picture, median (quartiles)\n", info.name.c_str());
  info.work = choose_work(info, backend, [&](const ShapeTrial& trial) {
    trials.push_back(json_of(trial));
    if (text) print_trial(trial);
  });
  const auto rates = measure_rates(info, backend);
  store_tuning(info, {rates, *info.work});
  if (text) {
    std::printf("work        %s\n", text_of(*info.work).c_str());
    std::printf(
        "rays        %.3g ns a level of the tree, %.3g ns towards lights\n"
        "nodes       %.3g ns\npairs       %.3g ns\npixels      %.3g ns\n"
        "transforms  %.3g ns a butterfly\nlevels      %.3g ns\n%s, in %.0f s\n",
        rates.ray_s * 1e9, rates.shadow_ray_s * 1e9, rates.node_s * 1e9, rates.pair_s * 1e9,
        rates.pixel_s * 1e9, rates.butterfly_s * 1e9, rates.level_s * 1e9,
        tuning_file(info).c_str(),
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  options.report.write(Json{{"device", rates.device},
                            {"ray_s", rates.ray_s},
                            {"shadow_ray_s", rates.shadow_ray_s},
                            {"node_s", rates.node_s},
                            {"pair_s", rates.pair_s},
                            {"pixel_s", rates.pixel_s},
                            {"butterfly_s", rates.butterfly_s},
                            {"level_s", rates.level_s},
                            {"work", raywave::json_of(*info.work)},
                            {"trials", trials}});
}

}  // namespace

void add_tune(CLI::App& app) {
  auto* command = add_command(app, section::measure, "tune",
                              "Measure a device: its fastest work shape, and rates for plan",
                              "build/raywave tune    # some minutes; kept in the cache folder");
  const auto options = arguments_of(*command, run_tune);
  options->device.add_to(*command);
  options->report.add_to(*command, "rates and trials");
}

}  // namespace raywave::cli
