// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/tune.hpp"

#include <algorithm>
#include <array>

#include "host/evaluate/built_in_meshes.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/render.hpp"
#include "host/trace/work_shape.hpp"

namespace raywave {
namespace {

struct BuiltIn {
  Scene scene;
  World world;
};

/// A ball 8 mm wide, partly inside a wall of 14 mm x 8 mm, 100 mm away: it has samples at many
/// distances from the WRPs.
BuiltIn ball_in_wall(int frames) {
  Scene scene;
  scene.file = "tune";
  scene.sampling.pitch_m = 100e-6;
  scene.sampling.frames = frames;
  scene.wrp.grid = glm::ivec2(2, 2);
  scene.lights.emplace_back();
  scene.materials.resize(2);
  scene.materials[0].specular = glm::dvec3(0.5);
  Object ball, wall;
  ball.material = 0;
  ball.position_m = {0, 0, 0.1};
  ball.width_m = 8e-3;
  wall.material = 1;
  wall.position_m = {0, 0, 0.101};
  wall.width_m = 14e-3;
  scene.objects = {ball, wall};
  const Meshes meshes{{unit_sphere(48), flat_rectangle(8.0 / 14)}, {true, false}, {0, 1}};
  return {scene, place_objects(scene, meshes)};
}

constexpr std::array stages{"samples", "trace", "propagate", "encode"};

/// Pictures of the ball in the wall: as it is, with the shadows of many lights, and over WRPs.
enum class Lit { plainly, with_shadows, over_wrps };

/// Seconds of these stages for four frames, measured on the device whose rates are the defaults.
constexpr std::array plain_s{0.0131, 0.0156, 0.0233, 0.00395};
constexpr double shadows_s = 0.0333, wrps_s = 0.0560;

BuiltIn lit(BuiltIn ball, Lit how) {
  constexpr int lights = 8;
  if (how == Lit::over_wrps) ball.scene.wrp.propagation = WrpPropagation::spectrum;
  if (how == Lit::with_shadows) {
    ball.scene.trace.shadows = true;
    while (ball.scene.lights.size() < lights) {
      Light light = ball.scene.lights[0];
      light.direction.x = 0.2 * static_cast<double>(ball.scene.lights.size());
      ball.scene.lights.push_back(light);
    }
  }
  return ball;
}

/// Seconds of each stage of one rendering, in the order of `stages`; on CPUs the processor time
/// divided by the number of compute units.
std::array<double, stages.size()> stages_s(const cl::Device& device, const BuiltIn& ball,
                                           cl::FftBackend backend) {
  RenderOptions how;
  how.fft = backend;
  const auto result = render(device, ball.scene, ball.world, how);
  const bool on_processor = device.info().kind == cl::DeviceKind::cpu;
  const auto& seconds = on_processor ? result.processor_seconds : result.seconds;
  std::array<double, stages.size()> now{};
  for (std::size_t i = 0; i < now.size(); ++i)
    now[i] = seconds.at(stages[i]) / (on_processor ? std::max(1u, device.info().compute_units) : 1);
  return now;
}

bool clearly_faster(const ShapeRuns& runs, const ShapeRuns& best_runs) {
  const auto tried = spread_of(runs), best = spread_of(best_runs);
  return tried.median < 0.95 * best.median && tried.high < best.low;
}

}  // namespace

cl::WorkShape choose_work(const cl::DeviceInfo& device,
                          const std::function<std::pair<ShapeRuns, ShapeRuns>(
                              const cl::WorkShape&, const cl::WorkShape&)>& run,
                          const std::function<void(const ShapeTrial&)>& tell) {
  auto kind = device;
  kind.work = {};
  auto best = work_shape(kind);
  const auto better = [&](const WorkKnob& knob, int value) {
    ShapeTrial trial{knob.name, best, {}, {}, "", false};
    trial.shape.*knob.value = value;
    if (value == best.*knob.value || !why_unfit(trial.shape, device).empty()) return false;
    try {
      std::tie(trial.best, trial.tried) = run(best, trial.shape);
      trial.kept = clearly_faster(trial.tried, trial.best);
    } catch (const cl::DeviceError& error) {
      trial.refused = error.what();
    }
    if (trial.kept) best = trial.shape;
    tell(trial);
    return trial.kept;
  };
  for (const auto& knob : work_knobs) {
    const int before = best.*knob.value;
    while (better(knob, best.*knob.value / 2)) {
    }
    if (best.*knob.value != before) continue;
    while (better(knob, best.*knob.value * 2)) {
    }
  }
  return best;
}

cl::WorkShape choose_work(const cl::DeviceInfo& device, cl::FftBackend backend,
                          const std::function<void(const ShapeTrial&)>& tell) {
  const auto ball = ball_in_wall(1);
  const auto in_shape = [&](const cl::WorkShape& shape) {
    auto info = device;
    info.work = shape;
    return cl::Device(info);
  };
  const auto run = [&](const cl::WorkShape& best, const cl::WorkShape& tried) {
    const std::array devices{in_shape(best), in_shape(tried)};
    std::array<ShapeRuns, 2> runs;
    for (int turn = 0; turn < 8; ++turn) {
      for (std::size_t i = 0; i < devices.size(); ++i) {
        const auto now = stages_s(devices[i], ball, backend);
        if (turn > 0) runs[i].push_back(now[0] + now[1]);  // turn 0 compiles the kernels
      }
    }
    return std::pair(runs[0], runs[1]);
  };
  return choose_work(device, run, tell);
}

DeviceRates measure_rates(const cl::DeviceInfo& info, cl::FftBackend backend) {
  const cl::Device device(info);
  const auto least_of = [&](Lit how) {
    const auto ball = lit(ball_in_wall(4), how);
    std::array<double, stages.size()> least{};
    for (int turn = 0; turn < 6; ++turn) {
      const auto now = stages_s(device, ball, backend);
      if (turn == 0) continue;  // turn 0 compiles the kernels
      for (std::size_t i = 0; i < least.size(); ++i)
        least[i] = turn == 1 ? now[i] : std::min(least[i], now[i]);
    }
    return least;
  };
  const auto plain = least_of(Lit::plainly), shadows = least_of(Lit::with_shadows),
             wrps = least_of(Lit::over_wrps);
  const auto scaled = [](double rate_s, double measured_s, double default_s) {
    return std::max(1e-15, rate_s * measured_s / default_s);
  };
  const auto defaults = default_rates();
  return {info.name,
          true,
          scaled(defaults.ray_s, plain[0], plain_s[0]),
          scaled(defaults.shadow_ray_s, std::max(0.0, shadows[0] - plain[0]), shadows_s),
          scaled(defaults.node_s, plain[1], plain_s[1]),
          scaled(defaults.pair_s, wrps[1], wrps_s),
          scaled(defaults.pixel_s, wrps[1], wrps_s),
          scaled(defaults.butterfly_s, plain[2], plain_s[2]),
          scaled(defaults.level_s, plain[3], plain_s[3])};
}

}  // namespace raywave
