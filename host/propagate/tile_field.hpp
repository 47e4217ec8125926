// SPDX-License-Identifier: Apache-2.0
/// The field of a tile of the hologram, as propagation hands it on.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <tuple>

#include "cl/buffer.hpp"

namespace raywave {

/// The transform of a virtual plane, before the last step of compact propagation
/// (kernels/propagate/transformed.h). Refers to memory of CompactPropagator and of the stack of
/// planes.
struct TransformedPlane {
  const cl::ComplexBuffer& plane;
  std::int32_t row_stride, first;
  const cl::Buffer<float>&phases_x, &phases_y, &squares_x, &squares_y, &shares_x, &shares_y;
  float depth;
  float side;       // -1: samples before the hologram; 1
  bool two_floats;  // option two_floats of the kernels
  glm::ivec2 size;  // of the tile, pixels

  /// TRANSFORMED_PARAMETERS, for cl::Kernel::run.
  auto arguments() const {
    return std::tie(plane, row_stride, first, phases_x, phases_y, squares_x, squares_y, shares_x,
                    shares_y, depth, side);
  }
};

/// Either the samples of a tile, rows without gaps, or the transform that they are made of.
struct TileField {
  TileField(const cl::ComplexBuffer& of_pixels) : samples(&of_pixels) {}
  TileField(const TransformedPlane& plane) : transformed(&plane) {}

  const cl::ComplexBuffer* samples = nullptr;
  const TransformedPlane* transformed = nullptr;
};

}  // namespace raywave
