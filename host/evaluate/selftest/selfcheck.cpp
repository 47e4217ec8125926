// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/selftest/selfcheck.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <thread>
#include <utility>

#include "host/geometry/kernel_options.hpp"
#include "host/geometry/shared_types.hpp"
#include "kernels/common/shared_layout.h"

namespace raywave::selftest {
namespace {

cl::Program selfcheck(const cl::Device& device, int lanes) {
  return cl::Program(device, "kernels/instruments/selfcheck.cl",
                     {{option::lanes, std::to_string(lanes)}});
}

/// Runs `part(first, last)` over [0, count) on all host threads and returns the largest result; NaN
/// when any result is NaN.
template <class F>
double largest_of_threads(std::size_t count, F&& part) {
  const std::size_t threads = std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, 64);
  std::vector<double> found(threads);
  std::vector<std::thread> pool;
  for (std::size_t i = 0; i < threads; ++i)
    pool.emplace_back([&, i] { found[i] = part(count * i / threads, count * (i + 1) / threads); });
  for (auto& thread : pool) thread.join();
  double largest = 0;
  for (const double f : found)
    if (!(f <= largest)) largest = f;
  return largest;
}

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

double cos_sin_error(const cl::Device& device, int lanes, std::span<const float> turns) {
  std::vector<float> all(turns.begin(), turns.end());
  const auto packet = static_cast<std::size_t>(lanes), blocks = (all.size() + packet - 1) / packet;
  all.resize(blocks * packet);
  const cl::Buffer<float> in(device, all, "turns"), cosines(device, all.size(), "cosines"),
      sines(device, all.size(), "sines");
  selfcheck(device, lanes)
      .kernel("cos_sin")
      .run({blocks}, {64}, in, cosines, sines, static_cast<std::int32_t>(blocks));
  const auto c = cosines.read(), s = sines.read();
  return largest_of_threads(all.size(), [&](std::size_t first, std::size_t last) {
    double error = 0;
    for (std::size_t i = first; i < last; ++i) {
      const double radians =
          2 * std::numbers::pi * std::remainder(static_cast<double>(all[i]), 1.0);
      // !(a <= b) is true for NaN too.
      for (const double e :
           {std::abs(c[i] - std::cos(radians)), std::abs(s[i] - std::sin(radians))}) {
        if (!(e <= error)) error = e;
      }
    }
    return error;
  });
}

double cos_sin_error_everywhere(const cl::Device& device, int lanes) {
  constexpr std::uint32_t end = std::bit_cast<std::uint32_t>(0.5f) + 1, step = 1u << 23;
  std::vector<float> turns(2 * step);
  double largest = 0;
  for (std::uint32_t first = 0; first < end; first += step) {
    for (std::uint32_t i = 0; i < step; ++i) {
      turns[i] = std::bit_cast<float>(std::min(first + i, end - 1));
      turns[step + i] = -turns[i];
    }
    const double error = cos_sin_error(device, lanes, turns);
    if (!(error <= largest)) largest = error;
  }
  return largest;
}

std::vector<float> cos_sin_arguments() {
  // A uniform grid, random values of all magnitudes, and neighbours of special values
  std::vector<float> turns;
  constexpr int half = 1 << 16;
  for (int i = -half; i < half; ++i) turns.push_back(0.75f * static_cast<float>(i) / half);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> exponent(-126, 0);
  for (int i = 0; i < half; ++i)
    turns.push_back((i % 2 ? 0.5f : -0.5f) * std::exp2(exponent(random)));
  for (const float edge : {0.0f, 0.125f, 0.25f, 0.375f, 0.5f, 0.625f, 0.75f, 1e-38f, 1e-20f, 1e-8f,
                           1.0f, 1e3f, 4194303.5f}) {
    for (const float x : {edge, std::nextafter(edge, 0.0f), std::nextafter(edge, 1e9f)})
      turns.insert(turns.end(), {x, -x});
  }
  return turns;
}

std::vector<std::string> misplaced_members(const cl::Device& device) {
  using Place = std::array<std::int32_t, 3>;  // size of the struct, offset and size of the member
  std::vector<Place> expected;
  std::vector<std::string> names;
#define MEMBER(T, member)                                                     \
  expected.push_back({static_cast<std::int32_t>(sizeof(device::T)),           \
                      static_cast<std::int32_t>(offsetof(device::T, member)), \
                      static_cast<std::int32_t>(sizeof(device::T::member))}); \
  names.emplace_back(#T "." #member);
  RAYWAVE_LAYOUT(MEMBER)
#undef MEMBER
  const cl::Buffer<std::int32_t> layout(device, 3 * expected.size(), "layout");
  selfcheck(device, 1).kernel("struct_layout").run({1}, {1}, layout);
  const auto found = layout.read();
  std::vector<std::string> misplaced;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!std::equal(expected[i].begin(), expected[i].end(),
                    found.begin() + static_cast<std::ptrdiff_t>(3 * i)))
      misplaced.push_back(names[i]);
  }
  return misplaced;
}

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
