// SPDX-License-Identifier: Apache-2.0
/// How far phases will be off, by precision, and which precision a scene needs. docs/accuracy.md,
/// "Precision of phase", derives it.
#pragma once

#include <array>

#include "host/plan/plan.hpp"

namespace raywave {

/// Predicted errors of phase in turns, root mean square over a field; 2 pi times their sum is the
/// field's relative L2 error.
struct PhaseError {
  double waves_turns = 0;      // from samples, or hits, to the pixels of the WRPs
  double bounces_turns = 0;    // of paths over mirrors and through glass
  double propagate_turns = 0;  // from the WRPs to the hologram

  double total_turns() const { return waves_turns + bounces_turns + propagate_turns; }
};

using PhaseErrors = std::array<PhaseError, 2>;  // by Precision

/// Phase errors of a plan whose planes and rays are set.
PhaseErrors phase_errors_of(const Plan& plan);
/// In the precision that the plan has.
inline double phase_error_turns(const Plan& plan) {
  return phase_errors_of(plan)[static_cast<std::size_t>(plan.precision)].total_turns();
}

/// The precision that was asked for; else the cheapest that keeps the error below spec.phase_turns;
/// where none does, the cheapest of those with the least error.
///
/// has_doubles  whether the device can compute in doubles
Precision choose_precision(const AccuracySpec& spec, const PhaseErrors& errors, bool has_doubles);

}  // namespace raywave
