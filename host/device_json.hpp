// SPDX-License-Identifier: Apache-2.0
/// What reports say of the device they were made on.
#pragma once

#include <nlohmann/json.hpp>

#include "cl/device.hpp"

namespace raywave {

inline nlohmann::ordered_json json_of(const cl::DeviceInfo& device) {
  return {{"index", device.index},   {"name", device.name},       {"platform", device.platform},
          {"vendor", device.vendor}, {"version", device.version}, {"driver", device.driver}};
}

}  // namespace raywave
