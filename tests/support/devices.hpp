// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cl/fft.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"

namespace raywave::test {

/// Keep what test cases have built on them for those that follow.
inline std::vector<cl::Device>& kept_devices() {
  static auto& kept = *new std::vector<cl::Device>;  // drivers end before static objects do
  return kept;
}

/// All devices found, opened; the test fails when there is none.
inline std::vector<cl::Device> all_devices() {
  const auto infos = cl::list_devices();
  REQUIRE_FALSE(infos.empty());
  std::vector<cl::Device> opened(infos.begin(), infos.end());
  if (kept_devices().empty()) kept_devices() = opened;
  return opened;
}

/// Calls `use` with the device as one that takes packets of each width.
template <class Use>
void for_all_lanes(const cl::Device& device, Use use) {
  auto info = device.info();
  for (const int lanes : {1, 4, 8, 16}) {
    info.float_lanes = lanes;
    use(cl::Device(info));
  }
}

inline std::vector<cl::FftBackend> backends_of(const cl::Device& device) {
  std::vector<cl::FftBackend> backends;
  for (const auto backend : cl::all_backends) {
    if (cl::serves(backend, device.info())) backends.push_back(backend);
  }
  return backends;
}

}  // namespace raywave::test

/// A test case whose body runs for each device, as `device`; it fails when there is none.
#define DEVICE_TEST(...) DEVICE_TEST_NAMED(DEVICE_TEST_JOINED(on_device_, __COUNTER__), __VA_ARGS__)
#define DEVICE_TEST_JOINED(name, count) DEVICE_TEST_JOINED_TEXT(name, count)
#define DEVICE_TEST_JOINED_TEXT(name, count) name##count
#define DEVICE_TEST_NAMED(function, ...)                                                  \
  static void function(const raywave::cl::Device& device);                                \
  TEST_CASE(__VA_ARGS__) {                                                                \
    for (const auto& found_device : raywave::test::all_devices()) function(found_device); \
  }                                                                                       \
  static void function(const raywave::cl::Device& device)
