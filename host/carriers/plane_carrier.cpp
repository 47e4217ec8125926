// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/plane_carrier.hpp"

#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/memory.hpp"

namespace raywave {

PlaneCarrier::PlaneCarrier(const cl::Device& device, const cl::Device& planes_device,
                           CarrierOptions options, StageTimes& times)
    : samples_device_(device),
      device_(planes_device),
      options_(std::move(options)),
      times_(times) {}

void PlaneCarrier::prepare(const DeviceScene& scene, std::shared_ptr<const SampleTable> table) {
  const StageClock clock(times_, "samples");
  frames_together_ = frames_together(*plan_, device_.info().largest_buffer_bytes);
  const KernelKey key{plan_->samples.aimed,
                      is_near_hologram(*plan_),
                      plan_->specular.bounces,
                      plan_->beyond_diffraction,
                      plan_->precision,
                      frames_together_,
                      scene.options};
  if (!has_source_ || key != built_for_ || table_ != table) {
    release();
    table_ = std::move(table);
    make_source(scene, table_.get(), frames_together_);
    has_source_ = true;
    built_for_ = key;
  }
  samples_device_.finish();
}

void PlaneCarrier::release() {
  has_source_ = false;
  drop_source();
  table_ = nullptr;
}

void PlaneCarrier::require_far_hits() const {
  if (!plan_->samples.aimed && is_near_hologram(*plan_))
    throw InputError(one_line(plan_->scene_name) +
                     ": it crosses the hologram, whose rays miss most of what lies so near; leave "
                     "out --method rays");
}

/// Memory for filled planes. Frames that are filled together need one stack for every plane of a
/// tile; a single frame needs one plane at a time.
void PlaneCarrier::make_stacks() {
  const auto size = static_cast<std::size_t>(frames_together_) * plan_->gathered_pixels();
  stacks_.resize(frames_together_ > 1 ? plan_->most_wrps_of_a_tile() : 1);
  lit_.resize(stacks_.size());
  for (auto& stack : stacks_) {
    if (stack.size() == size) continue;
    stack = {};  // frees the old memory first
    stack = {device_, size, "fields of a WRP"};
  }
}

void PlaneCarrier::make_field() {
  const auto pixels = area_of(plan_->tiling.tile_size);
  if (field_.size() != pixels) field_ = {device_, pixels, "field at the hologram"};
}

/// The first frame of those that are filled together fills the planes of all.
FilledPlane PlaneCarrier::filled(std::size_t number, int frame) {
  const auto& wrp = plan_->wrps[number];
  const auto first = plan_->wrps_of(wrp.tile).first;
  const int within = frame % frames_together_;
  if (number == first) make_stacks();
  const auto place = frames_together_ > 1 ? number - first : 0;
  if (within == 0) {
    if (number == first) start(plan_->hologram.seed + static_cast<std::uint32_t>(frame));
    const StageClock clock(times_, "trace");
    const bool is_whole = options_.filled || options_.fft != cl::FftBackend::host;
    lit_[place] = fill(wrp, stacks_[place], is_whole);
    device_.finish();
  }
  return {stacks_[place], within, lit_[place]};
}

TileField PlaneCarrier::carry(std::size_t tile, int frame) {
  const auto [first, end] = plan_->wrps_of(tile);
  for (auto wrp = first; wrp < end; ++wrp) {
    if (options_.filling) options_.filling(wrp, frame);
    const auto plane = filled(wrp, frame);
    if (options_.filled) options_.filled(wrp, plane.stack, plane.plane);
    add(plan_->wrps[wrp], wrp == first, plane);
  }
  return sum();
}

}  // namespace raywave
