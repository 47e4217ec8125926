// SPDX-License-Identifier: Apache-2.0
/// A tree of bounding boxes over an object's vertices. It finds the largest values of functions of
/// position without a visit to every vertex, so that a frame in which objects only move costs
/// nothing per triangle.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "host/geometry/motion.hpp"

namespace raywave {

struct VertexTree {
  static constexpr std::size_t leaf_size = 32;

  struct Node {
    glm::dvec3 min_m, max_m;         // box around the vertices below
    std::uint32_t first = 0, count;  // range of these vertices, in `vertices`
    std::uint32_t right = 0;         // index of the right child, the left one follows; 0: a leaf
  };
  std::vector<Node> nodes;              // node 0 is the root
  std::vector<std::uint32_t> vertices;  // vertex indices, leaf by leaf
};

/// positions_m  at least one
VertexTree build_vertex_tree(std::span<const glm::dvec3> positions_m);

/// Makes the boxes anew after the vertices have moved.
void refit(VertexTree& tree, std::span<const glm::dvec3> positions_m);

/// The corners of a node's box after a motion.
inline std::array<glm::dvec3, 8> corners_of(const VertexTree::Node& node, const Motion& motion) {
  const auto min_m = motion(node.min_m), size_m = node.max_m - node.min_m;
  const auto along = motion.moved ? motion.scale * motion.turn : glm::dmat3(1);
  const auto x_m = along[0] * size_m.x, y_m = along[1] * size_m.y, z_m = along[2] * size_m.z;
  const auto xy_m = min_m + x_m + y_m;
  return {min_m,       min_m + x_m,       min_m + y_m,       xy_m,
          min_m + z_m, min_m + x_m + z_m, min_m + y_m + z_m, xy_m + z_m};
}

/// Raises `largest` to the largest values that some functions take at a tree's vertices. Branch and
/// bound: a subtree is skipped where no corner of its box promises more.
///
/// positions_m  the vertices of which the tree was built
/// motion       from there to the positions at which the functions are taken
/// values_at    position -> std::array<double, N>; over a box, each value is largest at a corner
/// least        a vertex may be missed that raises no value by more than this and a few roundings
template <std::size_t N, class ValuesAt>
void raise_to_largest(const VertexTree& tree, std::span<const glm::dvec3> positions_m,
                      const Motion& motion, const ValuesAt& values_at, double least,
                      std::array<double, N>& largest) {
  const auto raise = [&](std::array<double, N>& values, const glm::dvec3& p_m) {
    const std::array<double, N> here = values_at(p_m);
    for (std::size_t i = 0; i < N; ++i) values[i] = here[i] > values[i] ? here[i] : values[i];
  };
  const auto visit = [&](const VertexTree::Node& leaf) {
    for (auto i = leaf.first; i < leaf.first + leaf.count; ++i)
      raise(largest, motion(positions_m[tree.vertices[i]]));
  };
  const auto bounds_of = [&](std::size_t node) {
    std::array<double, N> bounds;
    bounds.fill(-std::numeric_limits<double>::infinity());
    for (const auto& corner_m : corners_of(tree.nodes[node], motion)) raise(bounds, corner_m);
    return bounds;
  };

  // The most promising leaf of each function first: few other subtrees promise more then.
  for (std::size_t i = 0; i < N; ++i) {
    std::size_t node = 0;
    while (tree.nodes[node].right != 0) {
      const std::size_t right = tree.nodes[node].right;
      node = bounds_of(right)[i] > bounds_of(node + 1)[i] ? right : node + 1;
    }
    visit(tree.nodes[node]);
  }

  const auto search = [&](const auto& self, std::size_t node) -> void {
    const auto bounds = bounds_of(node);
    bool promises_more = false;
    for (std::size_t i = 0; i < N; ++i)
      promises_more = promises_more || bounds[i] > largest[i] + least;
    if (!promises_more) return;
    if (tree.nodes[node].right == 0) return visit(tree.nodes[node]);
    self(self, node + 1);
    self(self, tree.nodes[node].right);
  };
  search(search, 0);
}

}  // namespace raywave
