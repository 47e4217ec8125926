// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/vertex_tree.hpp"

#include <algorithm>
#include <glm/common.hpp>
#include <numeric>

namespace raywave {
namespace {

Box box_of(std::span<const glm::dvec3> positions_m, std::span<const std::uint32_t> vertices) {
  Box box;
  for (const auto vertex : vertices) box.add(positions_m[vertex]);
  return box;
}

/// Adds the node of the vertices first..first + count, and its subtree behind it. Halves at the
/// median along the longest side of the box.
void add_node(std::span<const glm::dvec3> positions_m, std::size_t first, std::size_t count,
              VertexTree& tree) {
  const auto vertices = std::span(tree.vertices).subspan(first, count);
  const auto box = box_of(positions_m, vertices);
  const auto node = tree.nodes.size();
  tree.nodes.push_back(
      {box.min_m, box.max_m, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count)});
  if (count <= VertexTree::leaf_size) return;

  const auto size_m = box.size_m();
  const int axis = size_m.x >= size_m.y && size_m.x >= size_m.z ? 0 : size_m.y >= size_m.z ? 1 : 2;
  const auto half = count / 2;
  std::nth_element(vertices.begin(), vertices.begin() + static_cast<std::ptrdiff_t>(half),
                   vertices.end(), [&](std::uint32_t a, std::uint32_t b) {
                     return positions_m[a][axis] < positions_m[b][axis];
                   });
  add_node(positions_m, first, half, tree);
  tree.nodes[node].right = static_cast<std::uint32_t>(tree.nodes.size());
  add_node(positions_m, first + half, count - half, tree);
}

}  // namespace

VertexTree build_vertex_tree(std::span<const glm::dvec3> positions_m) {
  VertexTree tree;
  tree.vertices.resize(positions_m.size());
  std::iota(tree.vertices.begin(), tree.vertices.end(), 0u);
  add_node(positions_m, 0, positions_m.size(), tree);
  return tree;
}

void refit(VertexTree& tree, std::span<const glm::dvec3> positions_m) {
  for (auto i = tree.nodes.size(); i-- > 0;) {  // children come behind their parents
    auto& node = tree.nodes[i];
    if (node.right != 0) {
      const auto &left = tree.nodes[i + 1], &right = tree.nodes[node.right];
      node.min_m = glm::min(left.min_m, right.min_m);
      node.max_m = glm::max(left.max_m, right.max_m);
      continue;
    }
    const auto box = box_of(positions_m, std::span(tree.vertices).subspan(node.first, node.count));
    node.min_m = box.min_m;
    node.max_m = box.max_m;
  }
}

}  // namespace raywave
