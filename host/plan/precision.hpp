// SPDX-License-Identifier: Apache-2.0
/// How far phases will be off, by precision, and which precision a scene needs. docs/accuracy.md,
/// "Predicted phase error", derives it.
#pragma once

#include <array>
#include <string>

#include "cl/device.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

struct Plan;

/// Predicted errors of phase in turns, root mean square over a field; 2 pi times their sum is the
/// field's relative L2 error.
struct PhaseError {
  double waves_turns = 0;      // from samples, or hits, to the pixels of the WRPs
  double bounces_turns = 0;    // of ways over mirrors and through glass
  double propagate_turns = 0;  // from the WRPs to the hologram

  double total_turns() const { return waves_turns + bounces_turns + propagate_turns; }
};

using PhaseErrors = std::array<PhaseError, 3>;  // by Precision

/// Of a plan whose planes and rays are set.
PhaseErrors predict_phase_errors(const Plan& plan);

/// What was asked for; else the cheapest that keeps the error below spec.phase_turns, or if none
/// does the cheapest of the best.
///
/// has_doubles  whether the device can compute in doubles
Precision choose_precision(const AccuracySpec& spec, const PhaseErrors& errors, bool has_doubles);

/// "float", "extended", "double"
const char* name_of(Precision precision);

/// The value of RAYWAVE_PRECISION (kernels/common/double_single.h).
/// throws  DeviceError when the device has no doubles
std::string precision_option(const cl::DeviceInfo& device, Precision precision);

}  // namespace raywave
