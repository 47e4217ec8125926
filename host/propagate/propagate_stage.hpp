// SPDX-License-Identifier: Apache-2.0
/// The stage "propagate": from the fields on a tile's WRPs to the field at the hologram.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/common/stage_clock.hpp"
#include "host/plan/plan.hpp"
#include "host/propagate/compact_propagator.hpp"
#include "host/propagate/propagator.hpp"

namespace raywave {

class PropagateStage {
public:
  PropagateStage(const cl::Device& device, cl::FftBackend fft, StageTimes& times);

  /// Makes the propagator for the plan's tiles. Planes at the hologram itself (Method::points and
  /// Method::rays) need none.
  ///
  /// plan        must outlive the stage, which reads it again in `run`
  /// keep_field  samples are wanted of `finish`, always
  /// throws  InputError when no light of some WRP arrives at the hologram
  void prepare(const Plan& plan, Method method, bool keep_field);

  /// Carries plane number `plane` of `stack`, the field on plan.wrps[wrp], to the hologram and adds
  /// it there. What the stack's plane then holds is not defined.
  ///
  /// lit  of a virtual plane: see CompactPropagator
  void run(std::size_t wrp, cl::ComplexBuffer& stack, int plane, const PlanePart& lit);

  /// The field of a tile at the hologram: the sum of all `run` since the last call. Valid until the
  /// next `run`.
  TileField finish();

  /// Forgets what `run` has added: of a picture that was stopped.
  void drop();

  /// Adds lines for light that is lost on its way, and for what virtual planes leave much wrong.
  void add_notes(std::vector<std::string>& notes) const;

private:
  /// The hologram's tile, as a WRP of it sees it.
  Target target_of(const Wrp& wrp) const;
  void require_reach() const;

  cl::Device device_;
  cl::FftBackend fft_;
  StageTimes& times_;
  const Plan* plan_ = nullptr;
  std::unique_ptr<Propagator> propagator_;
  std::unique_ptr<CompactPropagator> compact_propagator_;
  cl::ComplexBuffer field_;
  bool hands_on_transforms_ = false;  // encodes_transforms
  bool has_sum_ = false;              // in the propagator
  std::optional<TransformedPlane> transformed_;
};

}  // namespace raywave
