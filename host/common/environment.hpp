// SPDX-License-Identifier: Apache-2.0
/// Variables of the environment.
#pragma once

#include <cstdlib>
#include <string>

namespace raywave {

/// A variable's value; empty where it is not set.
inline std::string environment_variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

}  // namespace raywave
