// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "host/geometry/ray_tree.hpp"
#include "tests/support/catch.hpp"

namespace raywave {
namespace {

TEST_CASE("a tree over boxes holds each once, within the boxes above it, and is balanced") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1, 1), size(0, 0.3);
  for (const std::size_t count : {2, 3, 7, 64, 65, 1000}) {
    std::vector<Box> boxes;
    for (std::size_t i = 0; i < count; ++i) {
      // Some share one place: no split divides them
      const glm::dvec3 at =
          i % 5 == 0 ? glm::dvec3(0.1) : glm::dvec3(place(random), place(random), place(random));
      boxes.push_back({at, at + glm::dvec3(size(random), size(random), 0)});
    }
    const auto nodes = build_box_tree(boxes);
    REQUIRE(nodes.size() == count - 1);
    std::vector<int> seen(count, 0);
    int deepest = 0;
    using Sides = std::pair<glm::dvec3, glm::dvec3>;
    const std::function<void(std::int32_t, int, Sides)> visit = [&](std::int32_t number, int depth,
                                                                    Sides within) {
      deepest = std::max(deepest, depth);
      const auto& node = nodes.at(static_cast<std::size_t>(number));
      const auto look = [&](const float* min, const float* max, std::int32_t child,
                            std::int32_t is_leaf) {
        for (int axis = 0; axis < 3; ++axis) {
          REQUIRE(min[axis] >= within.first[axis]);
          REQUIRE(max[axis] <= within.second[axis]);
        }
        const Sides box{{min[0], min[1], min[2]}, {max[0], max[1], max[2]}};
        if (!is_leaf) return visit(child, depth + 1, box);
        const auto i = static_cast<std::size_t>(child);
        ++seen.at(i);
        for (int axis = 0; axis < 3; ++axis) {
          REQUIRE(min[axis] <= boxes[i].min_m[axis]);
          REQUIRE(max[axis] >= boxes[i].max_m[axis]);
        }
      };
      look(node.left_min, node.left_max, node.left_child, node.left_count);
      look(node.right_min, node.right_max, node.right_child, node.right_count);
    };
    visit(0, 1, {glm::dvec3(-INFINITY), glm::dvec3(INFINITY)});
    CHECK(std::all_of(seen.begin(), seen.end(), [](int times) { return times == 1; }));
    CHECK(deepest <= std::ceil(std::log2(static_cast<double>(count))));
  }
  CHECK(build_box_tree({}).empty());
  CHECK(build_box_tree(std::vector<Box>(1)).empty());
}

}  // namespace
}  // namespace raywave
