// SPDX-License-Identifier: Apache-2.0
#include "host/trace/interpolator.hpp"

#include <algorithm>

#include "host/trace/device_scene.hpp"

namespace raywave {
namespace {

/// A refinement of columns of which vectors of `lanes` are made together: number v is the sum over
/// j < width of column first[v] + j times coefficients, of which 2 lanes (v width + j) and on are
/// the real parts for each lane, then the imaginary ones.
struct Band {
  int width = 1;
  std::vector<std::int32_t> first;
  std::vector<float> coefficients;
};

/// count  of the columns that there are
Band band_of(const Interpolation& r, int count, int lanes) {
  const auto columns = static_cast<int>(r.first.size());
  const auto first_of = [&](int column) { return r.first[static_cast<std::size_t>(column)]; };
  Band band;
  for (int column = 0; column < columns; column += lanes)
    band.width = std::max(
        band.width, first_of(std::min(column + lanes, columns) - 1) - first_of(column) + r.taps);
  for (int column = 0; column < columns; column += lanes)
    band.first.push_back(std::min(first_of(column), count - band.width));
  const auto size = static_cast<std::size_t>(lanes);
  band.coefficients.resize(2 * size * band.first.size() * static_cast<std::size_t>(band.width));
  for (int column = 0; column < columns; ++column) {
    const int vector = column / lanes,
              from = first_of(column) - band.first[static_cast<std::size_t>(vector)];
    auto* part =
        &band.coefficients[2 * size * static_cast<std::size_t>(vector * band.width + from) +
                           static_cast<std::size_t>(column % lanes)];
    for (int tap = 0; tap < r.taps; ++tap, part += 2 * size) {
      const auto c = r.coefficients[static_cast<std::size_t>(column * r.taps + tap)];
      part[0] = c.real();
      part[size] = c.imag();
    }
  }
  return band;
}

std::size_t groups(int n, int size) { return static_cast<std::size_t>((n + size - 1) / size); }

/// Rows that a work-item makes.
int rows_together(int lanes) { return lanes == 1 ? 1 : 16; }

cl::Range group_of(int lanes) { return lanes == 1 ? cl::Range{64, 1} : cl::Range{1, 1}; }

template <typename Values, typename Buffer>
void upload(const cl::Device& device, const Values& values, Buffer& buffer) {
  if (buffer.size() != values.size()) buffer = {device, values.size(), "columns or rows of a WRP"};
  buffer.write(values);
}

}  // namespace

Interpolator::Interpolator(const cl::Device& device)
    : device_(device),
      lanes_(lanes_for(device.info())),
      program_(device, "kernels/gather/interpolate.cl",
               {{"RAYWAVE_LANES", std::to_string(lanes_)},
                {"RAYWAVE_INTERPOLATE_ROWS", std::to_string(rows_together(lanes_))}}),
      columns_(program_.kernel("interpolate_columns")),
      rows_(program_.kernel("interpolate_rows")) {}

void Interpolator::interpolate(const Plan& plan, const Wrp& wrp, const cl::ComplexBuffer& coarse,
                               int frame, cl::ComplexBuffer& fine) {
  const auto& layer = plan.layer_of(wrp);
  const auto& [columns, rows] = layer.axes;
  const auto centre_m = glm::dvec2(wrp.centre_m) - plan.tile_of(wrp).centre_m;
  if (!rows.interpolates()) {
    make_columns(plan, layer, centre_m.x, coarse, frame, fine);
    return;
  }
  if (!columns.interpolates()) {
    make_rows(plan, layer, -centre_m.y, coarse, frame, fine);
    return;
  }
  // Columns first, of fewer rows.
  if (const auto size =
          static_cast<std::size_t>(plan.tile_size.x) * static_cast<std::size_t>(rows.count);
      between_.size() < size) {
    between_ = {};
    between_ = {device_, size, "gathered rows of a WRP"};
  }
  make_columns(plan, layer, centre_m.x, coarse, frame, between_);
  make_rows(plan, layer, -centre_m.y, between_, 0, fine);
}

void Interpolator::make_columns(const Plan& plan, const DepthLayer& layer, double centre_m,
                                const cl::ComplexBuffer& coarse, int frame,
                                cl::ComplexBuffer& fine) {
  const auto size = plan.gathered_size(layer);
  const auto band = band_of(interpolation_of(plan, layer, 0, centre_m), size.x, lanes_);
  upload(device_, band.first, first_column_);
  upload(device_, band.coefficients, column_coefficients_);
  columns_.run({groups(plan.tile_size.x, lanes_), groups(size.y, rows_together(lanes_))},
               group_of(lanes_), coarse, size.x, size.y, frame, plan.tile_size.x, band.width,
               first_column_, column_coefficients_, fine);
}

void Interpolator::make_rows(const Plan& plan, const DepthLayer& layer, double centre_m,
                             const cl::ComplexBuffer& coarse, int frame, cl::ComplexBuffer& fine) {
  const auto r = interpolation_of(plan, layer, 1, centre_m);
  upload(device_, r.first, first_row_);
  upload(device_, r.coefficients, row_coefficients_);
  rows_.run({groups(plan.tile_size.x, lanes_), groups(plan.tile_size.y, rows_together(lanes_))},
            group_of(lanes_), coarse, layer.axes[1].count, frame, plan.tile_size.x,
            plan.tile_size.y, r.taps, first_row_, row_coefficients_, fine);
}

}  // namespace raywave
