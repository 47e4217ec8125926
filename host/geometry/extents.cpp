// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/extents.hpp"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <utility>

#include "host/common/threads.hpp"
#include "host/geometry/vertex_tree.hpp"

namespace raywave {
namespace {

constexpr std::size_t depth_bins = 256;  // bins of a scene's depth, for the choice of layers

constexpr double infinite = std::numeric_limits<double>::infinity();

/// Per axis, the functions of position whose largest values make Extents. Over a convex set on one
/// side of the hologram, each is largest at one of its corners.
enum Function : std::size_t {
  tangent_low,
  tangent_high,
  passed_low,
  passed_high,
  beyond,
  functions
};
using Values = std::array<double, 2 * functions>;

/// Infinite at a position that is not on this side of the hologram.
///
/// side  1: z > 0; -1: z < 0
Values values_at(const glm::dvec3& p_m, const SeenThrough& seen, double side) {
  Values values;
  if (!(side * p_m.z > 0)) {
    values.fill(infinite);
    return values;
  }
  const double share =
      (p_m.z - seen.distance_m) / p_m.z;  // share of the path from surface to hologram
  for (int axis = 0; axis < 2; ++axis) {
    const double x = p_m[axis], tangent = x / p_m.z;
    const double off_centre = x - seen.centre_m[axis], centre = x - off_centre * share,
                 reach = seen.half_m[axis] * std::abs(share);
    const auto first = static_cast<std::size_t>(axis) * functions;
    values[first + tangent_low] = -tangent;
    values[first + tangent_high] = tangent;
    values[first + passed_low] = reach - centre;
    values[first + passed_high] = centre + reach;
    values[first + beyond] = std::abs(off_centre) + seen.wider * seen.half_m[axis] -
                             seen.largest_tangent[axis] * std::abs(p_m.z);
  }
  return values;
}

Extents extents_from(const Values& largest) {
  Extents extents;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto of = [&](Function f) { return largest[axis * functions + f]; };
    extents.tangents[axis] = {-of(tangent_low), of(tangent_high)};
    extents.passed[axis] = {-of(passed_low), of(passed_high)};
    extents.beyond_m[axis] = of(beyond);
  }
  return extents;
}

/// The two sides of an object's surface: area as the hologram sees it, and the sum of depth times
/// that area.
struct Sides {
  double area[2] = {0, 0}, depth[2] = {0, 0};
  double mean_depth_m(int side) const {
    return area[side] > 0 ? depth[side] / area[side] : infinite;
  }
};

/// Sums over the area samples of an object that has moved so.
Sides sides_of(std::span<const AreaSample> samples, const Motion& motion) {
  // The hologram's centre and normal are taken to where the object was placed.
  const auto to_placed = glm::transpose(motion.turn) / motion.scale;
  const auto eye_m = motion.moved ? motion.from_m - to_placed * motion.to_m : glm::dvec3(0);
  const auto z_axis = glm::transpose(motion.scale * motion.turn)[2];
  const double volume_scale = motion.scale * motion.scale * motion.scale;
  // Partial sums, so that an addition need not wait for the one before.
  constexpr std::size_t partial = 8;
  double area[2][partial] = {}, depth[2][partial] = {};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto& sample = samples[i];
    const auto corner_sum_m = sample.corner_sum_m - 3.0 * eye_m;
    const double toward = volume_scale * glm::dot(sample.normal_m2, corner_sum_m),
                 z_m = glm::dot(z_axis, corner_sum_m);
    const double sum = sample.share * std::abs(toward) / z_m;
    const int side = toward < 0;
    area[side][i % partial] += sum / z_m;
    depth[side][i % partial] += sum;
  }
  Sides sides;
  for (int side = 0; side < 2; ++side) {
    for (std::size_t i = 0; i < partial; ++i) {
      sides.area[side] += area[side][i];
      sides.depth[side] += depth[side][i];
    }
    sides.depth[side] /= 3;
  }
  return sides;
}

/// The mean depth of the near sides of all objects.
double middle_of_surfaces(const World& world, const std::vector<std::vector<AreaSample>>& samples,
                          std::span<const DepthWeight> more) {
  std::vector<Sides> objects(samples.size());
  auto& threads = cl::Threads::shared();
  threads.for_each(std::min(threads.count(), samples.size()), samples.size(), 1,
                   [&](std::size_t, std::size_t i) {
                     objects[i] =
                         sides_of(samples[i], world.motion_of(static_cast<std::int32_t>(i)));
                   });
  double depth = 0, area = 0;
  for (const auto& sides : objects) {
    const int near = sides.mean_depth_m(0) < sides.mean_depth_m(1) ? 0 : 1;
    depth += sides.depth[near];
    area += sides.area[near];
  }
  for (const auto& other : more) {
    depth += other.seen_m2 * other.z_m;
    area += other.seen_m2;
  }
  const double middle_m = depth / area;
  return std::isfinite(middle_m) ? middle_m : (world.min_m.z + world.max_m.z) / 2;
}

/// Area of surfaces by depth, in bins of equal depth: how much of it, and its mean depth times
/// that.
class DepthHistogram {
public:
  /// Adds an area at one depth.
  void add(double z_m, double area) { add({z_m, z_m, z_m}, area); }

  DepthHistogram(double near_m, double far_m)
      : near_m_(near_m), bin_m_((far_m - near_m) / depth_bins) {}

  /// Adds a triangle, its area spread evenly: the share of its area beyond a depth falls with the
  /// square of the distance to its ends.
  void add(std::array<double, 3> z_m, double area) {
    std::sort(z_m.begin(), z_m.end());
    const auto bin = [&](double z) {
      constexpr int last_bin = depth_bins - 1;
      return bin_m_ > 0 ? std::clamp(static_cast<int>((z - near_m_) / bin_m_), 0, last_bin) : 0;
    };
    const int first = bin(z_m[0]), last = bin(z_m[2]);
    std::pair<double, double> before{0, 0};
    for (int i = first; i <= last; ++i) {
      const auto up_to = i == last ? std::pair{1.0, (z_m[0] + z_m[1] + z_m[2]) / 3}
                                   : moments_before(z_m, near_m_ + (i + 1) * bin_m_);
      const double share = std::max(0.0, up_to.first - before.first),
                   begin_m = near_m_ + i * bin_m_;
      area_[static_cast<std::size_t>(i)] += area * share;
      // Without the clamp, rounding would put the mean of a tiny share anywhere.
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

  /// Mean depth; infinite without any area.
  double mean() const { return mean_between(0, depth_bins); }

  /// Mean depths of `count` layers (of those that have area), chosen so that the sum of area times
  /// squared distance to the layer's mean is least.
  std::vector<double> means(int count) const {
    // least[i]: that sum for the first i bins in `round` + 1 layers; from[round][i]: first bin of
    // the last of these layers.
    std::vector<double> least(depth_bins + 1, infinite);
    least[0] = 0;
    std::vector<std::vector<std::size_t>> from;
    for (int round = 0; round < count; ++round) {
      std::vector<double> next(least.size(), infinite);
      auto& first = from.emplace_back(least.size(), 0);
      for (std::size_t end = round + 1 < count ? 1 : depth_bins; end <= depth_bins; ++end) {
        Sums layer;
        for (auto begin = end; begin-- > 0;) {
          layer.add(area_[begin], area_depth_[begin]);
          const double sum = least[begin] + layer.square();
          if (!(sum < next[end])) continue;
          next[end] = sum;
          first[end] = begin;
        }
      }
      least = std::move(next);
    }
    std::vector<double> all;
    auto end = depth_bins;
    for (auto first = from.rbegin(); first != from.rend(); ++first) {
      const auto begin = (*first)[end];
      if (const double mean = mean_between(begin, end); std::isfinite(mean))
        all.insert(all.begin(), mean);
      end = begin;
    }
    return all;
  }

private:
  /// Moments of a layer's bins, relative to the mean depth of its first bin.
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

  /// Share of a triangle's area before depth `at`, and the integral of depth over that share.
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

  double mean_between(std::size_t begin, std::size_t end) const {
    double area = 0, depth = 0;
    for (auto i = begin; i < end; ++i) {
      area += area_[i];
      depth += area_depth_[i];
    }
    return area > 0 ? depth / area : infinite;
  }

  double near_m_, bin_m_;
  std::array<double, depth_bins> area_{}, area_depth_{};
};

}  // namespace

void Extents::add(const Extents& other) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    tangents[axis].add(other.tangents[axis]);
    passed[axis].add(other.passed[axis]);
    beyond_m[axis] = std::max(beyond_m[axis], other.beyond_m[axis]);
  }
}

Extents extents_of(std::span<const glm::dvec3> points, const SeenThrough& seen) {
  std::vector<Extents> ranges((points.size() + cl::Threads::range - 1) / cl::Threads::range);
  cl::Threads::shared().for_ranges(
      points.size(), [&](std::size_t, std::size_t from, std::size_t to) {
        Values largest;
        largest.fill(-infinite);
        for (auto i = from; i < to; ++i) {
          const auto values = values_at(points[i], seen, points[i].z < 0 ? -1 : 1);
          for (std::size_t f = 0; f < values.size(); ++f)
            largest[f] = values[f] > largest[f] ? values[f] : largest[f];
        }
        ranges[from / cl::Threads::range] = extents_from(largest);
      });
  Extents all;
  for (const auto& range : ranges) all.add(range);
  return all;
}

Extents extents_of(const World& world, const SeenThrough& seen) {
  if (world.placed.empty()) return extents_of(world.positions, seen);
  Values largest;
  largest.fill(-infinite);
  // Boxes that promise as much, to rounding, are opened too: no vertex is missed by a rounding.
  const double reach_m = glm::length(glm::max(glm::abs(world.min_m), glm::abs(world.max_m))) +
                         glm::length(glm::abs(seen.centre_m) + seen.half_m) +
                         std::abs(seen.distance_m);
  const double least = -0x1p-48 * reach_m;
  for (std::size_t i = 0; i < world.placed.size(); ++i) {
    const auto& placed = world.placed[i];
    const double side = lies_before(world, i) ? -1 : 1;
    raise_to_largest(
        placed.tree, placed.own(world.positions), world.motions[i],
        [&](const glm::dvec3& p_m) { return values_at(p_m, seen, side); }, least, largest);
  }
  return extents_from(largest);
}

std::vector<double> middles_of_surfaces(const World& world, int layers,
                                        const std::vector<bool>& dark,
                                        std::span<const DepthWeight> more) {
  auto every = std::vector<std::vector<AreaSample>>(world.object_closed.size());
  if (world.area_samples.empty()) {
    for (std::size_t i = 0; i < world.triangles.size(); ++i)
      every[static_cast<std::size_t>(world.triangle_object[i])].push_back(area_sample(world, i, 1));
  }
  if (!dark.empty() && !world.area_samples.empty()) every = world.area_samples;
  for (std::size_t i = 0; i < dark.size(); ++i) {
    if (dark[i]) every[i].clear();
  }
  const auto& samples = world.area_samples.empty() || !dark.empty() ? every : world.area_samples;
  if (layers == 1) return {middle_of_surfaces(world, samples, more)};
  double near_m = world.min_m.z, far_m = world.max_m.z;
  for (const auto& other : more) {
    near_m = std::min(near_m, other.z_m);
    far_m = std::max(far_m, other.z_m);
  }
  const DepthHistogram none(near_m, far_m);
  auto all = none;
  for (const auto& of_object : samples) {
    std::array<DepthHistogram, 2> sides{none, none};
    for (const auto& sample : of_object) {
      const auto [a, b, c] = world.corners_m(sample.triangle);
      const auto n = glm::cross(b - a, c - a), centre = (a + b + c) / 3.0;
      const double seen = glm::dot(n, centre) / (centre.z * centre.z);
      sides[seen < 0].add({a.z, b.z, c.z}, sample.share * std::abs(seen));
    }
    all.add(sides[0].mean() < sides[1].mean() ? sides[0] : sides[1]);
  }
  for (const auto& other : more) all.add(other.z_m, other.seen_m2);
  const auto means = all.means(layers);
  return means.empty() ? std::vector{(near_m + far_m) / 2} : means;
}

}  // namespace raywave
