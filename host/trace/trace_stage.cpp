// SPDX-License-Identifier: Apache-2.0
#include "host/trace/trace_stage.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/predict/memory.hpp"
#include "host/trace/compact_gatherer.hpp"
#include "host/trace/fan_tracer.hpp"
#include "host/trace/gatherer.hpp"
#include "host/trace/interpolator.hpp"

namespace raywave {
namespace {

/// throws  InputError when the paper's fan has no ray that the hologram's pixels can show
void require_rays(const Plan& plan) {
  const auto has_rays = [](const Wrp& wrp) { return !wrp.fan.empty(); };
  if (plan.aimed || std::any_of(plan.wrps.begin(), plan.wrps.end(), has_rays)) return;
  const auto degrees = [](double sine) {
    return number_text(std::asin(sine) * 180 / std::numbers::pi) + " degrees";
  };
  throw InputError(
      plan.scene_name + ": no ray of the fan is as flat as the hologram's pixels can show, " +
      degrees(plan.largest_sine.x) + " x " + degrees(plan.largest_sine.y) +
      " off the axis; give a smaller sampling.pitch or hologram.pitch, or bring the scene to the "
      "axis");
}

/// Plans with equal keys share kernels.
KernelKey kernel_key(const Plan& plan, const DeviceScene& arrays, int frames_together) {
  return {
      plan.aimed,      plan.compact.has_value(), is_near_hologram(plan), plan.bounces,
      plan.bounces_as, plan.antialias,           plan.visibility_parts,  plan.beyond_diffraction,
      plan.precision,  arrays.options,           frames_together};
}

}  // namespace

/// Computes the fields on WRPs by gathering from surface samples or by tracing fans of rays.
class FieldSource {
public:
  /// table  of another laser; null: samples are found
  FieldSource(const cl::Device& device, const Plan& plan, const DeviceScene& arrays, int frames,
              std::unique_ptr<SampleTable> table)
      : table_(std::move(table)) {
    const bool snapped = plan.fan_source == FanSource::surface;
    if (table_)
      table_->show(plan, arrays);
    else if (plan.aimed || snapped)
      table_ = std::make_unique<SampleTable>(device, plan, arrays, !plan.aimed);
    if (plan.compact)
      compact_gatherer_ = std::make_unique<CompactGatherer>(device, plan, arrays, *table_, frames);
    else if (plan.aimed)
      gatherer_ = std::make_unique<Gatherer>(device, plan, arrays, *table_, frames);
    if (plan.aimed && plan.has_fans())
      fan_tracer_ = std::make_unique<FanTracer>(device, plan, arrays, HitSource::bounced);
    if (!plan.aimed)
      fan_tracer_ = std::make_unique<FanTracer>(
          device, plan, arrays, snapped ? HitSource::surface : HitSource::hit, table_.get());
  }

  int samples() const { return table_ ? table_->count : 0; }
  int hidden_samples() const { return table_ ? table_->hidden : 0; }

  void find_samples(const Plan& plan, const DeviceScene& arrays) {
    if (table_) table_->find(plan, arrays);
  }

  /// The samples, for another laser; gathering is over then.
  std::unique_ptr<SampleTable> take_table() { return std::move(table_); }

  /// Starts the frames of seed, seed + 1, ...
  void start(std::uint32_t seed) {
    seed_ = seed;
    if (gatherer_) gatherer_->draw_phases(seed);
    if (compact_gatherer_) compact_gatherer_->draw_phases(seed);
  }

  /// Returns the lit part of a virtual plane.
  PlanePart fill(const Wrp& wrp, cl::ComplexBuffer& stack, bool is_whole) {
    if (compact_gatherer_) return compact_gatherer_->gather(wrp, stack, is_whole);
    if (gatherer_) gatherer_->gather(wrp, stack);
    if (fan_tracer_) fan_tracer_->trace(wrp, seed_, stack);
    return {};
  }

private:
  std::unique_ptr<SampleTable> table_;
  std::unique_ptr<Gatherer> gatherer_;
  std::unique_ptr<CompactGatherer> compact_gatherer_;
  std::unique_ptr<FanTracer> fan_tracer_;
  std::uint32_t seed_ = 0;
};

TraceStage::TraceStage(const cl::Device& device, StageTimes& times)
    : device_(device), times_(times) {}
TraceStage::~TraceStage() = default;

int TraceStage::samples() const { return source_->samples(); }
int TraceStage::hidden_samples() const { return source_->hidden_samples(); }
double TraceStage::radiance_unit() const { return arrays_->radiance_unit; }

void TraceStage::take_over(TraceStage& other) {
  arrays_ = std::move(other.arrays_);
  table_ = other.source_->take_table();
  other.source_ = nullptr;
}

void TraceStage::prepare(const World& world, const Plan& plan) {
  require_rays(plan);
  plan_ = &plan;
  // The scene in device memory. The time for trees is reported as a stage of its own.
  if (arrays_ && !source_) {
    const StageClock clock(times_, "prepare");
    arrays_->show(plan);
  } else if (arrays_) {
    const StageClock clock(times_, "tree");
    arrays_->place(world, plan);
  } else {
    {
      const StageClock clock(times_, "prepare");
      arrays_ = std::make_unique<DeviceScene>(device_, world, plan);
    }
    times_.wall_s["tree"] = arrays_->tree_seconds;
    times_.wall_s["prepare"] -= arrays_->tree_seconds;
  }

  // Surface samples; kernels are kept when they fit the plan.
  const StageClock clock(times_, "samples");
  frames_together_ = frames_together(plan, device_.info().largest_buffer_bytes);
  if (const auto key = kernel_key(plan, *arrays_, frames_together_); source_ && key == built_for_) {
    source_->find_samples(plan, *arrays_);
  } else {
    source_ = nullptr;  // frees the old memory first
    source_ =
        std::make_unique<FieldSource>(device_, plan, *arrays_, frames_together_, std::move(table_));
    built_for_ = key;
  }
  device_.finish();
}

/// Allocates the memory for fields on WRPs. Frames gathered together need one stack for every WRP
/// of a tile; a single frame needs one field at a time.
void TraceStage::make_stacks() {
  const auto size = static_cast<std::size_t>(frames_together_) * plan_->gathered_pixels();
  stacks_.resize(frames_together_ > 1 ? plan_->most_wrps_of_a_tile() : 1);
  lit_.resize(stacks_.size());
  for (auto& stack : stacks_) {
    if (stack.size() == size) continue;
    stack = {};  // frees the old memory first
    stack = {device_, size, "fields of a WRP"};
  }
  const auto interpolates = [](const DepthLayer& layer) { return layer.interpolates(); };
  if (!interpolator_ && std::any_of(plan_->layers.begin(), plan_->layers.end(), interpolates)) {
    interpolator_ = std::make_unique<Interpolator>(device_);
    const auto size_of_tile =
        static_cast<std::size_t>(plan_->tile_size.x) * static_cast<std::size_t>(plan_->tile_size.y);
    interpolated_ = {device_, size_of_tile, "field of a WRP"};
  }
}

WrpField TraceStage::run(std::size_t number, int frame, bool is_whole) {
  const auto& wrp = plan_->wrps[number];
  const auto first = plan_->wrps_of(wrp.tile).first;
  const int within = frame % frames_together_;
  if (number == first) make_stacks();
  const auto place = frames_together_ > 1 ? number - first : 0;
  auto& stack = stacks_[place];

  // The first frame of a group fills the planes of all frames that are computed together.
  if (within == 0) {
    if (number == first) source_->start(plan_->seed + static_cast<std::uint32_t>(frame));
    const StageClock clock(times_, "trace");
    lit_[place] = source_->fill(wrp, stack, is_whole);
    device_.finish();
  }
  // A layer with fewer rows is interpolated frame by frame.
  if (!plan_->layer_of(wrp).interpolates()) return {stack, within, lit_[place]};

  const StageClock clock(times_, "trace");
  interpolator_->interpolate(*plan_, wrp, stack, within, interpolated_);
  device_.finish();
  return {interpolated_, 0};
}

}  // namespace raywave
