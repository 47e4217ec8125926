// SPDX-License-Identifier: Apache-2.0
/// The sample table: the sources of light on the scene's surfaces (kernels/samples.cl).
#pragma once

#include "host/device_scene.hpp"
#include "host/plan.hpp"

namespace raywave {

/// Where rays of a lattice from the hologram's centre pierce the scene: every layer, outsides of closed meshes, both sides of open ones.
/// The set does not depend on how a surface is cut into triangles.
struct SampleTable {
  /// throws  InputError when there are more than 2^28 cells or samples
  SampleTable(const cl::Device& device, const Plan& plan, const DeviceScene& scene);

  device::Lattice lattice{};
  int count = 0;
  int hidden = 0;                          // samples that something may hide from a part of the hologram
  cl::Buffer<std::int32_t> first_of_cell;  // nx * ny + 1: samples of cell c are [first_of_cell[c], first_of_cell[c + 1])
  cl::Buffer<device::Sample> samples;      // cell by cell, row by row; at least one element
  cl::Buffer<std::uint32_t> lit;           // which lights fall on each sample, 32 to a word
};

}  // namespace raywave
