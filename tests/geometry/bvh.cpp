// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/bvh.hpp"

#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>
#if __has_include(<CGAL/AABB_traits_3.h>)  // CGAL 6; CGAL 5 has the names without _3
#include <CGAL/AABB_traits_3.h>
#include <CGAL/AABB_triangle_primitive_3.h>
#else
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_triangle_primitive.h>
#endif

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>

#include "host/evaluate/selftest/selfcheck.hpp"
#include "host/reference/surfaces.hpp"
#include "tests/support/devices.hpp"

using namespace raywave;
using reference::Ray;

namespace {

using Random = reference::Random;
using Soup = reference::Surface;
using reference::as_float;
using reference::in_box;
using reference::random_rays;
using reference::rays_at_edges;
using reference::sphere;
using reference::torus;
using reference::uniform;
using reference::unit_vector;
using Caster = selftest::RayCaster;

/// Runs `f(device, lanes)` on every device with 1 lane, 8 lanes and as many as it has.
template <class F>
void on_every_device(F&& f) {
  for (const auto& device : test::all_devices()) {
    std::vector<int> lanes{1, 8};
    const int own = device.info().float_lanes;
    if (own == 4 || own == 16) lanes.push_back(own);
    for (const int n : lanes) {
      INFO(device.info().name << ", " << n << " lanes");
      f(device, n);
    }
  }
}

/// A test case whose body runs so, as on_every_device calls it.
#define LANES_TEST(...) LANES_TEST_NAMED(DEVICE_TEST_JOINED(on_lanes_, __LINE__), __VA_ARGS__)
#define LANES_TEST_NAMED(function, ...)                               \
  static void function(const raywave::cl::Device& device, int lanes); \
  TEST_CASE(__VA_ARGS__) { on_every_device(function); }               \
  static void function(const raywave::cl::Device& device, int lanes)

/// Every hit against brute force; fewer than one ray in `one_in` may meet another triangle than the
/// exact one.
void check_all(Caster& scene, const Bvh& bvh, const std::vector<Ray>& rays, int one_in) {
  const auto hits = scene.nearest(rays);
  const auto occluded = scene.occluded(rays);
  std::size_t others = 0, found = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto verdict = reference::judge(hits[i], rays[i], bvh.triangles);
    if (!verdict.fault.empty()) FAIL_CHECK("ray " << i << ": " << verdict.fault);
    others += !verdict.exact;
    found += hits[i].triangle >= 0;
    if (occluded[i] != (hits[i].triangle >= 0))
      FAIL_CHECK("ray " << i << ": occluded " << occluded[i] << ", hit " << hits[i].triangle);
  }
  CHECK(found > rays.size() / 20);
  CHECK(others * static_cast<std::size_t>(one_in) <= rays.size());
}

int real_depth(const Bvh& bvh, int node = 0) {
  const auto& n = bvh.nodes[node];
  const int left = n.left_count ? 0 : real_depth(bvh, n.left_child),
            right = n.right_count ? 0 : real_depth(bvh, n.right_child);
  return 1 + std::max(left, right);
}

/// Visits children below `node` as (min, max, child, count).
void visit(const Bvh& bvh, int node,
           const std::function<void(const float*, const float*, int, int)>& f) {
  const auto& n = bvh.nodes[node];
  f(n.left_min, n.left_max, n.left_child, n.left_count);
  f(n.right_min, n.right_max, n.right_child, n.right_count);
  if (!n.left_count) visit(bvh, n.left_child, f);
  if (!n.right_count) visit(bvh, n.right_child, f);
}

/// Trees of `parts` runs of the triangles, joined.
Bvh built_in_parts(const Soup& soup, std::size_t parts, glm::dvec3 origin_m, int leaf_size) {
  std::vector<Bvh> trees;
  const auto count = soup.triangles.size();
  for (std::size_t i = 0; i < parts; ++i) {
    const auto first = i * count / parts, last = (i + 1) * count / parts;
    if (first == last) continue;
    trees.push_back(build_bvh(soup.positions,
                              std::span(soup.triangles).subspan(first, last - first), origin_m,
                              leaf_size));
  }
  return joined(trees);
}

}  // namespace

TEST_CASE("the flat tree holds every triangle once, inside all its boxes, and states its depth") {
  Random random(1);
  for (const int count : {1, 2, 3, 5, 8, 100, 1000}) {
    for (const int leaf_size : {1, 2, 4, 8}) {
      const std::size_t parts = GENERATE(1, 3, 700);
      INFO(count << " triangles, leaves of " << leaf_size << ", " << parts << " trees joined");
      Soup soup;
      for (int i = 0; i < count; ++i)
        soup.triangle(in_box(random, 1), in_box(random, 1), in_box(random, 1));
      const glm::dvec3 origin(0.1, 0.2, 0.3);
      const auto bvh = built_in_parts(soup, parts, origin, leaf_size);
      REQUIRE(bvh.triangles.size() == soup.triangles.size());
      CHECK(bvh.depth == real_depth(bvh));
      auto order = bvh.order;
      std::sort(order.begin(), order.end());
      for (std::size_t i = 0; i < order.size(); ++i) CHECK(order[i] == i);
      for (std::size_t i = 0; i < order.size(); ++i) {
        const auto corner = soup.positions[soup.triangles[bvh.order[i]].y] - origin;
        for (int axis = 0; axis < 3; ++axis) CHECK(bvh.triangles[i].b[axis] == float(corner[axis]));
      }
      std::vector<int> seen(order.size());
      visit(bvh, 0, [&](const float* low, const float* high, int child, int leaf_count) {
        CHECK(leaf_count <= leaf_size);
        if (low[0] > high[0]) return;  // the empty child of a tree of one leaf
        std::vector<int> inside;
        for (int i = child; i < child + leaf_count; ++i) inside.push_back(i);
        if (!leaf_count)
          visit(bvh, child, [&](const float*, const float*, int c, int n) {
            for (int i = c; i < c + n; ++i) inside.push_back(i);
          });
        for (const int i : inside) {
          const auto& t = bvh.triangles[i];
          for (const auto* p : {t.a, t.b, t.c})
            for (int axis = 0; axis < 3; ++axis)
              CHECK((p[axis] > low[axis] && p[axis] < high[axis]));
        }
        for (int i = child; i < child + leaf_count; ++i) ++seen[i];
      });
      CHECK(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
    }
  }
}

TEST_CASE("long triangles get far smaller boxes than division at the median gives") {
  Random random(6);
  Soup soup;
  for (int i = 0; i < 2000; ++i) {
    const auto from = in_box(random, 1);
    soup.triangle(from, from + in_box(random, 1), from + in_box(random, 1e-3));
  }
  // Halves of the longest axis, down to leaves of as many.
  const auto box_of = [&](std::uint32_t i, glm::dvec3& low, glm::dvec3& high) {
    for (int c = 0; c < 3; ++c) {
      low = min(low, soup.positions[soup.triangles[i][c]]);
      high = max(high, soup.positions[soup.triangles[i][c]]);
    }
  };
  const auto half_surface = [](glm::dvec3 size) {
    return size.x * size.y + size.y * size.z + size.z * size.x;
  };
  std::vector<std::uint32_t> order(soup.triangles.size());
  std::iota(order.begin(), order.end(), 0u);
  const std::function<double(std::size_t, std::size_t)> halves = [&](std::size_t from,
                                                                     std::size_t to) {
    glm::dvec3 low(INFINITY), high(-INFINITY);
    for (auto i = from; i < to; ++i) box_of(order[i], low, high);
    const double own = from == 0 && to == order.size() ? 0 : half_surface(high - low);
    if (to - from <= 4) return own;
    const auto size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto at = [&](std::size_t i) { return order.begin() + static_cast<std::ptrdiff_t>(i); };
    const auto middle = (from + to) / 2;
    std::nth_element(at(from), at(middle), at(to), [&](std::uint32_t a, std::uint32_t b) {
      return soup.positions[soup.triangles[a].x][axis] < soup.positions[soup.triangles[b].x][axis];
    });
    return own + halves(from, middle) + halves(middle, to);
  };
  double surfaces = 0;
  visit(build_bvh(soup.positions, soup.triangles, {}, 4), 0,
        [&](const float* low, const float* high, int, int) {
          surfaces += half_surface({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
        });
  CHECK(surfaces < 0.7 * halves(0, order.size()));
}

TEST_CASE(
    "joined trees cost rays less than one tree where objects lie apart, and little more else") {
  struct Row {
    double spread_m, most;
  };
  for (const auto& row : {Row{15e-3, 0.85}, Row{2.5e-3, 1.4}}) {  // measured: 0.79 and 1.30
    Random random(13);
    Soup soup;
    for (int ball = 0; ball < 12; ++ball) {
      const auto mesh = sphere(in_box(random, 2 * row.spread_m), 5e-3, 24);
      const auto first = static_cast<std::uint32_t>(soup.positions.size());
      soup.positions.insert(soup.positions.end(), mesh.positions.begin(), mesh.positions.end());
      for (const auto& t : mesh.triangles) soup.triangles.push_back(t + first);
    }
    INFO("balls of 5 mm, up to " << 2 * row.spread_m << " m off");
    CHECK(surface_cost(built_in_parts(soup, 12, {}, 4)) <
          row.most * surface_cost(build_bvh(soup.positions, soup.triangles, {}, 4)));
  }
}

TEST_CASE("crowded or coinciding triangles do not make the tree deep") {
  for (const double ratio : {0.9, 1.0}) {
    Soup soup;
    double x = 1;
    for (int i = 0; i < 600; ++i, x *= ratio)
      soup.triangle({x, 0, 0}, {x * 0.95, 0.1 * x, 0}, {x * 0.95, 0, 0.1 * x});
    const auto bvh = build_bvh(soup.positions, soup.triangles, {});
    INFO("each " << ratio << " of the one before");
    CHECK(bvh.depth <= 20);
    CHECK(bvh.depth == real_depth(bvh));
  }
}

TEST_CASE("a tree without triangles is refused") {
  CHECK_THROWS_AS(build_bvh({}, {}, {}), InputError);
  CHECK_THROWS_AS(joined({}), InputError);
}

LANES_TEST("hits in a soup with slivers, points and duplicates equal brute force, at any scale") {
  for (const double size : {1e-6, 1e-2, 1e3}) {
    INFO("size " << size);
    Random random(2);
    const auto soup = reference::soup(random, 300, size);
    const auto bvh = build_bvh(soup.positions, soup.triangles, {});
    Caster scene(device, lanes, bvh);
    check_all(scene, bvh, as_float(random_rays(random, 5003, size)), 200);
  }
}

LANES_TEST("hits in trees that were joined equal brute force") {
  Random random(12);
  const auto soup = reference::soup(random, 300, 1e-2);
  for (const std::size_t parts : {2, 7, 300}) {
    INFO(parts << " trees");
    const auto bvh = built_in_parts(soup, parts, {}, 4);
    Caster scene(device, lanes, bvh, bvh.depth);
    check_all(scene, bvh, as_float(random_rays(random, 5003, 1e-2)), 200);
  }
}

LANES_TEST("scenes of one and two triangles are hit like any other") {
  for (const int count : {1, 2}) {
    Random random(3);
    Soup soup;
    for (int i = 0; i < count; ++i) soup.triangle({-1, -1, 0.1 * i}, {2, -1, 0.2}, {-1, 2, 0.3});
    const auto bvh = build_bvh(soup.positions, soup.triangles, {});
    Caster scene(device, lanes, bvh, bvh.depth);
    check_all(scene, bvh, as_float(random_rays(random, 1001, 0.5)), 200);
  }
}

LANES_TEST("a stack of exactly the tree's depth is enough for the deepest tree") {
  Random random(4);
  const auto soup = reference::soup(random, 400, 1);
  const auto bvh = build_bvh(soup.positions, soup.triangles, {}, 1);
  Caster exact(device, lanes, bvh, bvh.depth), roomy(device, lanes, bvh);
  const auto rays = as_float(random_rays(random, 3001, 1));
  const auto a = exact.nearest(rays), b = roomy.nearest(rays);
  for (std::size_t i = 0; i < rays.size(); ++i)
    CHECK((a[i].triangle == b[i].triangle && a[i].t == b[i].t));
}

TEST_CASE("hits on closed meshes equal those of CGAL and brute force") {
  using Cartesian = CGAL::Simple_cartesian<double>;
  using Triangles = std::vector<Cartesian::Triangle_3>;
#if __has_include(<CGAL/AABB_traits_3.h>)
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits_3<
      Cartesian, CGAL::AABB_triangle_primitive_3<Cartesian, Triangles::const_iterator>>>;
#else
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<
      Cartesian, CGAL::AABB_triangle_primitive<Cartesian, Triangles::const_iterator>>>;
#endif
  const auto point = [](const float* p) { return Cartesian::Point_3(p[0], p[1], p[2]); };

  Random random(5);
  for (const auto& mesh : {sphere({0, 0, 0}, 5e-3, 24), torus(5e-3)}) {
    const auto bvh = build_bvh(mesh.positions, mesh.triangles, {});
    Triangles corners;
    for (const auto& t : bvh.triangles) corners.emplace_back(point(t.a), point(t.b), point(t.c));
    Tree tree(corners.begin(), corners.end());
    std::vector<Ray> rays;
    for (int i = 0; i < 4001; ++i) {
      const auto origin = 1e-2 * unit_vector(random);
      rays.push_back({origin, normalize(in_box(random, 4e-3) - origin), 0, 1});
    }
    rays = as_float(rays);
    on_every_device([&](const raywave::cl::Device& device, int lanes) {
      Caster scene(device, lanes, bvh);
      check_all(scene, bvh, rays, 1000);
      const auto hits = scene.nearest(rays);
      int disagreements = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const auto& o = rays[i].origin;
        const auto& d = rays[i].direction;
        const auto found = tree.first_intersected_primitive(
            Cartesian::Ray_3({o.x, o.y, o.z}, Cartesian::Vector_3(d.x, d.y, d.z)));
        const int theirs = found ? static_cast<int>(*found - corners.begin()) : -1;
        if (theirs == hits[i].triangle) continue;
        const bool same_place =
            theirs >= 0 &&
            std::abs(
                reference::intersect(bvh.triangles[theirs], rays[i], reference::float_sideways).t -
                hits[i].t) < 1e-8;
        disagreements += !same_place;
      }
      CHECK(disagreements <= 1);
    });
  }
}

LANES_TEST("no ray of a million slips through edges and vertices of closed meshes") {
  for (const double size : {5e-3, 1.0}) {
    for (const auto& mesh : {sphere({0, 0, 0}, size, 24), torus(size)}) {
      Random random(6);
      const auto bvh = build_bvh(mesh.positions, mesh.triangles, {});
      Caster scene(device, lanes, bvh);
      std::size_t missed = 0, behind = 0;
      for (const auto& hit : scene.nearest(rays_at_edges(random, bvh.triangles, 250'000, size))) {
        missed += hit.triangle < 0;
        behind += !(hit.t <= 1 + 1e-5);
      }
      CHECK(missed == 0);
      CHECK(behind == 0);  // through a crack to the far side
    }
  }
}

LANES_TEST("a ray that passes a needle's tip in line with it is no hit") {
  // Needles thinner than rounding: their two long sides, each widened, meet far past the tip. All
  // share one leaf, so no box but their own keeps the rays out; two specks at its corners make it
  // large.
  Random random(9);
  for (int round = 0; round < 20; ++round) {
    Soup soup;
    std::vector<Ray> rays;
    for (int i = 0; i < 6; ++i) {
      const auto a = in_box(random, 1), b = a + 0.3 * unit_vector(random);
      soup.triangle(a, b, a + (b - a) * 0.25);
      for (int k = 0; k < 50; ++k) {
        const auto past_tip = a + (b - a) * uniform(random, 1.1, 2);
        const auto direction = normalize(cross(b - a, unit_vector(random)));
        rays.push_back({past_tip - 3.0 * direction, direction, 0, 10});
      }
    }
    for (const double corner : {-4.0, 4.0})
      soup.triangle(glm::dvec3(corner), glm::dvec3(corner, corner, 0.99 * corner),
                    glm::dvec3(0.99 * corner));
    const auto bvh = build_bvh(soup.positions, soup.triangles, {}, 8);
    Caster scene(device, lanes, bvh);
    for (const auto& hit : scene.nearest(rays)) CHECK(hit.triangle == -1);
  }
}

LANES_TEST("axis-parallel rays in the planes of a grid's edges hit it") {
  // A flat square of 16 x 16 cells whose corners are exact in float; rays run exactly through the
  // lines, and the edge counts too.
  Soup soup;
  const int n = 16;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double x = i - n / 2, y = j - n / 2;
      soup.triangle({x, y, 0}, {x + 1, y, 0}, {x + 1, y + 1, 0});
      soup.triangle({x, y, 0}, {x + 1, y + 1, 0}, {x, y + 1, 0});
    }
  }
  const auto bvh = build_bvh(soup.positions, soup.triangles, {});
  std::vector<Ray> rays;
  for (int j = 0; j <= 2 * n; ++j)
    for (int i = 0; i <= 2 * n; ++i)
      for (const double sign : {-1.0, 1.0})
        rays.push_back({{0.5 * i - n / 2, 0.5 * j - n / 2, -3 * sign}, {-0.0, 0.0, sign}, 0, 100});
  Caster scene(device, lanes, bvh);
  for (const auto& hit : scene.nearest(rays)) CHECK((hit.triangle >= 0 && hit.t == 3));
}

LANES_TEST("t_min and t_max cut the ray") {
  Soup soup;
  for (const double z : {1.0, 2.0, 3.0}) soup.triangle({-1, -1, z}, {1, -1, z}, {0, 1, z});
  const auto bvh = build_bvh(soup.positions, soup.triangles, {});
  struct Case {
    double t_min, t_max, t;
  };
  const std::vector<Case> cases{{0, 9, 1}, {1.5, 9, 2}, {1, 9, 2},   {2.5, 9, 3}, {3, 9, 0},
                                {0, 1, 0}, {1, 2, 0},   {0, 0.5, 0}, {4, 9, 0},   {2, 1, 0}};
  std::vector<Ray> rays;
  for (const auto& c : cases) rays.push_back({{0, 0, 0}, {0, 0, 1}, c.t_min, c.t_max});
  Caster scene(device, lanes, bvh);
  const auto hits = scene.nearest(rays);
  const auto occluded = scene.occluded(rays);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    INFO(cases[i].t_min << " to " << cases[i].t_max);
    CHECK(hits[i].t == (cases[i].t > 0 ? cases[i].t : float(cases[i].t_max)));
    CHECK((hits[i].triangle >= 0) == (cases[i].t > 0));
    CHECK(occluded[i] == (cases[i].t > 0));
  }
}

LANES_TEST("a mesh one kilometre away is hit as if it stood at the origin") {
  Random random(7);
  const auto near = torus(5e-3);
  auto far = near;
  const glm::dvec3 origin(1000, -1000, 1000);
  for (auto& p : far.positions) p += origin;
  const auto far_bvh = build_bvh(far.positions, far.triangles, origin),
             near_bvh = build_bvh(near.positions, near.triangles, {});
  // Doubles resolve 1e-13 m there.
  std::vector<Ray> rays;
  for (int i = 0; i < 2001; ++i) {
    const auto from = 1e-2 * unit_vector(random);
    rays.push_back({from, normalize(in_box(random, 4e-3) - from), 0, 1});
  }
  Caster far_scene(device, lanes, far_bvh), near_scene(device, lanes, near_bvh);
  const auto a = far_scene.nearest(rays), b = near_scene.nearest(rays);
  int different = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) different += !(std::abs(a[i].t - b[i].t) < 1e-8);
  CHECK(different <= 2);  // silhouettes
}

LANES_TEST("the distance of a hit is accurate to float rounding") {
  // Near-parallel rays onto a tilted, bumpy surface, as from a wavefront recording plane; rms of
  // the error against double.
  struct Case {
    double distance, rms;
  };
  // A float holds 5 mm to 0.13 nm rms, 100 mm to 2.2 nm, 1 m to 17 nm; the corner's difference
  // from the origin, the blend and t itself are each rounded to that. Measured on PoCL: 0.145,
  // 3.97 and 29.6 nm.
  for (const auto& c : {Case{5e-3, 0.2e-9}, Case{0.1, 5e-9}, Case{1, 40e-9}}) {
    Random random(8);
    const auto mesh = torus(5e-3);
    const auto bvh = build_bvh(mesh.positions, mesh.triangles, {});
    Caster scene(device, lanes, bvh);
    std::vector<Ray> rays;
    for (int i = 0; i < 20000; ++i) {
      const auto p = in_box(random, 4e-3);
      rays.push_back(
          {{p.x, p.y, -c.distance},
           normalize(glm::dvec3(uniform(random, -0.05, 0.05), uniform(random, -0.05, 0.05), 1)),
           0,
           10});
    }
    rays = as_float(rays);
    const auto hits = scene.nearest(rays);
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i].triangle < 0) continue;
      const auto exact = reference::intersect(bvh.triangles[hits[i].triangle], rays[i]);
      if (exact.triangle < 0) continue;
      sum += std::pow(hits[i].t - exact.t, 2);
      ++count;
    }
    const double rms = std::sqrt(sum / count);
    UNSCOPED_INFO(c.distance << " m: " << rms * 1e9 << " nm rms over " << count << " hits");
    CHECK(rms < c.rms);
  }
}
