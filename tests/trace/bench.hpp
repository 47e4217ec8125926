// SPDX-License-Identifier: Apache-2.0
/// Stages for light from mirrors and through glass.
#pragma once

#include "tests/support/samples.hpp"

namespace raywave::test {

inline Material glass(double ior) { return Material{.transparency = 1.0, .ior = ior}; }

/// 160 x 160 pixels of 8 um; all pixels gather all samples.
inline Stage bench(Bounces bounces) {
  Stage stage;
  stage.scene.hologram = {{160, 160}, {8e-6, 8e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 25e-6;
  stage.scene.trace.bounces = bounces;
  return stage;
}

}  // namespace raywave::test
