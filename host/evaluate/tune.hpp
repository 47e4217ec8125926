// SPDX-License-Identifier: Apache-2.0
/// Measures a device for planning and for the kernels: its rates, and its fastest work shape.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cl/fft.hpp"
#include "host/forecast/tuning.hpp"

namespace raywave {

/// Seconds of a few runs in one work shape; none where the device refuses it.
using ShapeRuns = std::vector<double>;

/// A work shape that was tried against the best so far, each of the two `runs` in turn with the
/// other.
struct ShapeTrial {
  const char* knob = "";
  cl::WorkShape shape;
  ShapeRuns best, tried;
  std::string refused;  // by the device: why
  // Faster by more than 5 % and than the runs scatter: the upper quartile lies below the best's
  // lower one
  bool kept = false;
};

/// Halves and doubles one knob after the other, as long as it helps and the device can work so.
///
/// run     both shapes in turn, a few times; throws DeviceError when the device refuses the second
/// tell    each trial as it ends
cl::WorkShape choose_work(const cl::DeviceInfo& device,
                          const std::function<std::pair<ShapeRuns, ShapeRuns>(
                              const cl::WorkShape&, const cl::WorkShape&)>& run,
                          const std::function<void(const ShapeTrial&)>& tell);

/// Chooses the work shape by rendering one frame of a built-in scene, a ball in a wall; sampling
/// and gathering count. On CPUs, time is processor seconds divided by the compute units, so that
/// other programs count little; on other devices, wall-clock seconds. Kernels of each shape are
/// compiled first.
cl::WorkShape choose_work(const cl::DeviceInfo& device, cl::FftBackend backend,
                          const std::function<void(const ShapeTrial&)>& tell);

/// Measures the rates: renders four frames of the built-in scene a few times; the time of each
/// stage scales its default rates. Time is measured as in choose_work.
DeviceRates measure_rates(const cl::DeviceInfo& device, cl::FftBackend backend);

}  // namespace raywave
