// SPDX-License-Identifier: Apache-2.0
#include "cl/pocl.hpp"

namespace raywave::cl {

bool needs_single_items(const DeviceInfo& device) {
  return device.platform.find("Portable Computing Language") != std::string::npos &&
         device.driver.starts_with("6.");
}

}  // namespace raywave::cl
