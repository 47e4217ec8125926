// SPDX-License-Identifier: Apache-2.0
/// Fields on the virtual planes of compact propagation, gathered from the sample table
/// (kernels/gather/compact.cl, compact_gather.cl).
#pragma once

#include <optional>
#include <tuple>
#include <vector>

#include "host/carriers/virtual_planes/footprint_bins.hpp"
#include "host/trace/samples.hpp"

namespace raywave {

class CompactGatherer {
public:
  /// plan    whose light travels by virtual planes
  /// frames  number gathered together, 1 to most_frames_together
  /// bins    where the samples of each bin are listed; none: as the device asks for
  /// planes  the device that has the planes; none: that of the samples
  CompactGatherer(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                  const SampleTable& table, int frames, std::optional<Counting> bins = {},
                  std::optional<cl::Device> planes = {});

  /// Draws the random phases of frames seed, seed + 1, ... for the current samples of the table.
  void draw_phases(std::uint32_t seed);

  /// Fills `field` (frames x Plan::gathered_pixels) with the field of the layer's samples on the
  /// virtual plane of a tile, for CompactPropagator.
  ///
  /// is_whole  rows outside the lit part are filled, too: with zeros
  /// returns   the lit part
  /// accuracy  docs/accuracy.md, "Virtual planes"
  PlanePart gather(const Wrp& wrp, cl::ComplexBuffer& field, bool is_whole = true);

  /// The pixels that the samples light, as the last `gather` found them.
  std::vector<device::CompactFootprint> footprints() const;

  /// Bytes copied to the device of the planes, so far.
  std::uint64_t crossed_bytes() const { return crossed_bytes_; }

private:
  /// The first `count` elements where the planes are: `copy` on another device.
  template <class T>
  const cl::Buffer<T>& at_planes(const cl::Buffer<T>& from, std::size_t count, cl::Buffer<T>& copy);
  device::CompactPlane plane_of(const Wrp& wrp) const;
  void make_twiddles(int most_nodes);
  void make_weights(const Wrp& wrp, const device::CompactPlane& plane, int most_nodes);

  const Plan& plan_;
  const DeviceScene& scene_;
  const SampleTable& table_;
  int frames_;
  cl::Device device_, planes_device_;
  int lanes_, plane_lanes_, tile_rows_;
  cl::Program program_;
  cl::Kernel aim_, draw_phases_, profile_;
  cl::Program gather_program_;
  cl::Kernel gather_;
  FootprintBins bins_;
  int twiddles_for_ = 0, weights_for_ = 0;  // nodes, at most
  // Tile, scan lines, knots and half sides that weights_ were made for
  using WeightsKey = std::tuple<std::size_t, int, int, float, float>;
  WeightsKey weights_key_;
  cl::Buffer<device::CompactFootprint> footprints_;
  cl::Buffer<float> twiddles_, weights_, profiles_;
  cl::Buffer<float> seen_;     // COMPACT_SEEN numbers of each sample, floats or doubles
  cl::ComplexBuffer phasors_;  // frames x samples
  struct Copies {              // on the device of the planes, where it is another
    cl::Buffer<device::CompactFootprint> footprints;
    cl::Buffer<std::int32_t> offsets, first_of_bin, bin_samples, is_fresh;
    cl::Buffer<float> profiles;
    cl::ComplexBuffer phasors;
  } copies_;
  std::uint64_t crossed_bytes_ = 0;
};

}  // namespace raywave
