// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/virtual_planes/compact_gatherer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/carriers/virtual_planes/planning/planes.hpp"
#include "host/trace/gather_options.hpp"
#include "host/trace/work_shape.hpp"
#include "kernels/gather/compact_layout.h"

namespace raywave {
namespace {

double cubic_spline(double x) {
  x = std::abs(x);
  return x < 1 ? 2.0 / 3 - x * x + x * x * x / 2 : std::pow(std::max(2 - x, 0.0), 3) / 6;
}

/// Error, in turns, of polynomials between the knots.
constexpr double knots_error_turns = 1e-6;

/// Knots along a line of the tile, as few as the phases allow. Paths as functions of the place on
/// the line are analytic up to a depth off it, in units of what the knots cover: Chebyshev
/// interpolation gains a factor of rho with each knot (Trefethen, Approximation Theory and
/// Approximation Practice, theorem 8.2).
int knots_for(const Plan& plan, const DepthLayer& layer) {
  double reach_m = 0;
  for (int axis = 0; axis < 2; ++axis)
    reach_m = std::max(reach_m, window_function(plan, axis).reach * plan.tile_window_m()[axis] / 2);
  const double near_m = std::min(layer.closest_m(), std::abs(layer.distance_m)),
               depth = near_m / reach_m, rho = depth + std::sqrt(depth * depth + 1);
  int knots = 8;
  while (knots < COMPACT_MOST_KNOTS &&
         near_m / plan.hologram.wavelength_m * std::pow(rho, -knots) > knots_error_turns)
    knots *= 2;
  return knots;
}

}  // namespace

CompactGatherer::CompactGatherer(const cl::Device& device, const Plan& plan,
                                 const DeviceScene& scene, const SampleTable& table, int frames,
                                 std::optional<Counting> bins, std::optional<cl::Device> planes)
    : plan_(plan),
      scene_(scene),
      table_(table),
      frames_(frames),
      device_(device),
      planes_device_(planes.value_or(device)),
      lanes_(lanes_for(device.info())),
      plane_lanes_(lanes_for(planes_device_.info())),
      tile_rows_(plane_lanes_ == 1 ? 1
                 : frames > 4      ? 4
                                   : COMPACT_BIN),
      program_(device, "kernels/gather/compact.cl",
               gather_options(device, plan, scene, table, frames, tile_rows_)),
      aim_(program_.kernel("aim")),
      draw_phases_(program_.kernel("draw_phases")),
      profile_(program_.kernel("profile")),
      gather_program_(planes_device_, "kernels/gather/compact_gather.cl",
                      {{option::lanes, std::to_string(plane_lanes_)},
                       {option::frames, std::to_string(frames)},
                       {option::tile_rows, std::to_string(tile_rows_)}}),
      gather_(gather_program_.kernel("gather_compact")),
      bins_(device, plan.scene_name, bins.value_or(counting_of(device.info()))) {}

std::vector<device::CompactFootprint> CompactGatherer::footprints() const {
  std::vector<device::CompactFootprint> footprints(static_cast<std::size_t>(table_.count));
  footprints_.read(footprints);
  return footprints;
}

void CompactGatherer::draw_phases(std::uint32_t seed) {
  const auto room = table_.samples.size();
  if (footprints_.size() < room) {
    footprints_ = {device_, room, "footprints of samples"};
    phasors_ = {device_, room * static_cast<std::size_t>(frames_), "phases"};
    const std::size_t floats = plan_.precision == Precision::doubles ? 2 : 1;
    seen_ = {device_, COMPACT_SEEN * room * floats, "samples as a tile sees them"};
  }
  if (table_.count > 0)
    draw_phases_.run({static_cast<std::size_t>(table_.count)},
                     {lanes_ == 1 ? std::size_t{64} : std::size_t{1}}, table_.samples, table_.count,
                     frames_, seed, -std::numeric_limits<float>::infinity(), phasors_);
}

device::CompactPlane CompactGatherer::plane_of(const Wrp& wrp) const {
  const auto& compact = *plan_.virtual_planes();
  const auto& layer = plan_.layer_of(wrp);
  const auto half = plan_.tile_window_m() / 2.0,
             period = glm::dvec2(compact.size) * plan_.hologram.pitch_m;
  const auto origin = origin_of_tile(plan_, plan_.tile_of(wrp)) - glm::dvec2(plan_.extent.origin_m);
  device::CompactPlane plane{};
  plane.nx = compact.size.x;
  plane.ny = compact.size.y;
  plane.row_stride = compact.row_stride();
  plane.tile_nx = plan_.tiling.tile_size.x;
  plane.tile_ny = plan_.tiling.tile_size.y;
  std::tie(plane.origin_x, plane.origin_x_low) = split(origin.x);
  std::tie(plane.origin_y, plane.origin_y_low) = split(origin.y);
  std::tie(plane.hologram_z, plane.hologram_z_low) = split(-plan_.extent.origin_m.z);
  std::tie(plane.z0, plane.z0_low) = split(std::abs(wrp.centre_m.z));
  plane.side = wrp.centre_m.z < 0 ? -1.0f : 1.0f;
  std::tie(plane.begin_z, plane.end_z) = layer_bounds(plan_, layer);
  std::tie(plane.turns_hi, plane.turns_lo) = split(1 / plan_.hologram.wavelength_m);
  std::tie(plane.frequency_x, plane.frequency_x_low) = split(1 / period.x);
  std::tie(plane.frequency_y, plane.frequency_y_low) = split(1 / period.y);
  put(plan_.hologram.pitch_m, plane.pitch_x, plane.pitch_y);
  put(half, plane.half_x, plane.half_y);
  put(period, plane.period_x, plane.period_y);
  put(period / plan_.hologram.wavelength_m, plane.pixels_per_sine_x, plane.pixels_per_sine_y);
  plane.margin = static_cast<float>(compact.margin_px);
  plane.rough_margin = static_cast<float>(compact.rough_margin_px);
  plane.highlight_margin = static_cast<float>(compact.highlight_margin_px);
  plane.lines = compact.most_lines();
  plane.highlight_lines = compact.highlight_lines;
  plane.lines_tolerance = static_cast<float>(compact.lines_tolerance);
  put(plan_.hologram.largest_sine, plane.sine_limit_x, plane.sine_limit_y);
  const auto& light = plan_.slm.illumination;
  const double side = plane.side;
  put(light.sine_at(origin_of_tile(plan_, plan_.tile_of(wrp))) * glm::dvec2(side, -side),
      plane.reference_x, plane.reference_y);
  put(light.curvature_per_m() * side, plane.reference_fall_x, plane.reference_fall_y);
  put(1.0 / (COMPACT_EDGE * half), plane.per_cut_x, plane.per_cut_y);
  plane.knots = knots_for(plan_, layer);
  const auto& lattice = table_.lattice;
  plane.window_scale_x = 1 / lattice.half_width;
  plane.window_scale_y = 1 / lattice.half_height;
  plane.window_shift_x = (static_cast<float>(origin.x) - lattice.centre_x) / lattice.half_width;
  plane.window_shift_y = (static_cast<float>(origin.y) - lattice.centre_y) / lattice.half_height;
  return plane;
}

/// Twiddle factors exp(2 pi i (pixel + 1/2) node / n), with the sign of odd pixels changed, of all
/// sizes n that footprints need. Odd pixels' signs bring the tile into the middle of the transform.
void CompactGatherer::make_twiddles(int most_nodes) {
  if (most_nodes <= twiddles_for_) return;
  twiddles_for_ = most_nodes;
  std::vector<float> table;
  for (int n = COMPACT_STEP; n <= most_nodes; n += COMPACT_STEP) {
    for (int node = 1; node <= n; ++node) {
      for (const bool is_sine : {false, true}) {
        for (int pixel = 0; pixel < n / 2; ++pixel) {
          const double turns =
              static_cast<double>((2 * pixel + 1) * node % (2 * n)) / (2 * n) + 0.5 * (pixel % 2);
          table.push_back(static_cast<float>(is_sine ? std::sin(2 * std::numbers::pi * turns)
                                                     : std::cos(2 * std::numbers::pi * turns)));
        }
      }
    }
  }
  table.resize(table.size() + 2 * COMPACT_PACKET, 0.0f);
  twiddles_ = {device_, std::span<const float>(table), "twiddles of footprints"};
}

/// The places on the tile, and the weights of nodes (kernels/gather/compact_layout.h), of all sizes
/// that footprints need.
void CompactGatherer::make_weights(const Wrp& wrp, const device::CompactPlane& plane,
                                   int most_nodes) {
  if (const WeightsKey key{wrp.tile, plane.lines, plane.knots, plane.half_x, plane.half_y};
      key == weights_key_ && most_nodes <= weights_for_)
    return;
  else
    weights_key_ = key;
  weights_for_ = most_nodes;
  const int parts = table_.visibility_parts, splines = parts > 0 ? parts + 4 : 0;
  const auto half_m = plan_.tile_window_m() / 2.0, window_m = plan_.window_m() / 2.0;
  const auto origin_m = origin_of_tile(plan_, plan_.tile_of(wrp)) * glm::dvec2(1, -1);
  const auto middle_of = [&](int part) { return (part - 1.5) * 2 / parts - 1; };

  // In half tiles from the origin, downwards, as in the kernel
  const int pairs = plane.knots / 2;
  const auto knot_at = [&](int axis, int knot) {
    const double at = window_function(plan_, axis).reach *
                      std::cos(std::numbers::pi * (knot % pairs + 0.5) / plane.knots);
    return knot < pairs ? at : -at;
  };
  const auto row_of = [](int line, int lines) {
    return std::cos(std::numbers::pi * (line + 0.5) / lines);
  };
  std::vector<double> rows;
  for (int lines = 1; lines <= plane.lines; ++lines) {
    for (int line = 0; line < lines; ++line) rows.push_back(row_of(line, lines));
  }
  for (int part = 0; part < splines; ++part)
    rows.push_back((middle_of(part) * window_m.y - origin_m.y) / half_m.y);
  std::vector<float> table;
  for (int axis = 0; axis < 2; ++axis) {
    for (int i = 0; i < COMPACT_KNOT_ROOM; ++i)
      table.push_back(static_cast<float>(knot_at(axis, i % plane.knots)));
  }
  for (const double row : rows)
    table.insert(table.end(), static_cast<std::size_t>(plane.knots), static_cast<float>(row));
  table.resize(COMPACT_PLACES, 0.0f);

  for (int n = COMPACT_STEP; n <= most_nodes; n += COMPACT_STEP) {
    const glm::ivec2 half_nodes{COMPACT_HALF_NODES(n, plane.nx, plane.tile_nx),
                                COMPACT_HALF_NODES(n, plane.ny, plane.tile_ny)};
    // A row: nodes on the right, on the left, and the middle one
    const auto add_row = [&](int axis, const auto& right, const auto& left) {
      const auto begin = table.size();
      table.resize(begin + COMPACT_NODE_ROOM(n), 0.0f);
      const double step =
          plan_.virtual_planes()->size[axis] * plan_.hologram.pitch_m[axis] / half_m[axis] / n;
      for (int node = 1; node <= half_nodes[axis]; ++node) {
        const auto at = begin + static_cast<std::size_t>(node - 1);
        table[at] = static_cast<float>(right(node * step));
        table[at + static_cast<std::size_t>(n)] = static_cast<float>(left(node * step));
      }
      table[begin + static_cast<std::size_t>(2 * n)] = static_cast<float>(right(0.0));
    };
    const auto add_weights = [&](int axis, const auto& weight) {
      add_row(axis, weight, [&](double at) { return weight(-at); });
    };
    const auto window = [&](int axis, double at) {
      return window_function(plan_, axis)(at) * plan_.virtual_planes()->size[axis] / n;
    };
    const auto spline = [&](int axis, int part, double at) {
      return cubic_spline(
          ((origin_m[axis] + at * half_m[axis]) / window_m[axis] - middle_of(part)) * parts / 2);
    };
    add_weights(0, [&](double at) { return window(0, at); });
    for (int part = 0; part < splines; ++part)
      add_weights(0, [&](double at) { return spline(0, part, at); });
    for (int lines = 1; lines <= plane.lines; ++lines) {
      for (int line = 0; line < lines; ++line) {
        add_weights(1, [&](double at) {
          double product = window(1, at);
          for (int other = 0; other < lines; ++other) {
            const double there = row_of(other, lines);
            if (other != line) product *= (at - there) / (row_of(line, lines) - there);
          }
          return product;
        });
      }
    }
    for (int part = 0; part < splines; ++part)
      add_weights(1, [&](double at) { return window(1, at) * spline(1, part, at); });
    for (int axis = 0; axis < 2; ++axis) {
      for (int knot = 0; knot < pairs; ++knot) {
        const auto polynomial = [&](double at) {
          double product = 1;
          for (int other = 0; other < plane.knots; ++other) {
            if (other != knot)
              product *= (at - knot_at(axis, other)) / (knot_at(axis, knot) - knot_at(axis, other));
          }
          return product;
        };
        add_row(
            axis, [&](double at) { return (polynomial(at) + polynomial(-at)) / 2; },
            [&](double at) { return (polynomial(at) - polynomial(-at)) / 2; });
      }
    }
  }
  upload(device_, table, weights_, "weights of nodes");
}

template <class T>
const cl::Buffer<T>& CompactGatherer::at_planes(const cl::Buffer<T>& from, std::size_t count,
                                                cl::Buffer<T>& copy) {
  if (planes_device_.queue()() == device_.queue()()) return from;
  make_room(planes_device_, copy, count, "samples beside their device");
  from.on_host([&](std::span<const T> data) { copy.write(data); }, 0, count);
  crossed_bytes_ += count * sizeof(T);
  return copy;
}

PlanePart CompactGatherer::gather(const Wrp& wrp, cl::ComplexBuffer& field, bool is_whole) {
  const auto plane = plane_of(wrp);
  const glm::ivec2 size{plane.nx, plane.ny};
  const auto lanes = static_cast<std::size_t>(lanes_);
  const cl::Range group{lanes_ == 1 ? std::size_t{64} : std::size_t{1}},
      local = plane_lanes_ == 1 ? cl::Range{COMPACT_BIN, 4} : cl::Range{1, 1};
  if (table_.count > 0)
    aim_.run({(static_cast<std::size_t>(table_.count) + lanes - 1) / lanes}, group, scene_.lights,
             table_.samples, table_.lit, table_.paths, table_.count, plane, footprints_, seen_);
  bins_.find(footprints_, table_.count, size, is_whole);
  std::size_t floats = 1;
  for (const auto& batch : bins_.batches) floats = std::max(floats, batch.floats + COMPACT_PACKET);
  const int most_nodes = COMPACT_NODES_FOR(bins_.longest);
  make_twiddles(most_nodes);
  make_weights(wrp, plane, most_nodes);
  make_room(device_, profiles_, floats, "profiles of samples");

  const auto& footprints = at_planes(footprints_, footprints_.size(), copies_.footprints);
  const auto& offsets = at_planes(bins_.offsets, bins_.offsets.size(), copies_.offsets);
  const auto& phasors = at_planes(phasors_, phasors_.size(), copies_.phasors);
  const auto& first_of_bin =
      at_planes(bins_.first_of_bin, bins_.first_of_bin.size(), copies_.first_of_bin);
  const auto& bin_samples =
      at_planes(bins_.bin_samples, bins_.bin_samples.size(), copies_.bin_samples);
  const auto& is_fresh = at_planes(bins_.is_fresh, bins_.is_fresh.size(), copies_.is_fresh);
  const int down = size.y / COMPACT_BIN;
  std::size_t fresh = 0;
  for (const auto& batch : bins_.batches) {
    if (batch.rows == 0) continue;
    if (batch.samples > 0)
      profile_.run({static_cast<std::size_t>(batch.samples)}, group, scene_.lights, table_.samples,
                   table_.lit, table_.visibility_masks, table_.paths, footprints_, seen_,
                   bins_.lit_samples, bins_.offsets, twiddles_, weights_, batch.first_sample,
                   batch.samples, plane, profiles_);
    const std::int32_t strips = batch.rows * COMPACT_BIN / tile_rows_;
    const auto& profiles = at_planes(profiles_, batch.floats + COMPACT_PACKET, copies_.profiles);
    gather_.run({static_cast<std::size_t>(size.x / plane_lanes_), static_cast<std::size_t>(strips)},
                local, footprints, offsets, profiles, phasors, table_.count, first_of_bin,
                bin_samples, is_fresh, static_cast<std::int32_t>(fresh), batch.first_bin,
                (batch.first_row % down + down) % down, strips, plane, field);
    fresh += static_cast<std::size_t>(batch.rows);
  }
  return bins_.lit;
}

}  // namespace raywave
