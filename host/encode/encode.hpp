// SPDX-License-Identifier: Apache-2.0
/// From a complex field to the grey levels of a phase-only SLM.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cl/program.hpp"
#include "host/plan/predict/memory.hpp"

namespace raywave {

/// Phase of each sample as an 8-bit grey level: round(phase / 2 pi * 256) mod 256 with the phase in
/// [0, 2 pi), so that level l shows the phase 2 pi l / 256. Zero samples have phase 0.
class PhaseEncoder {
public:
  explicit PhaseEncoder(const cl::Device& device);
  std::vector<std::uint8_t> operator()(const cl::ComplexBuffer& field) {
    return levels_of(field).read();
  }
  /// The grey levels on the device, valid until the next field is encoded into that buffer.
  ///
  /// buffer  0 to buffers - 1: while one is copied to the host, the next field is encoded into
  ///         another
  const cl::Buffer<std::uint8_t>& levels_of(const cl::ComplexBuffer& field, std::size_t buffer = 0);
  static constexpr std::size_t buffers = level_buffers;

private:
  cl::Device device_;
  cl::Program program_;
  std::array<cl::Buffer<std::uint8_t>, buffers> levels_;
};

}  // namespace raywave
