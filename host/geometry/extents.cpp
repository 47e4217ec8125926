// SPDX-License-Identifier: Apache-2.0
// Loops over lanes: frames of a scene that moves wait for these passes.
#include "host/geometry/extents.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

#include "host/common/threads.hpp"
#include "host/geometry/clusters.hpp"
#include "host/geometry/lanes.hpp"

namespace raywave {
namespace {

constexpr int depth_bins = 256;  // of a scene's depth, for the choice of layers

constexpr double infinite = std::numeric_limits<double>::infinity();

/// What an extents is made of, per axis: functions of place that, over a convex set before the
/// hologram, are largest at one of its corners.
enum Function : std::size_t {
  tangent_low,
  tangent_high,
  passed_low,
  passed_high,
  beyond,
  functions
};
using Largest = std::array<double, 2 * functions>;

/// Infinite where a place is not before the hologram.
RAYWAVE_FOR_SEVERAL_CPUS void raise_extents(const Places* places, std::size_t count,
                                            const SeenThrough& seen, Lanes* largest) {
  Lanes nearest(infinite);
  for (std::size_t n = 0; n < count; ++n) {
    const auto& z_m = places[n].at_m[2].v;
    for (std::size_t i = 0; i < Lanes::count; ++i)
      nearest.v[i] = z_m[i] < nearest.v[i] ? z_m[i] : nearest.v[i];
    for (int axis = 0; axis < 2; ++axis) {
      const auto& x_m = places[n].at_m[axis].v;
      Lanes* const of_axis = largest + axis * functions;
      for (std::size_t i = 0; i < Lanes::count; ++i) {
        const double x = x_m[i], z = z_m[i], tangent = x / z;
        // Of the way from the surface to the hologram
        const double share = (z - seen.distance_m) / z;
        const double off_centre = x - seen.centre_m[axis], centre = x - off_centre * share,
                     reach = seen.half_m[axis] * std::abs(share);
        const double values[functions] = {
            -tangent, tangent, reach - centre, centre + reach,
            std::abs(off_centre) + seen.wider * seen.half_m[axis] - seen.largest_tangent[axis] * z};
        for (std::size_t f = 0; f < functions; ++f)
          of_axis[f].v[i] = values[f] > of_axis[f].v[i] ? values[f] : of_axis[f].v[i];
      }
    }
  }
  for (std::size_t f = 0; f < 2 * functions; ++f) {
    for (std::size_t i = 0; i < Lanes::count; ++i)
      largest[f].v[i] = nearest.v[i] > 0 ? largest[f].v[i] : infinite;
  }
}

Extents extents_from(const Largest& largest) {
  Extents extents;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto of = [&](Function f) { return largest[axis * functions + f]; };
    extents.tangents[axis] = {-of(tangent_low), of(tangent_high)};
    extents.passed[axis] = {-of(passed_low), of(passed_high)};
    extents.beyond_m[axis] = of(beyond);
  }
  return extents;
}

/// Of some points, all looked at.
Largest largest_among(std::span<const glm::dvec3> points, const SeenThrough& seen) {
  std::array<Lanes, 2 * functions> largest;
  largest.fill(Lanes(-infinite));
  std::array<Places, 16> room;
  for (std::size_t first = 0; first < points.size(); first += room.size() * Lanes::count) {
    const auto count = std::min(room.size() * Lanes::count, points.size() - first);
    const auto places = side_by_side(
        count, [&](std::size_t i) { return points[first + i]; }, room);
    raise_extents(places.data(), places.size(), seen, largest.data());
  }
  Largest all;
  std::transform(largest.begin(), largest.end(), all.begin(),
                 [](const Lanes& one) { return one.largest(); });
  return all;
}

/// Of an object's surfaces: one side, or the other. Areas as the hologram sees them, and depths
/// weighted with them.
struct Sides {
  double weight[2] = {0, 0}, sum[2] = {0, 0};
  double middle(int side) const {
    return weight[side] > 0 ? sum[side] / weight[side] : std::numeric_limits<double>::infinity();
  }
};

/// Of area_samples of an object that has moved so.
RAYWAVE_FOR_SEVERAL_CPUS Sides sides_of(const AreaSamples* area_samples, std::size_t count,
                                        const Motion& motion) {
  Lanes weight[2] = {Lanes(0), Lanes(0)}, sum[2] = {Lanes(0), Lanes(0)};
  for (std::size_t n = 0; n < count; ++n) {
    const auto& share = area_samples[n].share.v;
    Places corners[3] = {area_samples[n].corners[0], area_samples[n].corners[1],
                         area_samples[n].corners[2]};
    for (auto& corner : corners) corner.move(motion);
    const auto &a = corners[0].at_m, &b = corners[1].at_m, &c = corners[2].at_m;
    for (std::size_t i = 0; i < Lanes::count; ++i) {
      const double ux = b[0].v[i] - a[0].v[i], uy = b[1].v[i] - a[1].v[i],
                   uz = b[2].v[i] - a[2].v[i];
      const double vx = c[0].v[i] - a[0].v[i], vy = c[1].v[i] - a[1].v[i],
                   vz = c[2].v[i] - a[2].v[i];
      const double x = a[0].v[i] + b[0].v[i] + c[0].v[i], y = a[1].v[i] + b[1].v[i] + c[1].v[i],
                   z = a[2].v[i] + b[2].v[i] + c[2].v[i];  // of the centre, tripled
      const double toward =
          (uy * vz - uz * vy) * x + (uz * vx - ux * vz) * y + (ux * vy - uy * vx) * z;
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
double middle_of_surfaces(const World& world, std::span<const AreaSamples> area_samples) {
  // Parts of ranges that belong to one object; added in order, for the same sum every time.
  struct Part {
    std::size_t object;
    Sides sides;
  };
  std::vector<std::vector<Part>> ranges((area_samples.size() + cl::Threads::range - 1) /
                                        cl::Threads::range);
  cl::Threads::shared().for_ranges(
      area_samples.size(), [&](std::size_t, std::size_t from, std::size_t to) {
        auto& parts = ranges[from / cl::Threads::range];
        while (from < to) {
          const auto object = area_samples[from].object;
          auto end = from + 1;
          while (end < to && area_samples[end].object == object) ++end;
          parts.push_back({static_cast<std::size_t>(object),
                           sides_of(&area_samples[from], end - from, world.motion_of(object))});
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

/// Area of surfaces by depth, in bins of equal depth: how much of it, and its mean depth times
/// that.
class DepthHistogram {
public:
  DepthHistogram(double near_m, double far_m)
      : near_m_(near_m), bin_m_((far_m - near_m) / depth_bins) {}

  /// A triangle of that area, evenly lit: its share beyond a depth falls as the square of what is
  /// left to its ends.
  void add(std::array<double, 3> z_m, double area) {
    std::sort(z_m.begin(), z_m.end());
    const auto bin = [&](double z) {
      return bin_m_ > 0 ? std::clamp(static_cast<int>((z - near_m_) / bin_m_), 0, depth_bins - 1)
                        : 0;
    };
    const int first = bin(z_m[0]), last = bin(z_m[2]);
    std::pair<double, double> before{0, 0};
    for (int i = first; i <= last; ++i) {
      const auto up_to = i == last ? std::pair{1.0, (z_m[0] + z_m[1] + z_m[2]) / 3}
                                   : moments_before(z_m, near_m_ + (i + 1) * bin_m_);
      const double share = std::max(0.0, up_to.first - before.first),
                   begin_m = near_m_ + i * bin_m_;
      area_[static_cast<std::size_t>(i)] += area * share;
      // Of next to nothing, rounding would put the mean anywhere.
      area_depth_[static_cast<std::size_t>(i)] +=
          area *
          std::clamp(up_to.second - before.second, share * begin_m, share * (begin_m + bin_m_));
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

  /// Means of `count` layers, or of as many as have area, between which the sum of area times
  /// squared distance to the mean is least.
  std::vector<double> means(int count) const {
    // least[i]: of the first i bins in as many layers as the round says; from[round][i]: where the
    // last of these begins.
    std::vector<double> least(static_cast<std::size_t>(depth_bins) + 1,
                              std::numeric_limits<double>::infinity());
    least[0] = 0;
    std::vector<std::vector<int>> from;
    for (int round = 0; round < count; ++round) {
      std::vector<double> next(least.size(), std::numeric_limits<double>::infinity());
      from.emplace_back(least.size(), 0);
      for (int end = round + 1 < count ? 1 : depth_bins; end <= depth_bins; ++end) {
        Sums layer;
        for (int begin = end - 1; begin >= 0; --begin) {
          layer.add(area_[static_cast<std::size_t>(begin)],
                    area_depth_[static_cast<std::size_t>(begin)]);
          const double sum = least[static_cast<std::size_t>(begin)] + layer.square();
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
      if (const double mean = mean_between(begin, end); std::isfinite(mean))
        all.insert(all.begin(), mean);
      end = begin;
    }
    return all;
  }

private:
  /// Of the bins of a layer, around the first's mean.
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
    // Between `end` and `to`, which lies before `middle`
    const auto corner = [](double end, double middle, double other, double to) {
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

void Extents::add(const Extents& other) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    for (const auto& [whole, part] : {std::pair{&tangents[axis], &other.tangents[axis]},
                                      {&passed[axis], &other.passed[axis]}}) {
      whole->low = std::min(whole->low, part->low);
      whole->high = std::max(whole->high, part->high);
    }
    beyond_m[axis] = std::max(beyond_m[axis], other.beyond_m[axis]);
  }
}

Extents extents_of(std::span<const glm::dvec3> points, const SeenThrough& seen) {
  std::vector<Extents> ranges((points.size() + cl::Threads::range - 1) / cl::Threads::range);
  cl::Threads::shared().for_ranges(
      points.size(), [&](std::size_t, std::size_t from, std::size_t to) {
        ranges[from / cl::Threads::range] =
            extents_from(largest_among(points.subspan(from, to - from), seen));
      });
  Extents all;
  for (const auto& range : ranges) all.add(range);
  return all;
}

Extents extents_of(const World& world, const SeenThrough& seen) {
  if (world.placed.empty()) return extents_of(world.positions, seen);
  Largest largest;
  largest.fill(-infinite);
  const auto raise = [&](std::span<const Places> places, std::span<Lanes> to) {
    raise_extents(places.data(), places.size(), seen, to.data());
  };
  for (std::size_t i = 0; i < world.placed.size(); ++i) {
    const auto& placed = world.placed[i];
    raise_to_largest(placed.clusters,
                     std::span(world.positions).subspan(placed.first_vertex, placed.vertices),
                     world.motions[i], raise, 0, largest);
  }
  return extents_from(largest);
}

std::vector<double> middles_of_surfaces(const World& world, int layers) {
  std::vector<AreaSamples> every;
  if (world.area_samples.empty()) {
    for (std::size_t i = 0; i < world.triangles.size(); ++i) add_area_sample(world, i, 1, every);
  }
  const auto& area_samples = world.area_samples.empty() ? every : world.area_samples;
  if (layers == 1) return {middle_of_surfaces(world, area_samples)};
  const DepthHistogram none(world.min_m.z, world.max_m.z);
  std::vector<std::array<DepthHistogram, 2>> sides(world.object_closed.size(), {none, none});
  for (auto group : area_samples) {
    for (auto& corner : group.corners) corner.move(world.motion_of(group.object));
    for (std::size_t i = 0; i < group.count; ++i) {
      const auto a = group.corners[0].get(i), b = group.corners[1].get(i),
                 c = group.corners[2].get(i);
      const auto n = glm::cross(b - a, c - a), centre = (a + b + c) / 3.0;
      const double seen = glm::dot(n, centre) / (centre.z * centre.z);
      sides[static_cast<std::size_t>(group.object)][seen < 0].add(
          {a.z, b.z, c.z}, group.share.v[i] * std::abs(seen));
    }
  }
  auto all = none;
  for (const auto& [one, other] : sides) all.add(one.mean() < other.mean() ? one : other);
  const auto means = all.means(layers);
  return means.empty() ? std::vector{(world.min_m.z + world.max_m.z) / 2} : means;
}

}  // namespace raywave
