// SPDX-License-Identifier: Apache-2.0
#include "host/trace/interpolator.hpp"

#include "host/geometry/kernel_options.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {
namespace {

std::size_t groups(int n, int size) { return static_cast<std::size_t>((n + size - 1) / size); }

/// Number of rows that one work-item computes.
int rows_together(int lanes) { return lanes == 1 ? 1 : 16; }

cl::Range group_of(int lanes) { return lanes == 1 ? cl::Range{64, 1} : cl::Range{1, 1}; }

template <typename Values, typename Buffer>
void upload(const cl::Device& device, const Values& values, Buffer& buffer) {
  if (buffer.size() != values.size()) buffer = {device, values.size(), "rows of a WRP"};
  buffer.write(values);
}

}  // namespace

Interpolator::Interpolator(const cl::Device& device)
    : device_(device),
      lanes_(lanes_for(device.info())),
      program_(device, "kernels/gather/interpolate.cl",
               {{option::lanes, std::to_string(lanes_)},
                {option::interpolate_rows, std::to_string(rows_together(lanes_))}}),
      rows_(program_.kernel("interpolate_rows")) {}

void Interpolator::interpolate(const Plan& plan, const Wrp& wrp, const cl::ComplexBuffer& coarse,
                               int frame, cl::ComplexBuffer& fine) {
  const auto& layer = plan.layer_of(wrp);
  // The offset of the WRP from the tile's centre; rows are counted downwards.
  const double centre_m = plan.tile_of(wrp).centre_m.y - wrp.centre_m.y;
  const auto r = interpolation_of(plan, layer, centre_m);
  upload(device_, r.first, first_row_);
  upload(device_, r.coefficients, coefficients_);
  rows_.run({groups(plan.tile_size.x, lanes_), groups(plan.tile_size.y, rows_together(lanes_))},
            group_of(lanes_), coarse, layer.rows.count, frame, plan.tile_size.x, plan.tile_size.y,
            r.taps, first_row_, coefficients_, fine);
}

}  // namespace raywave
