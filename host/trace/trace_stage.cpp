// SPDX-License-Identifier: Apache-2.0
#include "host/trace/trace_stage.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/memory.hpp"
#include "host/trace/compact_gatherer.hpp"
#include "host/trace/fan_tracer.hpp"
#include "host/trace/gatherer.hpp"

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

/// Plans with equal keys share kernels that find samples.
TableKey table_key(const Plan& plan, const DeviceScene& scene) {
  return {plan.aimed, plan.bounces_as, plan.antialias, plan.visibility_parts, scene.options};
}

/// Plans with equal keys share kernels.
KernelKey kernel_key(const Plan& plan, const DeviceScene& scene, int frames_together) {
  return {table_key(plan, scene),  plan.compact.has_value(), is_near_hologram(plan), plan.bounces,
          plan.beyond_diffraction, plan.precision,           frames_together};
}

}  // namespace

/// Computes the fields on WRPs by gathering from surface samples or by tracing fans of rays.
class FieldSource {
public:
  /// table  null: light has no samples
  FieldSource(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
              std::shared_ptr<const SampleTable> table, int frames)
      : table_(std::move(table)) {
    if (plan.compact)
      compact_gatherer_ = std::make_unique<CompactGatherer>(device, plan, scene, *table_, frames);
    else if (plan.aimed)
      gatherer_ = std::make_unique<Gatherer>(device, plan, scene, *table_, frames);
    if (!plan.aimed) fan_tracer_ = std::make_unique<FanTracer>(device, plan, scene);
  }

  const SampleTable* table() const { return table_.get(); }

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
  std::shared_ptr<const SampleTable> table_;  // of the kernels below, also when there is a newer
  std::unique_ptr<Gatherer> gatherer_;
  std::unique_ptr<CompactGatherer> compact_gatherer_;
  std::unique_ptr<FanTracer> fan_tracer_;
  std::uint32_t seed_ = 0;
};

TraceStage::TraceStage(const cl::Device& device, StageTimes& times,
                       std::shared_ptr<TracedWorld> shared)
    : device_(device), times_(times), shared_(std::move(shared)) {}
TraceStage::~TraceStage() = default;

int TraceStage::samples() const { return shared_->table ? shared_->table->count : 0; }
int TraceStage::hidden_samples() const { return shared_->table ? shared_->table->hidden : 0; }
double TraceStage::radiance_unit() const { return scene().radiance_unit; }

void TraceStage::prepare(const World& world, const Plan& plan, bool has_stayed) {
  require_rays(plan);
  plan_ = &plan;
  place(world, has_stayed);

  const StageClock clock(times_, "samples");
  frames_together_ = frames_together(plan, device_.info().largest_buffer_bytes);
  find_samples(has_stayed);
  const auto key = kernel_key(plan, scene(), frames_together_);
  if (!source_ || key != built_for_ || source_->table() != shared_->table.get()) {
    source_ = nullptr;  // frees the old memory first
    source_ =
        std::make_unique<FieldSource>(device_, plan, scene(), shared_->table, frames_together_);
    built_for_ = key;
  }
  device_.finish();
}

/// The scene in device memory. The time for trees is reported as a stage of its own.
void TraceStage::place(const World& world, bool has_stayed) {
  auto& scene = shared_->scene;
  if (!scene) {
    {
      const StageClock clock(times_, "prepare");
      scene = std::make_unique<DeviceScene>(device_, world, *plan_);
    }
    times_.wall_s["tree"] = scene->tree_seconds;
    times_.wall_s["prepare"] -= scene->tree_seconds;
  } else if (has_stayed) {
    const StageClock clock(times_, "prepare");
    scene->show(*plan_);
  } else {
    const StageClock clock(times_, "tree");
    scene->place(world, *plan_);
  }
}

/// The samples of the scene, as this plan's laser sees them.
void TraceStage::find_samples(bool has_stayed) {
  auto& table = shared_->table;
  const auto key = table_key(*plan_, scene());
  if (!plan_->aimed) {
    table = nullptr;
  } else if (!table || key != shared_->built_for) {
    source_ = nullptr;  // frees the old memory first
    table = nullptr;
    table = std::make_shared<SampleTable>(device_, *plan_, scene());
    shared_->built_for = key;
  } else if (has_stayed) {
    table->show(*plan_, scene());
  } else {
    table->find(*plan_, scene());
  }
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
  return {stack, within, lit_[place]};
}

}  // namespace raywave
