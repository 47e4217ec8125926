// SPDX-License-Identifier: Apache-2.0
/// How far phases will be off, by precision, and which precision a scene needs. docs/accuracy.md,
/// "Precision of phase", derives it.
#pragma once

#include "host/plan/plan.hpp"

namespace raywave {

/// Phase errors of a plan whose planes and rays are set, by precision.
PhaseErrors predict_phase_errors(const Plan& plan);

/// The precision that was asked for; else the cheapest that keeps the error below spec.phase_turns;
/// where none does, the cheapest of those with the least error.
///
/// has_doubles  whether the device can compute in doubles
Precision choose_precision(const AccuracySpec& spec, const PhaseErrors& errors, bool has_doubles);

/// "float", "double"
const char* name_of(Precision precision);

}  // namespace raywave
