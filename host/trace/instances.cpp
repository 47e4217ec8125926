// SPDX-License-Identifier: Apache-2.0
#include "host/trace/instances.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <span>
#include <tuple>
#include <utility>

#include "host/common/threads.hpp"
#include "host/geometry/bvh.hpp"
#include "host/geometry/normal_cones.hpp"
#include "host/geometry/ray_tree.hpp"
#include "host/plan/lattice.hpp"

namespace raywave {
namespace {

/// Six times the volume below a triangle, against a corner of the scene: the distance to the
/// hologram would cancel digits of the sum.
double volume_below(const World& world, std::size_t triangle) {
  const auto corners = world.triangles[triangle];
  const auto a = world.positions[corners.x] - world.min_m,
             b = world.positions[corners.y] - world.min_m,
             c = world.positions[corners.z] - world.min_m;
  return glm::dot(a, glm::cross(b, c));
}

/// Winding of an object: 1 when its triangles are counter-clockwise seen from outside, -1 when they
/// are clockwise, 0 when the mesh is open.
std::int32_t side_of(const World& world, std::size_t object) {
  if (!world.object_closed[object]) return 0;
  const auto [first, count] = triangles_of(object, world.triangle_object);
  double volume = 0;
  for (auto i = first; i < first + count; ++i) volume += volume_below(world, i);
  return volume == 0 ? 0 : volume > 0 ? 1 : -1;
}

std::vector<std::int32_t> sides_of(const World& world) {
  std::vector<std::int32_t> sides;
  for (std::size_t i = 0; i < world.object_closed.size(); ++i) sides.push_back(side_of(world, i));
  return sides;
}

/// The corners of an object's vertices in the frame of the instances.
std::vector<float> in_frame(std::span<const glm::dvec3> positions_m, glm::dvec3 anchor_m) {
  std::vector<float> floats;
  floats.reserve(3 * positions_m.size());
  for (const auto& p : positions_m) {
    for (int axis = 0; axis < 3; ++axis)
      floats.push_back(static_cast<float>(p[axis] - anchor_m[axis]));
  }
  return floats;
}

/// The triangles beyond the edges of an instance's, in their order.
///
/// object  of an instance of one
std::vector<std::int32_t> neighbours_in(const World& world, std::optional<std::size_t> object,
                                        std::vector<glm::uvec3> triangles) {
  const bool deforms = object && !world.placed.empty() && world.placed[*object].deforming;
  if (!deforms || !world.placed[*object].seams_hold)
    return neighbours_of(world.positions, triangles);
  // As they are at rest: what meets for a picture alone is not joined
  const auto& placed = world.placed[*object];
  for (auto& t : triangles) t -= glm::uvec3(static_cast<glm::uint>(placed.first_vertex));
  return neighbours_of(placed.deforming->rest.positions_m, triangles);
}

/// A tree's nodes as they stand on the device.
///
/// first_node, first_triangle  the place of its own
std::vector<device::BvhNode> nodes_at(const Bvh& bvh, std::int32_t first_node,
                                      std::int32_t first_triangle) {
  auto nodes = bvh.nodes;
  for (auto& node : nodes) {
    node.left_child += BVH_COUNT(node.left_count) > 0 ? first_triangle : first_node;
    node.right_child += BVH_COUNT(node.right_count) > 0 ? first_triangle : first_node;
  }
  return nodes;
}

/// The objects of each instance: first all that have never moved, if any, then one instance for
/// each object that has.
std::vector<std::vector<std::size_t>> sets_of(const std::vector<bool>& apart) {
  std::vector<std::vector<std::size_t>> instances(1);
  for (std::size_t i = 0; i < apart.size(); ++i) {
    if (!apart[i]) instances[0].push_back(i);
  }
  if (instances[0].empty()) instances.clear();
  for (std::size_t i = 0; i < apart.size(); ++i) {
    if (apart[i]) instances.push_back({i});
  }
  return instances;
}

void put_split(double value, float& high, float& low) { std::tie(high, low) = split(value); }

/// An instance after a motion.
///
/// anchor_m  origin of the instance's frame before the motion, world
/// origin_m  origin of the scene frame, world
/// eye_m     where rays of the lattice come from, world
/// root      root of its tree; its node number is `place`
device::Instance instance_after(const Motion& motion, glm::dvec3 anchor_m, glm::dvec3 origin_m,
                                glm::dvec3 eye_m, const device::BvhNode& root, std::int32_t place) {
  auto instance = instance_at_rest(place);
  const auto outward = motion.scale * motion.turn,
             inward = glm::transpose(motion.turn) / motion.scale;
  const auto centre = motion.moved ? motion.to_m - origin_m + outward * (anchor_m - motion.from_m)
                                   : anchor_m - origin_m;
  glm::dvec3 low, high;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      put_split(inward[column][row], instance.inward[3 * row + column],
                instance.inward_low[3 * row + column]);
      put_split(outward[column][row], instance.outward[3 * row + column],
                instance.outward_low[3 * row + column]);
    }
    put_split(centre[row], instance.centre[row], instance.centre_low[row]);
    low[row] = std::min(root.left_min[row], root.right_min[row]);
    high[row] = std::max(root.left_max[row], root.right_max[row]);
  }
  // Rays of the lattice leave the eye for what lies beyond it. Where that is the hologram's centre,
  // they come to it from what lies before it.
  const auto middle = (low + high) / 2.0, half = (high - low) / 2.0;
  const double z_m = (origin_m + centre + outward * middle).z - eye_m.z;
  double half_z_m = 0;
  for (int axis = 0; axis < 3; ++axis) half_z_m += std::abs(outward[axis][2]) * half[axis];
  const int side = z_m > half_z_m ? 1 : z_m < -half_z_m ? -1 : 0;
  set_view(instance, middle, glm::length(high - low) / 2, inward * (eye_m - origin_m - centre),
           side);
  instance.moved = motion.moved || centre != glm::dvec3(0);
  return instance;
}

/// Box of an instance after a motion, scene frame: that of the corners of the boxes below its root,
/// and what rounding may do to rays that come from the hologram.
Box box_after(const Motion& motion, glm::dvec3 anchor_m, glm::dvec3 origin_m,
              const device::BvhNode& root) {
  Box box;
  const auto add = [&](const float* min, const float* max) {
    if (min[0] > max[0]) return;  // a root with one child
    for (int corner = 0; corner < 8; ++corner) {
      glm::dvec3 p;
      for (int axis = 0; axis < 3; ++axis) p[axis] = corner >> axis & 1 ? max[axis] : min[axis];
      box.add(motion(p + anchor_m) - origin_m);
    }
  };
  add(root.left_min, root.left_max);
  add(root.right_min, root.right_max);
  const double reach_m =
      glm::length(glm::max(glm::abs(box.min_m), glm::abs(box.max_m))) + glm::length(origin_m);
  const glm::dvec3 margin_m(0x1p-20 * reach_m);
  return {box.min_m - margin_m, box.max_m + margin_m};
}

}  // namespace

device::Instance instance_at_rest(std::int32_t root) {
  device::Instance instance{};
  for (const int i : {0, 4, 8}) instance.inward[i] = instance.outward[i] = 1;
  instance.root = root;
  instance.top = -1;
  return instance;
}

Instances::Instances(const cl::Device& device, const World& world, glm::dvec3 anchor_m,
                     DeviceTree& tree, bool for_samples)
    : device_(device),
      anchor_m_(anchor_m),
      sides_(sides_of(world)),
      apart_(sides_.size(), false),
      for_samples_(for_samples) {
  tree.positions = {device, std::span<const float>(in_frame(world.positions, anchor_m)),
                    "vertices"};
  for (const auto& placed : world.placed) versions_.push_back(placed.version);
}

std::vector<std::size_t> Instances::place(const World& world, const Plan& plan, DeviceTree& tree) {
  const auto motion_of = [&](std::size_t object) {
    return world.motion_of(static_cast<std::int32_t>(object));
  };
  const auto deforms = [&](std::size_t object) {
    return !world.placed.empty() && world.placed[object].deforming;
  };
  bool any_deforms = false;
  for (std::size_t i = 0; i < apart_.size(); ++i) {
    apart_[i] = apart_[i] || motion_of(i).moved || deforms(i);
    any_deforms = any_deforms || deforms(i);
  }
  const auto changed = upload_changed(world, tree);
  if (auto sets = sets_of(apart_); sets != objects_ || (any_deforms && trees_.empty())) {
    objects_ = std::move(sets);
    build_trees(world, plan, tree);
  } else if (!changed.empty()) {
    deform(world, plan, changed, tree);
  }
  std::vector<device::Instance> placed;
  std::vector<Box> boxes;
  for (std::size_t i = 0; i < roots_.size(); ++i) {
    const auto motion = motion_of(objects_[i][0]);
    placed.push_back(instance_after(motion, anchor_m_, plan.extent.origin_m, plan.lattice.eye_m,
                                    root_nodes_[i], roots_[i]));
    boxes.push_back(box_after(motion, anchor_m_, plan.extent.origin_m, root_nodes_[i]));
  }
  if (const auto top = build_box_tree(boxes); !top.empty()) {
    placed[0].top = 0;
    tree.nodes.write(top);  // in front of the instances' trees
  }
  cl::put(device_, tree.instances, placed, "instances");
  return changed;
}

/// Uploads the vertices that have changed. Returns their objects.
std::vector<std::size_t> Instances::upload_changed(const World& world, DeviceTree& tree) {
  std::vector<std::size_t> changed;
  for (std::size_t i = 0; i < world.placed.size(); ++i) {
    const auto& placed = world.placed[i];
    if (placed.version == versions_[i]) continue;
    versions_[i] = placed.version;
    changed.push_back(i);
    tree.positions.write(in_frame(placed.own(world.positions), anchor_m_), 3 * placed.first_vertex);
    sides_[i] = side_of(world, i);
  }
  return changed;
}

/// The tree of an instance, of those of its objects.
InstanceTree Instances::built(const World& world, const Plan& plan, std::size_t instance) const {
  const auto& objects = objects_[instance];
  std::vector<std::uint32_t> numbers;
  std::vector<glm::uvec3> corners;
  std::vector<std::pair<std::size_t, std::span<const glm::uvec3>>> parts;  // object, its triangles
  for (const auto object : objects) {
    const auto [first, count] = triangles_of(object, world.triangle_object);
    if (count == 0) continue;
    parts.emplace_back(object, std::span(world.triangles).subspan(first, count));
    corners.insert(corners.end(), parts.back().second.begin(), parts.back().second.end());
    for (std::size_t i = 0; i < count; ++i)
      numbers.push_back(static_cast<std::uint32_t>(first + i));
  }
  std::vector<Bvh> trees(parts.size());
  auto& threads = cl::Threads::shared();
  threads.for_each(
      std::min(threads.count(), parts.size()), parts.size(), 1, [&](std::size_t, std::size_t i) {
        const auto& [object, triangles] = parts[i];
        const auto* known = world.ray_tree ? world.ray_tree->tree_of(object, anchor_m_) : nullptr;
        trees[i] =
            known ? *known : build_bvh(world.positions, triangles, anchor_m_, triangles_of_leaf);
      });
  InstanceTree result;
  result.bvh = joined(trees);
  std::vector<std::int32_t> sides;
  std::vector<glm::uvec3> in_order;
  sides.reserve(numbers.size());
  in_order.reserve(numbers.size());
  result.triangles.reserve(numbers.size());
  for (const auto place : result.bvh.order) {
    in_order.push_back(corners[place]);
    const auto t = glm::ivec3(corners[place]);
    const auto object = static_cast<std::size_t>(world.triangle_object[numbers[place]]);
    result.triangles.push_back(
        {t.x, t.y, t.z, plan.lighting.material_of(object, world.material_of(numbers[place])),
         sides_[object], static_cast<std::int32_t>(instance)});
    sides.push_back(sides_[object]);
  }
  store_normal_cones(result.bvh, sides);
  if (wants_neighbours_)
    result.neighbours = neighbours_in(
        world, objects.size() == 1 ? std::optional(objects[0]) : std::nullopt, std::move(in_order));
  return result;
}

void Instances::build_trees(const World& world, const Plan& plan, DeviceTree& tree) {
  wants_neighbours_ = for_samples_ && breaks_pay(plan.lattice, world.triangles.size());
  trees_.clear();
  for (std::size_t instance = 0; instance < objects_.size(); ++instance)
    trees_.push_back(built(world, plan, instance));
  costs_.clear();
  of_picture_.assign(trees_.size(), std::nullopt);
  std::vector<const InstanceTree*> shown;
  for (const auto& one : trees_) {
    shown.push_back(&one);
    costs_.push_back(surface_cost(one.bvh));
  }
  upload(shown, tree);
  if (std::none_of(world.placed.begin(), world.placed.end(),
                   [](const PlacedObject& placed) { return placed.deforming != nullptr; }))
    trees_.clear();
}

/// One tree per instance; triangles are stored in the order of the tree's leaves.
void Instances::upload(const std::vector<const InstanceTree*>& shown, DeviceTree& tree) {
  // First the nodes of the tree over the instances, which place() makes
  std::vector<device::BvhNode> nodes(shown.size() - 1);
  std::vector<device::Triangle> triangles;
  std::vector<std::int32_t> neighbours;
  roots_.clear();
  root_nodes_.clear();
  for (const auto* one : shown) {
    const auto first_node = static_cast<std::int32_t>(nodes.size()),
               first_triangle = static_cast<std::int32_t>(triangles.size());
    for (const auto other : one->neighbours)
      neighbours.push_back(other < 0 ? other : first_triangle + other);
    const auto more = nodes_at(one->bvh, first_node, first_triangle);
    nodes.insert(nodes.end(), more.begin(), more.end());
    triangles.insert(triangles.end(), one->triangles.begin(), one->triangles.end());
    roots_.push_back(first_node);
    root_nodes_.push_back(more[0]);
    depth_ = std::max(depth_, one->bvh.depth);
  }
  cl::put(device_, tree.nodes, nodes, "trees");
  cl::put(device_, tree.triangles, triangles, "triangles");
  if (neighbours.empty()) neighbours.push_back(-1);
  cl::put(device_, tree.neighbours, neighbours, "neighbours of triangles");
}

/// Refits the trees of objects whose vertices have changed, or builds them for this picture.
void Instances::deform(const World& world, const Plan& plan,
                       const std::vector<std::size_t>& changed, DeviceTree& tree) {
  bool is_whole = false;  // trees of another size, or triangles that have changed
  std::vector<std::size_t> refitted;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const auto object = objects_[i][0];
    if (objects_[i].size() > 1 ||
        std::find(changed.begin(), changed.end(), object) == changed.end())
      continue;
    const auto& placed = world.placed[object];
    auto& one = trees_[i];
    refit_bvh(one.bvh, world.positions,
              std::span(world.triangles).subspan(placed.first_triangle, placed.triangles),
              anchor_m_);
    for (auto& triangle : one.triangles) {
      is_whole = is_whole || triangle.side != sides_[object];
      triangle.side = sides_[object];
    }
    store_normal_cones(one.bvh, std::vector<std::int32_t>(one.triangles.size(), sides_[object]));
    is_whole = is_whole || of_picture_[i].has_value();
    of_picture_[i].reset();
    if (placed.seams_hold && surface_cost(one.bvh) <= most_refitted_cost * costs_[i]) {
      refitted.push_back(i);
      continue;
    }
    is_whole = true;
    of_picture_[i] = built(world, plan, i);
  }
  if (is_whole) {
    std::vector<const InstanceTree*> shown;
    for (std::size_t i = 0; i < trees_.size(); ++i)
      shown.push_back(of_picture_[i] ? &*of_picture_[i] : &trees_[i]);
    upload(shown, tree);
    return;
  }
  std::int32_t first_triangle = 0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < trees_.size() && next < refitted.size(); ++i) {
    if (i == refitted[next]) {
      const auto nodes = nodes_at(trees_[i].bvh, roots_[i], first_triangle);
      tree.nodes.write(nodes, static_cast<std::size_t>(roots_[i]));
      root_nodes_[i] = nodes[0];
      ++next;
    }
    const auto& of_it = of_picture_[i] ? *of_picture_[i] : trees_[i];
    first_triangle += static_cast<std::int32_t>(of_it.triangles.size());
  }
}

}  // namespace raywave
