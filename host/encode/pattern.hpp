// SPDX-License-Identifier: Apache-2.0
/// Test patterns that tell on a bench whether an SLM is described right (docs/slm.md#at-the-bench).
#pragma once

#include "host/common/choices.hpp"
#include "host/common/npy.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

struct PatternSpec {
  Pattern pattern = Pattern::lens;
  double focal_m = 0.3;     // lens: to its focus along the light; < 0: it diverges
  double period_px = 16;    // blaze: pixels to a turn; checker: pixels to two squares
  Side side = Side::right;  // blaze: where the light goes, seen along the light
};

/// The SLM without what hides a phase: phases are shown as they are.
SlmSpec slm_of_pattern(SlmSpec slm);

/// The pattern as a field of modulus 1.
///
/// throws  InputError when the SLM's pixels cannot show it; the message gives what they can
FieldStack pattern_field(const PatternSpec& spec, const HologramSpec& hologram);

/// The distance by which a blaze moves its spot per metre of way.
double blaze_slope(const PatternSpec& spec, const HologramSpec& hologram);

}  // namespace raywave
