// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/wrps/carrier.hpp"

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {

void WrpCarrier::fit(const Plan& plan) {
  plan_ = &plan;
  if (!propagator_) {
    const StageClock clock(times_, "prepare");
    propagator_.emplace(
        device_,
        PropagatorSpec{plan.tiling.tile_size, plan.hologram.pitch_m, plan.hologram.wavelength_m,
                       std::get<SpectrumWrps>(plan.carrier).padding, options_.fft});
  }
  for (const auto& wrp : plan.wrps) {
    try {
      propagator_->require_reach(target_of(wrp));
    } catch (const InputError& error) {
      throw InputError(plan.scene_name + ": WRPs " + std::to_string(plan.grid.x) + " x " +
                       std::to_string(plan.grid.y) + ": " + error.what());
    }
  }
  make_field();
}

Target WrpCarrier::target_of(const Wrp& wrp) const {
  return {plan_->tile_of(wrp).centre_m - glm::dvec2(wrp.centre_m), wrp.centre_m.z};
}

void WrpCarrier::add(const Wrp& wrp, bool is_first, const FilledPlane& plane) {
  const StageClock clock(times_, "propagate");
  if (is_first && has_sum_) propagator_->collect(field_);  // of a picture that was stopped
  has_sum_ = true;
  const auto tile = target_of(wrp);
  propagator_->load(plane.stack, plane.plane, {&tile, 1});
  propagator_->add(tile);
  device_.finish();
}

TileField WrpCarrier::sum() {
  const StageClock clock(times_, "propagate");
  propagator_->collect(field_);
  has_sum_ = false;
  device_.finish();
  return field_;
}

void WrpCarrier::add_notes(std::vector<std::string>& notes) const {
  if (const double farthest_m = plan_->layers.back().distance_m;
      farthest_m > propagator_->farthest_m())
    notes.push_back("from " + length_text(farthest_m) +
                    " away light gets lost: a padded plane this small samples enough directions up "
                    "to " +
                    length_text(propagator_->farthest_m()) + "; --method points has no such limit");
}

}  // namespace raywave
