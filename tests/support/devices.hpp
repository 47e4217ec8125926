// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cl/fft.hpp"
#include "tests/support/catch.hpp"

namespace raywave::test {

/// All devices found, opened; the test fails when there is none.
inline std::vector<cl::Device> all_devices() {
  const auto infos = cl::list_devices();
  REQUIRE_FALSE(infos.empty());
  return {infos.begin(), infos.end()};
}

/// The message of the DeviceError that `action` throws.
template <class Action>
std::string device_error_of(Action action) {
  try {
    action();
  } catch (const cl::DeviceError& error) {
    return error.what();
  }
  return "no DeviceError";
}

inline std::vector<cl::FftBackend> backends_of(const cl::Device& device) {
  std::vector<cl::FftBackend> backends;
  for (const auto backend : cl::all_backends) {
    if (cl::serves(backend, device.info())) backends.push_back(backend);
  }
  return backends;
}

}  // namespace raywave::test
