// SPDX-License-Identifier: Apache-2.0
#include "cl/pocl.hpp"

#include <unistd.h>

#include <filesystem>
#include <sstream>

#include "host/common/environment.hpp"

namespace raywave::cl {

bool is_pocl(const DeviceInfo& device) {
  return device.platform.find("Portable Computing Language") != std::string::npos;
}

bool needs_single_items(const DeviceInfo& device) {
  return is_pocl(device) && device.driver.starts_with("6.");
}

std::string missing_tool(const DeviceInfo& device) {
  if (!is_pocl(device)) return "";
  std::istringstream path(environment_variable("PATH"));
  for (std::string folder; std::getline(path, folder, ':');)
    if (access((std::filesystem::path(folder) / "ld").c_str(), X_OK) == 0) return "";
  return "; PoCL links kernels with ld, which no folder of PATH has: add its folder (/usr/bin) to "
         "PATH, or install binutils";
}

}  // namespace raywave::cl
