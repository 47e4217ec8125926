// SPDX-License-Identifier: Apache-2.0
/// The description of a device in reports.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "cl/device.hpp"

namespace raywave {

nlohmann::ordered_json json_of(const cl::WorkShape& shape);
nlohmann::ordered_json json_of(const cl::DeviceInfo& device);

}  // namespace raywave
