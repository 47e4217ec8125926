// SPDX-License-Identifier: Apache-2.0
/// Light over wavefront recording planes and by the shifted angular spectrum, as in the paper: rays
/// are aimed at surface samples, or start in fans from the planes' pixels.
#pragma once

#include <optional>

#include "host/carriers/plane_carrier.hpp"
#include "host/propagate/propagator.hpp"

namespace raywave {

class WrpCarrier final : public SourceCarrier {
public:
  using SourceCarrier::SourceCarrier;

  void fit(const Plan& plan) override;
  void add_notes(std::vector<std::string>& notes) const override;

private:
  void add(const Wrp& wrp, bool is_first, const FilledPlane& plane) override;
  TileField sum() override;
  /// The hologram's tile, as a WRP of it sees it.
  Target target_of(const Wrp& wrp) const;

  std::optional<Propagator> propagator_;
  bool has_sum_ = false;  // in the propagator
};

}  // namespace raywave
