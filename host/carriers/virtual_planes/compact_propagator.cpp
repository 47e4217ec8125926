// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/virtual_planes/compact_propagator.hpp"

#include <cmath>

#include "host/carriers/virtual_planes/planning/planes.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/propagate/propagation.hpp"

namespace raywave {
namespace {

/// More of what sphere and parabola differ by needs two floats (docs/accuracy.md).
constexpr double float_remainder_turns = 2;

std::size_t size(int n) { return static_cast<std::size_t>(n); }

/// Pixels from the tile's origin (planning/planes.hpp); tables are read in whole packets.
constexpr int packet = 16;

template <class F>
std::vector<float> table_of(int pixels, const F& value) {
  std::vector<float> table(size(pixels + packet), 0.0f);
  for (int i = 0; i < pixels; ++i) table[size(i)] = static_cast<float>(value(i - pixels / 2));
  return table;
}

}  // namespace

CompactPropagator::CompactPropagator(const cl::Device& device, const Plan& plan,
                                     cl::FftBackend backend)
    : device_(device),
      size_(plan.virtual_planes()->size),
      tile_size_(plan.tiling.tile_size),
      row_stride_(size(plan.virtual_planes()->row_stride())),
      pitch_m_(plan.hologram.pitch_m),
      wavelength_m_(plan.hologram.wavelength_m) {
  if (backend == cl::FftBackend::host) {
    host_fft_ = std::make_unique<PlaneFft>(size(size_.x), size(size_.y), row_stride_);
  } else {
    device_fft_ =
        cl::make_fft(device, backend, {size(size_.x), size(size_.y), size(size_.x), size(size_.y)});
    plane_ = {device, area_of(size_), "virtual plane"};
  }
  const auto shares = [&](int axis) {
    const auto window = window_function(plan, axis);
    const double half = plan.tiling.tile_size[axis] / 2.0;
    return table_of(plan.tiling.tile_size[axis],
                    [&](int pixel) { return 1 / (window(pixel / half) * size_[axis]); });
  };
  share_x_ = shares(0);
  share_y_ = shares(1);
}

void CompactPropagator::make_tables(double z0_m) {
  if (z0_m == z0_m_) return;
  z0_m_ = z0_m;
  const auto square = [&](int axis) {
    return table_of(tile_size_[axis],
                    [&](int pixel) { return std::pow(pixel * pitch_m_[axis] / z0_m, 2); });
  };
  const auto phase = [&](int axis, double constant) {
    return table_of(tile_size_[axis], [&](int pixel) {
      const double turns =
          std::pow(pixel * pitch_m_[axis], 2) / (2 * z0_m * wavelength_m_) + constant;
      return turns - std::round(turns);
    });
  };
  put(device_, phases_x_, phase(0, z0_m / wavelength_m_), "phases");
  put(device_, phases_y_, phase(1, 0), "phases");
  put(device_, squares_x_, square(0), "squares");
  put(device_, squares_y_, square(1), "squares");
  put(device_, shares_x_, share_x_, "shares");
  put(device_, shares_y_, share_y_, "shares");
  const auto corner = glm::dvec2(tile_size_) / 2.0 * pitch_m_ / z0_m;
  const double bend = std::sqrt(1 + corner.x * corner.x + corner.y * corner.y) - 1,
               depth = z0_m / (2 * wavelength_m_);
  depth_ = static_cast<float>(depth);
  two_floats_ = std::abs(depth) * bend * bend > float_remainder_turns;
}

TransformedPlane CompactPropagator::transform(cl::ComplexBuffer& stack, int plane,
                                              const PlanePart& lit, double z0_m) {
  make_tables(z0_m);
  // The signs of odd samples stand the tile in the transform's middle.
  const auto first = size_ / 2 - tile_size_ / 2;
  std::size_t begin = size(plane) * row_stride_ * size(size_.y), stride = row_stride_;
  if (host_fft_) {
    stack.change_on_host(
        [&](std::span<std::complex<float>> samples) {
          host_fft_->forward(
              samples.data(), lit,
              {{size(first.x), size(tile_size_.x)}, {size(first.y), size(tile_size_.y)}});
        },
        begin, row_stride_ * size(size_.y));
  } else {
    plane_.copy_rows_from(stack, begin, size(size_.x), stride);
    device_fft_->forward(plane_);
    begin = 0;
    stride = size(size_.x);
  }
  begin += size(first.y) * stride + size(first.x);
  return {host_fft_ ? stack : plane_,
          static_cast<std::int32_t>(stride),
          static_cast<std::int32_t>(begin),
          phases_x_,
          phases_y_,
          squares_x_,
          squares_y_,
          shares_x_,
          shares_y_,
          depth_,
          z0_m < 0 ? -1.0f : 1.0f,
          two_floats_,
          tile_size_};
}

void CompactPropagator::add(cl::ComplexBuffer& stack, int plane, const PlanePart& lit, double z0_m,
                            bool is_first, cl::ComplexBuffer& field) {
  const auto transformed = transform(stack, plane, lit, z0_m);
  auto& program = programs_[two_floats_];
  if (!program)
    program.emplace(device_, "kernels/propagate/compact.cl",
                    cl::Options{{option::lanes, std::to_string(device_.info().float_lanes)},
                                {option::two_floats, two_floats_ ? "1" : "0"}});
  run_rows(device_, program->kernel("finish"), tile_size_.x, tile_size_.y, transformed.arguments(),
           tile_size_.x, tile_size_.y, static_cast<std::int32_t>(!is_first), field);
}

}  // namespace raywave
