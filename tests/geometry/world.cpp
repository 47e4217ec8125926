// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/world.hpp"

#include "host/geometry/extents.hpp"
#include "host/planning/make_plan.hpp"
#include "tests/support/worlds.hpp"

using namespace raywave;
using namespace raywave::test;
using glm::dvec3;
using reference::in_box;
using reference::unit_vector;

namespace {

/// Triangles with corners anywhere in a cube.
Surface cloud(Random& random, int triangles, double half) {
  Surface s;
  for (int i = 0; i < triangles; ++i)
    s.triangle(in_box(random, half), in_box(random, half), in_box(random, half));
  return s;
}

/// A thousand times as long as wide, of many triangles.
Surface sliver() {
  return grid(2000, 1, [](double s, double t) {
    return dvec3(s - 0.5, 1e-3 * (t - 0.5), 0.3 * s * s) * 9.0 * mm;
  });
}

/// Turns objects at random, about 0.1 m away.
void pose(Scene& scene, Random& random) {
  for (auto& object : scene.objects) {
    object.rotation_deg = in_box(random, 180);
    object.position_m = in_box(random, 10 * mm) + dvec3(0, 0, 0.1);
  }
}

void add(Fleet& fleet, Mesh mesh, std::optional<double> width_m) {
  auto object = object_at("", 1, {0, 0, 0.1});
  object.width_m = width_m;
  fleet.add(std::move(mesh), object);
}

Fleet fleet(Random& random) {
  Fleet fleet;
  fleet.scene.file = "scene.toml";
  fleet.scene.materials = {glowing()};
  fleet.scene.sampling.mode = SamplingMode::aimed;
  add(fleet, mesh_of(sphere({}, 4 * mm, 40)), {});
  add(fleet, mesh_of(cloud(random, 3000, 1)), 7 * mm);
  add(fleet, mesh_of(sliver()), {});
  add(fleet, mesh_of(box({}, {1, 2, 0.5}), [](dvec3 p) { return p + dvec3(3e3, -2e5, 1e4); }),
      3 * mm);  // far from its own origin
  add(fleet, mesh_of(cloud(random, 40, 3 * mm)), 5 * mm);
  pose(fleet.scene, random);
  return fleet;
}

using Long = glm::tvec3<long double>;

/// Turned about x, then y, then z.
Long turned(Long p, dvec3 degrees) {
  for (int axis = 0; axis < 3; ++axis) {
    const long double angle =
        std::numbers::pi_v<long double> / 180 * static_cast<long double>(degrees[axis]);
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const auto pa = p[a], pb = p[b];
    p[a] = std::cos(angle) * pa - std::sin(angle) * pb;
    p[b] = std::sin(angle) * pa + std::cos(angle) * pb;
  }
  return p;
}

/// Positions of an object's vertices, by its definition.
std::vector<dvec3> placed(const Object& object, const Mesh& mesh) {
  std::vector<Long> all;
  Long low(INFINITY), high(-INFINITY);
  for (const auto& p : mesh.positions) {
    all.push_back(turned(Long(p), object.rotation_deg));
    low = glm::min(low, all.back());
    high = glm::max(high, all.back());
  }
  const long double scale = object.width_m ? *object.width_m / (high.x - low.x) : 1;
  std::vector<dvec3> places;
  for (const auto& p : all)
    places.emplace_back(Long(object.position_m) + scale * (p - (low + high) / 2.0L));
  return places;
}

double largest(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// A random lens's view: windows and planes of any size and place.
SeenThrough any_view(Random& random) {
  return {uniform(random, 0, 0.15), glm::dvec2(in_box(random, 5 * mm)),
          glm::dvec2(uniform(random, 1, 5), uniform(random, 1, 5)) * mm,
          glm::dvec2(uniform(random, 0.02, 0.3), uniform(random, 0.02, 0.3)),
          uniform(random, 1, 2)};
}

/// Extents by their definition: vertex by vertex, from the rays to the window's edges.
Extents extents_by_hand(const std::vector<dvec3>& points, const SeenThrough& seen) {
  Extents extents;
  for (const auto& p : points) {
    for (int axis = 0; axis < 2; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      extents.tangents[i].add(p[axis] / p.z);
      for (const double side : {-1.0, 1.0}) {
        const double edge = seen.centre_m[axis] + side * seen.half_m[axis];
        extents.passed[i].add(edge + (p[axis] - edge) * seen.distance_m / p.z);
        const double wide_edge = seen.centre_m[axis] + side * seen.wider * seen.half_m[axis];
        extents.beyond_m[i] = std::max(
            extents.beyond_m[i], side * (wide_edge - p[axis]) - seen.largest_tangent[axis] * p.z);
      }
    }
  }
  return extents;
}

void check_alike(const Interval& a, const Interval& b, double within) {
  CHECK(std::abs(a.low - b.low) <= within);
  CHECK(std::abs(a.high - b.high) <= within);
}

}  // namespace

TEST_CASE(
    "moved objects are where their definition puts them, to rounding, near their mesh's origin or "
    "far from it") {
  Random random(1);
  auto many = fleet(random);
  auto world = place_objects(many.scene, many.meshes);
  for (int n = 0; n < 6; ++n) {
    if (n > 0) pose(many.scene, random);
    if (n == 4) {  // from the mesh's own size to a width, and back
      many.scene.objects[0].width_m = 6 * mm;
      many.scene.objects[4].width_m = {};
    }
    move_objects(many.scene, world);
    const auto now_m = positions_now(world);
    for (std::size_t i = 0; i < many.scene.objects.size(); ++i) {
      const auto wanted_m = placed(many.scene.objects[i], many.meshes.meshes[i]);
      REQUIRE(world.placed[i].vertices == wanted_m.size());
      double size_m = 0, off_m = 0;
      for (std::size_t v = 0; v < wanted_m.size(); ++v) {
        size_m = std::max(size_m, largest(wanted_m[v] - wanted_m[0]));
        off_m = std::max(off_m, largest(now_m[world.placed[i].first_vertex + v] - wanted_m[v]));
      }
      INFO("object " << i << ", pose " << n << ": off by " << off_m / size_m << " of its size");
      CHECK(off_m <= 1e-12 * size_m);
    }
  }
}

TEST_CASE("triangles and normals move with their objects") {
  Random random(2);
  auto many = fleet(random);
  auto world = place_objects(many.scene, many.meshes);
  pose(many.scene, random);
  move_objects(many.scene, world);
  const auto fresh = place_objects(many.scene, many.meshes);
  const auto normals = normals_now(world);
  for (std::size_t v = 0; v < normals.size(); ++v)
    REQUIRE(largest(dvec3(normals[v]) - dvec3(fresh.normals[v])) <= 4 * 0x1p-24);
  const auto now_m = positions_now(world);
  for (std::size_t t = 0; t < world.triangles.size(); ++t) {
    const auto corners_m = world.corners_m(t);
    for (int c = 0; c < 3; ++c) REQUIRE(corners_m[c] == now_m[world.triangles[t][c]]);
  }
}

TEST_CASE("objects that have not moved, or have moved back, keep their positions bit for bit") {
  Random random(3);
  auto many = fleet(random);
  const auto home = many.scene;
  auto world = place_objects(home, many.meshes);
  const auto was = world;
  CHECK(positions_now(world) == was.positions);
  pose(many.scene, random);
  many.scene.objects[2] = home.objects[2];
  move_objects(many.scene, world);
  CHECK(world.motions[0].moved);
  CHECK_FALSE(world.motions[2].moved);
  CHECK(world.positions == was.positions);  // the placed ones stay
  CHECK(positions_now(world) != was.positions);
  move_objects(home, world);
  CHECK(positions_now(world) == was.positions);
  CHECK(normals_now(world) == was.normals);
  CHECK(world.min_m == was.min_m);
  CHECK(world.max_m == was.max_m);
}

TEST_CASE("a moved world has the box and extents of all its vertices") {
  Random random(4);
  auto many = fleet(random);
  auto world = place_objects(many.scene, many.meshes);
  for (int n = 0; n < 40; ++n) {
    if (n > 0) pose(many.scene, random);
    move_objects(many.scene, world);
    const auto now_m = positions_now(world);
    dvec3 low(INFINITY), high(-INFINITY);
    for (const auto& p : now_m) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    CHECK(largest(world.min_m - low) < 1e-15);  // of 0.1 m: 10 roundings
    CHECK(largest(world.max_m - high) < 1e-15);
    const auto seen = any_view(random);
    const auto found = extents_of(world, seen), wanted = extents_by_hand(now_m, seen),
               among_points = extents_of(now_m, seen);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      check_alike(found.tangents[axis], wanted.tangents[axis], 1e-14);
      check_alike(found.passed[axis], wanted.passed[axis], 1e-14);
      CHECK(std::abs(found.beyond_m[axis] - wanted.beyond_m[axis]) < 1e-14);
      check_alike(among_points.tangents[axis], wanted.tangents[axis], 1e-14);
      check_alike(among_points.passed[axis], wanted.passed[axis], 1e-14);
      CHECK(std::abs(among_points.beyond_m[axis] - wanted.beyond_m[axis]) < 1e-14);
    }
  }
}

namespace {
/// Components of positions along each of some directions, as functions of position.
auto along(const std::array<dvec3, 4>& directions, std::size_t& visits) {
  return [&](const dvec3& p_m) {
    ++visits;
    std::array<double, 4> values;
    for (std::size_t i = 0; i < 4; ++i) values[i] = glm::dot(p_m, directions[i]);
    return values;
  };
}

std::array<dvec3, 4> four_directions(Random& random) {
  std::array<dvec3, 4> directions;
  for (auto& direction : directions) direction = unit_vector(random);
  return directions;
}
}  // namespace

TEST_CASE("a vertex tree finds the extremes of any number of vertices") {
  Random random(5);
  for (const std::size_t count : {1, 2, 31, 32, 33, 64, 65, 1000, 5000, 40000}) {
    std::vector<dvec3> positions;
    for (std::size_t i = 0; i < count; ++i) positions.push_back(in_box(random, 1) + dvec3(0, 0, 5));
    // All in one place
    if (count == 1000) std::fill(positions.begin(), positions.end(), dvec3(1, 2, 3));
    const auto tree = build_vertex_tree(positions);
    for (int n = 0; n < 10; ++n) {
      const auto directions = four_directions(random);
      const Motion motion{glm::dmat3(uniform(random, 0.1, 3)), 0.5, in_box(random, 1),
                          in_box(random, 1), n % 2 == 0};
      std::array<double, 4> wanted;
      wanted.fill(-INFINITY);
      auto found = wanted;
      for (const auto& p : positions) {
        for (std::size_t i = 0; i < 4; ++i)
          wanted[i] = std::max(wanted[i], glm::dot(motion(p), directions[i]));
      }
      std::size_t visits = 0;
      raise_to_largest(tree, positions, motion, along(directions, visits), 0, found);
      for (std::size_t i = 0; i < 4; ++i) REQUIRE(std::abs(found[i] - wanted[i]) < 1e-14);
    }
  }
}

TEST_CASE("a vertex tree visits few vertices and boxes of a ball") {
  const auto ball = sphere({}, 1, 200);
  const auto tree = build_vertex_tree(ball.positions);
  Random random(6);
  const auto directions = four_directions(random);
  std::size_t visits = 0;
  std::array<double, 4> found;
  found.fill(-INFINITY);
  raise_to_largest(tree, ball.positions, {}, along(directions, visits), 0, found);
  INFO(visits << " corners of boxes and vertices of " << ball.positions.size());
  CHECK(visits < ball.positions.size() / 4);
}

TEST_CASE(
    "a move to an impossible position is refused with the message of placing there, and a later "
    "move works") {
  Fleet one;
  add(one, mesh_of(grid(4, 4, [](double s, double t) { return dvec3(s, t, 0); })), 10 * mm);
  auto world = place_objects(one.scene, one.meshes);
  const auto home = one.scene;
  const auto check_refused = [&](const std::string& why) {
    const auto said = input_error_of([&] { move_objects(one.scene, world); });
    CHECK_SAYS(said, why);
    CHECK(said == input_error_of([&] { place_objects(one.scene, one.meshes); }));
    one.scene = home;
  };
  one.scene.objects[0].rotation_deg = {0, 90, 0};
  check_refused("width cannot be reached");
  one.scene.objects[0].width_m = 1e5;
  check_refused("; give a width");
  one.scene.objects[0].position_m.z = 0.2;
  move_objects(one.scene, world);
  CHECK(world.min_m.z == 0.2);
}

TEST_CASE("a moved world has the plan of a world placed there") {
  Random random(7);
  auto many = fleet(random);
  auto world = place_objects(many.scene, many.meshes);
  for (const int layers : {1, 3}) {
    for (const int tiles : {1, 2}) {
      pose(many.scene, random);
      many.scene.wrp.layers = layers;
      many.scene.hologram.tiles = glm::ivec2(tiles);
      move_objects(many.scene, world);
      const auto moved = make_plan(many.scene, world),
                 fresh = make_plan(many.scene, place_objects(many.scene, many.meshes));
      CHECK(moved.extent.near_m == Catch::Approx(fresh.extent.near_m).epsilon(1e-13));
      CHECK(moved.extent.far_m == Catch::Approx(fresh.extent.far_m).epsilon(1e-13));
      CHECK(moved.grid == fresh.grid);
      CHECK(moved.lattice.size == fresh.lattice.size);
      CHECK(moved.lattice.first == fresh.lattice.first);
      REQUIRE(moved.layers.size() == fresh.layers.size());
      for (std::size_t i = 0; i < moved.layers.size(); ++i)
        CHECK(moved.layers[i].distance_m ==
              Catch::Approx(fresh.layers[i].distance_m).epsilon(1e-11));
      REQUIRE(moved.wrps.size() == fresh.wrps.size());
      for (std::size_t i = 0; i < moved.wrps.size(); ++i)
        CHECK(largest(moved.wrps[i].centre_m - fresh.wrps[i].centre_m) < 1e-12);
    }
  }
}
