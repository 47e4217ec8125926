// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/virtual_planes/carrier.hpp"

#include <utility>

#include "host/carriers/virtual_planes/planning/facts.hpp"

namespace raywave {

void VirtualPlaneCarrier::fit(const Plan& plan) {
  plan_ = &plan;
  if (!propagator_) {
    const StageClock clock(times_, "prepare");
    propagator_.emplace(device_, plan, options_.fft);
  }
  hands_on_transforms_ = encodes_transforms(plan, options_.keep_field);
  if (hands_on_transforms_)
    field_ = {};
  else
    make_field();
}

void VirtualPlaneCarrier::make_source(const DeviceScene& scene, const SampleTable* table,
                                      int frames) {
  gatherer_.emplace(samples_device_, *plan_, scene, *table, frames, std::nullopt, device_);
}

PlanePart VirtualPlaneCarrier::fill(const Wrp& wrp, cl::ComplexBuffer& stack, bool is_whole) {
  return gatherer_->gather(wrp, stack, is_whole);
}

void VirtualPlaneCarrier::add(const Wrp& wrp, bool is_first, const FilledPlane& plane) {
  const StageClock clock(times_, "propagate");
  if (hands_on_transforms_)
    transformed_.emplace(
        propagator_->transform(plane.stack, plane.plane, plane.lit, wrp.centre_m.z));
  else
    propagator_->add(plane.stack, plane.plane, plane.lit, wrp.centre_m.z, is_first, field_);
  device_.finish();
  if (is_on_two_devices() && options_.fft == cl::FftBackend::host)
    plane_bytes_ += 2 * plan_->gathered_pixels() * sizeof(std::complex<float>);
}

TileField VirtualPlaneCarrier::sum() {
  if (hands_on_transforms_) return transformed_.value();
  return field_;
}

void VirtualPlaneCarrier::add_notes(std::vector<std::string>& notes) const {
  for (auto& warning : warnings_of(*plan_->virtual_planes(), *plan_))
    notes.push_back(std::move(warning));
  // Of the first picture: others are much alike
  if (is_on_two_devices() && !std::exchange(has_said_crossing_, true))
    notes.push_back("samples on " + samples_device_.info().name + ", planes and levels on " +
                    device_.info().name + ": " + cl::format_bytes(gatherer_->crossed_bytes()) +
                    " of samples crossed, and " + cl::format_bytes(plane_bytes_) +
                    " of planes to the host's FFT and back");
}

}  // namespace raywave
