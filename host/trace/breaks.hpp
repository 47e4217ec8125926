// SPDX-License-Identifier: Apache-2.0
/// Where surfaces end, fold or are too steep, as the hologram's centre sees them
/// (kernels/samples/breaks.h).
#pragma once

#include <cstdint>

#include "cl/program.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {

/// The breaks in the cells of a lattice, in device memory.
class Breaks {
public:
  /// For scenes with the same options as this one.
  Breaks(const cl::Device& device, const DeviceScene& scene);

  /// Finds the breaks of a scene. They stay unknown when it has too many triangles for that to pay,
  /// or is so far away that rounding is felt in a cell.
  void find(const device::Lattice& lattice, const DeviceScene& scene);

  std::int32_t known = 0;
  cl::Buffer<float> cells, tiles;

private:
  cl::Device device_;
  cl::Program program_;
  cl::Kernel find_faces_, mark_breaks_;
  cl::Buffer<std::int32_t> faces_;
};

}  // namespace raywave
