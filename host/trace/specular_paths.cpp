// SPDX-License-Identifier: Apache-2.0
#include "host/trace/specular_paths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "kernels/samples/path_layout.h"

namespace raywave {
namespace {

/// Gauss-Legendre nodes: the places of most weight for a polynomial's error over the whole window.
constexpr std::array<double, PATH_NODES_ALONG> nodes{-0.861136311594053, -0.339981043584856,
                                                     0.339981043584856, 0.861136311594053};

/// Room in a cell for samples, at first. Few cells have more; these are searched again, and the
/// next frame gives all of them room.
constexpr int usual_slots = 4;

/// Exponents of x and y of the terms from one degree to another.
std::vector<glm::ivec2> terms_of(int first_degree, int last_degree) {
  std::vector<glm::ivec2> terms;
  for (int degree = first_degree; degree <= last_degree; ++degree) {
    for (int y = 0; y <= degree; ++y) terms.emplace_back(degree - y, y);
  }
  return terms;
}

double power(double x, int exponent) { return exponent <= 0 ? 1 : std::pow(x, exponent); }

using Matrix = std::vector<std::vector<double>>;  // rows

/// The matrix that solves `equations` for the unknowns in the least-squares sense: (A^T A)^-1 A^T.
/// The equations' columns must not depend on each other.
Matrix least_squares(const Matrix& equations) {
  const auto unknowns = equations[0].size(), count = equations.size();
  Matrix left(unknowns, std::vector<double>(unknowns + count));
  for (std::size_t i = 0; i < unknowns; ++i) {
    for (std::size_t j = 0; j < unknowns; ++j) {
      for (const auto& row : equations) left[i][j] += row[i] * row[j];
    }
    for (std::size_t k = 0; k < count; ++k) left[i][unknowns + k] = equations[k][i];
  }
  for (std::size_t i = 0; i < unknowns; ++i) {
    auto largest = i;
    for (auto row = i; row < unknowns; ++row) {
      if (std::abs(left[row][i]) > std::abs(left[largest][i])) largest = row;
    }
    std::swap(left[i], left[largest]);
    const double pivot = left[i][i];
    for (auto& value : left[i]) value /= pivot;
    for (std::size_t row = 0; row < unknowns; ++row) {
      const double factor = left[row][i];
      if (row == i || factor == 0) continue;
      for (std::size_t k = 0; k < left[row].size(); ++k) left[row][k] -= factor * left[i][k];
    }
  }
  for (auto& row : left)
    row.erase(row.begin(), row.begin() + static_cast<std::ptrdiff_t>(unknowns));
  return left;
}

/// The table of kernels/samples/path_layout.h.
///
/// reach  half sides of the hologram over those of the window that visibility masks divide
std::vector<float> fits(double reach) {
  std::vector<glm::dvec2> places;
  for (const double y : nodes) {
    for (const double x : nodes) places.emplace_back(reach * x, reach * y);
  }
  std::vector<float> table;
  for (int axis = 0; axis < 2; ++axis) {
    for (const auto& place : places) table.push_back(static_cast<float>(place[axis]));
  }
  const auto add = [&](const Matrix& rows) {
    for (const auto& row : rows) {
      for (const double value : row) table.push_back(static_cast<float>(value));
    }
  };

  Matrix slopes, values;
  for (int axis = 0; axis < 2; ++axis) {
    for (const auto& place : places) {
      auto& row = slopes.emplace_back();
      for (const auto& term : terms_of(2, PATH_DEGREE)) {
        auto lower = term;
        --lower[axis];
        row.push_back(term[axis] * power(place.x, lower.x) * power(place.y, lower.y));
      }
    }
  }
  for (const auto& place : places) {
    auto& row = values.emplace_back();
    for (const auto& term : terms_of(0, PATH_AMPLITUDE_DEGREE))
      row.push_back(power(place.x, term.x) * power(place.y, term.y));
  }
  add(least_squares(slopes));
  add(least_squares(values));
  return table;
}

}  // namespace

SpecularPaths::SpecularPaths(const cl::Device& device, const cl::Options& options,
                             std::size_t visibility_words)
    : device_(device),
      program_(device, "kernels/samples/paths.cl", options),
      find_(program_.kernel("find_paths")),
      pack_(program_.kernel("pack_paths")),
      visibility_words_(visibility_words) {}

std::vector<glm::ivec2> SpecularPaths::find(const Plan& plan, const DeviceScene& scene,
                                            const device::Lattice& lattice,
                                            std::span<const glm::ivec2> cells) {
  if (const double reach = 1 / std::max(1.0, plan.cone.half_width); reach != fit_reach_) {
    fit_ = {device_, std::span<const float>(fits(reach)), "fits of paths"};
    fit_reach_ = reach;
  }
  all_.slots = std::max({usual_slots, all_.slots, crowded_.slots});
  all_.numbers.resize(cells.size());
  std::iota(all_.numbers.begin(), all_.numbers.end(), std::size_t{0});
  find_in(plan, scene, lattice, cells, all_);
  auto counts = all_.counts;
  crowded_.slots = 0;
  crowded_.numbers.clear();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i].x <= all_.slots) continue;
    crowded_.slots = std::max(crowded_.slots, counts[i].x);
    crowded_.numbers.push_back(i);
    all_.counts[i] = {0, 0};
  }
  if (crowded_.numbers.empty()) return counts;
  all_.on_counts.write(all_.counts);
  find_in(plan, scene, lattice, cells, crowded_);
  for (std::size_t k = 0; k < crowded_.numbers.size(); ++k)
    counts[crowded_.numbers[k]] = crowded_.counts[k];
  return counts;
}

void SpecularPaths::find_in(const Plan& plan, const DeviceScene& scene,
                            const device::Lattice& lattice, std::span<const glm::ivec2> cells,
                            Found& found) {
  const auto count = found.numbers.size(), room = count * static_cast<std::size_t>(found.slots);
  std::vector<glm::ivec2> wanted;
  for (const auto number : found.numbers) wanted.push_back(cells[number]);
  make_room(device_, found.on_cells, count, "cells with mirrors and glass");
  make_room(device_, found.on_counts, count, "samples of each cell");
  make_room(device_, found.samples, room, "samples in mirrors and glass");
  make_room(device_, found.visibility_masks, room * visibility_words_,
            "visibility masks of samples");
  make_room(device_, found.paths, room, "paths over mirrors and through glass");
  found.on_cells.write(wanted);
  const auto number = [](double value) { return static_cast<float>(value); };
  const auto& images = plan.specular.images;
  const auto& extent = plan.extent;
  const double nearest_m = extent.near_m > 0  ? images.near_m
                           : extent.far_m < 0 ? -images.far_m
                                              : extent.closest_m;
  find_.run({count}, {1}, scene.arguments(), lattice, number(nearest_m),
            number(extent.near_m < 0 ? images.near_m : 0),
            number(extent.far_m > 0 ? images.far_m : 0), number(images.folded_m), fit_,
            found.on_cells, static_cast<std::int32_t>(count), found.slots, found.on_counts,
            found.samples, found.visibility_masks, found.paths);
  found.counts.resize(count);
  found.on_counts.read(found.counts);
}

void SpecularPaths::pack(std::span<const glm::ivec4> first, cl::Buffer<device::Sample>& samples,
                         cl::Buffer<std::uint32_t>& visibility_masks,
                         cl::Buffer<std::uint32_t>& lit, cl::Buffer<device::SamplePath>& paths) {
  for (auto* found : {&all_, &crowded_}) {
    const auto count = found->numbers.size();
    if (count == 0) continue;
    std::vector<glm::ivec4> places;
    for (const auto number : found->numbers) places.push_back(first[number]);
    make_room(device_, found->on_first, count, "samples of each cell");
    found->on_first.write(places);
    pack_.run({count}, group_of_samples(device_.info()), found->on_counts, found->on_first,
              static_cast<std::int32_t>(count), found->slots, found->samples,
              found->visibility_masks, found->paths, samples, visibility_masks, lit, paths);
  }
}

}  // namespace raywave
