// SPDX-License-Identifier: Apache-2.0
/// On how many scan lines a sample's light is known before it is interpolated.
#pragma once

#include "host/plan/plan.hpp"

namespace raywave {

/// As few scan lines as add little to what the window leaves wrong, unless their number is given,
/// with the errors of all; what samples with highlights need.
///
/// moved_from  the same scene before its objects moved; null: it has not
void choose_lines(Plan& plan, bool lines_are_given, const Plan* moved_from);

}  // namespace raywave
