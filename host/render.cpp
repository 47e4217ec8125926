// SPDX-License-Identifier: Apache-2.0
#include "host/render.hpp"

#include <chrono>

#include "host/encode.hpp"
#include "host/propagator.hpp"
#include "host/tracer.hpp"

namespace raywave {
namespace {

/// Adds the seconds between its birth and its end to a stage.
class StageClock {
public:
  StageClock(const cl::Device& device, double& seconds) : device_(device), seconds_(seconds) {}
  ~StageClock() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  StageClock(const StageClock&) = delete;
  StageClock& operator=(const StageClock&) = delete;

  /// Launches return before their work is done.
  void wait() const { device_.finish(); }

private:
  const cl::Device& device_;
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

RenderResult render(const cl::Device& device, const Scene& scene, const RenderOptions& options) {
  RenderResult result;
  const auto stage = [&](const char* name) { return StageClock(device, result.seconds[name]); };
  const auto report = [&](const std::string& what, double share) {
    if (options.progress) options.progress(what, share);
  };

  report("meshes", 0);
  const World world = [&] {
    const auto clock = stage("meshes");
    return build_world(scene);
  }();
  result.plan = make_plan(scene, world, options.fft);
  const auto& plan = result.plan;

  report("tree and kernels", 0);
  auto tracer = [&] {
    const auto clock = stage("prepare");
    return Tracer(device, scene, world, plan);
  }();
  result.seconds["tree"] = tracer.tree_seconds();
  result.seconds["prepare"] -= tracer.tree_seconds();
  auto propagator = [&] {
    const auto clock = stage("prepare");
    return Propagator(device, {plan.size, plan.pitch_m, plan.wavelength_m, scene.wrp.padding, options.fft});
  }();
  PhaseEncoder encode(device);

  const auto pixels = static_cast<std::size_t>(plan.size.x) * static_cast<std::size_t>(plan.size.y);
  const auto frames = static_cast<std::size_t>(scene.sampling.frames);
  cl::ComplexBuffer field(device, pixels, "field of a WRP");
  result.field = {plan.size.x, plan.size.y, scene.sampling.frames, std::vector<std::complex<float>>(frames * pixels)};
  if (options.keep_wrps) result.wrps.assign(plan.wrps.size(), {plan.size.x, plan.size.y, scene.sampling.frames, {}});

  const double steps = static_cast<double>(frames * plan.wrps.size());
  double done = 0;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const auto seed = scene.sampling.seed + static_cast<std::uint32_t>(frame);
    for (std::size_t i = 0; i < plan.wrps.size(); ++i) {
      const auto& wrp = plan.wrps[i];
      report("WRP " + std::to_string(i + 1) + " of " + std::to_string(plan.wrps.size()) +
                 (frames > 1 ? ", frame " + std::to_string(frame + 1) : ""),
             done++ / steps);
      {
        const auto clock = stage("trace");
        tracer.trace(wrp, seed, field);
        clock.wait();
      }
      if (options.keep_wrps) {
        const auto samples = field.read();
        result.wrps[i].samples.insert(result.wrps[i].samples.end(), samples.begin(), samples.end());
      }
      const auto clock = stage("propagate");
      propagator.load(field);
      propagator.add({-wrp.centre_m.x, -wrp.centre_m.y}, wrp.centre_m.z);
      clock.wait();
    }
    {
      const auto clock = stage("propagate");
      propagator.collect(field);
      clock.wait();
    }
    const auto clock = stage("encode");
    result.levels.push_back(encode(field));
    field.read(std::span(result.field.samples).subspan(frame * pixels, pixels));
  }
  report("done", 1);
  result.device_peak_bytes = device.peak_bytes();
  return result;
}

}  // namespace raywave
