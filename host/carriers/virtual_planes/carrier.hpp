// SPDX-License-Identifier: Apache-2.0
/// Light over virtual planes, one Fourier transform away from a tile of the hologram
/// (host/carriers/virtual_planes/planning/planes.hpp, docs/pipeline.md#virtual-planes).
#pragma once

#include <optional>

#include "host/carriers/plane_carrier.hpp"
#include "host/carriers/virtual_planes/compact_gatherer.hpp"
#include "host/carriers/virtual_planes/compact_propagator.hpp"

namespace raywave {

class VirtualPlaneCarrier final : public PlaneCarrier {
public:
  using PlaneCarrier::PlaneCarrier;

  void fit(const Plan& plan) override;
  void add_notes(std::vector<std::string>& notes) const override;

private:
  void make_source(const DeviceScene& scene, const SampleTable* table, int frames) override;
  void drop_source() override { gatherer_.reset(); }
  void start(std::uint32_t seed) override { gatherer_->draw_phases(seed); }
  PlanePart fill(const Wrp& wrp, cl::ComplexBuffer& stack, bool is_whole) override;
  void add(const Wrp& wrp, bool is_first, const FilledPlane& plane) override;
  TileField sum() override;

  bool is_on_two_devices() const { return samples_device_.queue()() != device_.queue()(); }

  std::optional<CompactGatherer> gatherer_;
  std::optional<CompactPropagator> propagator_;
  bool hands_on_transforms_ = false;  // encodes_transforms
  mutable bool has_said_crossing_ = false;
  std::optional<TransformedPlane> transformed_;
  std::uint64_t plane_bytes_ = 0;  // that crossed, of two devices
};

}  // namespace raywave
