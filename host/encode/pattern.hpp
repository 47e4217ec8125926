// SPDX-License-Identifier: Apache-2.0
/// Test patterns that tell on a bench whether an SLM is described right (docs/slm.md#at-the-bench).
#pragma once

#include <string>

#include "host/common/npy.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

enum class Pattern {
  lens,     // focuses the light: tells the sign of phase
  blaze,    // turns the light to one side: tells flips and turns
  checker,  // squares half a turn apart: no light stays on the axis where a turn is a turn
  ramp      // grey rises by a turn from left to right, below a plain quarter: to be looked at
};

enum class Side { right, left, up, down };

struct PatternSpec {
  Pattern pattern = Pattern::lens;
  double focal_m = 0.3;     // lens: to its focus along the light; < 0: it diverges
  double period_px = 16;    // blaze: pixels to a turn; checker: pixels to two squares
  Side side = Side::right;  // blaze: where the light goes, seen along the light
};

/// throws  InputError for a name that is none
Pattern pattern_of(const std::string& name);
Side side_of(const std::string& name);
const char* name_of(Pattern pattern);
const char* name_of(Side side);

/// The SLM without what hides a phase: phases are shown as they are.
SlmSpec slm_of_pattern(SlmSpec slm);

/// The pattern as a field of modulus 1.
///
/// throws  InputError when the SLM's pixels cannot show it; the message gives what they can
FieldStack pattern_field(const PatternSpec& spec, const HologramSpec& hologram);

/// The distance by which a blaze moves its spot per metre of way.
double blaze_slope(const PatternSpec& spec, const HologramSpec& hologram);

}  // namespace raywave
