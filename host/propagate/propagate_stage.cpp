// SPDX-License-Identifier: Apache-2.0
#include "host/propagate/propagate_stage.hpp"

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/compact.hpp"

namespace raywave {

PropagateStage::PropagateStage(const cl::Device& device, cl::FftBackend fft, StageTimes& times)
    : device_(device), fft_(fft), times_(times) {}

void PropagateStage::prepare(const Plan& plan, Method method, bool keep_field) {
  plan_ = &plan;
  const auto pixels =
      static_cast<std::size_t>(plan.tile_size.x) * static_cast<std::size_t>(plan.tile_size.y);
  // A scene that moves may change from virtual planes to WRPs
  if (plan.compact) propagator_ = nullptr;
  if (!plan.compact) compact_propagator_ = nullptr;
  if (plan.is_at_hologram()) propagator_ = nullptr;
  if (plan.compact) {
    if (!compact_propagator_) {
      const StageClock clock(times_, "prepare");
      compact_propagator_ = std::make_unique<CompactPropagator>(device_, plan, fft_);
    }
  } else if (method == Method::wrp && !plan.is_at_hologram()) {
    if (!propagator_) {
      const StageClock clock(times_, "prepare");
      propagator_ = std::make_unique<Propagator>(
          device_,
          PropagatorSpec{plan.tile_size, plan.pitch_m, plan.wavelength_m, plan.padding, fft_});
    }
    require_reach();
  }
  hands_on_transforms_ = encodes_transforms(plan, keep_field);
  if (hands_on_transforms_) field_ = {};
  if (!hands_on_transforms_ && field_.size() != pixels)
    field_ = {device_, pixels, "field at the hologram"};
}

Target PropagateStage::target_of(const Wrp& wrp) const {
  return {plan_->tile_of(wrp).centre_m - glm::dvec2(wrp.centre_m), wrp.centre_m.z};
}

void PropagateStage::require_reach() const {
  for (const auto& wrp : plan_->wrps) {
    try {
      propagator_->require_reach(target_of(wrp));
    } catch (const InputError& error) {
      throw InputError(plan_->scene_name + ": WRPs " + std::to_string(plan_->grid.x) + " x " +
                       std::to_string(plan_->grid.y) + ": " + error.what());
    }
  }
}

void PropagateStage::run(std::size_t number, cl::ComplexBuffer& stack, int plane,
                         const PlanePart& lit) {
  if (compact_propagator_) {
    const StageClock clock(times_, "propagate");
    const auto& wrp = plan_->wrps[number];
    if (hands_on_transforms_) {
      transformed_.emplace(compact_propagator_->transform(stack, plane, lit, wrp.centre_m.z));
      return device_.finish();
    }
    compact_propagator_->add(stack, plane, lit, wrp.centre_m.z,
                             number == plan_->wrps_of(wrp.tile).first, field_);
    return device_.finish();
  }
  if (!propagator_) {
    field_.copy_from(stack, static_cast<std::size_t>(plane) * field_.size());
    return;
  }
  const StageClock clock(times_, "propagate");
  const auto tile = target_of(plan_->wrps[number]);
  has_sum_ = true;
  propagator_->load(stack, plane, {&tile, 1});
  propagator_->add(tile);
  device_.finish();
}

TileField PropagateStage::finish() {
  if (propagator_) {
    const StageClock clock(times_, "propagate");
    propagator_->collect(field_);
    has_sum_ = false;
    device_.finish();
  }
  if (hands_on_transforms_) return transformed_.value();
  return field_;
}

void PropagateStage::drop() {
  if (propagator_ && has_sum_) propagator_->collect(field_);
  has_sum_ = false;
}

void PropagateStage::add_notes(std::vector<std::string>& notes) const {
  for (auto& warning : compact_warnings(*plan_)) notes.push_back(std::move(warning));
  if (!propagator_) return;
  if (const double farthest_m = plan_->layers.back().distance_m;
      farthest_m > propagator_->farthest_m())
    notes.push_back("from " + length_text(farthest_m) +
                    " away light gets lost: a padded plane this small samples enough directions up "
                    "to " +
                    length_text(propagator_->farthest_m()) + "; --method points has no such limit");
}

}  // namespace raywave
