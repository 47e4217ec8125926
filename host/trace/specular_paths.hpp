// SPDX-License-Identifier: Apache-2.0
/// Samples that the hologram sees in mirrors and through glass (kernels/samples/paths.cl).
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "cl/buffer.hpp"
#include "cl/program.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {

/// Finds the samples of some cells of the lattice, and appends them to those of SampleTable.
class SpecularPaths {
public:
  /// options           of kernels/samples/samples.cl
  /// visibility_words  of a sample (SampleTable)
  SpecularPaths(const cl::Device& device, const cl::Options& options, std::size_t visibility_words);

  /// Samples of a cell, and how many of them are hidden from some part of the window.
  ///
  /// cells  numbers of cells, and sources that SampleTable has met in each
  std::vector<glm::ivec2> find(const Plan& plan, const DeviceScene& scene,
                               const device::Lattice& lattice, std::span<const glm::ivec2> cells);

  /// Writes the samples that `find` has found behind others.
  ///
  /// first  for each cell: place of its first sample, hidden samples before it, place of its first
  ///        path
  void pack(std::span<const glm::ivec4> first, cl::Buffer<device::Sample>& samples,
            cl::Buffer<std::uint32_t>& visibility_masks, cl::Buffer<std::uint32_t>& lit,
            cl::Buffer<device::SamplePath>& paths);

private:
  cl::Device device_;
  cl::Program program_;
  cl::Kernel find_, pack_;
  std::size_t visibility_words_;
  cl::Buffer<float> fit_;
  double fit_reach_ = 0;  // that it was made for
  /// What has been found in some cells, with the same room for samples in each.
  struct Found {
    std::vector<std::size_t> numbers;  // of the cells among those of `find`
    std::vector<glm::ivec2> counts;
    std::int32_t slots = 0;
    cl::Buffer<glm::ivec2> on_cells, on_counts;
    cl::Buffer<glm::ivec4> on_first;
    cl::Buffer<device::Sample> samples;
    cl::Buffer<std::uint32_t> visibility_masks;
    cl::Buffer<device::SamplePath> paths;
  };
  void find_in(const Plan& plan, const DeviceScene& scene, const device::Lattice& lattice,
               std::span<const glm::ivec2> cells, Found& found);
  Found all_, crowded_;  // of all cells; again of those with more samples than most have
};

}  // namespace raywave
