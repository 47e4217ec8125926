// SPDX-License-Identifier: Apache-2.0
/// Functions of OpenCL C for headers of kernels that are compiled as C++ in namespace
/// raywave::kernel: one lane, which the compiler vectorises.
#pragma once

#include <cmath>

namespace raywave::kernel {

using std::copysign, std::fabs, std::fma, std::sqrt;
using uint = unsigned;
inline float fmin(float a, float b) { return a < b ? a : b; }
inline float fmax(float a, float b) { return a > b ? a : b; }

}  // namespace raywave::kernel
