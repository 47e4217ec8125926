// SPDX-License-Identifier: Apache-2.0
/// How long a device needs for each operation that planning counts (host/forecast/cost.hpp).
#pragma once

#include <string>

namespace raywave {

/// Seconds per operation, all compute units of the device together.
struct DeviceRates {
  std::string device;  // "default" for figures that no measurement stands behind
  double ray_s = 0, shadow_ray_s = 0, node_s = 0, pair_s = 0, pixel_s = 0, butterfly_s = 0,
         level_s = 0;
};

/// Rates of PoCL on two cores of a server processor.
inline DeviceRates default_rates() {
  return {"default", 1e-9, 3.2e-9, 3e-9, 1.55e-9, 1.24e-9, 0.062e-9, 0.95e-9};
}

}  // namespace raywave
