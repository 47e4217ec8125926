// SPDX-License-Identifier: Apache-2.0
/// What is propagated, and where to.
#pragma once

#include <glm/vec2.hpp>

#include "cl/fft.hpp"
#include "cl/program.hpp"
#include "host/plan/padded_plane.hpp"

namespace raywave {

struct PropagatorSpec {
  glm::ivec2 size{1, 1};  // samples of every plane in and out, x and y
  glm::dvec2 pitch_m{1, 1};
  double wavelength_m = 1;
  double padding = 2;  // 1 to 64; the padded size is the next that the FFT transforms fast
  cl::FftBackend backend = cl::FftBackend::host;
  double distance_m = 0;  // the longest that is asked for: padded_size widens planes for it
};

/// Where a plane's light is wanted: on a plane `distance_m` away along the direction of travel, its
/// centre shifted by `shift_m` (x right, y up) from the source's.
struct Target {
  glm::dvec2 shift_m{0, 0};
  double distance_m = 0;
  bool operator==(const Target&) const = default;
};

/// Launches a kernel that walks along rows: all of a row on CPUs, one packet of it per work-item
/// elsewhere.
void run_rows(const cl::Device& device, cl::Kernel kernel, int nx, int ny, const auto&... args) {
  const auto rows = static_cast<std::size_t>(ny);
  if (device.info().kind == cl::DeviceKind::cpu) return kernel.run({1, rows}, {1, 1}, args...);
  kernel.run({static_cast<std::size_t>(nx), rows}, {64, 1}, args...);
}

}  // namespace raywave
