// SPDX-License-Identifier: Apache-2.0
/// Measures what planning and kernels want to know of a device: its rates, and the work shape in
/// which it is fastest.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cl/fft.hpp"
#include "host/trace/tuning.hpp"

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

/// The same with the samples and the gathering of a built-in scene, one frame of a ball in a wall.
/// On CPUs in processor seconds over the compute units, so that other programs count little; else
/// by the wall's clock. Kernels of each shape are compiled first.
cl::WorkShape choose_work(const cl::DeviceInfo& device, cl::FftBackend backend,
                          const std::function<void(const ShapeTrial&)>& tell);

/// Renders four frames of that scene a few times; each stage scales its default rates. Time counts
/// as above.
DeviceRates measure_rates(const cl::DeviceInfo& device, cl::FftBackend backend);

}  // namespace raywave
