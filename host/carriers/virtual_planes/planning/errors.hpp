// SPDX-License-Identifier: Apache-2.0
/// What compact propagation costs in accuracy, before anything is computed.
#pragma once

#include <glm/vec3.hpp>

#include "host/plan/plan.hpp"

namespace raywave {

/// Relative L2 errors of the field at the hologram, of samples that nothing hides.
///
/// accuracy  within a factor of 1.6 of what scenes show (tests/trace/compact.cpp); the scene
///           is taken to fill its box
///
/// Error of the window and of cutting footprints off: along each axis, the wave of samples at some
/// depths is cut, carried to the hologram and back.
double predicted_window_error(const Plan& plan);

/// The part of it that comes from cutting long footprints off, in no time.
double predicted_cut_error(const Plan& plan);

/// Error of so many scan lines, or fewer for samples within VirtualPlanes::lines_tolerance: what
/// interpolation between them leaves of the phases of samples spread through each layer's box.
double predicted_lines_error(const Plan& plan, int lines);

/// Error of so many scan lines in light that is a highlight alone, the sharpest of the scene's
/// materials: what interpolation leaves of its lobe exp(-a (t - t0)^2), t in half tiles up or down.
///
/// accuracy  what a wall shows is at most 1.6 times it (tests/trace/compact.cpp)
double predicted_highlights_error(const Plan& plan, int lines);

/// Scan lines of a sample that nothing hides, as kernels/gather/compact.cl counts them.
///
/// most  VirtualPlanes::most_lines
/// at_m  of the sample, from the tile's middle, y downwards
int scan_lines_of(const Plan& plan, int most, glm::dvec3 at_m, double z0_m);

/// a: how much sharper than the tile the amplitude of the sharpest highlight is; 0 where there is
/// none. Phong's lobe cos^m over an angle v / z is exp(-m v^2 / (2 z^2)), its amplitude the root.
double sharpest_highlight(const Plan& plan);

// On how many scan lines a sample's light is known before it is interpolated.

/// As few scan lines as add little to what the window leaves wrong, unless their number is given,
/// with the errors of all; what samples with highlights need.
///
/// moved_from  the same scene before its objects moved; null: it has not
void choose_lines(Plan& plan, bool lines_are_given, const Plan* moved_from);

}  // namespace raywave
