// SPDX-License-Identifier: Apache-2.0
/// Light of every surface sample at every pixel of the hologram (Method::points, and surfaces near
/// z = 0), or along rays from each pixel (Method::rays): nothing is propagated.
#pragma once

#include <optional>

#include "host/carriers/plane_carrier.hpp"

namespace raywave {

class HologramCarrier final : public PlaneCarrier {
public:
  using PlaneCarrier::PlaneCarrier;

  void fit(const Plan& plan) override {
    plan_ = &plan;
    require_far_hits();
    make_field();
  }
  void add_notes(std::vector<std::string>&) const override {}

private:
  void make_source(const DeviceScene& scene, const SampleTable* table, int frames) override {
    source_.emplace(device_, *plan_, scene, table, frames);
  }
  void drop_source() override { source_.reset(); }
  void start(std::uint32_t seed) override { source_->start(seed); }
  PlanePart fill(const Wrp& wrp, cl::ComplexBuffer& stack, bool) override {
    source_->fill(wrp, stack);
    return {};
  }
  void add(const Wrp&, bool, const FilledPlane& plane) override {
    field_.copy_from(plane.stack, static_cast<std::size_t>(plane.plane) * field_.size());
  }
  TileField sum() override { return field_; }

  std::optional<PlaneSource> source_;
};

}  // namespace raywave
