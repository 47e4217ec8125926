// SPDX-License-Identifier: Apache-2.0
// Loops over lanes, which the compiler makes vectors of: frames of a scene that moves wait for these passes.
#include "host/outline.hpp"

#include <cmath>
#include <glm/geometric.hpp>
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
constexpr int depth_bins = 256;  // of a scene's depth, for the choice of slabs

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
  double distance_m, centre_m[2], half_m[2], largest_tangent[2];
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
        const double off_centre = x - seen.centre_m[axis], centre = x - off_centre * share, reach = seen.half_m[axis] * std::abs(share);
        const double beyond = std::abs(off_centre) + seen.wider * seen.half_m[axis] - seen.largest_tangent[axis] * z;
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
  Outline outline;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    outline.tangents[axis] = {low[axis].smallest(), high[axis].largest()};
    outline.passed[axis] = {low[2 + axis].smallest(), high[2 + axis].largest()};
    outline.beyond_m[axis] = high[4 + axis].largest();
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

/// Middle of the near sides of all objects.
double middle_of_surfaces(const World& world) {
  // Parts of ranges that belong to one object; added in order, for the same sum every time.
  struct Part {
    std::size_t object;
    Sides sides;
  };
  const auto count = facet_count(world);
  std::vector<std::vector<Part>> ranges((count + cl::Threads::range - 1) / cl::Threads::range);
  const auto object_at = [&](std::size_t i) { return static_cast<std::size_t>(world.triangle_object[facet_of(world, i).triangle]); };
  cl::Threads::shared().for_ranges(count, [&](std::size_t, std::size_t from, std::size_t to) {
    while (from < to) {
      const auto object = object_at(from);
      auto end = from + 1;
      while (end < to && object_at(end) == object) ++end;
      ranges[from / cl::Threads::range].push_back({object, sides_of_range(world, from, end)});
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

/// Area of surfaces by depth, in bins of equal depth: how much of it, and its mean depth times that.
class DepthHistogram {
public:
  DepthHistogram(double near_m, double far_m) : near_m_(near_m), bin_m_((far_m - near_m) / depth_bins) {}

  /// A triangle of that area, evenly lit: its share beyond a depth falls as the square of what is left to its ends.
  void add(std::array<double, 3> z_m, double area) {
    std::sort(z_m.begin(), z_m.end());
    const auto bin = [&](double z) { return bin_m_ > 0 ? std::clamp(static_cast<int>((z - near_m_) / bin_m_), 0, depth_bins - 1) : 0; };
    const int first = bin(z_m[0]), last = bin(z_m[2]);
    std::pair<double, double> before{0, 0};
    for (int i = first; i <= last; ++i) {
      const auto up_to = i == last ? std::pair{1.0, (z_m[0] + z_m[1] + z_m[2]) / 3} : moments_before(z_m, near_m_ + (i + 1) * bin_m_);
      const double share = std::max(0.0, up_to.first - before.first), begin_m = near_m_ + i * bin_m_;
      area_[static_cast<std::size_t>(i)] += area * share;
      // Of next to nothing, rounding would put the mean anywhere.
      area_depth_[static_cast<std::size_t>(i)] +=
          area * std::clamp(up_to.second - before.second, share * begin_m, share * (begin_m + bin_m_));
      before = up_to;
    }
  }

  void add(const DepthHistogram& other) {
    for (std::size_t i = 0; i < area_.size(); ++i) {
      area_[i] += other.area_[i];
      area_depth_[i] += other.area_depth_[i];
    }
  }

  /// Infinite without any area.
  double mean() const { return mean_between(0, depth_bins); }

  /// Means of `count` slabs, or of as many as have area, between which the sum of area times squared distance to the mean is least.
  std::vector<double> means(int count) const {
    // least[i]: of the first i bins in as many slabs as the round says; from[round][i]: where the last of these begins.
    std::vector<double> least(static_cast<std::size_t>(depth_bins) + 1, std::numeric_limits<double>::infinity());
    least[0] = 0;
    std::vector<std::vector<int>> from;
    for (int round = 0; round < count; ++round) {
      std::vector<double> next(least.size(), std::numeric_limits<double>::infinity());
      from.emplace_back(least.size(), 0);
      for (int end = round + 1 < count ? 1 : depth_bins; end <= depth_bins; ++end) {
        Sums slab;
        for (int begin = end - 1; begin >= 0; --begin) {
          slab.add(area_[static_cast<std::size_t>(begin)], area_depth_[static_cast<std::size_t>(begin)]);
          const double sum = least[static_cast<std::size_t>(begin)] + slab.square();
          if (!(sum < next[static_cast<std::size_t>(end)])) continue;
          next[static_cast<std::size_t>(end)] = sum;
          from.back()[static_cast<std::size_t>(end)] = begin;
        }
      }
      least = std::move(next);
    }
    std::vector<double> all;
    for (int end = depth_bins, round = count - 1; round >= 0; --round) {
      const int begin = from[static_cast<std::size_t>(round)][static_cast<std::size_t>(end)];
      if (const double mean = mean_between(begin, end); std::isfinite(mean)) all.insert(all.begin(), mean);
      end = begin;
    }
    return all;
  }

private:
  /// Of the bins of a slab, around the first's mean.
  struct Sums {
    double origin = 0, area = 0, depth = 0, squared = 0;
    void add(double more, double more_depth) {
      if (more <= 0) return;
      if (area == 0) origin = more_depth / more;
      const double away = more_depth / more - origin;
      area += more;
      depth += more * away;
      squared += more * away * away;
    }
    double square() const { return area > 0 ? std::max(0.0, squared - depth * depth / area) : 0; }
  };

  /// Of a triangle of unit area: the part before `at`, and the integral of its depth.
  static std::pair<double, double> moments_before(const std::array<double, 3>& z, double at) {
    const auto corner = [](double end, double middle, double other, double to) {  // between `end` and `to`, which lies before `middle`
      const double reach = to - end, share = reach * reach / ((other - end) * (middle - end));
      return std::pair{share, share * (end + reach * 2 / 3)};
    };
    if (at <= z[0]) return {0, 0};
    if (at <= z[1]) return corner(z[0], z[1], z[2], at);
    if (at >= z[2]) return {1, (z[0] + z[1] + z[2]) / 3};
    const auto beyond = corner(z[2], z[1], z[0], at);
    return {1 - beyond.first, (z[0] + z[1] + z[2]) / 3 - beyond.second};
  }

  double mean_between(int begin, int end) const {
    double area = 0, depth = 0;
    for (int i = begin; i < end; ++i) {
      area += area_[static_cast<std::size_t>(i)];
      depth += area_depth_[static_cast<std::size_t>(i)];
    }
    return area > 0 ? depth / area : std::numeric_limits<double>::infinity();
  }

  double near_m_, bin_m_;
  std::array<double, depth_bins> area_{}, area_depth_{};
};

}  // namespace

void Outline::add(const Outline& other) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    for (const auto& [whole, part] : {std::pair{&tangents[axis], &other.tangents[axis]}, {&passed[axis], &other.passed[axis]}}) {
      whole->low = std::min(whole->low, part->low);
      whole->high = std::max(whole->high, part->high);
    }
    beyond_m[axis] = std::max(beyond_m[axis], other.beyond_m[axis]);
  }
}

Outline outline_of(std::span<const glm::dvec3> points, double distance_m, glm::dvec2 centre_m, glm::dvec2 window_m, double wider,
                   glm::dvec2 largest_tangent) {
  const Seen seen{distance_m, {centre_m.x, centre_m.y}, {window_m.x / 2, window_m.y / 2}, {largest_tangent.x, largest_tangent.y}, wider};
  std::vector<Outline> ranges((points.size() + cl::Threads::range - 1) / cl::Threads::range);
  cl::Threads::shared().for_ranges(points.size(), [&](std::size_t, std::size_t from, std::size_t to) {
    ranges[from / cl::Threads::range] = outline_of_range(points.data() + from, to - from, seen);
  });
  Outline all;
  for (const auto& range : ranges) all.add(range);
  return all;
}

std::vector<double> middles_of_surfaces(const World& world, int slabs) {
  if (slabs == 1) return {middle_of_surfaces(world)};
  const DepthHistogram none(world.min_m.z, world.max_m.z);
  std::vector<std::array<DepthHistogram, 2>> sides(world.object_closed.size(), {none, none});
  for (std::size_t i = 0; i < facet_count(world); ++i) {
    const auto facet = facet_of(world, i);
    const auto t = world.triangles[facet.triangle];
    const auto &a = world.positions[t.x], &b = world.positions[t.y], &c = world.positions[t.z];
    const auto n = glm::cross(b - a, c - a), centre = (a + b + c) / 3.0;
    const double seen = glm::dot(n, centre) / (centre.z * centre.z);
    sides[static_cast<std::size_t>(world.triangle_object[facet.triangle])][seen < 0].add({a.z, b.z, c.z}, facet.share * std::abs(seen));
  }
  auto all = none;
  for (const auto& [one, other] : sides) all.add(one.mean() < other.mean() ? one : other);
  const auto means = all.means(slabs);
  return means.empty() ? std::vector{(world.min_m.z + world.max_m.z) / 2} : means;
}

}  // namespace raywave
