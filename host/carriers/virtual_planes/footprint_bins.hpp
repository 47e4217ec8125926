// SPDX-License-Identifier: Apache-2.0
/// Lists of the samples that light each bin of a virtual plane, for kernels/gather/compact.cl.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cl/program.hpp"
#include "host/common/plane_fft.hpp"
#include "host/trace/scan.hpp"

namespace raywave {

class FootprintBins {
public:
  /// Samples whose profiles are in memory at the same time, and the rows of bins that they light.
  struct Batch {
    int first_sample = 0, samples = 0;  // in lit_samples
    int first_row = 0, rows = 0;        // of bins; the first may be negative, or beyond the plane
    int first_bin = 0;                  // in first_of_bin
    std::size_t floats = 0;             // of its profiles
    std::int64_t entries = 0;           // samples in all of its bins
    bool operator==(const Batch&) const = default;
  };

  /// scene         its name, for messages
  /// batch_floats  room for the profiles of a batch; 0: as the device asks for
  FootprintBins(const cl::Device& device, std::string scene, Counting counting,
                std::size_t batch_floats = 0);

  /// Divides the samples into batches and makes their lists.
  ///
  /// footprints  of `count` samples
  /// size        pixels of the plane
  /// is_whole    rows outside the lit part get batches without samples, which fill them with zeros
  /// throws      InputError where 32 bits do not count the lists
  void find(const cl::Buffer<device::CompactFootprint>& footprints, int count, glm::ivec2 size,
            bool is_whole);

  std::vector<Batch> batches;
  PlanePart lit;                          // that the samples light: whole rows of bins
  int longest = 0;                        // pixels along a footprint
  cl::Buffer<std::int32_t> lit_samples;   // in the order of their numbers
  cl::Buffer<std::int32_t> offsets;       // of each sample's profiles, in its batch
  cl::Buffer<std::int32_t> first_of_bin;  // in bin_samples, batch by batch
  cl::Buffer<std::int32_t> bin_samples;
  cl::Buffer<std::int32_t> is_fresh;  // rows of bins, batch by batch: nothing lit them before

private:
  void require_few(std::int64_t entries) const;
  void divide_on_host();
  bool divide_on_device(const cl::Buffer<device::CompactFootprint>& footprints, int count,
                        glm::ivec2 bins);
  void add_dark_rows(glm::ivec2 size, const LinePart& wanted);
  void list_on_host(glm::ivec2 bins);
  void list_on_device(const cl::Buffer<device::CompactFootprint>& footprints, glm::ivec2 bins);

  struct OnDevice {
    explicit OnDevice(const cl::Device& device);
    cl::Program program;
    cl::Kernel weigh, cut, place, list, sum_chunks;
    Scan<glm::ivec2> scan_weights;
    Scan<std::int32_t> scan_bins;
    cl::Buffer<glm::ivec2> weights;
    cl::Buffer<std::int32_t> found, counts;
  };

  cl::Device device_;
  std::string scene_;
  std::size_t batch_floats_;
  std::optional<OnDevice> on_device_;
  int left_ = 0, right_ = 0;  // pixels across the lit part
  // On the host
  std::vector<device::CompactFootprint> footprints_;
  std::vector<std::int32_t> lit_, offset_;
};

}  // namespace raywave
