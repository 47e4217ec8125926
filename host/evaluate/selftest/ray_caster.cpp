// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/selftest/ray_caster.hpp"

#include <utility>

#include "host/geometry/kernel_options.hpp"

namespace raywave::selftest {
namespace {

std::vector<float> planes_of(std::span<const reference::Ray> rays) {
  std::vector<float> planes;
  planes.reserve(8 * rays.size());
  const auto add = [&](auto value_of) {
    for (const auto& r : rays) planes.push_back(static_cast<float>(value_of(r)));
  };
  for (int axis = 0; axis < 3; ++axis) add([=](const auto& r) { return r.origin[axis]; });
  for (int axis = 0; axis < 3; ++axis) add([=](const auto& r) { return r.direction[axis]; });
  add([](const auto& r) { return r.t_min; });
  add([](const auto& r) { return r.t_max; });
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
  const cl::Buffer<float> planes(device_, planes_of(rays), "rays"),
      t_u_v(device_, 3 * n, "t, u, v");
  const cl::Buffer<std::int32_t> triangle(device_, n, "triangle");
  program_.kernel("intersect_nearest")
      .run({(n + lanes_ - 1) / lanes_}, {8}, tree_.arguments(), planes,
           static_cast<std::int32_t>(n), triangle, t_u_v);
  const auto ids = triangle.read();
  const auto values = t_u_v.read();
  std::vector<reference::Hit> hits(n);
  for (std::size_t i = 0; i < n; ++i)
    hits[i] = {.t = values[i], .triangle = ids[i], .u = values[n + i], .v = values[2 * n + i]};
  return hits;
}

std::vector<int> RayCaster::occluded(std::span<const reference::Ray> rays) {
  const auto n = rays.size();
  const cl::Buffer<float> planes(device_, planes_of(rays), "rays");
  const cl::Buffer<std::int32_t> result(device_, n, "occluded");
  program_.kernel("intersect_any")
      .run({(n + lanes_ - 1) / lanes_}, {8}, tree_.arguments(), planes,
           static_cast<std::int32_t>(n), result);
  return result.read();
}

}  // namespace raywave::selftest
