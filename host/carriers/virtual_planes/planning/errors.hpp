// SPDX-License-Identifier: Apache-2.0
/// What compact propagation costs in accuracy, before anything is computed.
#pragma once

#include <glm/vec3.hpp>

#include "host/plan/plan.hpp"

namespace raywave {

/// Scan lines of a sample that nothing hides, as kernels/gather/compact.cl counts them.
///
/// most  VirtualPlanes::most_lines
/// at_m  of the sample, from the tile's middle, y downwards
int scan_lines_of(const Plan& plan, int most, glm::dvec3 at_m, double z0_m);

/// As few scan lines as add little to what the window leaves wrong, unless their number is given,
/// with the errors of all; what samples with highlights need.
///
/// moved_from  the same scene before its objects moved; null: it has not
void choose_lines(Plan& plan, bool lines_are_given, const Plan* moved_from);

}  // namespace raywave
