// SPDX-License-Identifier: Apache-2.0
// Objects that deform: trees that are refitted, and worlds whose vertices change.
#include <cstring>

#include "host/geometry/extents.hpp"
#include "host/geometry/normal_cones.hpp"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec3;
using reference::in_box;
using reference::unit_vector;

namespace {

/// A bend and a twist.
dvec3 bent(dvec3 p) {
  const double a = 120 * p.y;
  return {std::cos(a) * p.x - std::sin(a) * p.z + 40 * p.y * p.y, p.y,
          std::sin(a) * p.x + std::cos(a) * p.z};
}

bool are_equal(const Bvh& a, const Bvh& b) {
  return a.nodes.size() == b.nodes.size() && a.order == b.order && a.depth == b.depth &&
         std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof a.nodes[0]) == 0 &&
         std::memcmp(a.triangles.data(), b.triangles.data(),
                     a.triangles.size() * sizeof a.triangles[0]) == 0;
}

TEST_CASE("a tree that is refitted to where it was built is the same, bit for bit") {
  Random random;
  for (const int rings : {1, 3, 40}) {
    const auto ball = sphere({0, 0, 10 * mm}, 1 * mm, rings + 2);
    for (const dvec3 origin : {dvec3(0), dvec3(0, 0, 9 * mm)}) {
      const auto built = build_bvh(ball.positions, ball.triangles, origin, 4);
      auto refitted = built;
      store_normal_cones(refitted, std::vector<std::int32_t>(refitted.triangles.size(), 1));
      refit_bvh(refitted, ball.positions, ball.triangles, origin);
      CHECK(are_equal(refitted, built));
      // There and back again
      auto moved = ball.positions;
      for (auto& p : moved) p = bent(p) + in_box(random, 0.3 * mm);
      refit_bvh(refitted, moved, ball.triangles, origin);
      CHECK_FALSE(are_equal(refitted, built));
      refit_bvh(refitted, ball.positions, ball.triangles, origin);
      CHECK(are_equal(refitted, built));
    }
  }
  // One triangle: a root with one child
  const std::vector<dvec3> corners{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  const std::vector<glm::uvec3> one{{0, 1, 2}};
  const auto built = build_bvh(corners, one, {});
  auto refitted = built;
  refit_bvh(refitted, corners, one, {});
  CHECK(are_equal(refitted, built));
}

/// Triangles below a child, and whether its box holds all of them with the margin.
std::size_t triangles_within(const Bvh& bvh, std::int32_t child, std::int32_t count,
                             const float* low, const float* high, double margin) {
  std::vector<std::size_t> places;
  const std::function<void(std::int32_t, std::int32_t)> collect = [&](auto number, auto bits) {
    const auto first = static_cast<std::size_t>(number);
    if (BVH_COUNT(bits) > 0) {
      for (auto i = first; i < first + static_cast<std::size_t>(BVH_COUNT(bits)); ++i)
        places.push_back(i);
      return;
    }
    collect(bvh.nodes[first].left_child, bvh.nodes[first].left_count);
    collect(bvh.nodes[first].right_child, bvh.nodes[first].right_count);
  };
  collect(child, count);
  bool is_within = true;
  for (const auto place : places) {
    for (const auto* corner :
         {bvh.triangles[place].a, bvh.triangles[place].b, bvh.triangles[place].c})
      for (int axis = 0; axis < 3; ++axis)
        is_within = is_within && low[axis] <= corner[axis] - 0.9 * margin &&
                    high[axis] >= corner[axis] + 0.9 * margin;
  }
  CHECK(is_within);
  return places.size();
}

TEST_CASE("boxes of a refitted tree hold the triangles below them, with their margin") {
  Random random;
  const auto ball = sphere({0, 0, 10 * mm}, 1 * mm, 30);
  auto bvh = build_bvh(ball.positions, ball.triangles, {0, 0, 9 * mm}, 4);
  const double at_rest = surface_cost(bvh);
  auto moved = ball.positions;
  for (auto& p : moved) p = bent(p - dvec3(0, 0, 10 * mm)) + dvec3(0, 0, 12 * mm);
  double reach = 0;
  for (auto& p : moved)
    for (int i = 0; i < 3; ++i) reach = std::max(reach, std::abs(p[i] - (i == 2 ? 9 * mm : 0)));
  refit_bvh(bvh, moved, ball.triangles, {0, 0, 9 * mm});
  for (const auto& node : bvh.nodes) {
    triangles_within(bvh, node.left_child, node.left_count, node.left_min, node.left_max,
                     box_margin_m(reach));
    triangles_within(bvh, node.right_child, node.right_count, node.right_min, node.right_max,
                     box_margin_m(reach));
  }
  // A bend costs little; triangles that go anywhere cost much
  CHECK(surface_cost(bvh) > at_rest);
  CHECK(surface_cost(bvh) < 2 * at_rest);
  for (auto& p : moved) p = in_box(random, 1 * mm) + dvec3(0, 0, 10 * mm);
  refit_bvh(bvh, moved, ball.triangles, {0, 0, 9 * mm});
  CHECK(surface_cost(bvh) > 4 * at_rest);
}

TEST_CASE("the heuristic's cost of a small tree is the sum of its boxes by hand") {
  // Two leaves: boxes 1 x 1 x 1 and 2 x 1 x 1, the whole 4 x 1 x 1
  Bvh bvh;
  bvh.nodes.push_back({});
  auto& node = bvh.nodes[0];
  const auto put = [](float* to, float x, float y, float z) { to[0] = x, to[1] = y, to[2] = z; };
  put(node.left_min, 0, 0, 0);
  put(node.left_max, 1, 1, 1);
  put(node.right_min, 2, 0, 0);
  put(node.right_max, 4, 1, 1);
  node.left_count = 3;
  node.right_count = 2;
  // Half surfaces: 3, 5, 9
  CHECK(surface_cost(bvh) == Catch::Approx(1 + double{triangle_cost} * (3 * 3 + 2 * 5) / 9));
}

/// Scene and meshes of an object whose place is its mesh's, and of one beside it.
struct Pair : Fleet {
  explicit Pair(const Mesh& first) {
    scene.file = "scene.toml";
    scene.materials = {glowing(), glowing()};
    scene.materials[1].reflectivity = 0.5;  // rays on the host look for mirrors
    put(first, 1);
    put(mesh_of(sphere({3 * mm, 0, 0}, 1 * mm, 8)), 0);
  }

  void put(const Mesh& mesh, int material) {
    auto object = object_at("", 1, {0, 0, 20 * mm}, material);
    object.width_m.reset();
    object.anchor = Anchor::origin;
    add(mesh, object);
  }
};

/// The nearest hit by every triangle, in double.
double nearest(const World& world, dvec3 origin, dvec3 direction) {
  double nearest = INFINITY;
  for (std::size_t i = 0; i < world.triangles.size(); ++i) {
    const auto [a, b, c] = world.corners_m(i);
    const auto n = glm::cross(b - a, c - a);
    const double t = glm::dot(a - origin, n) / glm::dot(direction, n);
    const auto p = origin + t * direction;
    const bool inside = glm::dot(glm::cross(b - a, p - a), n) >= 0 &&
                        glm::dot(glm::cross(c - b, p - b), n) >= 0 &&
                        glm::dot(glm::cross(a - c, p - c), n) >= 0;
    if (inside && t > 0) nearest = std::min(nearest, t);
  }
  return nearest;
}

TEST_CASE(
    "a world with other vertices is the world of an object with that mesh, also after moves") {
  const auto ball = sphere({}, 1 * mm, 24);
  const auto rest = mesh_of(ball), other = mesh_of(ball, bent);
  const Pair before(rest), after(other);
  const auto expected = place_objects(after.scene, after.meshes);
  auto world = place_objects(before.scene, before.meshes);
  const auto count = world.placed[0].vertices;
  REQUIRE(expected.placed[0].vertices == count);
  const auto untouched = world;
  set_vertices(world, 0, std::span(expected.positions).first(count),
               std::span(expected.normals).first(count));
  CHECK(world.placed[0].version == 1);
  for (const bool turned : {false, true}) {
    INFO(turned);
    auto scene = before.scene;
    auto there = expected;
    if (turned) {
      scene.objects[0].rotation_deg = {20, -50, 70};
      scene.objects[0].position_m += dvec3(1 * mm, 0, 2 * mm);
    }
    move_objects(scene, world);
    move_objects(scene, there);
    CHECK(world.positions == there.positions);
    CHECK(glm::distance(world.min_m, there.min_m) < 1e-17);
    CHECK(glm::distance(world.max_m, there.max_m) < 1e-17);
    CHECK(world.object_closed == there.object_closed);
    REQUIRE(world.area_samples[0].size() == there.area_samples[0].size());
    for (std::size_t i = 0; i < world.area_samples[0].size(); ++i) {
      CHECK(world.area_samples[0][i].triangle == there.area_samples[0][i].triangle);
      CHECK(world.area_samples[0][i].normal_m2 == there.area_samples[0][i].normal_m2);
      CHECK(world.area_samples[0][i].corner_sum_m == there.area_samples[0][i].corner_sum_m);
    }
    SeenThrough seen{.distance_m = 15 * mm, .half_m = {2 * mm, 1 * mm}};
    const auto a = extents_of(world, seen), b = extents_of(there, seen);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      CHECK(a.tangents[axis].low == Catch::Approx(b.tangents[axis].low).epsilon(1e-13));
      CHECK(a.passed[axis].high == Catch::Approx(b.passed[axis].high).epsilon(1e-13));
    }
    CHECK(middles_of_surfaces(world, 1) == middles_of_surfaces(there, 1));
    // Rays of the host
    Random random;
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
      const auto from = in_box(random, 4 * mm);
      const auto to = in_box(random, 2 * mm) + dvec3(0, 0, 20 * mm);
      const auto direction = glm::normalize(to - from);
      const auto hit = world.ray_tree->nearest(world.motions, from, direction, 0, 1);
      const double t = nearest(world, from, direction);
      CHECK(hit.has_value() == std::isfinite(t));
      if (hit && ++hits) CHECK(std::abs(hit->t - t) < 1e-8);  // trees keep corners as floats
    }
    CHECK(hits > 40);
  }
  // The world that it was copied from is as it was, and so is this one when it gets its vertices
  CHECK(untouched.placed[0].version == 0);
  set_vertices(world, 0, std::span(untouched.positions).first(count),
               std::span(untouched.normals).first(count));
  move_objects(before.scene, world);
  CHECK(world.min_m == untouched.min_m);
  CHECK(world.positions == untouched.positions);
}

TEST_CASE("an object is closed until vertices that lay at one place have parted") {
  Mesh soup;  // a box of single triangles
  for (const auto cube = box({}, dvec3(1 * mm)); const auto& t : cube.triangles) {
    for (int i = 0; i < 3; ++i) {
      soup.triangles.resize(soup.positions.size() / 3 + 1);
      soup.triangles.back()[i] = static_cast<glm::uint>(soup.positions.size());
      soup.positions.push_back(cube.positions[t[i]]);
    }
  }
  soup.normals.assign(soup.positions.size(), dvec3(0));
  soup.uvs.assign(soup.positions.size(), glm::dvec2(0));
  const Pair pair(finish_mesh(std::move(soup), Normals::flat));
  auto world = place_objects(pair.scene, pair.meshes);
  REQUIRE(world.object_closed[0]);
  const auto count = world.placed[0].vertices;
  const std::vector normals(world.normals.begin(),
                            world.normals.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector positions(world.positions.begin(),
                        world.positions.begin() + static_cast<std::ptrdiff_t>(count));
  const auto rest = positions;
  for (auto& p : positions) p = 1.5 * p;
  set_vertices(world, 0, positions, normals);
  CHECK(world.object_closed[0]);
  positions[4].x += 1e-9;
  set_vertices(world, 0, positions, normals);
  CHECK_FALSE(world.object_closed[0]);
  CHECK_FALSE(world.placed[0].seams_hold);
  set_vertices(world, 0, rest, normals);
  CHECK(world.object_closed[0]);
  // What cannot be is refused
  positions.pop_back();
  CHECK_REFUSED(set_vertices(world, 0, positions, normals),
                "object 0: it has 24 vertices, and 23 positions");
  positions.emplace_back(NAN, 0, 0);
  CHECK_REFUSED(set_vertices(world, 0, positions, normals), "NaN or infinite");
  CHECK(world.object_closed[0]);
}

TEST_CASE("a shape between two keys is a quarter of the way where its place says so") {
  const std::vector<VertexKey> keys{{{{0, 0, 1}, {4, 0, 1}}, {{0, 0, 1}, {1, 0, 0}}},
                                    {{{4, 8, 1}, {4, 0, 5}}, {{0, 1, 0}, {-1, 0, 0}}},
                                    {{{0, 0, 0}, {0, 0, 0}}, {{0, 0, 1}, {0, 0, 1}}}};
  const auto quarter = shape_at(keys, 0.25);
  CHECK(quarter.positions_m == std::vector<dvec3>{{1, 2, 1}, {4, 0, 2}});
  CHECK(glm::distance(dvec3(quarter.normals[0]), glm::normalize(dvec3(0, 0.25, 0.75))) < 1e-7);
  CHECK(shape_at(keys, 0.5).normals[1] == glm::vec3(1, 0, 0));  // there is none between
  for (const auto& [place, key] : {std::pair{0.0, 0u}, {1.0, 1u}, {2.0, 2u}, {-3.0, 0u}, {7.0, 2u}})
    CHECK(shape_at(keys, place).positions_m == keys[key].positions_m);
}

TEST_CASE("corners stay apart that are equal in one mesh of an object and differ in another one") {
  // Two triangles that share an edge in the first mesh, and open like a book in the second; a third
  // one without an area in the first mesh, and a fourth one without an area in both
  Mesh first{.positions = {{0, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {1, 0, 0}},
             .triangles = {{0, 1, 2}, {4, 3, 5}, {0, 1, 4}, {2, 2, 5}},
             .triangle_material = {0, 1, 2, 3}};
  first.materials.resize(4);
  first.normals.assign(6, {0, 0, 1});
  first.uvs.assign(6, {0, 0});
  auto second = first;
  second.positions[3].x = second.positions[4].x = 0.1;
  const auto alone = finish_mesh(first, Normals::file);
  CHECK(alone.positions.size() == 4);
  CHECK(alone.triangles.size() == 2);
  const auto [mesh, shapes] = finish_meshes({first, second}, Normals::file);
  CHECK(mesh.triangles.size() == 3);
  CHECK(mesh.triangle_material == std::vector<std::int32_t>{0, 1, 2});
  REQUIRE(mesh.positions.size() == 6);
  REQUIRE(shapes.size() == 1);
  for (std::size_t i = 0; i < 3; ++i) {
    for (int c = 0; c < 3; ++c) {
      CHECK(mesh.positions[mesh.triangles[i][c]] == first.positions[first.triangles[i][c]]);
      CHECK(shapes[0].positions[mesh.triangles[i][c]] == second.positions[second.triangles[i][c]]);
    }
  }
}

}  // namespace
