// SPDX-License-Identifier: Apache-2.0
/// Results of `raywave tune` for a device, and the device properties that planning needs. Results
/// are stored in the cache folder, one file per platform, device and driver.
#pragma once

#include <filesystem>
#include <optional>

#include "cl/device.hpp"
#include "host/forecast/cost.hpp"

namespace raywave {

struct Tuning {
  DeviceRates rates;
  cl::WorkShape work;
};

std::filesystem::path tuning_file(const cl::DeviceInfo& device);

/// The stored results for the device; none when there is no file, or when another version of
/// raywave wrote it in another layout.
///
/// throws  InputError with file and key (or line) when the file is damaged or has a value that the
///         device cannot use
std::optional<Tuning> load_tuning(const cl::DeviceInfo& device);

/// throws  InputError when the file cannot be written
void store_tuning(const cl::DeviceInfo& device, const Tuning& tuning);

/// The device with its stored work shape, if any.
///
/// throws  the errors of load_tuning
cl::DeviceInfo tuned(cl::DeviceInfo device);

/// The properties of a device that planning needs, with the rates that `raywave tune` measured, or
/// default rates.
///
/// throws  the errors of load_tuning
DeviceFigures figures_of(const cl::DeviceInfo& device);

}  // namespace raywave
