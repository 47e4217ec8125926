// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/box_tree.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <numeric>
#include <utility>

namespace raywave {
namespace {

float below(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded > value ? std::nextafter(rounded, -INFINITY) : rounded;
}

float above(double value) { return -below(-value); }

class Builder {
public:
  explicit Builder(std::span<const Box> boxes) : boxes_(boxes), order_(boxes.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
  }

  /// Adds a node over order_[first, end), two boxes at least, and those below it.
  std::int32_t add(std::size_t first, std::size_t end) {
    const auto place = nodes.size();
    nodes.emplace_back();
    const auto middle = divide(first, end);
    const auto left = child(first, middle), right = child(middle, end);
    auto& node = nodes[place];  // the vector may have moved
    store(left, node.left_min, node.left_max, node.left_child, node.left_count);
    store(right, node.right_min, node.right_max, node.right_child, node.right_count);
    return static_cast<std::int32_t>(place);
  }

  std::vector<device::BvhNode> nodes;

private:
  struct Child {
    Box box;
    std::int32_t number = 0;
    bool is_leaf = false;
  };

  /// Sorts the boxes into two halves along the longest axis; returns where the second begins.
  std::size_t divide(std::size_t first, std::size_t end) {
    glm::dvec3 low(INFINITY), high(-INFINITY);
    for (auto i = first; i < end; ++i) {
      low = glm::min(low, sum(order_[i]));
      high = glm::max(high, sum(order_[i]));
    }
    const auto size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto middle = first + (end - first) / 2;
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(first), at(middle), at(end), [&](std::size_t a, std::size_t b) {
      const double x = sum(a)[axis], y = sum(b)[axis];
      return x != y ? x < y : a < b;
    });
    return middle;
  }

  Child child(std::size_t first, std::size_t end) {
    Child result{boxes_[order_[first]], 0, end - first == 1};
    for (auto i = first + 1; i < end; ++i) {
      result.box.min_m = glm::min(result.box.min_m, boxes_[order_[i]].min_m);
      result.box.max_m = glm::max(result.box.max_m, boxes_[order_[i]].max_m);
    }
    result.number = result.is_leaf ? static_cast<std::int32_t>(order_[first]) : add(first, end);
    return result;
  }

  glm::dvec3 sum(std::size_t box) const { return boxes_[box].min_m + boxes_[box].max_m; }

  static void store(const Child& child, float* min, float* max, std::int32_t& number,
                    std::int32_t& count) {
    for (int axis = 0; axis < 3; ++axis) {
      min[axis] = below(child.box.min_m[axis]);
      max[axis] = above(child.box.max_m[axis]);
    }
    number = child.number;
    count = child.is_leaf;
  }

  std::span<const Box> boxes_;
  std::vector<std::size_t> order_;
};

}  // namespace

std::vector<device::BvhNode> build_box_tree(std::span<const Box> boxes) {
  if (boxes.size() < 2) return {};
  Builder builder(boxes);
  builder.nodes.reserve(boxes.size() - 1);
  builder.add(0, boxes.size());
  return std::move(builder.nodes);
}

}  // namespace raywave
