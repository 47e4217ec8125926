// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/ray_tree.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <numeric>
#include <utility>

#include "host/common/threads.hpp"

namespace raywave {
namespace {

struct Ray {
  glm::dvec3 origin, direction, inverse;
  double t_min = 0;
};

/// True where the ray passes through the box between t_min and t_max.
bool meets_box(const float* low, const float* high, const Ray& ray, double t_max) {
  double enter = ray.t_min, leave = t_max;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (low[axis] - ray.origin[axis]) * ray.inverse[axis],
                 b = (high[axis] - ray.origin[axis]) * ray.inverse[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave * (1 + 1e-12);
}

struct TriangleHit {
  double t = 0, u = 0, v = 0;
};

/// Moeller and Trumbore's test.
std::optional<TriangleHit> meets(const Corners& corners, const Ray& ray, double t_max) {
  const auto a = point_of(corners.a), ab = point_of(corners.b) - a, ac = point_of(corners.c) - a;
  const auto across = glm::cross(ray.direction, ac);
  const double determinant = glm::dot(ab, across);
  if (determinant == 0) return std::nullopt;
  const auto off = ray.origin - a;
  const auto turned = glm::cross(off, ab);
  const double u = glm::dot(off, across) / determinant,
               v = glm::dot(ray.direction, turned) / determinant,
               t = glm::dot(ac, turned) / determinant;
  if (u < 0 || v < 0 || u + v > 1 || t <= ray.t_min || t >= t_max) return std::nullopt;
  return TriangleHit{t, u, v};
}

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
    Box sums;
    for (auto i = first; i < end; ++i) sums.add(sum(order_[i]));
    const auto size = sums.size_m();
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
    for (auto i = first + 1; i < end; ++i) result.box.add(boxes_[order_[i]]);
    result.number = result.is_leaf ? static_cast<std::int32_t>(order_[first]) : add(first, end);
    return result;
  }

  glm::dvec3 sum(std::size_t box) const { return boxes_[box].min_m + boxes_[box].max_m; }

  static void store(const Child& child, float* min, float* max, std::int32_t& number,
                    std::int32_t& count) {
    for (int axis = 0; axis < 3; ++axis) {
      min[axis] = rounded_down(child.box.min_m[axis]);
      max[axis] = rounded_up(child.box.max_m[axis]);
    }
    number = child.number;
    count = child.is_leaf;
  }

  std::span<const Box> boxes_;
  std::vector<std::size_t> order_;
};

}  // namespace

std::pair<std::size_t, std::size_t> triangles_of(std::size_t object,
                                                 std::span<const std::int32_t> triangle_object) {
  const auto own = std::equal_range(triangle_object.begin(), triangle_object.end(),
                                    static_cast<std::int32_t>(object));
  return {static_cast<std::size_t>(own.first - triangle_object.begin()),
          static_cast<std::size_t>(own.second - own.first)};
}

RayTree::RayTree(std::span<const glm::dvec3> positions_m, std::span<const glm::vec3> normals,
                 std::span<const glm::uvec3> triangles,
                 std::span<const std::int32_t> triangle_object, std::size_t objects,
                 glm::dvec3 origin_m)
    : objects_(objects), origin_m_(origin_m) {
  auto& threads = cl::Threads::shared();
  threads.for_each(
      std::min(threads.count(), objects), objects, 1, [&](std::size_t, std::size_t object) {
        const auto [first, count] = triangles_of(object, triangle_object);
        if (count == 0) return;
        auto& tree = objects_[object];
        tree.first_triangle = first;
        const auto corners = triangles.subspan(first, count);
        tree.normals.reserve(3 * corners.size());
        for (const auto& triangle : corners)
          for (int corner = 0; corner < 3; ++corner)
            tree.normals.push_back(normals.empty() ? glm::vec3(0) : normals[triangle[corner]]);
        tree.bvh = build_bvh(positions_m, corners, origin_m, triangles_of_leaf);
      });
}

const Bvh* RayTree::tree_of(std::size_t object, glm::dvec3 origin_m) const {
  const auto& tree = objects_[object];
  return origin_m == origin_m_ && !tree.is_refitted && !tree.normals.empty() ? &tree.bvh : nullptr;
}

void RayTree::refit(std::size_t object, std::span<const glm::dvec3> positions_m,
                    std::span<const glm::vec3> normals, std::span<const glm::uvec3> triangles) {
  auto& tree = objects_[object];
  if (tree.normals.empty()) return;
  const auto corners = triangles.subspan(tree.first_triangle, tree.bvh.order.size());
  for (std::size_t i = 0; i < tree.normals.size(); ++i)
    tree.normals[i] = normals[corners[i / 3][static_cast<int>(i % 3)]];
  refit_bvh(tree.bvh, positions_m, corners, origin_m_);
  tree.is_refitted = true;
}

std::optional<RayHit> RayTree::nearest(std::span<const Motion> motions, glm::dvec3 origin,
                                       glm::dvec3 direction, double t_min, double t_max) const {
  std::optional<RayHit> best;
  std::vector<std::int32_t> waiting;
  for (std::size_t object = 0; object < objects_.size(); ++object) {
    const auto& tree = objects_[object];
    if (tree.normals.empty()) continue;
    // The ray in the object's frame: distances along it do not change
    const auto motion = motions.empty() ? Motion{} : motions[object];
    const auto back = glm::transpose(motion.turn) / motion.scale;
    Ray ray;
    ray.t_min = t_min;
    ray.direction = motion.moved ? back * direction : direction;
    ray.origin =
        (motion.moved ? motion.from_m + back * (origin - motion.to_m) : origin) - origin_m_;
    for (int axis = 0; axis < 3; ++axis)
      ray.inverse[axis] = 1 / (ray.direction[axis] == 0 ? 1e-300 : ray.direction[axis]);

    std::optional<TriangleHit> hit;
    std::size_t place = 0;
    const auto look_at = [&](std::int32_t child, std::int32_t count) {
      if (BVH_COUNT(count) == 0) return waiting.push_back(child);
      for (auto i = child; i < child + BVH_COUNT(count); ++i) {
        const auto found = meets(tree.bvh.triangles[static_cast<std::size_t>(i)], ray, t_max);
        if (!found) continue;
        hit = found;
        t_max = found->t;
        place = static_cast<std::size_t>(i);
      }
    };
    waiting.assign(1, 0);
    while (!waiting.empty()) {
      const auto& node = tree.bvh.nodes[static_cast<std::size_t>(waiting.back())];
      waiting.pop_back();
      if (meets_box(node.left_min, node.left_max, ray, t_max))
        look_at(node.left_child, node.left_count);
      if (meets_box(node.right_min, node.right_max, ray, t_max))
        look_at(node.right_child, node.right_count);
    }
    if (!hit) continue;
    const std::size_t number = tree.bvh.order[place];
    const auto normal = [&](std::size_t corner) {
      return glm::dvec3(tree.normals[3 * number + corner]);
    };
    const auto& corners = tree.bvh.triangles[place];
    const auto a = point_of(corners.a);
    const auto face = glm::cross(point_of(corners.b) - a, point_of(corners.c) - a);
    const auto smooth = (1 - hit->u - hit->v) * normal(0) + hit->u * normal(1) + hit->v * normal(2);
    const auto normal_or_face = glm::dot(smooth, smooth) > 0 ? smooth : face;
    best = {hit->t, tree.first_triangle + number, static_cast<std::int32_t>(object),
            glm::normalize(motion.turn * face), glm::normalize(motion.turn * normal_or_face)};
  }
  return best;
}

std::vector<device::BvhNode> build_box_tree(std::span<const Box> boxes) {
  if (boxes.size() < 2) return {};
  Builder builder(boxes);
  builder.nodes.reserve(boxes.size() - 1);
  builder.add(0, boxes.size());
  return std::move(builder.nodes);
}

}  // namespace raywave
