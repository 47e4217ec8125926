// SPDX-License-Identifier: Apache-2.0
/// The sample table: the sources of light on the scene's surfaces (kernels/samples/samples.cl).
#pragma once

#include <algorithm>
#include <glm/vec2.hpp>
#include <vector>

#include "host/plan/plan.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {

/// The points where the rays of a lattice from the hologram's centre pierce the scene: every
/// surface along a ray, the outside of closed meshes and both sides of open ones. The set does not
/// depend on how a surface is divided into triangles.
class SampleTable {
public:
  /// keep_unseen  samples that no part of the hologram's window sees stay in the table
  SampleTable(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
              bool keep_unseen = false);

  /// Finds the samples again, for a scene with the same options.
  /// throws  InputError when there are more than 2^28 cells or samples
  void find(const Plan& plan, const DeviceScene& scene);

  device::Lattice lattice{};
  int visibility_parts;  // Plan::visibility_parts
  int count = 0;
  int hidden = 0;  // samples that some part of the window does not see
  // Nx * ny + 1: samples of cell c are [first_of_cell[c], first_of_cell[c + 1])
  cl::Buffer<std::int32_t> first_of_cell;
  // `count`, cell by cell, row by row, and room to spare; at least one element
  cl::Buffer<device::Sample> samples;
  // Visibility mask of each sample: the parts of the window that see it, visibility_words() each
  // (kernels/samples/visibility.h)
  cl::Buffer<std::uint32_t> visibility_masks;
  cl::Buffer<std::uint32_t> lit;  // lights that reach each sample, 32 to a word

  std::vector<std::int32_t> first_of_row;          // of the lattice, and the count
  std::vector<std::int64_t> first_profile_of_row;  // the same of profiles: Sample::profile

  /// Of the window's sides, whose light a near sample's profiles keep apart
  /// (kernels/samples/visibility.h).
  int plane_wave_parts() const { return std::clamp(visibility_parts, 1, 8); }
  std::size_t visibility_words() const {
    return static_cast<std::size_t>(std::max(1, visibility_parts * visibility_parts / 32));
  }

private:
  /// Samples of a band of rows with room for the same number in every cell.
  struct Band {
    cl::Buffer<glm::ivec2> counts, first;  // samples, hidden ones
    cl::Buffer<device::Sample> samples;
    cl::Buffer<std::uint32_t> visibility_masks, lit;
  };

  cl::Device device_;
  cl::Program program_;
  cl::Kernel find_samples_, pack_samples_;
  int slots_ = 4;  // samples that a cell has room for, as many as it has needed so far
  Band band_;
};

}  // namespace raywave
