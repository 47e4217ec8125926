// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/selftest/ray_caster.hpp"

#include <algorithm>
#include <utility>

#include "host/geometry/kernel_options.hpp"

namespace raywave::selftest {
namespace {

constexpr std::size_t canaries = 64;
constexpr std::int32_t canary = -12345;

template <class T>
cl::Buffer<T> guarded(const cl::Device& device, std::size_t size, const char* name) {
  return {device, std::vector<T>(size + canaries, T(canary)), name};
}

/// Reads the first `size` elements of the buffer.
template <class T>
std::vector<T> read(const cl::Buffer<T>& buffer, std::size_t size) {
  auto values = buffer.read();
  const auto end = values.begin() + static_cast<std::ptrdiff_t>(size);
  if (!std::all_of(end, values.end(), [](T v) { return v == T(canary); }))
    throw cl::DeviceError("intersect.cl wrote beyond its outputs, with " + std::to_string(size) +
                          " elements");
  values.resize(size);
  return values;
}

std::vector<float> planes_of(std::span<const reference::Ray> rays) {
  std::vector<float> planes;
  planes.reserve(8 * rays.size());
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& r : rays) planes.push_back(static_cast<float>(r.origin[axis]));
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& r : rays) planes.push_back(static_cast<float>(r.direction[axis]));
  for (const auto& r : rays) planes.push_back(static_cast<float>(r.t_min));
  for (const auto& r : rays) planes.push_back(static_cast<float>(r.t_max));
  return planes;
}

}  // namespace

DeviceTree upload(const cl::Device& device, const Bvh& bvh) {
  std::vector<device::Triangle> triangles;
  std::vector<float> positions;
  for (const auto& t : bvh.triangles) {
    const int first = static_cast<int>(3 * triangles.size());
    triangles.push_back({first, first + 1, first + 2, 0, 0, 0});
    for (const auto* corner : {t.a, t.b, t.c})
      positions.insert(positions.end(), corner, corner + 3);
  }
  return {{device, bvh.nodes, "nodes"},
          {device, triangles, "triangles"},
          {device, positions, "vertices"},
          {device, std::vector{instance_at_rest()}, "instances"}};
}

RayCaster::RayCaster(const cl::Device& device, int lanes, const Bvh& bvh, int depth)
    : RayCaster(device, lanes, upload(device, bvh), depth) {}

RayCaster::RayCaster(const cl::Device& device, int lanes, DeviceTree tree, int depth)
    : device_(device),
      lanes_(static_cast<std::size_t>(lanes)),
      program_(
          device, "kernels/instruments/intersect.cl",
          {{option::lanes, std::to_string(lanes)}, {option::bvh_depth, std::to_string(depth)}}),
      tree_(std::move(tree)) {}

std::vector<reference::Hit> RayCaster::nearest(std::span<const reference::Ray> rays) {
  const auto n = rays.size();
  const cl::Buffer<float> planes(device_, planes_of(rays), "rays");
  const auto triangle = guarded<std::int32_t>(device_, n, "triangle");
  const auto t_u_v = guarded<float>(device_, 3 * n, "t, u, v");
  program_.kernel("intersect_nearest")
      .run({(n + lanes_ - 1) / lanes_}, {8}, tree_.arguments(), planes,
           static_cast<std::int32_t>(n), triangle, t_u_v);
  const auto ids = read(triangle, n);
  const auto values = read(t_u_v, 3 * n);
  std::vector<reference::Hit> hits(n);
  for (std::size_t i = 0; i < n; ++i)
    hits[i] = {.t = values[i], .triangle = ids[i], .u = values[n + i], .v = values[2 * n + i]};
  return hits;
}

std::vector<int> RayCaster::occluded(std::span<const reference::Ray> rays) {
  const auto n = rays.size();
  const cl::Buffer<float> planes(device_, planes_of(rays), "rays");
  const auto result = guarded<std::int32_t>(device_, n, "occluded");
  program_.kernel("intersect_any")
      .run({(n + lanes_ - 1) / lanes_}, {8}, tree_.arguments(), planes,
           static_cast<std::int32_t>(n), result);
  return read(result, n);
}

}  // namespace raywave::selftest
