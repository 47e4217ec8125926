// SPDX-License-Identifier: Apache-2.0
/// What PoCL needs. 6.0: its passes that make a loop over the items of a work-group end the process
/// on long kernels (docs/devices.md). A group of one item needs no loop.
#pragma once

#include "cl/device.hpp"

namespace raywave::cl {

bool is_pocl(const DeviceInfo& device);

/// Whether kernels must be launched in work-groups of one item, and programs be kept as objects:
/// the binary of a built program holds its kernels for groups of any size, which have the loop.
bool needs_single_items(const DeviceInfo& device);

/// "; PoCL needs ld ...", where it is PoCL's device and no folder of PATH has ld; else empty.
std::string missing_tool(const DeviceInfo& device);

}  // namespace raywave::cl
