// SPDX-License-Identifier: Apache-2.0
/// FLIP: what a person sees of the difference when one picture follows the other in its place.
#pragma once

#include <span>

#include "host/scene/image.hpp"

namespace raywave {

/// Pixels per degree of the screen that papers quote FLIP for: 0.7 m before one of 3840 pixels on
/// 0.7 m.
inline constexpr double flip_pixels_per_degree = 67.0206;

/// Mean FLIP of the pixels: 0 where the pictures are equal, at most 1.
///
/// reference, test  linear sRGB, one channel (grey) or three, of one size; values are cut off at 0
///                  and `white`
/// accuracy         1e-4 of flip-evaluator 1.7
/// source           Andersson et al., Proc. ACM Comput. Graph. Interact. Tech. 3, 15 (2020)
double flip_of(std::span<const Image> reference, std::span<const Image> test, double white);

}  // namespace raywave
