// SPDX-License-Identifier: Apache-2.0
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>

#include "host/bvh.hpp"
#include "host/error.hpp"

namespace raywave {
namespace {

using Cartesian = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Cartesian::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Cartesian, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Cartesian, Primitive>>;
using TreeNode = std::remove_cvref_t<decltype(*std::declval<Tree>().root_node())>;

/// A part of CGAL's tree: a node, or the one triangle that stands in place of a node. CGAL keeps no counts: half of a node's triangles,
/// rounded down, lie to its left.
struct Part {
  const TreeNode* node = nullptr;
  const Primitive* triangle = nullptr;
  std::size_t count = 1;

  CGAL::Bbox_3 box() const { return node ? node->bbox() : triangle->datum().bbox(); }
  Part left() const {
    const auto half = count / 2;
    return half == 1 ? Part{nullptr, &node->left_data(), 1} : Part{&node->left_child(), nullptr, half};
  }
  Part right() const {
    const auto rest = count - count / 2;
    return rest == 1 ? Part{nullptr, &node->right_data(), 1} : Part{&node->right_child(), nullptr, rest};
  }
};

/// What a node of the flat tree says of one child. As it stands: an empty box that no ray meets; its leaf is never opened.
struct Child {
  std::array<float, 3> min = filled(std::numeric_limits<float>::infinity());
  std::array<float, 3> max = filled(-std::numeric_limits<float>::infinity());
  int child = 0;
  int count = 1;

  static std::array<float, 3> filled(float x) { return {x, x, x}; }
};

float rounded_down(double x) {
  const auto f = static_cast<float>(x);
  return f <= x ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
}
float rounded_up(double x) { return -rounded_down(-x); }

device::BvhNode node_of(const Child& left, const Child& right) {
  device::BvhNode node;
  std::copy_n(left.min.begin(), 3, node.left_min);
  std::copy_n(left.max.begin(), 3, node.left_max);
  std::copy_n(right.min.begin(), 3, node.right_min);
  std::copy_n(right.max.begin(), 3, node.right_max);
  node.left_child = left.child;
  node.left_count = left.count;
  node.right_child = right.child;
  node.right_count = right.count;
  return node;
}

/// Copies CGAL's tree, depth first. Recursion goes as deep as the tree, log2 of the number of triangles: CGAL halves at the median.
class Flattener {
public:
  Flattener(const Triangles& triangles, double margin_m, int leaf_size)
      : triangles_(triangles), margin_m_(margin_m), leaf_size_(static_cast<std::size_t>(std::max(leaf_size, 1))) {}

  Bvh flatten(const Part& whole) {
    const auto root = flatten(whole, 1);
    if (root.count > 0) {
      bvh_.nodes.push_back(node_of(root, Child{}));
      bvh_.depth = 1;
    }
    return std::move(bvh_);
  }

private:
  Child flatten(const Part& part, int depth) {
    Child result;
    const auto box = part.box();
    for (int axis = 0; axis < 3; ++axis) {
      result.min[axis] = rounded_down(box.min(axis) - margin_m_);
      result.max[axis] = rounded_up(box.max(axis) + margin_m_);
    }
    if (part.count <= leaf_size_) {
      result.child = static_cast<int>(bvh_.triangles.size());
      result.count = static_cast<int>(part.count);
      collect(part);
    } else {
      const auto place = bvh_.nodes.size();
      result.child = static_cast<int>(place);
      result.count = 0;
      bvh_.depth = std::max(bvh_.depth, depth);
      bvh_.nodes.emplace_back();
      const auto left = flatten(part.left(), depth + 1);
      const auto right = flatten(part.right(), depth + 1);
      bvh_.nodes[place] = node_of(left, right);
    }
    return result;
  }

  void collect(const Part& part) {
    if (part.node) {
      collect(part.left());
      collect(part.right());
      return;
    }
    const auto& triangle = part.triangle->datum();
    device::Triangle rounded;
    for (int axis = 0; axis < 3; ++axis) {
      rounded.a[axis] = static_cast<float>(triangle[0][axis]);
      rounded.b[axis] = static_cast<float>(triangle[1][axis]);
      rounded.c[axis] = static_cast<float>(triangle[2][axis]);
    }
    bvh_.triangles.push_back(rounded);
    bvh_.order.push_back(static_cast<std::uint32_t>(part.triangle->id() - triangles_.begin()));
  }

  const Triangles& triangles_;
  double margin_m_;
  std::size_t leaf_size_;
  Bvh bvh_;
};

}  // namespace

double box_margin_m(double reach_m) { return reach_m * 0x1.4p-22; }

Bvh build_bvh(const std::vector<glm::dvec3>& positions_m, const std::vector<glm::uvec3>& triangles, glm::dvec3 origin_m, int leaf_size) {
  if (triangles.empty()) throw InputError("the scene has no triangle");
  if (triangles.size() > std::size_t{1} << 30)
    throw InputError("the scene has " + std::to_string(triangles.size()) + " triangles; at most 2^30 are possible");

  double reach_m = 0;
  const auto corner = [&](std::uint32_t i) {
    const auto p = positions_m[i] - origin_m;
    reach_m = std::max({reach_m, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    return Cartesian::Point_3(p.x, p.y, p.z);
  };
  Triangles corners;
  corners.reserve(triangles.size());
  for (const auto& t : triangles) corners.emplace_back(corner(t.x), corner(t.y), corner(t.z));

  Flattener flattener(corners, box_margin_m(reach_m), leaf_size);
  const Primitive first(corners.begin());
  if (corners.size() == 1) return flattener.flatten({nullptr, &first, 1});
  Tree tree(corners.begin(), corners.end());
  tree.build();
  return flattener.flatten({tree.root_node(), nullptr, corners.size()});
}

}  // namespace raywave
