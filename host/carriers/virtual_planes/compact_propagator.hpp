// SPDX-License-Identifier: Apache-2.0
/// Compact propagation's one transform, from a virtual plane to the tile of the hologram
/// (docs/pipeline.md).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "cl/fft.hpp"
#include "cl/program.hpp"
#include "host/common/plane_fft.hpp"
#include "host/plan/plan.hpp"
#include "host/propagate/tile_field.hpp"

namespace raywave {

class CompactPropagator {
public:
  /// plan  whose light travels by virtual planes; its tiles, pitch and wavelength are taken
  CompactPropagator(const cl::Device& device, const Plan& plan, cl::FftBackend backend);

  /// Adds the light of a virtual plane, z0_m in front of the tile, to `field` (the tile's pixels).
  /// The plane's memory is used for the transform.
  ///
  /// plane     its number in `stack`, planes of Plan::gathered_pixels
  /// lit       taken as zero elsewhere, whatever the plane holds there; FFTs on devices take all
  /// is_first  the field is written, whatever it holds
  /// accuracy  relative L2 error <= 1e-5, with the gathering, against the same computation in
  ///           double (tests/trace/compact.cpp; measured 2e-6)
  void add(cl::ComplexBuffer& stack, int plane, const PlanePart& lit, double z0_m, bool is_first,
           cl::ComplexBuffer& field);

  /// The same without the last step, for what takes it itself. Valid until the next call, or until
  /// the stack changes.
  TransformedPlane transform(cl::ComplexBuffer& stack, int plane, const PlanePart& lit,
                             double z0_m);

private:
  /// What the finishing pass multiplies with.
  void make_tables(double z0_m);

  cl::Device device_;
  glm::ivec2 size_, tile_size_;
  std::size_t row_stride_;  // of the stack's planes
  glm::dvec2 pitch_m_;
  double wavelength_m_;
  std::unique_ptr<PlaneFft> host_fft_;
  std::unique_ptr<cl::Fft> device_fft_;
  cl::ComplexBuffer plane_;  // for the latter
  std::vector<float> share_x_, share_y_;
  double z0_m_ = 0;  // of the tables
  float depth_ = 0;
  bool two_floats_ = false;
  std::array<std::optional<cl::Program>, 2> programs_;  // by two_floats_
  cl::Buffer<float> phases_x_, phases_y_, squares_x_, squares_y_, shares_x_, shares_y_;
};

}  // namespace raywave
