// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "host/device_scene.hpp"
#include "host/fitter.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec3;

namespace {

/// A ball, the same ball turned inside out beside it, and an open sheet behind both.
Stage stage_of_three() {
  Stage stage;
  stage.add(sphere({-0.2e-3, 0, 10e-3}, 0.15e-3, 12));
  stage.add(flipped(sphere({0.2e-3, 0, 10e-3}, 0.15e-3, 12)));
  stage.add(grid(9, 7, [](double s, double t) { return dvec3(s - 0.5, t - 0.5, 10.5 + 0.2 * s * t) * 1e-3; }));
  return stage;
}

/// Turned about an axis through the middle, and moved.
World moved(World world, double degrees, dvec3 by_m) {
  const auto middle = (world.min_m + world.max_m) / 2.0;
  const glm::dmat3 turn(glm::rotate(glm::dmat4(1), glm::radians(degrees), glm::normalize(dvec3(1, 2, 0.5))));
  world.min_m = dvec3(INFINITY);
  world.max_m = dvec3(-INFINITY);
  for (auto& p : world.positions) {
    p = middle + turn * (p - middle) + by_m;
    world.min_m = glm::min(world.min_m, p);
    world.max_m = glm::max(world.max_m, p);
  }
  for (auto& n : world.normals) n = turn * dvec3(n);
  return world;
}

/// A tree on a device, read back.
struct Fitted {
  std::vector<device::BvhNode> nodes;
  std::vector<device::Triangle> triangles;
  std::vector<Corners> corners;  // theirs

  explicit Fitted(const DeviceScene& arrays)
      : nodes(arrays.tree.nodes.read()), triangles(arrays.tree.triangles.read()), corners(reference::corners_of(arrays.tree)) {}

  /// Calls f(min, max, away, first, count) for every box that is there, with the triangles below it, which lie side by side.
  void visit(const std::function<void(const float*, const float*, bool, int, int)>& f) const { visit(0, f); }

private:
  std::pair<int, int> visit(int place, const std::function<void(const float*, const float*, bool, int, int)>& f) const {
    const auto& n = nodes[static_cast<std::size_t>(place)];
    std::pair<int, int> all{INT32_MAX, 0};
    const auto look_at = [&](const float* min, const float* max, int child, int count) {
      if (min[0] > max[0]) return;
      const bool away = (child & BVH_AWAY) != 0;
      const int number = child & ~BVH_AWAY;
      const auto range = count > 0 ? std::pair(number, count) : visit(number, f);
      f(min, max, away, range.first, range.second);
      all = {std::min(all.first, range.first), all.second + range.second};
    };
    look_at(n.left_min, n.left_max, n.left_child, n.left_count);
    look_at(n.right_min, n.right_max, n.right_child, n.right_count);
    return all;
  }
};

dvec3 corner(const Corners& t, int i) {
  const float* p = i == 0 ? t.a : i == 1 ? t.b : t.c;
  return {p[0], p[1], p[2]};
}

/// Positive where a triangle of a closed mesh shows its inner side to `eye`.
double inner_side(const Fitted& tree, int triangle, dvec3 eye) {
  const auto& t = tree.corners[static_cast<std::size_t>(triangle)];
  const auto a = corner(t, 0), n = glm::cross(corner(t, 1) - a, corner(t, 2) - a);
  return tree.triangles[static_cast<std::size_t>(triangle)].side * glm::dot(glm::normalize(n), glm::normalize(a - eye));
}

}  // namespace

TEST_CASE("the triangles of a placed tree are where the world has them") {
  for (const auto& device : all_devices()) {
    const auto stage = stage_of_three();
    const auto plan = make_plan(stage.scene, stage.world);
    DeviceScene arrays(device, stage.scene, stage.world, plan);
    for (const double degrees : {0.0, 3.0, 40.0}) {
      const auto world = moved(stage.world, degrees, {0.1e-3, 0, degrees * 1e-5});
      const auto now = make_plan(stage.scene, world);
      arrays.place(stage.scene, world, now);
      const Fitted tree(arrays);
      for (std::size_t i = 0; i < tree.triangles.size(); ++i) {
        const auto& t = tree.triangles[i];
        const int vertices[] = {t.corner_a, t.corner_b, t.corner_c};
        for (int c = 0; c < 3; ++c)
          REQUIRE(corner(tree.corners[i], c) == dvec3(glm::vec3(world.positions[static_cast<std::size_t>(vertices[c])] - now.origin_m)));
      }
    }
  }
}

TEST_CASE("the boxes of a fitted tree hold what lies below them, with a margin of a few roundings") {
  for (const auto& device : all_devices()) {
    const auto stage = stage_of_three();
    DeviceScene arrays(device, stage.scene, stage.world, make_plan(stage.scene, stage.world));
    for (const double degrees : {0.0, 3.0, 40.0}) {
      const auto world = moved(stage.world, degrees, {0, 0, 1e-3});
      arrays.place(stage.scene, world, make_plan(stage.scene, world));
      const Fitted tree(arrays);
      double reach = 0;
      for (const auto& t : tree.corners) {
        for (int c = 0; c < 3; ++c) reach = std::max({reach, std::abs(corner(t, c).x), std::abs(corner(t, c).y), std::abs(corner(t, c).z)});
      }
      std::size_t seen = 0;
      tree.visit([&](const float* min, const float* max, bool, int first, int count) {
        dvec3 low(INFINITY), high(-INFINITY);
        for (int i = first; i < first + count; ++i) {
          for (int c = 0; c < 3; ++c) {
            low = glm::min(low, corner(tree.corners[static_cast<std::size_t>(i)], c));
            high = glm::max(high, corner(tree.corners[static_cast<std::size_t>(i)], c));
          }
        }
        for (int axis = 0; axis < 3; ++axis) {
          REQUIRE(min[axis] <= low[axis] - reach * 0x1p-22);
          REQUIRE(min[axis] >= low[axis] - reach * 0x1p-21);
          REQUIRE(max[axis] >= high[axis] + reach * 0x1p-22);
          REQUIRE(max[axis] <= high[axis] + reach * 0x1p-21);
        }
        ++seen;
      });
      CHECK(seen >= tree.nodes.size());
    }
  }
}

TEST_CASE("what turns away holds nothing but inner sides of closed meshes, and most of these") {
  for (const auto& device : all_devices()) {
    const auto stage = stage_of_three();
    DeviceScene arrays(device, stage.scene, stage.world, make_plan(stage.scene, stage.world));
    for (const double degrees : {0.0, 3.0, 40.0}) {
      const auto world = moved(stage.world, degrees, {});
      const auto plan = make_plan(stage.scene, world);
      arrays.place(stage.scene, world, plan);
      const Fitted tree(arrays);
      std::vector<bool> away(tree.triangles.size(), false);
      tree.visit([&](const float*, const float*, bool is_away, int first, int count) {
        for (int i = first; i < first + count; ++i) {
          if (is_away) REQUIRE(inner_side(tree, i, -plan.origin_m) > 0);
          if (is_away) away[static_cast<std::size_t>(i)] = true;
        }
      });
      double inner = 0, found = 0;
      for (std::size_t i = 0; i < away.size(); ++i) {
        inner += inner_side(tree, static_cast<int>(i), -plan.origin_m) > 0;
        found += away[i];
      }
      CHECK(found > 0.8 * inner);
      CHECK(inner > 0.3 * static_cast<double>(away.size()));
    }
  }
}

TEST_CASE("the cost of a fitted tree is the surface of its boxes over that of the whole") {
  for (const auto& device : all_devices()) {
    const auto stage = stage_of_three();
    const auto bvh = build_bvh(stage.world.positions, stage.world.triangles, {0, 0, 10e-3}, 3);
    std::vector<device::Triangle> triangles;
    std::vector<float> positions;
    for (const auto i : bvh.order) {
      const auto t = glm::ivec3(stage.world.triangles[i]);
      triangles.push_back({t.x, t.y, t.z, 0, 0});
    }
    double reach = 0;
    for (const auto& p : stage.world.positions) {
      for (int axis = 0; axis < 3; ++axis) {
        positions.push_back(static_cast<float>(p[axis] - (axis == 2 ? 10e-3 : 0)));
        reach = std::max<double>(reach, std::abs(positions.back()));
      }
    }
    DeviceTree tree;
    tree.triangles = {device, std::span<const device::Triangle>(triangles), "triangles"};
    tree.positions = {device, std::span<const float>(positions), "vertices"};
    Fitter fitter(device);
    fitter.take(bvh, tree);
    const double cost = fitter.fit(tree, reach, {0, 0, -1});
    double sum = 0;
    dvec3 low(INFINITY), high(-INFINITY);
    for (const auto& node : tree.nodes.read()) {
      for (const auto& [min, max] : {std::pair{node.left_min, node.left_max}, {node.right_min, node.right_max}}) {
        const dvec3 from(min[0], min[1], min[2]), to(max[0], max[1], max[2]), size = to - from;
        sum += size.x * size.y + size.y * size.z + size.z * size.x;
        low = glm::min(low, from);
        high = glm::max(high, to);
      }
    }
    const auto whole = high - low;
    CHECK(cost == Catch::Approx(sum / (whole.x * whole.y + whole.y * whole.z + whole.z * whole.x)).epsilon(1e-5));
  }
}

TEST_CASE("a tree of one leaf is fitted, and its missing half stays empty") {
  for (const auto& device : all_devices()) {
    Stage stage;
    stage.add(rectangle({0, 0, 10e-3}, {1e-4, 0, 0}, {0, 1e-4, 0}));
    DeviceScene arrays(device, stage.scene, stage.world, make_plan(stage.scene, stage.world));
    const Fitted tree(arrays);
    REQUIRE(tree.nodes.size() == 1);
    CHECK(tree.nodes[0].right_min[0] > tree.nodes[0].right_max[0]);
    CHECK(tree.nodes[0].left_max[0] == Catch::Approx(1e-4).epsilon(1e-4));
    CHECK(tree.nodes[0].left_count == 2);
  }
}
