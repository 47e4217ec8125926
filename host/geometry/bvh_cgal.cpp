// SPDX-License-Identifier: Apache-2.0
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>
#if __has_include(<CGAL/AABB_traits_3.h>)  // CGAL 6; CGAL 5 has the names without _3
#include <CGAL/AABB_traits_3.h>
#include <CGAL/AABB_triangle_primitive_3.h>
#else
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_triangle_primitive.h>
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <future>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

#include "host/common/error.hpp"
#include "host/geometry/bvh.hpp"

namespace raywave {
namespace {

constexpr auto no_triangle = "the scene has no triangle";

using Cartesian = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Cartesian::Triangle_3>;
#if __has_include(<CGAL/AABB_traits_3.h>)
using Primitive = CGAL::AABB_triangle_primitive_3<Cartesian, Triangles::const_iterator>;
using WholeTraits = CGAL::AABB_traits_3<Cartesian, Primitive>;
#else
using Primitive = CGAL::AABB_triangle_primitive<Cartesian, Triangles::const_iterator>;
using WholeTraits = CGAL::AABB_traits<Cartesian, Primitive>;
#endif

/// Parts of so many triangles are divided anew.
constexpr std::size_t divided_anew = 512;

/// Leaves parts that are divided anew in any order, and without boxes, which nothing asks for.
struct Traits : WholeTraits {
  static bool is_divided_anew(auto begin, auto end) {
    return static_cast<std::size_t>(end - begin) <= divided_anew;
  }
  auto compute_bbox_object() const {
    return [box_of = WholeTraits::compute_bbox_object()](auto begin, auto end) {
      return is_divided_anew(begin, end) ? CGAL::Bbox_3() : box_of(begin, end);
    };
  }
  auto split_primitives_object() const {
    return [halve = WholeTraits::split_primitives_object()](auto begin, auto end,
                                                            const CGAL::Bbox_3& box) {
      if (!is_divided_anew(begin, end)) halve(begin, end, box);
    };
  }
};
using Tree = CGAL::AABB_tree<Traits>;
using TreeNode = std::remove_cvref_t<decltype(*std::declval<Tree>().root_node())>;

/// A part of CGAL's tree: a node, or the one triangle that stands in place of a node. CGAL keeps no
/// counts: half of a node's triangles, rounded down, lie to its left.
struct Part {
  const TreeNode* node = nullptr;
  const Primitive* triangle = nullptr;
  std::size_t count = 1;

  Part left() const {
    const auto half = count / 2;
    return half == 1 ? Part{nullptr, &node->left_data(), 1}
                     : Part{&node->left_child(), nullptr, half};
  }
  Part right() const {
    const auto rest = count - count / 2;
    return rest == 1 ? Part{nullptr, &node->right_data(), 1}
                     : Part{&node->right_child(), nullptr, rest};
  }
};

/// Four numbers fill a SIMD vector; the last is not used.
using Lanes = std::array<float, 4>;

struct Box {
  Lanes min = filled(std::numeric_limits<float>::infinity()),
        max = filled(-std::numeric_limits<float>::infinity());

  static Lanes filled(float x) { return {x, x, x, x}; }
  void add(const Box& other) {
    for (std::size_t i = 0; i < 4; ++i) {
      min[i] = other.min[i] < min[i] ? other.min[i] : min[i];
      max[i] = other.max[i] > max[i] ? other.max[i] : max[i];
    }
  }
  float half_surface() const {
    const float x = max[0] - min[0], y = max[1] - min[1], z = max[2] - min[2];
    return x * y + y * z + z * x;
  }
};

/// One child in a node of the flat tree. The default is an empty box that no ray meets, so that its
/// leaf is never opened.
struct Child {
  Box box;
  int child = 0;
  int count = 1;
};

device::BvhNode node_of(const Child& left, const Child& right) {
  device::BvhNode node;
  std::copy_n(left.box.min.begin(), 3, node.left_min);
  std::copy_n(left.box.max.begin(), 3, node.left_max);
  std::copy_n(right.box.min.begin(), 3, node.right_min);
  std::copy_n(right.box.max.begin(), 3, node.right_max);
  node.left_child = left.child;
  node.left_count = left.count;
  node.right_child = right.child;
  node.right_count = right.count;
  return node;
}

/// What is divided by surface area: a triangle of a part, or a tree that is joined with others.
struct Item {
  Box box;             // rounded outwards
  Lanes centre;        // centre of the box, doubled
  std::size_t number;  // of the triangle or tree
};

/// Flattens CGAL's tree, depth first. CGAL halves at the median. Its lowest parts, which hold most
/// of the boxes, are divided anew by the surface-area heuristic: the sum of box surface times
/// triangle count is least (Wald, IEEE Symposium on Interactive Ray Tracing, 33 (2007)).
class Flattener {
public:
  Flattener(const Triangles& triangles, double margin_m, int leaf_size)
      : triangles_(triangles),
        margin_m_(margin_m),
        leaf_size_(static_cast<std::size_t>(std::max(leaf_size, 1))) {}

  Bvh flatten(const Part& whole) {
    reserve(whole.count);
    const auto root = flatten(whole, 1);
    if (root.count > 0) {
      bvh_.nodes.push_back(node_of(root, Child{}));
      bvh_.depth = 1;
    }
    return std::move(bvh_);
  }

  /// The trees as parts of one.
  Bvh join(std::span<const Bvh> trees) {
    trees_ = trees;
    std::uint32_t first = 0;
    for (const auto& tree : trees) {
      const auto& root = tree.nodes[0];
      Item item{{}, {}, first_of_trees_.size()};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        item.box.min[axis] = std::min(root.left_min[axis], root.right_min[axis]);
        item.box.max[axis] = std::max(root.left_max[axis], root.right_max[axis]);
        item.centre[axis] = item.box.min[axis] + item.box.max[axis];
      }
      items_.push_back(item);
      first_of_trees_.push_back(first);
      first += static_cast<std::uint32_t>(tree.order.size());
    }
    reserve(first);
    divide(0, items_.size(), 1, 2 * static_cast<int>(std::bit_width(items_.size())));
    return std::move(bvh_);
  }

private:
  /// Largest depth of the subtree that replaces such a part: twice the depth of halving.
  static constexpr int largest_depth = 18;
  /// Number of triangles from which on a half is worth a thread, and the depth to which it is.
  static constexpr std::size_t side_by_side = 1 << 14;
  static constexpr int deepest_side_by_side = 4;
  static constexpr std::size_t bins = 16;

  /// Memory that nothing is written to costs no time.
  void reserve(std::size_t triangles) {
    bvh_.nodes.reserve(triangles / 2);
    bvh_.triangles.reserve(triangles);
    bvh_.order.reserve(triangles);
  }

  Child flatten(const Part& part, int depth) {
    if (part.count > divided_anew) {
      // Large halves are flattened side by side: as if one came after the other
      Flattener right(triangles_, margin_m_, static_cast<int>(leaf_size_));
      std::future<Child> from_right;
      if (part.count > side_by_side && depth <= deepest_side_by_side)
        from_right = std::async(std::launch::async, [&] {
          right.reserve(part.right().count);
          return right.flatten(part.right(), depth + 1);
        });
      return inner(
          depth, [&] { return flatten(part.left(), depth + 1); },
          [&] {
            return from_right.valid() ? append(right.bvh_, from_right.get())
                                      : flatten(part.right(), depth + 1);
          });
    }
    items_.clear();
    collect(part);
    return divide(0, items_.size(), depth, largest_depth);
  }

  Child inner(int depth, const auto& make_left, const auto& make_right) {
    const auto place = bvh_.nodes.size();
    bvh_.nodes.emplace_back();
    bvh_.depth = std::max(bvh_.depth, depth);
    const Child left = make_left(), right = make_right();
    bvh_.nodes[place] = node_of(left, right);
    Child whole{left.box, static_cast<int>(place), 0};
    whole.box.add(right.box);
    return whole;
  }

  /// Adds the nodes and triangles of another tree's part, whose top is `top`.
  Child append(const Bvh& part, Child top) {
    const auto first_node = static_cast<int>(bvh_.nodes.size()),
               first_triangle = static_cast<int>(bvh_.triangles.size());
    const auto shift = [&](int& child, int count) {
      child += count > 0 ? first_triangle : first_node;
    };
    shift(top.child, top.count);
    for (auto node : part.nodes) {
      shift(node.left_child, node.left_count);
      shift(node.right_child, node.right_count);
      bvh_.nodes.push_back(node);
    }
    bvh_.triangles.insert(bvh_.triangles.end(), part.triangles.begin(), part.triangles.end());
    bvh_.order.insert(bvh_.order.end(), part.order.begin(), part.order.end());
    bvh_.depth = std::max(bvh_.depth, part.depth);
    return top;
  }

  void collect(const Part& part) {
    if (part.node) {
      collect(part.left());
      collect(part.right());
      return;
    }
    const auto box = part.triangle->datum().bbox();
    Item item{{}, {}, static_cast<std::size_t>(part.triangle->id() - triangles_.begin())};
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      item.box.min[i] = rounded_down(box.min(axis) - margin_m_);
      item.box.max[i] = rounded_up(box.max(axis) + margin_m_);
      item.centre[i] = item.box.min[i] + item.box.max[i];
    }
    items_.push_back(item);
  }

  Child divide(std::size_t from, std::size_t to, int depth, int depth_left) {
    const auto middle = split(from, to, depth_left);
    if (middle == from) return trees_.empty() ? leaf(from, to) : whole_tree(from, depth);
    return inner(
        depth, [&] { return divide(from, middle, depth + 1, depth_left - 1); },
        [&] { return divide(middle, to, depth + 1, depth_left - 1); });
  }

  /// Orders the items from..to and returns the index at which they are best divided; `from`: they
  /// stay together.
  std::size_t split(std::size_t from, std::size_t to, int depth_left) {
    const auto count = to - from;
    if (count == 1) return from;
    Box whole, centres;
    for (auto i = from; i < to; ++i) {
      whole.add(items_[i].box);
      centres.add({items_[i].centre, items_[i].centre});
    }
    float least = count <= leaf_size_
                      ? triangle_cost * static_cast<float>(count) * whole.half_surface()
                      : std::numeric_limits<float>::infinity();
    std::size_t best_axis = 3, best_bin = 0;
    const auto bin_of = [&](const Item& item, std::size_t axis, float rate) {
      return std::min(static_cast<std::size_t>((item.centre[axis] - centres.min[axis]) * rate),
                      bins - 1);
    };
    const auto rate_of = [&](std::size_t axis) {
      return bins / (centres.max[axis] - centres.min[axis]);
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float rate = rate_of(axis);
      if (!(rate < std::numeric_limits<float>::infinity())) continue;
      std::array<Box, bins> boxes;
      std::array<std::size_t, bins> counts{};
      unsigned filled = 0;  // bit i: bin i holds something
      for (auto i = from; i < to; ++i) {
        const auto bin = bin_of(items_[i], axis, rate);
        boxes[bin].add(items_[i].box);
        ++counts[bin];
        filled |= 1u << bin;
      }
      std::array<float, bins> right_cost;  // of a filled bin: cost of the bins from it on
      Box box;
      std::size_t in_box = 0;
      for (auto left = filled; left != 0;) {
        const auto bin = static_cast<std::size_t>(std::bit_width(left)) - 1;
        left ^= 1u << bin;
        box.add(boxes[bin]);
        in_box += counts[bin];
        right_cost[bin] = static_cast<float>(in_box) * box.half_surface();
      }
      box = {};
      in_box = 0;
      for (;;) {
        const auto bin = static_cast<std::size_t>(std::countr_zero(filled));
        filled &= filled - 1;
        if (filled == 0) break;
        box.add(boxes[bin]);
        in_box += counts[bin];
        const float cost =
            whole.half_surface() +
            triangle_cost * (static_cast<float>(in_box) * box.half_surface() +
                             right_cost[static_cast<std::size_t>(std::countr_zero(filled))]);
        if (!(cost < least)) continue;
        least = cost;
        best_axis = axis;
        best_bin = bin;
      }
    }
    const auto at = [&](std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); };
    const bool halve =
        count > leaf_size_ && (best_axis == 3 || count > std::size_t{1} << (depth_left - 1));
    if (halve) {
      std::size_t longest = 0;
      for (std::size_t axis = 1; axis < 3; ++axis)
        if (centres.max[axis] - centres.min[axis] > centres.max[longest] - centres.min[longest])
          longest = axis;
      const auto middle = from + count / 2;
      std::nth_element(at(from), at(middle), at(to), [&](const Item& a, const Item& b) {
        return a.centre[longest] < b.centre[longest];
      });
      return middle;
    }
    if (best_axis == 3) return from;
    const float rate = rate_of(best_axis);
    const auto middle = std::partition(at(from), at(to), [&](const Item& item) {
      return bin_of(item, best_axis, rate) <= best_bin;
    });
    return static_cast<std::size_t>(middle - items_.begin());
  }

  Child leaf(std::size_t from, std::size_t to) {
    Child result{{}, static_cast<int>(bvh_.triangles.size()), static_cast<int>(to - from)};
    for (auto i = from; i < to; ++i) {
      result.box.add(items_[i].box);
      const auto& triangle = triangles_[items_[i].number];
      Corners rounded;
      for (int axis = 0; axis < 3; ++axis) {
        rounded.a[axis] = static_cast<float>(triangle[0][axis]);
        rounded.b[axis] = static_cast<float>(triangle[1][axis]);
        rounded.c[axis] = static_cast<float>(triangle[2][axis]);
      }
      bvh_.triangles.push_back(rounded);
      bvh_.order.push_back(static_cast<std::uint32_t>(items_[i].number));
    }
    return result;
  }

  /// One of the trees that are joined.
  Child whole_tree(std::size_t item, int depth) {
    const auto number = items_[item].number;
    const auto& tree = trees_[number];
    const auto first = bvh_.order.size();
    const auto top = append(tree, {items_[item].box, 0, 0});
    for (auto i = first; i < bvh_.order.size(); ++i) bvh_.order[i] += first_of_trees_[number];
    bvh_.depth = std::max(bvh_.depth, depth - 1 + tree.depth);
    return top;
  }

  const Triangles& triangles_;
  double margin_m_;
  std::size_t leaf_size_;
  std::vector<Item> items_;
  std::span<const Bvh> trees_;                 // that are joined
  std::vector<std::uint32_t> first_of_trees_;  // number of the first triangle of each
  Bvh bvh_;
};

}  // namespace

double box_margin_m(double reach_m) { return reach_m * 0x1.4p-22; }

Bvh build_bvh(std::span<const glm::dvec3> positions_m, std::span<const glm::uvec3> triangles,
              glm::dvec3 origin_m, int leaf_size) {
  if (triangles.empty()) throw InputError(no_triangle);
  if (triangles.size() > std::size_t{1} << 30)
    throw InputError("the scene has " + std::to_string(triangles.size()) +
                     " triangles; at most 2^30 are possible");

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

Bvh joined(std::span<const Bvh> trees) {
  if (trees.empty()) throw InputError(no_triangle);
  return trees.size() == 1 ? trees[0] : Flattener({}, 0, 1).join(trees);
}

}  // namespace raywave
