// SPDX-License-Identifier: Apache-2.0
/// What planning needs to know of a device. Plain values, so that planning needs no OpenCL;
/// host/trace/tuning.hpp fills them in.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "host/common/fft_backend.hpp"
#include "host/plan/predict/rates.hpp"

namespace raywave {

/// Memory that there is.
struct MemoryLimits {
  static constexpr auto none = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t device_bytes = none, largest_buffer_bytes = none, host_bytes = none;
  bool device_on_host = true;  // the device's memory is the host's

  /// What one of several renderers may take that work at the same time.
  MemoryLimits for_one_of(int renderers) const {
    const auto part = [&](std::uint64_t bytes) {
      return bytes == none ? none : bytes / static_cast<std::uint64_t>(renderers);
    };
    return {part(device_bytes), largest_buffer_bytes, part(host_bytes), device_on_host};
  }
};

struct DeviceFigures {
  std::string name;  // empty: none is known
  bool has_doubles = false;
  MemoryLimits memory;  // without limits where nothing is known of it
  FftBackend fft = FftBackend::host;
  DeviceRates rates = default_rates();
};

}  // namespace raywave
