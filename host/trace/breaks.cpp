// SPDX-License-Identifier: Apache-2.0
#include "host/trace/breaks.hpp"

#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"

namespace raywave {
namespace {

constexpr std::size_t tile = 8;  // BREAK_TILE of kernels/samples/breaks.h

void make_room(const cl::Device& device, cl::Buffer<float>& buffer, std::size_t size) {
  if (buffer.size() != size) buffer = {device, size, "breaks of surfaces"};
  buffer.fill_zero();
}

}  // namespace

Breaks::Breaks(const cl::Device& device, const DeviceScene& scene)
    : cells(device, 1, "breaks of surfaces"),
      tiles(device, 1, "breaks of surfaces"),
      device_(device),
      program_(device, "kernels/samples/breaks.cl",
               {{option::alpha, scene.options.at(option::alpha)}}),
      find_faces_(program_.kernel("find_faces")),
      mark_breaks_(program_.kernel("mark_breaks")) {}

void Breaks::find(const device::Lattice& lattice, const DeviceScene& scene) {
  const float cell_m = lattice.step * (lattice.near_z - lattice.centre_z);
  known = scene.tree.has_neighbours() && cell_m > 0 &&
          lattice.bias < static_cast<float>(most_bias_of_breaks) * cell_m;
  if (!known) return;
  const auto along = [](std::int32_t n) { return (static_cast<std::size_t>(n) + tile - 1) / tile; };
  const auto tile_count = along(lattice.nx) * along(lattice.ny);
  make_room(device_, cells, tile * tile * tile_count);
  make_room(device_, tiles, tile_count);

  const auto count = scene.tree.triangles.size(), group = std::size_t{64};
  const auto triangles = static_cast<std::int32_t>(count);
  if (faces_.size() != count) faces_ = {device_, count, "faces of triangles"};
  find_faces_.run({count}, cl::Range{group}, scene.tree.arguments(), scene.materials, lattice,
                  triangles, faces_);
  mark_breaks_.run({count}, cl::Range{group}, scene.tree.arguments(), lattice, triangles,
                   scene.tree.neighbours, faces_, cells, tiles);
}

}  // namespace raywave
