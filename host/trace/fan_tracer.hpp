// SPDX-License-Identifier: Apache-2.0
/// Fields on the WRPs by backward ray tracing on the device (kernels/gather/fan.cl).
#pragma once

#include <cstdint>

#include "cl/program.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {

class FanTracer {
public:
  FanTracer(const cl::Device& device, const Plan& plan, const DeviceScene& arrays);

  /// Fills `field` (ny x nx) with the field of one WRP.
  ///
  /// seed      of the random phases; equal for all WRPs of a frame
  /// accuracy  docs/accuracy.md, "Tracing and gathering"
  void trace(const Wrp& wrp, std::uint32_t seed, cl::ComplexBuffer& field);

private:
  cl::Device device_;
  const Plan& plan_;
  const DeviceScene& scene_;
  int lanes_;
  cl::Program program_;
  cl::Kernel trace_fan_;
};

}  // namespace raywave
