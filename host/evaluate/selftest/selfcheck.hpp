// SPDX-License-Identifier: Apache-2.0
/// Errors of a device's arithmetic and struct layout, measured with
/// kernels/instruments/selfcheck.cl.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cl/device.hpp"

namespace raywave::selftest {

/// Units, and the red laser and the SLM of the checks.
constexpr double nm = 1e-9, um = 1e-6, mm = 1e-3, red_m = 638e-9, slm_m = 3.74e-6;

/// Stated in kernels/common/phase.h.
constexpr double cos_sin_bound = 1.7e-7;

/// Largest distance of the device's cosines and sines of 2 pi turns from the C library's in double.
/// NaN when any is NaN.
double cos_sin_error(const cl::Device& device, int lanes, std::span<const float> turns);

/// cos_sin_error over every float in [-0.5, 0.5]: 2.1 thousand million. Since arguments are reduced
/// exactly first, this holds for all |turns| < 2^22.
double cos_sin_error_everywhere(const cl::Device& device, int lanes);

/// A hundred thousand arguments up to 0.75 turns, evenly spread and near zero, with those where
/// folds meet and the largest there may be.
std::vector<float> cos_sin_arguments();

/// Members of shared structs ("Sample.key") that the device places elsewhere than the host.
std::vector<std::string> misplaced_members(const cl::Device& device);

}  // namespace raywave::selftest
