// SPDX-License-Identifier: Apache-2.0
/// How the pictures of a hologram are judged: where they are focused, how they are blurred, and
/// what is left out. Shared by their measurement (host/evaluate/quality.hpp) and their prediction
/// (host/forecast/picture_model.hpp).
#pragma once

#include <vector>

#include "host/plan/plan.hpp"

namespace raywave {

/// Pixels left out on every side after the blur.
inline constexpr int picture_border_px = 20;

/// Depths that pictures are focused on, in metres: nearest surface, farthest surface, and out of
/// focus, before the nearest by a tenth of the depth between them, or by 1 % of its distance where
/// that is more. Surfaces at one depth count once.
std::vector<double> quality_depths_m(const Plan& plan);

}  // namespace raywave
