// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/device_json.hpp"

#include <nlohmann/json.hpp>

#include "host/trace/work_shape.hpp"

namespace raywave {

nlohmann::ordered_json json_of(const cl::WorkShape& shape) {
  nlohmann::ordered_json j;
  for (const auto& knob : work_knobs) j[knob.name] = shape.*knob.value;
  return j;
}

nlohmann::ordered_json json_of(const cl::DeviceInfo& device) {
  return {{"index", device.index},
          {"name", device.name},
          {"platform", device.platform},
          {"vendor", device.vendor},
          {"version", device.version},
          {"driver", device.driver},
          {"work", json_of(work_shape(device))}};
}

}  // namespace raywave
