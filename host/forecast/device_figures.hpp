// SPDX-License-Identifier: Apache-2.0
/// What forecasts need to know of a device. Plain values, so that they need no OpenCL;
/// host/forecast/tuning.hpp fills them in.
#pragma once

#include <string>

#include "host/common/fft_backend.hpp"
#include "host/forecast/rates.hpp"
#include "host/plan/memory.hpp"

namespace raywave {

struct DeviceFigures {
  std::string name;  // empty: none is known
  bool has_doubles = false;
  MemoryLimits memory;  // without limits where nothing is known of it
  FftBackend fft = FftBackend::host;
  DeviceRates rates = default_rates();
  std::string key;  // of platform, device and driver
  bool is_processor = false;
  bool keeps_kernels = false;  // whether its driver may have kernels of earlier programs
};

}  // namespace raywave
