// SPDX-License-Identifier: Apache-2.0
/// Fields on the WRPs by backward ray tracing on the device (kernels/trace.cl).
#pragma once

#include <cstdint>

#include "cl/program.hpp"
#include "host/device_scene.hpp"
#include "host/mesh.hpp"
#include "host/plan.hpp"
#include "host/scene.hpp"
#include "host/shared_types.hpp"

namespace raywave {

class Tracer {
public:
  Tracer(const cl::Device& device, const Scene& scene, const Plan& plan, const DeviceScene& arrays);

  /// Fills `field` (ny x nx) with the field of one WRP.
  ///
  /// seed      of the random phases; equal for all WRPs of a frame
  /// accuracy  docs/accuracy.md, "Tracing"
  void trace(const Wrp& wrp, std::uint32_t seed, cl::ComplexBuffer& field);

private:
  cl::Device device_;
  Plan plan_;
  double sampling_pitch_m_;
  const DeviceScene& scene_;
  int lanes_;
  cl::Program program_;
  cl::Kernel trace_fan_;
};

}  // namespace raywave
