// SPDX-License-Identifier: Apache-2.0
// What a tree's builder is worth to rays: CGAL's median split, which raywave uses, against a
// surface-area heuristic in 32 bins and, as a yardstick, Embree's builder. All become the same flat
// tree, which the device walks in packets (kernels/scene/bvh.h).
//
// usage: bench_trees TEAPOT.ply [DEVICE] Prints a table in Markdown: seconds of processor time to
// build, the expected cost of a random line (boxes' pairs and triangles that it meets), and
// nanoseconds of processor time per ray, for rays from the hologram's centre to their nearest hits
// and for rays from there to the hologram's window.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <random>

#include "cl/program.hpp"
#include "host/evaluate/selftest/ray_caster.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/geometry/bvh.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/geometry/world.hpp"
#include "host/reference/surfaces.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {
namespace {

using glm::dvec3;

struct Box {
  dvec3 min{INFINITY}, max{-INFINITY};
  void add(const Box& b) {
    min = glm::min(min, b.min);
    max = glm::max(max, b.max);
  }
  double half_surface() const {
    const auto s = glm::max(max - min, dvec3(0));
    return s.x * s.y + s.y * s.z + s.z * s.x;
  }
};

/// A tree as builders make it.
struct Node {
  Box box;
  Node* children[2] = {nullptr, nullptr};
  unsigned triangles[8] = {};
  unsigned count = 0;
};

struct Soup {
  std::vector<dvec3> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<Box> boxes() const {
    std::vector<Box> all;
    for (const auto& t : triangles) {
      Box b;
      for (int i = 0; i < 3; ++i) b.add({positions[t[i]], positions[t[i]]});
      all.push_back(b);
    }
    return all;
  }
};

constexpr unsigned leaf_size = 4;

/// Binned surface-area heuristic: a box's pair costs as much as a triangle.
class Binned {
public:
  explicit Binned(const std::vector<Box>& boxes) : boxes_(boxes), order_(boxes.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
  }
  Node* build() { return build(0, order_.size()); }

private:
  static constexpr std::size_t bins = 32;

  Node* build(std::size_t from, std::size_t to) {
    nodes_.push_back(std::make_unique<Node>());
    auto* node = nodes_.back().get();
    Box centres;
    for (auto i = from; i < to; ++i) {
      const auto& b = boxes_[order_[i]];
      node->box.add(b);
      const auto c = (b.min + b.max) / 2.0;
      centres.add({c, c});
    }
    const auto count = to - from;
    double best =
        count <= leaf_size ? static_cast<double>(count) * node->box.half_surface() : INFINITY;
    int best_axis = -1;
    std::size_t best_bin = 0;
    for (int axis = 0; axis < 3 && count > 1; ++axis) {
      const double extent = centres.max[axis] - centres.min[axis];
      if (!(extent > 0)) continue;
      Box boxes[bins];
      double counts[bins] = {};
      for (auto i = from; i < to; ++i) {
        const auto bin = bin_of(order_[i], axis, centres);
        boxes[bin].add(boxes_[order_[i]]);
        ++counts[bin];
      }
      double right_cost[bins] = {}, n = 0;
      Box box;
      for (auto b = bins; b-- > 1;) {
        box.add(boxes[b]);
        n += counts[b];
        right_cost[b] = n > 0 ? n * box.half_surface() : INFINITY;
      }
      box = {};
      n = 0;
      for (std::size_t b = 0; b + 1 < bins; ++b) {
        box.add(boxes[b]);
        n += counts[b];
        const double cost = node->box.half_surface() + (n > 0 ? n * box.half_surface() : INFINITY) +
                            right_cost[b + 1];
        if (cost >= best) continue;
        best = cost;
        best_axis = axis;
        best_bin = b;
      }
    }
    if (best_axis < 0 && count <= leaf_size) {
      for (auto i = from; i < to; ++i) node->triangles[node->count++] = order_[i];
      return node;
    }
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    auto middle = from + count / 2;
    if (best_axis >= 0) {
      const auto split = std::partition(
          at(from), at(to), [&](unsigned t) { return bin_of(t, best_axis, centres) <= best_bin; });
      middle = static_cast<std::size_t>(split - order_.begin());
    }
    node->children[0] = build(from, middle);
    node->children[1] = build(middle, to);
    return node;
  }

  std::size_t bin_of(unsigned t, int axis, const Box& centres) const {
    const double c = (boxes_[t].min[axis] + boxes_[t].max[axis]) / 2;
    const double share = (c - centres.min[axis]) / (centres.max[axis] - centres.min[axis]);
    return std::min(static_cast<std::size_t>(share * bins), bins - 1);
  }

  const std::vector<Box>& boxes_;
  std::vector<unsigned> order_;
  std::vector<std::unique_ptr<Node>> nodes_;
};

/// Embree's builder, by its surface-area heuristic.
class Embree {
public:
  explicit Embree(const std::vector<Box>& boxes)
      : device_(rtcNewDevice("threads=1")), bvh_(rtcNewBVH(device_)) {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const glm::vec3 low(boxes[i].min), high(boxes[i].max);
      RTCBuildPrimitive p{};
      p.lower_x = low.x, p.lower_y = low.y, p.lower_z = low.z;
      p.upper_x = high.x, p.upper_y = high.y, p.upper_z = high.z;
      p.geomID = 0, p.primID = static_cast<unsigned>(i);
      primitives_.push_back(p);
    }
  }
  ~Embree() {
    rtcReleaseBVH(bvh_);
    rtcReleaseDevice(device_);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

  Node* build() {
    auto how = rtcDefaultBuildArguments();
    how.byteSize = sizeof how;
    how.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
    how.maxBranchingFactor = 2;
    how.maxDepth = 60;
    how.sahBlockSize = 1;
    how.minLeafSize = 1;
    how.maxLeafSize = leaf_size;
    how.traversalCost = 1;
    how.intersectionCost = 1;
    how.bvh = bvh_;
    how.primitives = primitives_.data();
    how.primitiveCount = how.primitiveArrayCapacity = primitives_.size();
    how.createNode = [](RTCThreadLocalAllocator memory, unsigned, void*) -> void* {
      return new (rtcThreadLocalAlloc(memory, sizeof(Node), alignof(Node))) Node;
    };
    how.setNodeChildren = [](void* node, void** children, unsigned count, void*) {
      for (unsigned i = 0; i < count; ++i)
        static_cast<Node*>(node)->children[i] = static_cast<Node*>(children[i]);
    };
    how.setNodeBounds = [](void*, const RTCBounds**, unsigned, void*) {};
    how.createLeaf = [](RTCThreadLocalAllocator memory, const RTCBuildPrimitive* of,
                        std::size_t count, void*) -> void* {
      auto* node = new (rtcThreadLocalAlloc(memory, sizeof(Node), alignof(Node))) Node;
      for (std::size_t i = 0; i < count; ++i) node->triangles[node->count++] = of[i].primID;
      return node;
    };
    return static_cast<Node*>(rtcBuildBVH(&how));
  }

private:
  RTCDevice device_;
  RTCBVH bvh_;
  std::vector<RTCBuildPrimitive> primitives_;
};

Box fit(Node& node, const std::vector<Box>& boxes) {
  node.box = {};
  for (unsigned i = 0; i < node.count; ++i) node.box.add(boxes[node.triangles[i]]);
  for (auto* child : node.children) {
    if (child) node.box.add(fit(*child, boxes));
  }
  return node.box;
}

/// The flat tree of raywave's kernels.
class Flat {
public:
  Flat(const Soup& soup, double margin_m) : soup_(soup), margin_m_(margin_m) {}
  Bvh of(const Node& root) {
    put(root, 1);
    return std::move(bvh_);
  }

private:
  struct Child {
    glm::vec3 min, max;
    int child, count;
  };
  Child put(const Node& node, int depth) {
    Child result{glm::vec3(node.box.min - margin_m_), glm::vec3(node.box.max + margin_m_), 0,
                 static_cast<int>(node.count)};
    if (node.count > 0) {
      result.child = static_cast<int>(bvh_.triangles.size());
      for (unsigned i = 0; i < node.count; ++i) {
        const auto corners = soup_.triangles[node.triangles[i]];
        Corners t;
        for (int axis = 0; axis < 3; ++axis) {
          t.a[axis] = static_cast<float>(soup_.positions[corners.x][axis]);
          t.b[axis] = static_cast<float>(soup_.positions[corners.y][axis]);
          t.c[axis] = static_cast<float>(soup_.positions[corners.z][axis]);
        }
        bvh_.triangles.push_back(t);
      }
      return result;
    }
    const auto place = bvh_.nodes.size();
    result.child = static_cast<int>(place);
    bvh_.depth = std::max(bvh_.depth, depth);
    bvh_.nodes.emplace_back();
    const auto left = put(*node.children[0], depth + 1), right = put(*node.children[1], depth + 1);
    auto& flat = bvh_.nodes[place];
    std::copy_n(&left.min.x, 3, flat.left_min);
    std::copy_n(&left.max.x, 3, flat.left_max);
    std::copy_n(&right.min.x, 3, flat.right_min);
    std::copy_n(&right.max.x, 3, flat.right_max);
    flat.left_child = left.child, flat.left_count = left.count, flat.right_child = right.child,
    flat.right_count = right.count;
    return result;
  }

  const Soup& soup_;
  double margin_m_;
  Bvh bvh_;
};

/// Of a random line that meets the whole: pairs of boxes that it is tested against, and triangles.
std::pair<double, double> expected(const Bvh& bvh) {
  double pairs = 1, triangles = 0;
  Box whole;
  for (std::size_t n = 0; n < bvh.nodes.size(); ++n) {
    const auto& node = bvh.nodes[n];
    const auto add = [&](const float* min, const float* max, int count) {
      const Box box{{min[0], min[1], min[2]}, {max[0], max[1], max[2]}};
      if (n == 0) whole.add(box);
      (count > 0 ? triangles : pairs) += box.half_surface() / 1.0 * (count > 0 ? count : 1);
    };
    if (n == 0) pairs = 0;
    add(node.left_min, node.left_max, node.left_count);
    add(node.right_min, node.right_max, node.right_count);
  }
  return {1 + pairs / whole.half_surface(), triangles / whole.half_surface()};
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

// The hologram: its centre's distance, half its sides
constexpr double eye_z = -0.1, window_x = 3.6e-3, window_y = 2e-3;
constexpr std::size_t side = 1024;

/// Processor nanoseconds per ray of primary and visibility rays.
std::pair<double, double> ray_ns(const cl::Device& device, const Bvh& bvh) {
  const auto lanes = static_cast<std::size_t>(lanes_for(device.info()));
  const cl::Program program(device, "kernels/instruments/intersect.cl",
                            {{option::lanes, std::to_string(lanes)}, {option::bvh_depth, "64"}});
  const auto tree = selftest::upload(device, bvh);
  constexpr std::size_t count = side * side;
  std::vector<float> rays(8 * count), back(8 * count);
  const auto put = [&](std::vector<float>& all, std::size_t i, dvec3 from, dvec3 to, double t_max) {
    const auto d = to - from;
    const double values[] = {from.x, from.y, from.z, d.x, d.y, d.z, 1e-3, t_max};
    for (std::size_t k = 0; k < 8; ++k) all[k * count + i] = static_cast<float>(values[k]);
  };
  const auto target = [](std::size_t i) {
    return dvec3((static_cast<double>(i % side) + 0.5) / side - 0.5,
                 (static_cast<double>(i / side) + 0.5) / side - 0.5, 0) *
           12.5e-3;
  };
  for (std::size_t i = 0; i < count; ++i) put(rays, i, {0, 0, eye_z}, target(i), 2);
  const cl::Buffer<std::int32_t> found(device, count, "triangle");
  const cl::Buffer<float> t_u_v(device, 3 * count, "t, u, v");
  const auto timed = [&](const char* kernel, const cl::Buffer<float>& planes, auto&&... out) {
    std::vector<double> ns;
    for (int i = 0; i < 6; ++i) {
      const Stopwatch watch;
      program.kernel(kernel).run({count / lanes}, {8}, tree.arguments(), planes,
                                 static_cast<std::int32_t>(count), out...);
      device.finish();
      if (i > 0) ns.push_back(1e9 * watch.processor_s() / count);
    }
    return median(ns);
  };
  const double primary =
      timed("intersect_nearest", {device, std::span<const float>(rays), "rays"}, found, t_u_v);
  const auto hits = found.read();
  const auto t = t_u_v.read();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (std::size_t i = 0; i < count; ++i) {
    const auto at =
        dvec3(0, 0, eye_z) + (target(i) - dvec3(0, 0, eye_z)) * double{hits[i] >= 0 ? t[i] : 1.0f};
    put(back, i, at, {window_x * uniform(random), window_y * uniform(random), eye_z},
        hits[i] >= 0 ? 1.0 : 0.0);
  }
  return {primary, timed("intersect_any", {device, std::span<const float>(back), "rays"}, found)};
}

/// Into the box of 12.5 mm about the origin.
Soup fitted(std::vector<dvec3> positions, std::vector<glm::uvec3> triangles) {
  Box box;
  for (const auto& p : positions) box.add({p, p});
  const auto size = box.max - box.min;
  for (auto& p : positions)
    p = (p - (box.min + box.max) / 2.0) * (12.5e-3 / std::max({size.x, size.y, size.z}));
  return {std::move(positions), std::move(triangles)};
}

Soup slivers(std::size_t count) {
  Soup soup;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return dvec3(normal(random), normal(random), normal(random)); };
  for (std::size_t i = 0; i < count; ++i) {
    const auto from = vector(), along = glm::normalize(vector()),
               aside = glm::normalize(vector()) * 1e-3;
    const auto first = static_cast<unsigned>(soup.positions.size());
    for (const auto& p : {from, from + along, from + along + aside}) soup.positions.push_back(p);
    soup.triangles.emplace_back(first, first + 1, first + 2);
  }
  return fitted(std::move(soup.positions), std::move(soup.triangles));
}

void compare(const cl::Device& device, const char* name, const Soup& soup) {
  const auto boxes = soup.boxes();
  const auto line = [&](const char* builder, double build_s, const Bvh& bvh) {
    const auto [pairs, triangles] = expected(bvh);
    const auto [nearest_ns, any_ns] = ray_ns(device, bvh);
    std::printf("| %s | %s | %.3g | %.1f | %.1f | %.1f | %.0f | %.0f |\n", name, builder, build_s,
                pairs, triangles, pairs + triangles, nearest_ns, any_ns);
    std::fflush(stdout);
  };
  for (const int leaf : {2, 4}) {
    const Stopwatch watch;
    const auto bvh = build_bvh(soup.positions, soup.triangles, {}, leaf);
    const double s = watch.processor_s();
    line(leaf == 2 ? "CGAL, leaves of 2" : "CGAL, leaves of 4", s, bvh);
  }
  const auto made = [&](const char* builder, auto&& maker) {
    const Stopwatch watch;
    auto* root = maker.build();
    fit(*root, boxes);
    const auto bvh = Flat(soup, box_margin_m(6.25e-3)).of(*root);
    line(builder, watch.processor_s(), bvh);
  };
  made("surface area, 32 bins", Binned(boxes));
  made("Embree", Embree(boxes));
}

}  // namespace
}  // namespace raywave

int main(int argc, char** argv) {
  using namespace raywave;
  if (argc < 2) {
    std::fprintf(stderr, "usage: bench_trees TEAPOT.ply [DEVICE]\n");
    return 2;
  }
  const raywave::cl::Device device(
      raywave::cl::list_devices().at(argc > 2 ? static_cast<std::size_t>(std::stoul(argv[2])) : 0));
  std::printf(
      "| scene | builder | build, s | boxes | triangles | cost | nearest, ns | any, ns "
      "|\n|---|---|---|---|---|---|---|---|\n");
  const auto teapot = load_mesh(argv[1], Normals::smooth, "bench_trees");
  compare(device, "teapot, 16 thousand", fitted(teapot.positions, teapot.triangles));
  const auto ball = reference::sphere({0, 0, 0}, 1, 500);
  compare(device, "sphere, 1 million", fitted(ball.positions, ball.triangles));
  compare(device, "slivers, 100 thousand", slivers(100'000));
}
