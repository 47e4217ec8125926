// SPDX-License-Identifier: Apache-2.0
/// Memory that a device and this machine have.
#pragma once

#include "cl/device.hpp"
#include "host/plan/memory.hpp"

namespace raywave {

/// Memory of the device and of this machine, or of its container when that has less.
MemoryLimits limits_of(const cl::DeviceInfo& device);

}  // namespace raywave
