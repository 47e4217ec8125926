// SPDX-License-Identifier: Apache-2.0
/// What `raywave tune` has found out about a device: a small file in the cache folder, one per
/// platform, device and driver.
#pragma once

#include <filesystem>
#include <optional>

#include "host/plan/cost.hpp"

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

}  // namespace raywave
