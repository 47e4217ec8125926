// SPDX-License-Identifier: Apache-2.0
#include "host/render.hpp"

#include <algorithm>
#include <chrono>
#include <memory>

#include "host/encode.hpp"
#include "host/gatherer.hpp"
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

/// The fields on the WRPs, by aimed samples or by fans of rays.
class FieldSource {
public:
  FieldSource(const cl::Device& device, const Scene& scene, const Plan& plan, const DeviceScene& arrays, int frames) {
    const bool snapped = scene.sampling.source == FanSource::surface;
    if (plan.aimed || snapped) table_ = std::make_unique<SampleTable>(device, plan, arrays);
    if (plan.aimed) gatherer_ = std::make_unique<Gatherer>(device, plan, arrays, *table_, frames);
    if (plan.aimed && plan.bounces > 0) tracer_ = std::make_unique<Tracer>(device, scene, plan, arrays, HitSource::bounced);
    if (!plan.aimed)
      tracer_ = std::make_unique<Tracer>(device, scene, plan, arrays, snapped ? HitSource::surface : HitSource::hit, table_.get());
  }

  int samples() const { return table_ ? table_->count : 0; }
  int hidden_samples() const { return table_ ? table_->hidden : 0; }

  /// Begins the frames seed, seed + 1, ...
  void start(std::uint32_t seed) {
    seed_ = seed;
    if (gatherer_) gatherer_->draw_phases(seed);
  }

  void fill(const Wrp& wrp, cl::ComplexBuffer& stack) {
    if (gatherer_) gatherer_->gather(wrp.centre_m, stack);
    if (tracer_) tracer_->trace(wrp, seed_, stack);
  }

private:
  std::unique_ptr<SampleTable> table_;
  std::unique_ptr<Gatherer> gatherer_;
  std::unique_ptr<Tracer> tracer_;
  std::uint32_t seed_ = 0;
};

/// Frames whose fields are held at the same time: as many as share one gathering and fit into half a gigabyte.
int frames_together(const Scene& scene, const Plan& plan, std::size_t pixels) {
  if (!plan.aimed || plan.bounces > 0) return 1;
  const double fitting = 512.0 * 1024 * 1024 / (8.0 * static_cast<double>(plan.wrps.size()) * static_cast<double>(pixels));
  return static_cast<int>(std::clamp(fitting, 1.0, static_cast<double>(std::min(scene.sampling.frames, Gatherer::most_frames))));
}

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
  result.plan = make_plan(scene, world, options.fft, options.method, options.rays_per_axis, device.info().fp64);
  const auto& plan = result.plan;

  report("tree and kernels", 0);
  const DeviceScene arrays = [&] {
    const auto clock = stage("prepare");
    return DeviceScene(device, scene, world, plan);
  }();
  result.seconds["tree"] = arrays.tree_seconds;
  result.seconds["prepare"] -= arrays.tree_seconds;
  const auto pixels = static_cast<std::size_t>(plan.size.x) * static_cast<std::size_t>(plan.size.y);
  const auto wrp_count = plan.wrps.size();
  const int together = frames_together(scene, plan, pixels);
  FieldSource source = [&] {
    const auto clock = stage("samples");
    return FieldSource(device, scene, plan, arrays, together);
  }();
  result.samples = source.samples();
  result.hidden_samples = source.hidden_samples();
  auto propagator = [&] {
    const auto clock = stage("prepare");
    return Propagator(device, {plan.size, plan.pitch_m, plan.wavelength_m, scene.wrp.padding, options.fft});
  }();
  PhaseEncoder encode(device);

  // Frames gathered together wait for each other's WRPs; one frame alone needs one field at a time.
  std::vector<cl::ComplexBuffer> stacks;
  for (std::size_t i = 0; i < (together > 1 ? wrp_count : 1); ++i)
    stacks.emplace_back(device, static_cast<std::size_t>(together) * pixels, "fields of a WRP");
  cl::ComplexBuffer field(device, pixels, "field at the hologram");
  const auto frames = scene.sampling.frames;
  result.field = {plan.size.x, plan.size.y, frames, std::vector<std::complex<float>>(static_cast<std::size_t>(frames) * pixels)};
  if (options.keep_wrps) result.wrps.assign(wrp_count, {plan.size.x, plan.size.y, frames, {}});

  for (int frame = 0; frame < frames; ++frame) {
    const int within = frame % together;
    if (within == 0) source.start(scene.sampling.seed + static_cast<std::uint32_t>(frame));
    for (std::size_t i = 0; i < wrp_count; ++i) {
      const auto& wrp = plan.wrps[i];
      auto& stack = stacks[together > 1 ? i : 0];
      report(
          "WRP " + std::to_string(i + 1) + " of " + std::to_string(wrp_count) + (frames > 1 ? ", frame " + std::to_string(frame + 1) : ""),
          static_cast<double>(static_cast<std::size_t>(frame) * wrp_count + i) /
              static_cast<double>(static_cast<std::size_t>(frames) * wrp_count));
      if (within == 0) {
        const auto clock = stage("trace");
        source.fill(wrp, stack);
        clock.wait();
      }
      if (options.keep_wrps) {
        std::vector<std::complex<float>> samples(pixels);
        stack.read(samples, static_cast<std::size_t>(within) * pixels);
        result.wrps[i].samples.insert(result.wrps[i].samples.end(), samples.begin(), samples.end());
      }
      if (options.method != Method::wrp) {
        field.copy_from(stack, static_cast<std::size_t>(within) * pixels);
        continue;
      }
      const auto clock = stage("propagate");
      propagator.load(stack, within);
      propagator.add({-wrp.centre_m.x, -wrp.centre_m.y}, wrp.centre_m.z);
      clock.wait();
    }
    if (options.method == Method::wrp) {
      const auto clock = stage("propagate");
      propagator.collect(field);
      clock.wait();
    }
    const auto clock = stage("encode");
    result.levels.push_back(encode(field));
    field.read(std::span(result.field.samples).subspan(static_cast<std::size_t>(frame) * pixels, pixels));
  }
  report("done", 1);
  result.device_peak_bytes = device.peak_bytes();
  return result;
}

}  // namespace raywave
