// SPDX-License-Identifier: Apache-2.0
/// The kernel option for the precision of a plan.
#pragma once

#include <string>

#include "cl/device.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// The value of RAYWAVE_PRECISION (kernels/common/double_single.h).
///
/// throws  DeviceError when the device has no doubles
std::string precision_option(const cl::DeviceInfo& device, Precision precision);

}  // namespace raywave
