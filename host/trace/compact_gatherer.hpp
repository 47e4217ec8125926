// SPDX-License-Identifier: Apache-2.0
/// Fields on the virtual planes of compact propagation, gathered from the sample table
/// (kernels/gather/compact.cl).
#pragma once

#include <tuple>
#include <vector>

#include "host/common/plane_fft.hpp"
#include "host/trace/samples.hpp"

namespace raywave {

class CompactGatherer {
public:
  /// plan    with Plan::compact
  /// frames  number gathered together, 1 to most_frames_together
  CompactGatherer(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                  const SampleTable& table, int frames);

  /// Draws the random phases of frames seed, seed + 1, ... for the current samples of the table.
  void draw_phases(std::uint32_t seed);

  /// Fills `field` (frames x Plan::gathered_pixels) with the field of the layer's samples on the
  /// virtual plane of a tile, for CompactPropagator.
  ///
  /// is_whole  rows outside the lit part are filled, too: with zeros
  /// returns   the lit part
  /// accuracy  docs/accuracy.md, "Compact propagation"
  PlanePart gather(const Wrp& wrp, cl::ComplexBuffer& field, bool is_whole = true);

  /// The pixels that the samples light, as the last `gather` found them.
  const std::vector<device::CompactFootprint>& footprints() const { return aimed_; }

private:
  /// Samples whose profiles are in memory at the same time, and the rows of bins that they light.
  struct Batch {
    int first_sample = 0, samples = 0;  // in lit_samples_
    int first_row = 0, rows = 0;        // of bins; the first may be negative, or beyond the plane
    int first_bin = 0;                  // in bins_.first
    std::size_t floats = 0;             // of its profiles
  };
  /// For every bin of every batch, the samples that light it.
  struct Bins {
    std::vector<Batch> batches;
    std::vector<std::int32_t> first, samples, is_fresh;
  };

  device::CompactPlane plane_of(const Wrp& wrp) const;
  void list_lit_samples();
  void place_profiles(glm::ivec2 size);
  PlanePart lit_part(glm::ivec2 size) const;
  void fill_bins(glm::ivec2 size, const LinePart& wanted);
  void require_few(std::int64_t entries) const;
  void make_rotors(int most_nodes);
  void make_weights(const Wrp& wrp, const device::CompactPlane& plane, int most_nodes);

  const Plan& plan_;
  const DeviceScene& scene_;
  const SampleTable& table_;
  int frames_;
  int lanes_, tile_rows_;
  cl::Program program_;
  cl::Kernel aim_, draw_phases_, profile_, gather_;
  cl::Device device_;
  std::vector<device::CompactFootprint> aimed_;  // of each sample
  std::vector<std::int32_t> lit_samples_;        // in the order of their numbers
  std::vector<std::int32_t> offset_;             // of each sample's profiles, in its batch
  Bins bins_;
  int rotors_for_ = 0, weights_for_ = 0;  // nodes, at most
  // Tile, scan lines, knots and half sides that weights_ were made for
  using WeightsKey = std::tuple<std::size_t, int, int, float, float>;
  WeightsKey weights_key_;
  cl::Buffer<device::CompactFootprint> footprints_;
  cl::Buffer<std::int32_t> lit_list_, offsets_, first_of_bin_, bin_samples_, is_fresh_;
  cl::Buffer<float> rotors_, weights_, profiles_;
  cl::Buffer<float> seen_;     // COMPACT_SEEN numbers of each sample, floats or doubles
  cl::ComplexBuffer phasors_;  // frames x samples
};

}  // namespace raywave
