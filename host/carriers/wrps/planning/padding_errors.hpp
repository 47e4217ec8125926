// SPDX-License-Identifier: Apache-2.0
/// The error that a small wrp.padding brings to the field: light that misses the hologram's window
/// wraps around to the other side of the padded plane, and into the window.
#pragma once

#include "host/plan/plan.hpp"

namespace raywave {

/// Relative L2 error of the field at the hologram against an endless padding, predicted: along each
/// axis, a line of every WRP (of 32 at most) is filled with the waves of some samples spread
/// through the box of its layer's surfaces, cut by cone, apodization and WRP as the gathering does,
/// and propagated with each padding and with a wide one. Takes milliseconds.
///
/// padded    samples of the padded planes; {SpectrumWrps::padded} for the plan's own
/// returns   an error for each
/// accuracy  within a factor of 1.6 of what the scene itself shows, measured from 0.003 to 0.9
///           (tests/forecast/propagation_errors.cpp); the scene is taken to fill its box
std::vector<double> predicted_padding_errors(const Plan& plan,
                                             const std::vector<glm::ivec2>& padded);

/// Relative L2 error of the field at the hologram against the waves of all samples, weighted as the
/// cone weighs them: what padding leaves wrong, and the fringes about the edges of the cones that
/// WRPs gather. They are sqrt(wavelength z) wide, so that holograms of few Fresnel zones lose much.
/// Of aimed samples.
///
/// accuracy  of small holograms within a factor of 1.6 (tests/forecast/propagation_errors.cpp); of
///           the demo scenes 0.75 to 2.3 of what is measured, since the scene is taken to fill its
///           box; a cone whose light is as wide as the padded plane leaves twice as much
double predicted_wave_error(const Plan& plan, glm::ivec2 padded);

}  // namespace raywave
