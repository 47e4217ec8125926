// SPDX-License-Identifier: Apache-2.0
/// What wrp.padding costs: light that misses the hologram's window comes round to the other side of the padded plane, and into the window
/// when the padding is small.
#pragma once

#include "host/mesh.hpp"
#include "host/plan.hpp"

namespace raywave {

/// Relative L2 error of the field at the hologram against an endless padding, predicted: along each axis, a line of every WRP (of 32 at
/// most) is filled with the waves of some samples spread through the scene's box, cut by cone, soft edge and WRP as the gathering does,
/// and propagated twice, with the plan's padding and with a wide one. Takes milliseconds.
///
/// padded    samples of the padded plane; plan.padded for the plan's own
/// accuracy  within a factor of 1.6 of what the scene itself shows, measured from 0.003 to 0.9 (tests/padding_error.cpp); the scene is
///           taken to fill its box
double predicted_padding_error(const Plan& plan, const World& world, glm::ivec2 padded);

}  // namespace raywave
