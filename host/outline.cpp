// SPDX-License-Identifier: Apache-2.0
// Loops over lanes, which the compiler makes vectors of: frames of a scene that moves wait for these passes.
#include "host/outline.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "cl/threads.hpp"

// The binary is not built for the CPU that it runs on. Results are the same on all: nothing is contracted.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define RAYWAVE_FOR_SEVERAL_CPUS [[gnu::target_clones("avx512f", "avx2", "default")]]
#else
#define RAYWAVE_FOR_SEVERAL_CPUS
#endif

namespace raywave {
namespace {

constexpr std::size_t lanes = 8;
constexpr std::size_t at_once = 1 << 13;  // vertices or triangles that a thread takes, a multiple of lanes

/// Numbers side by side.
struct Lanes {
  double v[lanes];
  explicit Lanes(double value) { std::fill_n(v, lanes, value); }
  double smallest() const { return *std::min_element(v, v + lanes); }
  double largest() const { return *std::max_element(v, v + lanes); }
  double sum() const {
    double all = 0;
    for (const double one : v) all += one;
    return all;
  }
};

struct Seen {
  double distance_m, half_m[2], steepest[2];  // steepest: tangents
  double wider;
};

/// Of the vertices, and the last of them in place of those that are missing to whole lanes.
RAYWAVE_FOR_SEVERAL_CPUS Outline outline_of_range(const glm::dvec3* positions, std::size_t count, const Seen& seen) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  Lanes low[4] = {Lanes(infinite), Lanes(infinite), Lanes(infinite), Lanes(infinite)};
  Lanes high[6] = {Lanes(-infinite), Lanes(-infinite), Lanes(-infinite), Lanes(-infinite), Lanes(-infinite), Lanes(-infinite)};
  for (std::size_t first = 0; first < count; first += lanes) {
    double p[3][lanes];
    for (std::size_t i = 0; i < lanes; ++i) {
      const auto& vertex = positions[std::min(first + i, count - 1)];
      p[0][i] = vertex.x;
      p[1][i] = vertex.y;
      p[2][i] = vertex.z;
    }
    for (int axis = 0; axis < 2; ++axis) {
      for (std::size_t i = 0; i < lanes; ++i) {
        const double x = p[axis][i], z = p[2][i], tangent = x / z;
        const double share = (z - seen.distance_m) / z;  // of the way from the surface to the hologram
        const double centre = x - x * share, reach = seen.half_m[axis] * std::abs(share);
        const double beyond = std::abs(x) + seen.wider * seen.half_m[axis] - seen.steepest[axis] * z;
        const double from = centre - reach, to = centre + reach;
        double &tangent_low = low[axis].v[i], &tangent_high = high[axis].v[i], &from_low = low[2 + axis].v[i],
               &to_high = high[2 + axis].v[i], &most_beyond = high[4 + axis].v[i];
        tangent_low = tangent < tangent_low ? tangent : tangent_low;
        tangent_high = tangent > tangent_high ? tangent : tangent_high;
        from_low = from < from_low ? from : from_low;
        to_high = to > to_high ? to : to_high;
        most_beyond = beyond > most_beyond ? beyond : most_beyond;
      }
    }
  }
  Outline outline{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    outline.tangents[axis] = {low[axis].smallest(), high[axis].largest()};
    outline.passed[axis] = {low[2 + axis].smallest(), high[2 + axis].largest()};
    outline.steepest[axis] = high[4 + axis].largest();
  }
  return outline;
}

/// Of an object's surfaces: one side, or the other. Areas as the hologram sees them, and depths weighted with them.
struct Sides {
  double weight[2] = {0, 0}, sum[2] = {0, 0};
  double middle(int side) const { return weight[side] > 0 ? sum[side] / weight[side] : std::numeric_limits<double>::infinity(); }
};

std::size_t facet_count(const World& world) { return world.facets.empty() ? world.triangles.size() : world.facets.size(); }
Facet facet_of(const World& world, std::size_t i) {
  return world.facets.empty() ? Facet{static_cast<std::uint32_t>(i), 1} : world.facets[i];
}

RAYWAVE_FOR_SEVERAL_CPUS Sides sides_of_range(const World& world, std::size_t from, std::size_t to) {
  Lanes weight[2] = {Lanes(0), Lanes(0)}, sum[2] = {Lanes(0), Lanes(0)};
  for (std::size_t first = from; first < to; first += lanes) {
    double a[3][lanes], b[3][lanes], c[3][lanes], share[lanes];
    for (std::size_t i = 0; i < lanes; ++i) {
      const auto facet = facet_of(world, std::min(first + i, to - 1));
      const auto t = world.triangles[facet.triangle];
      const auto &pa = world.positions[t.x], &pb = world.positions[t.y], &pc = world.positions[t.z];
      share[i] = first + i < to ? facet.share : 0;
      for (int axis = 0; axis < 3; ++axis) {
        a[axis][i] = pa[axis];
        b[axis][i] = pb[axis];
        c[axis][i] = pc[axis];
      }
    }
    for (std::size_t i = 0; i < lanes; ++i) {
      const double ux = b[0][i] - a[0][i], uy = b[1][i] - a[1][i], uz = b[2][i] - a[2][i];
      const double vx = c[0][i] - a[0][i], vy = c[1][i] - a[1][i], vz = c[2][i] - a[2][i];
      const double x = a[0][i] + b[0][i] + c[0][i], y = a[1][i] + b[1][i] + c[1][i],
                   z = a[2][i] + b[2][i] + c[2][i];  // of the centre, tripled
      const double toward = (uy * vz - uz * vy) * x + (uz * vx - ux * vz) * y + (ux * vy - uy * vx) * z;
      const double depth_weight = share[i] * std::abs(toward) / z, area = depth_weight / z;
      const bool other = toward < 0;
      weight[0].v[i] += other ? 0.0 : area;
      weight[1].v[i] += other ? area : 0.0;
      sum[0].v[i] += other ? 0.0 : depth_weight;
      sum[1].v[i] += other ? depth_weight : 0.0;
    }
  }
  Sides sides;
  for (int side = 0; side < 2; ++side) {
    sides.weight[side] = weight[side].sum();
    sides.sum[side] = sum[side].sum() / 3;
  }
  return sides;
}

}  // namespace

Outline outline_of(const World& world, double distance_m, glm::dvec2 window_m, double wider, glm::dvec2 largest_tangent) {
  const Seen seen{distance_m, {window_m.x / 2, window_m.y / 2}, {largest_tangent.x, largest_tangent.y}, wider};
  const auto count = world.positions.size();
  std::vector<Outline> ranges((count + at_once - 1) / at_once);
  cl::Threads::shared().for_ranges(count, at_once, [&](std::size_t, std::size_t from, std::size_t to) {
    ranges[from / at_once] = outline_of_range(world.positions.data() + from, to - from, seen);
  });
  Outline all = ranges.at(0);
  for (const auto& range : ranges) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      for (const auto& [whole, part] : {std::pair{&all.tangents[axis], &range.tangents[axis]}, {&all.passed[axis], &range.passed[axis]}}) {
        whole->add(part->low);
        whole->add(part->high);
      }
      all.steepest[axis] = std::max(all.steepest[axis], range.steepest[axis]);
    }
  }
  return all;
}

double middle_of_surfaces(const World& world) {
  // Parts of ranges that belong to one object; added in order, for the same sum every time.
  struct Part {
    std::size_t object;
    Sides sides;
  };
  const auto count = facet_count(world);
  std::vector<std::vector<Part>> ranges((count + at_once - 1) / at_once);
  const auto object_at = [&](std::size_t i) { return static_cast<std::size_t>(world.triangle_object[facet_of(world, i).triangle]); };
  cl::Threads::shared().for_ranges(count, at_once, [&](std::size_t, std::size_t from, std::size_t to) {
    while (from < to) {
      const auto object = object_at(from);
      auto end = from + 1;
      while (end < to && object_at(end) == object) ++end;
      ranges[from / at_once].push_back({object, sides_of_range(world, from, end)});
      from = end;
    }
  });
  std::vector<Sides> objects(world.object_closed.size());
  for (const auto& range : ranges) {
    for (const auto& part : range) {
      for (int side = 0; side < 2; ++side) {
        objects[part.object].weight[side] += part.sides.weight[side];
        objects[part.object].sum[side] += part.sides.sum[side];
      }
    }
  }
  double sum = 0, weight = 0;
  for (const auto& sides : objects) {
    const int near = sides.middle(0) < sides.middle(1) ? 0 : 1;
    sum += sides.sum[near];
    weight += sides.weight[near];
  }
  const double middle = sum / weight;
  return std::isfinite(middle) ? middle : (world.min_m.z + world.max_m.z) / 2;
}

}  // namespace raywave
