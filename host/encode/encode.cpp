// SPDX-License-Identifier: Apache-2.0
#include "host/encode/encode.hpp"

#include "host/geometry/kernel_options.hpp"

namespace raywave {

PhaseEncoder::PhaseEncoder(const cl::Device& device)
    : device_(device),
      program_(device, "kernels/encode/encode.cl",
               {{option::lanes, std::to_string(device.info().float_lanes)}}) {}

const cl::Buffer<std::uint8_t>& PhaseEncoder::levels_of(const cl::ComplexBuffer& field,
                                                        std::size_t buffer) {
  const std::size_t lanes = static_cast<std::size_t>(device_.info().float_lanes);
  auto& levels = levels_.at(buffer);
  if (levels.size() != field.size()) levels = {device_, field.size(), "hologram levels"};
  program_.kernel("encode").run({(field.size() + lanes - 1) / lanes}, {64}, field, levels,
                                static_cast<std::uint32_t>(field.size()));
  return levels;
}

}  // namespace raywave
