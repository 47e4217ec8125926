// SPDX-License-Identifier: Apache-2.0
#include "host/plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <span>
#include <sstream>

#include "host/error.hpp"
#include "host/gatherer.hpp"
#include "host/plane_errors.hpp"
#include "host/propagator.hpp"
#include "host/refiner.hpp"
#include "host/text.hpp"

namespace raywave {
namespace {

constexpr int largest_grid = 1024;

/// How many steps p lie, on the nearest surface, under the cone that a pixel sees. Three keep neighbouring samples apart in direction
/// (docs/pipeline.md, "Where the WRPs stand"); more only cost rays.
constexpr double samples_across_nearest = 3;

/// The same in pixels: fewer do not resolve the cone.
constexpr double pixels_across_nearest = 8;

/// How far beyond its geometric footprint the light of a sample is kept, in diffraction spots.
constexpr double tail_spots = Gatherer::near_tail;

/// Mirrors show things up to this many times as deep as the scene: rays are spaced for it.
constexpr double deepest_virtual_picture = 2;

/// Of a scene's depth, for the choice of slabs.
constexpr int depth_bins = 256;

constexpr double largest_lattice = 1 << 28;
constexpr double farthest_lattice_ray = 1 << 22;  // from the axis: floats count no farther and still tell places within a cell
constexpr std::size_t largest_fan = 1 << 24;

std::string millimetres(double metres) {
  std::ostringstream text;
  text.precision(6);
  text << metres * 1e3 << " mm";
  return text.str();
}

/// All digits of a count, as long as they are few.
std::string count_text(double count) {
  std::ostringstream text;
  text.precision(count < 1e15 ? 15 : 3);
  text << count;
  return text.str();
}

/// Rays across a fan, as fan_tangents makes them.
double fan_count(double window_m, double distance_m, double depth_m, double pitch_m) {
  return std::max(1.0, std::ceil(window_m / distance_m * depth_m / pitch_m - 1e-9));
}

struct Interval {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
  double middle() const { return (low + high) / 2; }
  double extent() const { return high - low; }
};

bool holds(const Slab& slab, double z_m) { return slab.begin_m <= z_m && z_m < slab.end_m; }

/// Calls `use` with the corners of all surfaces in a slab: vertices of the meshes, and where edges enter or leave it.
template <class Use>
void each_corner(const World& world, const Slab& slab, Use use) {
  for (const auto& p : world.positions) {
    if (holds(slab, p.z)) use(p);
  }
  for (const double at : {slab.begin_m, slab.end_m}) {
    if (!std::isfinite(at)) continue;
    for (const auto& corners : world.triangles) {
      for (int i = 0; i < 3; ++i) {
        const auto &a = world.positions[corners[i]], &b = world.positions[corners[(i + 1) % 3]];
        if ((a.z < at) != (b.z < at)) use(glm::mix(a, b, (at - a.z) / (b.z - a.z)));
      }
    }
  }
}

/// Where, along both axes of a slab's plane, light of its surfaces passes on its way into the hologram.
std::array<Interval, 2> footprint(const World& world, const Slab& slab, glm::dvec2 window_m, glm::dvec2 largest_tangent) {
  std::array<Interval, 2> passed;
  each_corner(world, slab, [&](const glm::dvec3& p) {
    const double share = (p.z - slab.distance_m) / p.z;  // of the way from the surface to the hologram
    for (int axis = 0; axis < 2; ++axis) {
      for (const double edge : {-window_m[axis] / 2, window_m[axis] / 2})
        passed[static_cast<std::size_t>(axis)].add(p[axis] + (edge - p[axis]) * share);
    }
  });
  for (int axis = 0; axis < 2; ++axis) {
    auto& along = passed[static_cast<std::size_t>(axis)];
    const double reach = window_m[axis] / 2 + slab.distance_m * largest_tangent[axis];
    along.low = std::clamp(along.low, -reach, reach);
    along.high = std::clamp(along.high, -reach, reach);
  }
  return passed;
}

/// Rays of the sample lattice towards everything in the scene whose light the hologram can show.
///
/// lit  tangents of the chief rays (to the hologram's centre) of whatever light can fall onto a WRP, low and high per axis
LatticePlan lattice_over(const Scene& scene, const World& world, const Plan& plan, glm::dvec2 largest_tangent,
                         const std::array<Interval, 2>& lit) {
  LatticePlan lattice;
  lattice.full_z_m = (plan.near_m + plan.far_m) / 2;
  lattice.step = scene.sampling.pitch_m / lattice.full_z_m;
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  double cells = 1;
  for (int axis = 0; axis < 2; ++axis) {
    Interval tangents;
    for (const auto& p : world.positions) tangents.add(p[axis] / p.z);
    const double reach = largest_tangent[axis] + std::max(1.0, plan.fan) * window[axis] / (2 * plan.near_m);
    const double low = std::max(-reach, lit[axis].low), high = std::max(low, std::min(reach, lit[axis].high));
    const double first = std::floor(std::clamp(tangents.low, low, high) / lattice.step - 0.5);
    const double last = std::ceil(std::clamp(tangents.high, low, high) / lattice.step - 0.5);
    cells *= last - first + 1;
    const std::string asked = one_line(scene.file.string()) + ": sampling.pitch " + millimetres(scene.sampling.pitch_m);
    if (!(cells <= largest_lattice))
      throw InputError(asked + " needs " + count_text(cells) +
                       " lattice cells or more, at most 268435456 are allowed; give a larger pitch");
    if (const double farthest = std::max(std::abs(first), std::abs(last)); farthest > farthest_lattice_ray)
      throw InputError(asked + " puts the scene " + count_text(farthest) +
                       " pitches off the axis, at most 4194304 are allowed; give a larger pitch");
    lattice.first[axis] = static_cast<int>(first);
    lattice.size[axis] = static_cast<int>(last - first + 1);
  }
  return lattice;
}

/// Directions of a fan that the SLM's pixels can show; steeper ones are left out.
std::vector<glm::dvec2> fan_of(const std::vector<double>& across, const std::vector<double>& up, glm::dvec2 largest_sine) {
  std::vector<glm::dvec2> fan;
  for (const double ty : up) {
    for (const double tx : across) {
      const double length = std::sqrt(1 + tx * tx + ty * ty);
      // As floats, which is what devices are given: every reader of the plan has the same rays.
      if (std::abs(tx) <= largest_sine.x * length && std::abs(ty) <= largest_sine.y * length)
        fan.emplace_back(static_cast<float>(tx), static_cast<float>(ty));
    }
  }
  return fan;
}

/// Adds the chief rays of the light that falls onto a slab's WRPs around `middle`, diffraction at its edges included.
void add_chief_tangents(const Plan& plan, const Slab& slab, glm::dvec2 middle, std::array<Interval, 2>& lit) {
  for (int axis = 0; axis < 2; ++axis) {
    const double window = plan.size[axis] * plan.pitch_m[axis];
    const auto narrowed = [&](double z) { return std::abs(z - slab.distance_m) / z; };
    const double spot = plan.wavelength_m * slab.max_m.z / (std::max(plan.fan, 1e-3) * window);
    const double footprint = plan.fan * window / 2 * std::max(narrowed(slab.min_m.z), narrowed(slab.max_m.z)) + 16 * spot;
    const double half = slab.grid[axis] * window / 2 + footprint;
    lit[static_cast<std::size_t>(axis)].add((middle[axis] - half) / slab.distance_m);
    lit[static_cast<std::size_t>(axis)].add((middle[axis] + half) / slab.distance_m);
  }
}

/// Area of surfaces by depth, in bins of equal depth: how much of it, and its mean depth times that.
class DepthHistogram {
public:
  DepthHistogram(double near_m, double far_m, int bins)
      : bins_(bins),
        near_m_(near_m),
        bin_m_((far_m - near_m) / bins),
        area_(static_cast<std::size_t>(bins)),
        area_depth_(static_cast<std::size_t>(bins)) {}

  /// A triangle of that area, evenly lit: its share beyond a depth falls as the square of what is left to its ends.
  void add(std::array<double, 3> z_m, double area) {
    std::sort(z_m.begin(), z_m.end());
    const auto bin = [&](double z) { return bin_m_ > 0 ? std::clamp(static_cast<int>((z - near_m_) / bin_m_), 0, bins_ - 1) : 0; };
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
  double mean() const { return mean_between(0, bins_); }

  /// Means of `count` slabs, or of as many as have area, between which the sum of area times squared distance to the mean is least.
  std::vector<double> means(int count) const {
    // least[i]: of the first i bins in as many slabs as the round says; from[round][i]: where the last of these begins.
    std::vector<double> least(static_cast<std::size_t>(bins_) + 1, std::numeric_limits<double>::infinity());
    least[0] = 0;
    std::vector<std::vector<int>> from;
    for (int round = 0; round < count; ++round) {
      std::vector<double> next(least.size(), std::numeric_limits<double>::infinity());
      from.emplace_back(least.size(), 0);
      for (int end = round + 1 < count ? 1 : bins_; end <= bins_; ++end) {
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
    for (int end = bins_, round = count - 1; round >= 0; --round) {
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

  int bins_;
  double near_m_, bin_m_;
  std::vector<double> area_, area_depth_;
};

/// Where aimed gathering costs least: footprints grow with the distance of a sample from its WRP, so the middles, by area as the hologram
/// sees it, of the objects' near sides, in so many slabs of depth. Either winding may be the outside.
std::vector<double> middles_of_surfaces(const World& world, int slabs) {
  const DepthHistogram none(world.min_m.z, world.max_m.z, slabs == 1 ? 1 : depth_bins);
  std::vector<std::array<DepthHistogram, 2>> sides(world.object_closed.size(), {none, none});
  for (std::size_t i = 0; i < world.triangles.size(); ++i) {
    const auto t = world.triangles[i];
    const auto &a = world.positions[t.x], &b = world.positions[t.y], &c = world.positions[t.z];
    const auto n = glm::cross(b - a, c - a), centre = (a + b + c) / 3.0;
    const double seen = glm::dot(n, centre) / (centre.z * centre.z);
    sides[static_cast<std::size_t>(world.triangle_object[i])][seen < 0].add({a.z, b.z, c.z}, std::abs(seen));
  }
  auto all = none;
  for (const auto& [one, other] : sides) all.add(one.mean() < other.mean() ? one : other);
  const auto means = all.means(slabs);
  return means.empty() ? std::vector{(world.min_m.z + world.max_m.z) / 2} : means;
}

/// Slabs around these distances, without those in which there is no surface; every sample belongs to the one whose WRPs its cone meets
/// with the smallest footprint, which is as wide as 1 - distance / depth.
std::vector<Slab> slabs_around(std::vector<double> distances_m, const World& world) {
  for (;;) {
    std::vector<Slab> slabs(distances_m.size());
    for (std::size_t i = 0; i < slabs.size(); ++i) {
      slabs[i].distance_m = distances_m[i];
      if (i > 0) slabs[i].begin_m = slabs[i - 1].end_m = (distances_m[i - 1] + distances_m[i]) / 2;
    }
    if (slabs.size() == 1) {
      slabs[0].min_m = world.min_m;
      slabs[0].max_m = world.max_m;
      return slabs;
    }
    std::vector<double> kept;
    for (auto& slab : slabs) {
      slab.min_m = glm::dvec3(std::numeric_limits<double>::infinity());
      slab.max_m = -slab.min_m;
      each_corner(world, slab, [&](const glm::dvec3& p) {
        slab.min_m = glm::min(slab.min_m, p);
        slab.max_m = glm::max(slab.max_m, p);
      });
      if (slab.min_m.z <= slab.max_m.z) kept.push_back(slab.distance_m);
    }
    if (kept.size() == distances_m.size()) return slabs;
    distances_m = kept.empty() ? std::vector{distances_m[0]} : kept;
  }
}

/// The part of a triangle that lies in a slab: a convex polygon of at most five corners.
struct Polygon {
  std::array<glm::dvec3, 5> corners;
  std::size_t count = 0;
};

Polygon within(const Slab& slab, const std::array<glm::dvec3, 3>& triangle) {
  Polygon part{{triangle[0], triangle[1], triangle[2]}, 3};
  for (const double side : {1.0, -1.0}) {
    const double at = side > 0 ? slab.begin_m : slab.end_m;
    const auto before = part;
    part.count = 0;
    for (std::size_t i = 0; i < before.count; ++i) {
      const auto &a = before.corners[i], &b = before.corners[(i + 1) % before.count];
      const bool a_inside = side * a.z >= side * at, b_inside = side * b.z >= side * at;
      if (a_inside) part.corners[part.count++] = a;
      if (a_inside != b_inside) part.corners[part.count++] = glm::mix(a, b, (at - a.z) / (b.z - a.z));
    }
  }
  return part;
}

/// Whether a rectangle around `middle` meets a convex polygon, by the separating axes of both.
bool meets(glm::dvec2 middle, glm::dvec2 half, std::span<const glm::dvec2> polygon) {
  const auto apart = [&](glm::dvec2 axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto& corner : polygon) {
      low = std::min(low, glm::dot(corner - middle, axis));
      high = std::max(high, glm::dot(corner - middle, axis));
    }
    const double reach = std::abs(axis.x) * half.x + std::abs(axis.y) * half.y;
    return low > reach || high < -reach;
  };
  if (apart({1, 0}) || apart({0, 1})) return false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto side = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (apart({-side.y, side.x})) return false;
  }
  return true;
}

/// The WRPs into which light of some triangle falls on its way to the hologram; all of them when there is none at all, so that whoever
/// looks at them finds out why.
std::vector<Wrp> lit_wrps(const Plan& plan, const World& world, std::vector<Wrp> wrps) {
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  std::vector<bool> lit(wrps.size(), false);
  std::size_t dark = wrps.size();
  for (const auto& corners : world.triangles) {
    if (dark == 0) return wrps;
    for (std::size_t s = 0; s < plan.slabs.size(); ++s) {
      const auto& slab = plan.slabs[s];
      const auto part = within(slab, {world.positions[corners.x], world.positions[corners.y], world.positions[corners.z]});
      if (part.count == 0) continue;
      std::array<glm::dvec2, 5> crossing;  // of the chief rays with the WRPs
      glm::dvec2 half = window / 2.0;
      for (std::size_t i = 0; i < part.count; ++i) {
        const auto& p = part.corners[i];
        crossing[i] = glm::dvec2(p) * (slab.distance_m / p.z);
        const auto spot = plan.wavelength_m * p.z / (std::max(plan.fan, 1e-3) * window);
        half =
            glm::max(half, window / 2.0 + std::max(plan.fan, 1.0) * window / 2.0 * std::abs(1 - slab.distance_m / p.z) + tail_spots * spot);
      }
      for (std::size_t i = 0; i < wrps.size(); ++i) {
        if (lit[i] || wrps[i].slab != s || !meets(wrps[i].centre_m, half, std::span(crossing).first(part.count))) continue;
        lit[i] = true;
        --dark;
      }
    }
  }
  if (dark == wrps.size()) return wrps;
  std::vector<Wrp> kept;
  for (std::size_t i = 0; i < wrps.size(); ++i) {
    if (lit[i]) kept.push_back(std::move(wrps[i]));
  }
  return kept;
}

/// Appends those of a slab, around `middle`.
void add_wrps_side_by_side(const Scene& scene, const Plan& plan, std::size_t number, glm::dvec2 middle, std::vector<Wrp>& wrps) {
  const auto& slab = plan.slabs[number];
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  // Aimed gathering uses its fan for what mirrors and glass show.
  const bool perspective = plan.aimed || scene.sampling.shape == FanShape::perspective;
  const double depth = (plan.far_m - slab.distance_m) * (plan.bounces > 0 ? deepest_virtual_picture : 1);
  for (int row = 0; row < slab.grid.y; ++row) {
    for (int column = 0; column < slab.grid.x; ++column) {
      Wrp wrp;
      wrp.slab = number;
      wrp.centre_m = {middle.x + (column - (slab.grid.x - 1) / 2.0) * window.x, middle.y - (row - (slab.grid.y - 1) / 2.0) * window.y,
                      slab.distance_m};
      if (plan.aimed && plan.bounces == 0) {
        wrps.push_back(std::move(wrp));
        continue;
      }
      const double p = scene.sampling.pitch_m;
      const auto rays = [&](int axis) { return fan_count(window[axis], slab.distance_m, depth, p); };
      if (!(rays(0) * rays(1) <= largest_fan)) {
        throw InputError(one_line(scene.file.string()) + ": sampling.pitch " + millimetres(p) + " needs " + count_text(rays(0)) + " x " +
                         count_text(rays(1)) + " rays per pixel, at most 16777216 are allowed; give a larger pitch");
      }
      std::array<std::vector<double>, 2> tangents;
      for (int axis = 0; axis < 2; ++axis) {
        // Perspective views turn with the pixel, parallel ones with the WRP.
        const double shift = perspective ? 0 : wrp.centre_m[axis];
        tangents[axis] = fan_tangents(window[axis], slab.distance_m, shift, depth, p);
        wrp.fan_step[axis] = window[axis] / slab.distance_m / static_cast<double>(tangents[axis].size());
      }
      wrp.fan = fan_of(tangents[0], tangents[1], perspective ? glm::dvec2(1) : plan.largest_sine);
      if (perspective) wrp.convergence_per_m = 1 / slab.distance_m;
      wrps.push_back(std::move(wrp));
    }
  }
}

Wrp plane_at_hologram(const Plan& plan, glm::dvec2 largest_tangent, int rays_per_axis) {
  Wrp plane;
  std::array<std::vector<double>, 2> tangents;
  for (int axis = 0; axis < 2; ++axis) {
    plane.fan_step[axis] = 2 * largest_tangent[axis] / rays_per_axis;
    for (int i = 0; i < rays_per_axis; ++i) tangents[axis].push_back((i - (rays_per_axis - 1) / 2.0) * plane.fan_step[axis]);
  }
  plane.fan = fan_of(tangents[0], tangents[1], plan.largest_sine);
  return plane;
}

/// About how many rays are aimed at samples: as if one surface filled the lattice, the slabs' middle depths in equal parts.
std::uint64_t aimed_rays(const Plan& plan) {
  double rays = 0;
  for (const auto& slab : plan.slabs) {
    const double middle = (slab.min_m.z + slab.max_m.z) / 2, narrowed = std::abs(middle - slab.distance_m) / middle;
    double of_slab = static_cast<double>(plan.lattice.size.x) * plan.lattice.size.y / static_cast<double>(plan.slabs.size());
    for (int axis = 0; axis < 2; ++axis)
      of_slab *= std::max(1.0, std::min(narrowed * (slab.distance_m > 0 ? plan.fan : 1.0), 1.0) * plan.size[axis]);
    rays += of_slab;
  }
  return static_cast<std::uint64_t>(rays);
}

/// Depths at which the WRPs stand, front to back.
std::vector<double> distances_of(const Scene& scene, const World& world, const Plan& plan) {
  const auto& given = scene.wrp.distances_m;
  const bool gathers_fans = !plan.aimed || plan.bounces > 0;
  if (const auto slabs = std::max(given.size(), static_cast<std::size_t>(scene.wrp.slabs)); gathers_fans && slabs > 1) {
    throw InputError(one_line(scene.file.string()) + ": wrp.slabs " + std::to_string(slabs) +
                     ": rays of fans, mirrors and glass pass from slab to slab, which needs all WRPs at one distance; give wrp.slabs 1" +
                     (given.empty() ? "" : " and one wrp.distance"));
  }
  if (!given.empty()) {
    if (!plan.aimed && given[0] >= plan.far_m) {  // rays of a fan go forwards; aimed ones meet samples on either side
      throw InputError(one_line(scene.file.string()) + ": wrp.distance " + millimetres(given[0]) +
                       " puts the WRPs behind the whole scene, which ends at " + millimetres(plan.far_m) + "; give less, or \"auto\"");
    }
    return given;
  }
  if (!gathers_fans) return middles_of_surfaces(world, scene.wrp.slabs);
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  const double cone = std::max(window.x, window.y) / plan.near_m;
  const double across =
      std::max(samples_across_nearest * scene.sampling.pitch_m, pixels_across_nearest * std::max(plan.pitch_m.x, plan.pitch_m.y));
  return {plan.near_m - std::min(across / cone, plan.near_m / 2)};
}

/// Places the WRPs of all slabs: Plan::slabs, grid and wrps.
///
/// returns  chief rays of the light that falls onto them
std::array<Interval, 2> place_wrps(const Scene& scene, const World& world, glm::dvec2 largest_tangent, Plan& plan) {
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  plan.slabs = slabs_around(distances_of(scene, world, plan), world);
  std::vector<glm::dvec2> middles;
  std::array<Interval, 2> covered, lit;
  double count = 0;
  for (auto& slab : plan.slabs) {
    const auto passed = footprint(world, slab, window, largest_tangent);
    glm::dvec2& middle = middles.emplace_back();
    for (int axis = 0; axis < 2; ++axis) {
      const auto& along = passed[static_cast<std::size_t>(axis)];
      middle[axis] = along.middle();
      const double wanted = std::max(1.0, std::ceil(along.extent() / window[axis] - 0.01));
      slab.grid[axis] = scene.wrp.grid ? (*scene.wrp.grid)[axis] : static_cast<int>(std::min(wanted, largest_grid + 1.0));
      for (const double side : {-0.5, 0.5})
        covered[static_cast<std::size_t>(axis)].add(middle[axis] + side * slab.grid[axis] * window[axis]);
    }
    count += static_cast<double>(slab.grid.x) * slab.grid.y;
    if (count > largest_grid) {
      throw InputError(scene.file.string() + ": the scene needs " + std::to_string(slab.grid.x) + " x " + std::to_string(slab.grid.y) +
                       " or more WRPs of the hologram's size, " + std::to_string(largest_grid) +
                       " are allowed; give wrp.grid, a larger hologram or a smaller scene");
    }
    add_chief_tangents(plan, slab, middle, lit);
  }
  for (int axis = 0; axis < 2; ++axis)
    plan.grid[axis] = scene.wrp.grid ? (*scene.wrp.grid)[axis]
                                     : static_cast<int>(std::ceil(covered[static_cast<std::size_t>(axis)].extent() / window[axis] - 0.01));
  for (std::size_t i = 0; i < plan.slabs.size(); ++i) add_wrps_side_by_side(scene, plan, i, middles[i], plan.wrps);
  if (!plan.aimed || plan.bounces > 0) return {Interval{-1e9, 1e9}, Interval{-1e9, 1e9}};
  plan.wrps = lit_wrps(plan, world, std::move(plan.wrps));
  return lit;
}

}  // namespace

std::vector<double> fan_tangents(double window_m, double distance_m, double shift_m, double depth_m, double pitch_m) {
  const double width = window_m / distance_m;
  const auto count = static_cast<std::size_t>(std::min(fan_count(window_m, distance_m, depth_m, pitch_m), double{largest_fan}));
  std::vector<double> tangents(count);
  for (std::size_t i = 0; i < count; ++i)
    tangents[i] = shift_m / distance_m + (static_cast<double>(i) - static_cast<double>(count - 1) / 2) * width / static_cast<double>(count);
  return tangents;
}

const Slab& Plan::slab_at(double z_m) const {
  return *std::find_if(slabs.begin(), slabs.end() - 1, [&](const Slab& slab) { return z_m < slab.end_m; });
}

std::size_t Plan::gathered_pixels() const {
  int rows = 0;
  for (const auto& slab : slabs) rows = std::max(rows, slab.rows.count);
  return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(rows);
}

WrpsExtent wrps_extent(const Plan& plan, const Slab& slab) {
  WrpsExtent extent{glm::dvec2(std::numeric_limits<double>::infinity()), glm::dvec2(-std::numeric_limits<double>::infinity())};
  const auto half_window = glm::dvec2(plan.size) * plan.pitch_m / 2.0;
  for (const auto& wrp : plan.wrps) {
    if (&plan.slab_of(wrp) != &slab) continue;
    extent.first = glm::min(extent.first, glm::dvec2(wrp.centre_m) - half_window);
    extent.last = glm::max(extent.last, glm::dvec2(wrp.centre_m) + half_window);
  }
  return extent;
}

std::pair<float, float> slab_bounds(const Plan& plan, const Slab& slab) {
  const auto in_frame = [&](double z_m) {
    constexpr double largest = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(z_m - plan.origin_m.z, -largest, largest));
  };
  return {in_frame(slab.begin_m), in_frame(slab.end_m)};
}

Plan make_plan(const Scene& scene, const World& world, Method method, int rays_per_axis, bool has_doubles, const Plan* moved_from) {
  const auto& hologram = scene.hologram;
  Plan plan;
  plan.size = hologram.resolution;
  plan.pitch_m = hologram.pitch_m;
  plan.wavelength_m = hologram.wavelength_m;
  plan.near_m = world.min_m.z;
  plan.far_m = world.max_m.z;

  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  for (int axis = 0; axis < 2; ++axis) plan.largest_sine[axis] = std::min(1.0, plan.wavelength_m / (2 * plan.pitch_m[axis]));
  const auto largest_tangent = [&](int axis) {
    const double sine = std::min(plan.largest_sine[axis], 0.999);
    return sine / std::sqrt(1 - sine * sine);
  };
  plan.aimed = method == Method::points || (method == Method::wrp && scene.sampling.mode == SamplingMode::aimed);
  const bool has_bounces = std::any_of(scene.objects.begin(), scene.objects.end(), [&](const Object& o) {
    const auto& m = scene.materials[static_cast<std::size_t>(o.material)];
    return m.reflectivity > 0 || m.transparency > 0;
  });
  plan.bounces = has_bounces ? scene.trace.depth : 0;
  plan.antialias = scene.sampling.antialias;
  plan.view_parts = scene.sampling.visibility;
  plan.fan = scene.sampling.fan;
  plan.edge = scene.sampling.edge;

  const glm::dvec2 steepest(largest_tangent(0), largest_tangent(1));
  std::array<Interval, 2> lit = {Interval{-1e9, 1e9}, Interval{-1e9, 1e9}};
  if (method == Method::wrp) {
    lit = place_wrps(scene, world, steepest, plan);
  } else {
    plan.slabs = {{.distance_m = 0, .min_m = world.min_m, .max_m = world.max_m}};
    plan.wrps = {plane_at_hologram(plan, steepest, rays_per_axis)};
  }
  plan.origin_m = {(world.min_m.x + world.max_m.x) / 2, (world.min_m.y + world.max_m.y) / 2, (plan.near_m + plan.far_m) / 2};
  plan.lattice = lattice_over(scene, world, plan, steepest, lit);
  for (int axis = 0; axis < 2; ++axis) {
    for (const auto& p : world.positions)
      plan.beyond_diffraction |= std::abs(p[axis]) + std::max(1.0, plan.fan) * window[axis] / 2 > 0.99 * largest_tangent(axis) * p.z;
  }

  for (auto& slab : plan.slabs) {
    slab.rows = {plan.size.y, plan.pitch_m.y, 0};
    if (method == Method::wrp && plan.aimed && plan.bounces == 0 && scene.wrp.oversampling)
      slab.rows = rows_for_band(plan, slab, *scene.wrp.oversampling);
  }
  for (const auto& wrp : plan.wrps) {
    if (!plan.aimed) plan.rays += wrp.fan.size() * static_cast<std::uint64_t>(plan.size.x) * static_cast<std::uint64_t>(plan.size.y);
  }
  if (plan.aimed) plan.rays = aimed_rays(plan);

  plan.phase_errors = predict_phase_errors(plan);
  plan.precision = choose_precision(scene.accuracy, plan.phase_errors, has_doubles);

  plan.padded = padded_size(plan.size, scene.wrp.padding);
  if (method == Method::wrp && moved_from) {
    plan.padding_error = moved_from->padding_error;
    plan.rows_error = moved_from->rows_error;
  } else if (method == Method::wrp) {
    plan.padding_error = predicted_padding_errors(plan, {plan.padded})[0];
    plan.rows_error = predicted_rows_error(plan);
  }
  return plan;
}

}  // namespace raywave
