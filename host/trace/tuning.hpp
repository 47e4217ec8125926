// SPDX-License-Identifier: Apache-2.0
/// What `raywave tune` has measured of a device: a small file in the cache folder, one per
/// platform, device and driver; and what planning is told about a device.
#pragma once

#include <filesystem>
#include <optional>

#include "cl/device.hpp"
#include "host/plan/device_figures.hpp"

namespace raywave {

struct Tuning {
  DeviceRates rates;
  cl::WorkShape work;
};

std::filesystem::path tuning_file(const cl::DeviceInfo& device);

/// What is stored for the device; none where nothing is, or where it has another layout, from
/// another version of raywave.
///
/// throws  InputError naming file and key (or line) for what is damaged, or no device can do
std::optional<Tuning> load_tuning(const cl::DeviceInfo& device);

/// throws  InputError when the file cannot be written
void store_tuning(const cl::DeviceInfo& device, const Tuning& tuning);

/// The device with its stored work shape, if any.
///
/// throws  as load_tuning
cl::DeviceInfo tuned(cl::DeviceInfo device);

/// Memory of the device and of this machine (of its container, where that has less).
MemoryLimits limits_of(const cl::DeviceInfo& device);

/// What planning needs to know of a device, with the rates that `raywave tune` has measured, if
/// any.
///
/// throws  as load_tuning
DeviceFigures figures_of(const cl::DeviceInfo& device);

}  // namespace raywave
