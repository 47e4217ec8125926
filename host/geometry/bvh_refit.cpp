// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "host/geometry/bvh.hpp"

namespace raywave {
namespace {

struct Bounds {
  float min[3] = {INFINITY, INFINITY, INFINITY}, max[3] = {-INFINITY, -INFINITY, -INFINITY};

  void add(const float* low, const float* high) {
    for (int i = 0; i < 3; ++i) {
      min[i] = std::min(min[i], low[i]);
      max[i] = std::max(max[i], high[i]);
    }
  }
  double half_surface() const {
    if (min[0] > max[0]) return 0;
    const double x = double{max[0]} - min[0], y = double{max[1]} - min[1],
                 z = double{max[2]} - min[2];
    return x * y + y * z + z * x;
  }
};

Bounds bounds_of(const float* low, const float* high) {
  Bounds bounds;
  bounds.add(low, high);
  return bounds;
}

}  // namespace

void refit_bvh(Bvh& bvh, std::span<const glm::dvec3> positions_m,
               std::span<const glm::uvec3> triangles, glm::dvec3 origin_m) {
  double reach_m = 0;
  for (const auto& t : triangles) {
    for (int i = 0; i < 3; ++i) {
      const auto p = positions_m[t[i]] - origin_m;
      reach_m = std::max({reach_m, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    }
  }
  const double margin_m = box_margin_m(reach_m);
  std::vector<Bounds> boxes(bvh.triangles.size());
  for (std::size_t place = 0; place < bvh.order.size(); ++place) {
    const auto& t = triangles[bvh.order[place]];
    auto& corners = bvh.triangles[place];
    auto& box = boxes[place];
    const glm::dvec3 p[] = {positions_m[t.x] - origin_m, positions_m[t.y] - origin_m,
                            positions_m[t.z] - origin_m};
    for (int axis = 0; axis < 3; ++axis) {
      corners.a[axis] = static_cast<float>(p[0][axis]);
      corners.b[axis] = static_cast<float>(p[1][axis]);
      corners.c[axis] = static_cast<float>(p[2][axis]);
      box.min[axis] = rounded_down(std::min({p[0][axis], p[1][axis], p[2][axis]}) - margin_m);
      box.max[axis] = rounded_up(std::max({p[0][axis], p[1][axis], p[2][axis]}) + margin_m);
    }
  }
  for (auto i = bvh.nodes.size(); i-- > 0;) {  // children come behind their parents
    auto& node = bvh.nodes[i];
    const auto fit = [&](std::int32_t child, std::int32_t& count, float* low, float* high) {
      if (low[0] > high[0]) return;  // a root with one child
      count = BVH_COUNT(count);
      Bounds whole;
      const auto first = static_cast<std::size_t>(child);
      if (count > 0) {
        for (auto k = first; k < first + static_cast<std::size_t>(count); ++k)
          whole.add(boxes[k].min, boxes[k].max);
      } else {
        const auto& below = bvh.nodes[first];
        whole.add(below.left_min, below.left_max);
        whole.add(below.right_min, below.right_max);
      }
      std::copy_n(whole.min, 3, low);
      std::copy_n(whole.max, 3, high);
    };
    fit(node.left_child, node.left_count, node.left_min, node.left_max);
    fit(node.right_child, node.right_count, node.right_min, node.right_max);
  }
}

double surface_cost(const Bvh& bvh) {
  if (bvh.nodes.empty()) return 0;
  double sum = 0;
  for (const auto& node : bvh.nodes) {
    const auto left = bounds_of(node.left_min, node.left_max),
               right = bounds_of(node.right_min, node.right_max);
    auto whole = left;
    whole.add(right.min, right.max);
    sum += whole.half_surface() +
           double{triangle_cost} * (BVH_COUNT(node.left_count) * left.half_surface() +
                                    BVH_COUNT(node.right_count) * right.half_surface());
  }
  auto root = bounds_of(bvh.nodes[0].left_min, bvh.nodes[0].left_max);
  root.add(bvh.nodes[0].right_min, bvh.nodes[0].right_max);
  return root.half_surface() > 0 ? sum / root.half_surface() : 0;
}

}  // namespace raywave
