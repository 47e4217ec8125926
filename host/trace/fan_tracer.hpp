// SPDX-License-Identifier: Apache-2.0
/// Fields on the WRPs by backward ray tracing on the device (kernels/gather/fan.cl).
#pragma once

#include <cstdint>

#include "cl/program.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/samples.hpp"

namespace raywave {

/// The light source that a ray's hit represents (kernels/gather/fan.cl, RAYWAVE_SOURCE).
enum class HitSource { hit = 0, surface = 1, bounced = 2 };

class FanTracer {
public:
  /// table  the surface samples, needed by HitSource::surface; outlives the tracer like `plan` and
  ///        `arrays`
  FanTracer(const cl::Device& device, const Plan& plan, const DeviceScene& arrays, HitSource source,
            const SampleTable* table = nullptr);

  /// Fills `field` (ny x nx) with the field of one WRP; HitSource::bounced adds to it.
  ///
  /// seed      of the random phases; equal for all WRPs of a frame
  /// accuracy  docs/accuracy.md, "Tracing and gathering"
  void trace(const Wrp& wrp, std::uint32_t seed, cl::ComplexBuffer& field);

private:
  cl::Device device_;
  const Plan& plan_;
  const DeviceScene& scene_;
  const SampleTable* table_;
  int lanes_;
  cl::Program program_;
  cl::Kernel trace_fan_;
  cl::Buffer<device::Sample> no_samples_;  // kernel arguments when there is no table
  cl::Buffer<std::int32_t> no_cells_;
};

}  // namespace raywave
