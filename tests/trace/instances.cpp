// SPDX-License-Identifier: Apache-2.0
#include "host/trace/instances.hpp"

#include "host/evaluate/selftest/selfcheck.hpp"
#include "host/geometry/normal_cones.hpp"
#include "host/planning/make_plan.hpp"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec3;

namespace {

glm::dmat3 turn_by(double degrees, dvec3 axis) {
  return glm::dmat3(glm::rotate(glm::dmat4(1), glm::radians(degrees), glm::normalize(axis)));
}

/// A ball, beside it a ball with reversed winding, and an open sheet behind both.
Stage stage_of_three() {
  Stage stage;
  stage.add(sphere({-0.2e-3, 0, 10e-3}, 0.15e-3, 12));
  stage.add(flipped(sphere({0.2e-3, 0, 10e-3}, 0.15e-3, 12)));
  stage.add(grid(
      9, 7, [](double s, double t) { return dvec3(s - 0.5, t - 0.5, 10.5 + 0.2 * s * t) * 1e-3; }));
  return stage;
}

/// Rotation and scaling about the centre of the world, and a translation.
Motion motion_of(const World& world, double degrees, double scale, dvec3 by_m) {
  const auto middle = (world.min_m + world.max_m) / 2.0;
  return {turn_by(degrees, {1, 2, 0.5}), scale, middle, middle + by_m, true};
}

/// A world whose objects have moved: as motions, or by moving every vertex.
World after(World world, const std::vector<Motion>& motions, bool vertex_by_vertex) {
  world.motions = vertex_by_vertex ? std::vector<Motion>() : motions;
  std::vector<std::size_t> object_of(world.positions.size());
  for (std::size_t i = 0; i < world.triangles.size(); ++i) {
    for (int c = 0; c < 3; ++c)
      object_of[world.triangles[i][c]] = static_cast<std::size_t>(world.triangle_object[i]);
  }
  world.min_m = dvec3(INFINITY);
  world.max_m = dvec3(-INFINITY);
  for (std::size_t i = 0; i < world.positions.size(); ++i) {
    const auto& motion = motions[object_of[i]];
    const auto p = motion(world.positions[i]);
    world.min_m = glm::min(world.min_m, p);
    world.max_m = glm::max(world.max_m, p);
    if (!vertex_by_vertex) continue;
    world.positions[i] = p;
    if (motion.moved) world.normals[i] = motion.turn * dvec3(world.normals[i]);
  }
  return world;
}

/// The triangles of a world in the order of a tree on the device, scene frame.
std::vector<Corners> corners_in_order(const World& world, dvec3 origin_m, const DeviceTree& tree) {
  std::vector<Corners> all;
  for (const auto& t : tree.triangles.read()) {
    Corners corners{};
    const int vertices[] = {t.corner_a, t.corner_b, t.corner_c};
    float* places[] = {corners.a, corners.b, corners.c};
    for (int c = 0; c < 3; ++c) {
      for (int axis = 0; axis < 3; ++axis)
        places[c][axis] = static_cast<float>(world.positions[vertices[c]][axis] - origin_m[axis]);
    }
    all.push_back(corners);
  }
  return all;
}

std::vector<Motion> some_motions(const World& world, int kind) {
  const auto all = motion_of(world, 40, 1, {0.1e-3, 0, 0.3e-3});
  if (kind == 0) return {all, all, all};
  if (kind == 1) return {motion_of(world, 3, 1.7, {0, 0, 0.05e-3}), {}, {}};
  return {{},
          motion_of(world, -110, 0.6, {-0.02e-3, 0.05e-3, 2e-3}),
          motion_of(world, 8, 1, {0, 0, 1.2e-3})};
}

}  // namespace

namespace {

/// Checks rays at moved objects against their triangles, moved one by one. Targets and every other
/// origin lie within these half sizes of the scene's middle; other rays come from the eye.
void check_rays(const raywave::cl::Device& device, const Stage& stage,
                const std::vector<Motion>& motions, Random& random, dvec3 target_m, dvec3 from_m,
                std::size_t least_instances = 1) {
  const auto moved = after(stage.world, motions, false), there = after(stage.world, motions, true);
  const auto plan = make_plan(stage.scene, moved);
  DeviceScene arrays(device, stage.world, make_plan(stage.scene, stage.world));
  arrays.place(moved, plan);
  REQUIRE(arrays.tree.instances.size() >= least_instances);
  const auto corners = corners_in_order(there, plan.extent.origin_m, arrays.tree);
  const auto within = [&](dvec3 half) {
    const double x = uniform(random, -half.x, half.x), y = uniform(random, -half.y, half.y);
    return dvec3(x, y, uniform(random, -half.z, half.z));
  };
  std::vector<reference::Ray> rays;
  for (int i = 0; i < 600; ++i) {
    const auto target = within(target_m), from = i % 2 ? within(from_m) : -plan.extent.origin_m;
    // The oracle gets rays and corners rounded to floats: only the traversal is compared.
    rays.push_back({dvec3(glm::vec3(from)), dvec3(glm::vec3((target - from) * 1.5)), 0, 2});
  }
  selftest::RayCaster caster(device, lanes_for(device.info()), std::move(arrays.tree));
  const auto found = caster.nearest(rays);
  const auto stopped = caster.occluded(rays);
  int hits = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto exact = reference::nearest_hit(corners, rays[i]);
    CAPTURE(i, found[i].triangle, found[i].t, exact.triangle, exact.t);
    hits += exact.triangle >= 0;
    // Where one of the two misses, the ray must pass an edge within rounding.
    if ((exact.triangle >= 0) != (found[i].triangle >= 0) ||
        (exact.triangle >= 0 &&
         std::abs(found[i].t - exact.t) * glm::length(rays[i].direction) > 2e-9))
      CHECK(reference::judge(found[i], rays[i], corners).fault == "");
    CHECK((stopped[i] != 0) == (found[i].triangle >= 0));
  }
  CHECK(hits > 100);
}

}  // namespace

DEVICE_TEST("rays hit instances at their places in the world, whichever objects move") {
  const auto stage = stage_of_three();
  for (const int kind : {0, 1, 2}) {
    CAPTURE(kind);
    Random random(static_cast<unsigned>(kind + 1));
    check_rays(device, stage, some_motions(stage.world, kind), random, {0.5e-3, 0.5e-3, 1e-3},
               dvec3(1e-3));
  }
}

DEVICE_TEST("rays find their way among 37 instances, as among all of their triangles") {
  Stage stage;
  Random random(11);
  std::vector<Motion> motions;
  for (int i = 0; i < 37; ++i) {
    // Some overlap, some lie on one line, one has not moved
    const dvec3 centre(i % 3 == 0 ? 0 : uniform(random, -0.5e-3, 0.5e-3),
                       uniform(random, -0.5e-3, 0.5e-3), 10e-3 + uniform(random, 0, 1e-3));
    stage.add(sphere(centre, 0.08e-3, 6));
    motions.push_back({turn_by(uniform(random, 0, 360), {1, i, 2}), uniform(random, 0.5, 1.5),
                       centre, centre + dvec3(0.1e-3, 0, 0.1e-3 * (i % 5)), true});
    if (i == 20) motions.back() = {};
  }
  check_rays(device, stage, motions, random, {0.7e-3, 0.7e-3, 1e-3}, {1e-3, 0, 1e-3}, 37);
}

DEVICE_TEST("moved instances have the samples of a world built at their places") {
  auto stage = stage_of_three();
  stage.scene.sampling.antialias = 4;
  stage.scene.trace.shadows = true;
  stage.scene.lights = {Light{.type = LightType::point, .position_m = {0.5e-3, 0.5e-3, 9e-3}}};
  for (auto& m : stage.scene.materials) m.specular = dvec3(0.5);
  for (const int kind : {0, 1, 2}) {
    const auto motions = some_motions(stage.world, kind);
    const auto moved = after(stage.world, motions, false);
    auto there = stage;
    there.world = after(stage.world, motions, true);
    const Rig fresh(device, there, Method::wrp, false);

    DeviceScene arrays(device, stage.world, make_plan(stage.scene, stage.world));
    arrays.place(moved, fresh.plan);
    const SampleTable table(device, fresh.plan, arrays, false);
    const auto samples = table.samples.read();
    REQUIRE(table.count > 200);
    // Culled subtrees hold no samples: a search without normal cones finds equal samples, except
    // at edges whose two sides lie within the gap that merges layers.
    auto nodes = arrays.tree.nodes.read();
    REQUIRE(std::any_of(nodes.begin(), nodes.end(), [](const auto& n) {
      return device::normal_cone_spread(n.left_count) > 0;
    }));
    for (auto& n : nodes) {
      n.left_count = BVH_COUNT(n.left_count);
      n.right_count = BVH_COUNT(n.right_count);
    }
    arrays.tree.nodes.write(nodes);
    CHECK(std::abs(SampleTable(device, fresh.plan, arrays, false).count - table.count) <= 2);
    // A ray may pass an edge within rounding.
    CHECK(std::abs(table.count - fresh.table.count) <= table.count / 200);
    std::map<std::uint32_t, device::Sample> by_key;
    for (const auto& s : fresh.samples) by_key[s.key] = s;
    int alike = 0;
    double squares = 0;
    for (int i = 0; i < table.count; ++i) {
      const auto& s = samples[i];
      const auto other = by_key.find(s.key);
      if (other == by_key.end()) continue;
      const auto& o = other->second;
      const bool same = glm::length(place(s) - place(o)) < 5e-9 &&
                        glm::length(normal(s) - normal(o)) < 1e-5 && s.hidden == o.hidden &&
                        std::abs(s.radiance - o.radiance) <= 1e-4f * (0.1f + o.radiance) &&
                        std::abs(s.tilt_x - o.tilt_x) < 1e-2f;
      alike += same;
      squares += same ? double(s.z - o.z) * double(s.z - o.z) : 0.0;
    }
    const double rms_nm = 1e9 * std::sqrt(squares / std::max(1, alike));
    CAPTURE(kind, alike, table.count, rms_nm);
    CHECK(alike >= table.count * 97 / 100);
    CHECK(rms_nm <= 0.25);  // measured up to 0.12
  }
}

namespace {
/// The culling test of kernels/scene/bvh.h.
bool turns_away(std::int32_t facing, const device::Instance& instance) {
  int along = 0;
  for (int i = 0; i < 3; ++i) along += device::normal_cone_axis(facing, i) * instance.view[i];
  return device::normal_cone_spread(facing) > 0 &&
         2 * along > VIEW_STEPS * device::normal_cone_spread(facing) + instance.view_margin;
}
}  // namespace

TEST_CASE(
    "normal cones culled by their bits face away everywhere in the instance, and few such cones "
    "are kept") {
  Random random(5);
  const auto direction = [&] {
    return glm::normalize(
        dvec3(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)) +
        dvec3(1e-9));
  };
  int away = 0, wanted = 0;
  for (int i = 0; i < 100000; ++i) {
    const NormalCone facing{i % 7 == 0 ? dvec3(0, -1, 0) : direction(), uniform(random, 0, 1.2)};
    const auto bits = normal_cone_bits(facing);
    REQUIRE(BVH_COUNT(bits) == 0);
    const dvec3 middle = direction(), eye = middle + direction() * uniform(random, 0.5, 20);
    const double radius = uniform(random, 0, 1);
    device::Instance instance{};
    set_view(instance, middle, radius, eye, 1);
    const dvec3 normal = glm::normalize(facing.axis + direction() * facing.spread * 0.999),
                place = middle + direction() * radius;
    // Only unit normals within the spread are in the cone.
    if (!(glm::length(normal - facing.axis) <= facing.spread)) continue;
    const bool is_away = turns_away(bits, instance);
    if (is_away) REQUIRE(glm::dot(normal, place - eye) > 0);
    // Cones that face away by more than the rounding of the bits must be culled.
    const double distance = glm::length(middle - eye);
    wanted +=
        glm::dot(facing.axis, middle - eye) > (facing.spread + 0.04) * distance + 1.2 * radius &&
        radius < 0.5 * distance;
    away += is_away;
  }
  CHECK(wanted > 10000);
  CHECK(away >= wanted);
}

DEVICE_TEST("culled subtrees hold only inner sides of closed meshes, and most of these") {
  const auto stage = stage_of_three();
  DeviceScene arrays(device, stage.world, make_plan(stage.scene, stage.world));
  const auto nodes = arrays.tree.nodes.read();
  const auto triangles = arrays.tree.triangles.read();
  const auto corners = reference::corners_of(arrays.tree);
  for (const dvec3 eye :
       {dvec3(0, 0, -10e-3), dvec3(5e-3, 2e-3, 1e-3), dvec3(-0.1e-3, 9e-3, -8e-3)}) {
    double inner = 0;
    auto instance = arrays.tree.instances.read()[0];
    set_view(instance, dvec3(0), 0.8e-3, eye, 1);
    const auto inner_side = [&](std::size_t i) {
      const auto& t = corners[i];
      const dvec3 a(t.a[0], t.a[1], t.a[2]), b(t.b[0], t.b[1], t.b[2]), c(t.c[0], t.c[1], t.c[2]);
      return triangles[i].side * glm::dot(glm::cross(b - a, c - a), a - eye) > 0;
    };
    for (std::size_t i = 0; i < corners.size(); ++i) inner += inner_side(i);
    double found = 0;
    // Visits all triangles below a node and counts those in culled subtrees. above: an ancestor
    // is culled
    const std::function<void(std::int32_t, bool)> visit = [&](std::int32_t place, bool above) {
      const auto& n = nodes[place];
      const auto look_at = [&](const float* min, const float* max, std::int32_t child,
                               std::int32_t count) {
        if (min[0] > max[0]) return;
        const bool away = above || turns_away(count, instance);
        if (BVH_COUNT(count) == 0) return visit(child, away);
        for (int i = child; i < child + BVH_COUNT(count); ++i) {
          if (away) REQUIRE(inner_side(static_cast<std::size_t>(i)));
          found += away;
        }
      };
      look_at(n.left_min, n.left_max, n.left_child, n.left_count);
      look_at(n.right_min, n.right_max, n.right_child, n.right_count);
    };
    visit(0, false);
    CHECK(inner > 0.25 * static_cast<double>(corners.size()));
    CHECK(found > 0.65 * inner);  // measured: 0.68
  }
}
