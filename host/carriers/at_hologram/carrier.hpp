// SPDX-License-Identifier: Apache-2.0
/// Light of every surface sample at every pixel of the hologram (Method::points, and surfaces near
/// z = 0), or along rays from each pixel (Method::rays): nothing is propagated.
#pragma once

#include "host/carriers/plane_carrier.hpp"

namespace raywave {

class HologramCarrier final : public SourceCarrier {
public:
  using SourceCarrier::SourceCarrier;

  void fit(const Plan& plan) override {
    plan_ = &plan;
    require_far_hits();
    make_field();
  }
  void add_notes(std::vector<std::string>&) const override {}

private:
  void add(const Wrp&, bool, const FilledPlane& plane) override {
    field_.copy_from(plane.stack, static_cast<std::size_t>(plane.plane) * field_.size());
  }
  TileField sum() override { return field_; }
};

}  // namespace raywave
