// SPDX-License-Identifier: Apache-2.0
/// Fields on planes, gathered from the sample table (kernels/gather/gather.cl).
#pragma once

#include <cstdint>

#include "cl/program.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/footprint.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/device_scene.hpp"
#include "host/trace/samples.hpp"

namespace raywave {

class Gatherer {
public:
  /// frames            number gathered together, 1 to most_frames_together: they share rays,
  ///                   visibility and shading, and differ in their phases
  /// plane_wave_spots  a sample is gathered as plane waves when the half width of its geometric
  ///                   footprint is below this many diffraction spots; 0: no sample is
  Gatherer(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
           const SampleTable& table, int frames,
           double plane_wave_spots = default_plane_wave_spots);

  /// Draws the random phases of frames seed, seed + 1, ... for the current samples of the table.
  void draw_phases(std::uint32_t seed);

  /// Fills `field` (frames x Tiling::tile_size) with the field of the layer's
  /// samples on the WRP. Every pixel of a WRP at the hologram receives every sample.
  ///
  /// accuracy  docs/accuracy.md, "Tracing and gathering"
  void gather(const Wrp& wrp, cl::ComplexBuffer& field);

private:
  std::int32_t profile_room(int pixels) const;
  device::GatherPlane plane_of(const Wrp& wrp) const;
  void add_footprints_at_hologram(device::GatherPlane& plane) const;
  void add_footprints(const Wrp& wrp, device::GatherPlane& plane) const;

  const Plan& plan_;
  const DeviceScene& scene_;
  const SampleTable& table_;
  int frames_;
  int lanes_;
  int tile_rows_, strip_tiles_;
  double plane_wave_spots_;
  cl::Program program_;
  cl::Kernel project_samples_, draw_phases_, profile_, gather_;
  cl::Device device_;
  cl::Buffer<device::ProjectedSample> projected_;
  cl::Buffer<std::int32_t> footprints_;  // pixels of each projected sample's footprint
  cl::Buffer<float> profiles_;
  cl::ComplexBuffer phasors_;  // frames x samples
};

// Fields on the WRPs by backward ray tracing on the device (kernels/gather/fan.cl).

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
